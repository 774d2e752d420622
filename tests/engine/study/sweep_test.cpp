// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/sweep.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/engine/study/study_fixture.h"

namespace palpate {
namespace {

using namespace test::study;
using testing::HasSubstr;

TEST(PowerFit, FindsAPowerAndWhatItsPointsScatterBy) {
    std::vector<std::array<double, 2>> pairs;
    for (const double x : {1.0, 2.0, 4.0, 8.0})
        pairs.push_back({x, 3.0 * x * x});
    const auto exact = fit_power("y", pairs);
    ASSERT_TRUE(exact);
    EXPECT_NEAR(exact->exponent, 2.0, 1e-12);
    EXPECT_NEAR(exact->standard_error, 0.0, 1e-12);
    pairs[1][1] *= 1.5;
    EXPECT_GT(fit_power("y", pairs)->standard_error, 0.05);
    pairs[0][1] = 0.0; // no logarithm
    EXPECT_EQ(fit_power("y", pairs)->points, 3u);
    pairs.pop_back();
    EXPECT_FALSE(fit_power("y", pairs)) << "two points fit any power";
}

TEST(Resampled, GoesTheSameWayAtAnotherSpeedAndRate) {
    std::vector<DeviceState> path(5);
    for (std::size_t i = 0; i < path.size(); ++i)
        path[i].position.x = static_cast<double>(i);
    const auto half = resampled(path, 1000.0, 0.5, 1000.0);
    ASSERT_EQ(half.size(), 9u);
    EXPECT_EQ(half[3].position.x, 1.5);
    EXPECT_EQ(half[3].time_s, 3e-3);
    const auto often = resampled(path, 1000.0, 1.0, 2000.0);
    ASSERT_EQ(often.size(), 9u);
    EXPECT_EQ(often[3].position.x, 1.5);
    EXPECT_EQ(often[3].time_s, 1.5e-3);
    path[3].trial = path[4].trial = 1;
    EXPECT_EQ(resampled(path, 1000.0, 0.5, 1000.0)[5].position.x, 2.0)
        << "nobody is between two trials";
    EXPECT_TRUE(resampled({}, 1000.0, 1.0, 1000.0).empty());
}

TEST(Sweep, ALagGrowsWithTheSpeed) {
    test::ScriptedClock clock(1.0);
    const Sweep sweep =
        run_sweep(SweepKind::speed, surface_cavity(), along_the_wall(1e-4), {}, 1, clock);
    ASSERT_EQ(sweep.rows.size(), 6 * (4 + kBaselines.size())) << "six speeds, four methods";
    double last_um = 0.0;
    for (const SweepRow& row : sweep.rows) {
        if (method_of(row.run) != "single" || row.value > 0.5) continue;
        EXPECT_GT(row.run.converged.rms_um, last_um) << row.value << " m/s";
        last_um = row.run.converged.rms_um;
    }
    const std::string csv = sweep_csv(std::vector{sweep});
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), sweep.rows.size() + 1);
    EXPECT_THAT(sweep_table(sweep), HasSubstr("single: position um rms over speed: to the power"));
}

// A penalty has no error over a formula of a distance: what is measured is its reference's.
TEST(Sweep, NoPowerIsFittedToWhatIsBelowTheReference) {
    std::vector<DeviceState> inputs = along_the_wall();
    inputs.front().position *= 0.8; // a leap, in which shares overshoot
    test::ScriptedClock clock(1.0);
    const Sweep sweep = run_sweep(SweepKind::speed, gradient_cavity(kHard), inputs, {}, 1, clock);
    ASSERT_FALSE(sweep.rows.empty());
    for (const SweepRow& row : sweep.rows)
        EXPECT_GT(row.known_to_um, 0.0) << row.value << " m/s";
    for (const PowerFit& fit : sweep.fits)
        EXPECT_THAT(fit.of, testing::Not(testing::StartsWith("penalty: position")));
    EXPECT_THAT(sweep_csv(std::vector{sweep}), HasSubstr(",known_to_um\n"));
    EXPECT_THAT(sweep_table(sweep), HasSubstr(" < "));
}

TEST(Sweep, TheErrorOfVoxelsFallsWithTheirSquare) {
    test::ScriptedClock clock(1.0);
    const Sweep sweep =
        run_sweep(SweepKind::voxels, surface_cavity(), along_the_wall(1e-4), {}, 1, clock);
    const auto fit = std::find_if(sweep.fits.begin(), sweep.fits.end(), [](const PowerFit& of) {
        return of.of == "adaptive: level um rms over voxels";
    });
    ASSERT_NE(fit, sweep.fits.end());
    EXPECT_NEAR(fit->exponent, 2.0, 3.0 * fit->standard_error + 0.1);
    // Of error and of time; but the time of paper is its budget.
    EXPECT_EQ(sweep.fits.size(), 2 * (4 + kBaselines.size()) - 1);
}

TEST(Sweep, PaperHasABudgetThatFitsIntoEachPeriod) {
    test::ScriptedClock clock(1.0);
    const Sweep sweep =
        run_sweep(SweepKind::rate, surface_cavity(), along_the_wall(1e-4), {}, 1, clock);
    std::size_t papers = 0;
    for (const SweepRow& row : sweep.rows)
        if (method_of(row.run) == "paper") {
            ++papers;
            EXPECT_EQ(title(row.run), "paper 50 us");
            EXPECT_LT(budget_of(row.run.loop), 1e6 / row.value);
        }
    EXPECT_EQ(papers, 5u);
}

// Rows of things that the value does not reach would be the same numbers again.
TEST(Sweep, BaselinesAreWhereTheValueIsTheirsToo) {
    test::ScriptedClock clock(1.0);
    SceneResources resources;
    resources.extract = [](const Isosurface&, const IsosurfaceSettings& facets, const Progress&) {
        return ball(facets.facet_size_m > 3e-3 ? 4 : 5);
    };
    const auto names_of = [&](SweepKind kind, auto&& of) {
        std::set<std::string> names;
        const Sweep sweep =
            run_sweep(kind, surface_cavity(), along_the_wall(1e-4), resources, 1, clock);
        for (const SweepRow& row : sweep.rows) {
            EXPECT_EQ(row.why_not, "") << name(kind);
            EXPECT_GT(row.run.level.frames, 0u) << name(kind) << " " << title(row.run);
            if (row.run.baseline && of(row)) names.insert(title(row.run));
        }
        return names;
    };
    const auto any = [](const SweepRow&) { return true; };
    EXPECT_EQ(names_of(SweepKind::rate, any).size(), kBaselines.size() + 1);
    EXPECT_EQ(names_of(SweepKind::facets, any), std::set<std::string>{"finger_proxy"});
    EXPECT_EQ(names_of(SweepKind::contact, any), std::set<std::string>{"finger_proxy"});
    EXPECT_EQ(
        names_of(SweepKind::contact, [](const auto& row) { return row.contact != "mesh"; }).size(),
        0u);
    EXPECT_EQ(names_of(SweepKind::voxels, any).count("finger_proxy"), 0u);
    EXPECT_EQ(names_of(SweepKind::stiffness, any).size(), 0u);
}

TEST(Sweep, SaysWhatItCannotVary) {
    test::ScriptedClock clock(1.0);
    const Sweep facets =
        run_sweep(SweepKind::facets, surface_cavity(), along_the_wall(1e-4), {}, 1, clock);
    ASSERT_EQ(facets.rows.size(), 4u);
    for (const SweepRow& row : facets.rows)
        EXPECT_EQ(row.why_not, "this build extracts no meshes");
    const Sweep still =
        run_sweep(SweepKind::speed, surface_cavity(), std::vector<DeviceState>(10), {}, 1, clock);
    ASSERT_EQ(still.rows.size(), 6u);
    EXPECT_EQ(still.rows[0].why_not, "the probe does not move");
}

} // namespace
} // namespace palpate
