// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/stepping/subdivision.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <palpate/haptics/effects/constant_force.h>
#include <palpate/haptics/effects/gradient_surface.h>
#include <palpate/haptics/stepping/frame_flags.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/contact_loop.h"
#include "tests/support/effect_lists.h"

namespace palpate {
namespace {

using test::ContactLoop;
using test::one_surface;
using test::stepping;

constexpr double kRadius = 0.05; // m

/// Pulls the proxy to the probe with nothing in the way, share by share.
std::vector<Vec3> free_path(const SteppingSettings& settings, double clock_step_us) {
    ContactLoop loop(settings, {}, {}, clock_step_us);
    loop.start({0, 0, 0});
    loop.move({0.01, 0, 0});
    return {loop.subdivision().path().begin(), loop.subdivision().path().end()};
}

// Corrected eq. (9) gives equal shares for a target that does not move: 1/M, 1/(M-1), ..., 1
// (numerics 1.3).
TEST(Subdivision, SharesOfAFixedTargetAreEqual) {
    ContactLoop loop(stepping(SteppingMethod::fixed, 5), {});
    loop.start({0, 0, 0});
    const SubdivisionResult result = loop.move({0.01, 0, 0});
    EXPECT_EQ(result.evaluations, 5u);
    const auto path = loop.subdivision().path();
    ASSERT_EQ(path.size(), 6u);
    for (std::size_t i = 0; i < path.size(); ++i)
        EXPECT_NEAR(path[i].x, 0.002 * static_cast<double>(i), 1e-17);
}

TEST(Subdivision, SingleIsOneEvaluation) {
    const auto path = free_path(stepping(SteppingMethod::single), 0.0);
    ASSERT_EQ(path.size(), 2u);
    EXPECT_EQ(path.back(), Vec3(0.01, 0, 0));
}

// Eq. (8): floor((t_delta - (t_n - t_0)) / estimate). Every reading of the scripted clock costs 10
// us, so steps last 10 us and the estimate settles around 10: the budget of 900 us holds about 90,
// and the last sub-step ends within the budget.
TEST(Subdivision, PaperSpendsItsBudgetAndNoMore) {
    SteppingSettings settings = stepping(SteppingMethod::paper);
    ContactLoop loop(settings, {}, {}, 10.0);
    loop.start({0, 0, 0});
    SubdivisionResult result;
    for (int frame = 0; frame < 20; ++frame)
        result = loop.move({0.001 * (frame + 1), 0, 0});
    EXPECT_GE(result.evaluations, 80u);
    EXPECT_LE(result.evaluations, 90u);
    EXPECT_EQ(loop.subdivision().steps_left().size(), result.evaluations);
    EXPECT_EQ(loop.subdivision().steps_left().back(), 0u);
    EXPECT_EQ(loop.proxy(), Vec3(0.02, 0, 0))
        << "the last action is that of eq. (7): the whole movement";
}

TEST(Subdivision, PaperMakesOneEvaluationWhenTheBudgetIsGone) {
    SteppingSettings settings = stepping(SteppingMethod::paper);
    settings.budget_us = 1.0;
    ContactLoop loop(settings, {}, {}, 50.0);
    loop.start({0, 0, 0});
    EXPECT_EQ(loop.move({0.001, 0, 0}).evaluations, 1u);
    EXPECT_EQ(loop.proxy(), Vec3(0.001, 0, 0));
}

TEST(Subdivision, AClockThatStandsStillIsBounded) {
    ContactLoop loop(stepping(SteppingMethod::paper), {}, {}, 0.0);
    loop.start({0, 0, 0});
    const SubdivisionResult result = loop.move({0.001, 0, 0});
    EXPECT_EQ(result.evaluations, static_cast<std::uint32_t>(Stepping::kMostEvaluations));
    EXPECT_EQ(loop.proxy(), Vec3(0.001, 0, 0));
}

// What begins a frame anew, a membrane that opens or a proxy that breaks away, gets one evaluation
// at least, and no more than are left.
TEST(Subdivision, AFrameThatBeginsAnewIsBounded) {
    LevelSettings membrane;
    membrane.strength_n = 1.0;
    membrane.yielding = Yielding::opens;
    SurfaceFinish rough;
    rough.friction = {0.5, 0.2};
    for (const SteppingSettings& settings :
         {stepping(SteppingMethod::paper),
          stepping(SteppingMethod::fixed, Stepping::kMostEvaluations)})
        for (const bool opens : {false, true}) {
            ContactLoop loop(
                settings,
                one_surface(make_solid_sphere(kRadius), opens ? membrane : LevelSettings{}), {},
                0.0, {rough});
            loop.start({0, 0, kRadius + 1e-6});
            std::uint32_t most = 0;
            for (int i = 0; i < 8; ++i)
                most = std::max(most, loop.move({1e-3 * i, 0, kRadius - 0.5e-3 * i}).evaluations);
            EXPECT_GT(most, static_cast<std::uint32_t>(Stepping::kMostEvaluations));
            EXPECT_LE(most, static_cast<std::uint32_t>(Stepping::kMostEvaluations + 2));
        }
}

TEST(Subdivision, RecordedDecisionsOfTheClockReproduceTheBits) {
    std::shared_ptr<const ScalarField> field = make_sphere_cavity(kRadius);
    const auto effects = [&] {
        std::vector<std::unique_ptr<Effect>> list;
        list.push_back(std::make_unique<GradientSurface>(
            field, TransferFunction::constant(std::numeric_limits<double>::infinity())));
        return list;
    };
    ContactLoop first(stepping(SteppingMethod::paper), {}, effects(), 3.0);
    ContactLoop second(stepping(SteppingMethod::paper), {}, effects(), 77.0);
    first.start({kRadius, 0, 0});
    second.start({kRadius, 0, 0});
    for (int i = 0; i < 200; ++i) {
        first.clock().set_step_us(1.0 + i % 17);
        const Vec3 probe = 0.052 * Vec3{std::cos(0.004 * i), std::sin(0.004 * i), 0};
        first.move(probe);
        const auto decisions = first.subdivision().steps_left();
        const auto result =
            second.subdivision().advance({probe, second.proxy(), 500.0, 1e-3}, decisions);
        second.start(result.proxy);
        ASSERT_EQ(second.proxy(), first.proxy());
    }
}

/// Largest drift off a cavity's wall after a probe has gone round 2 mm behind it at 0.2 m/s for one
/// second, m.
double drift(int sub_steps) {
    std::shared_ptr<const ScalarField> field = make_sphere_cavity(kRadius);
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(std::make_unique<GradientSurface>(
        field, TransferFunction::constant(std::numeric_limits<double>::infinity())));
    ContactLoop loop(stepping(SteppingMethod::fixed, sub_steps), {}, std::move(effects));
    loop.start({kRadius, 0, 0});
    double worst = 0.0;
    for (int i = 0; i <= 1000; ++i) {
        const double angle = 0.2e-3 * i / 0.052;
        loop.move(0.052 * Vec3{std::cos(angle), std::sin(angle), 0});
        worst = std::max(worst, glm::length(loop.proxy()) - kRadius);
    }
    return worst;
}

// numerics 2.1: the paper's scheme is exactly first order: drift x N is constant. 3 % for the
// shrinking lever arm of a drifted proxy.
TEST(Subdivision, DriftOfTheMemorylessSurfaceFallsAsOneOverN) {
    const double one = drift(1);
    const double speed = 0.2 * kRadius / 0.052;                        // of the proxy, m/s
    const double law_m = speed * speed * 1e-3 * 1.0 / (2.0 * kRadius); // in a second of 1 ms frames
    EXPECT_NEAR(one, law_m, 0.02 * law_m); // lever arm: 0.4 mm is 0.8 % of R, in a square
    for (int n : {2, 8, 46})
        EXPECT_NEAR(drift(n) * n, one, 0.03 * one) << n;
}

TEST(Subdivision, AdaptiveReachesTheClosestPointOfACavity) {
    ContactLoop loop(stepping(SteppingMethod::adaptive), one_surface(make_sphere_cavity(kRadius)));
    loop.start({0, 0, 0});
    double worst = 0.0;
    std::uint32_t evaluations = 0;
    for (int i = 0; i <= 2000; ++i) {
        const double angle = 0.2e-3 * i / 0.055;
        const Vec3 probe = 0.055 * Vec3{std::cos(angle), std::sin(angle), 0};
        evaluations += loop.move(probe).evaluations;
        if (i > 3)
            worst = std::max(worst, glm::length(loop.proxy() - kRadius * glm::normalize(probe)));
    }
    // The stop at 0.1 um applies its last step, which squares what is left: far below a nanometre.
    EXPECT_LE(worst, 1e-9);
    EXPECT_LE(evaluations, 2001u * 4u);
}

// One evaluation leaves depth / radius of curvature of the way, half of it or less here: 200 frames
// come to rest with any method.
TEST(Subdivision, AHeldProbeMovesNoBit) {
    for (SteppingMethod method :
         {SteppingMethod::adaptive, SteppingMethod::fixed, SteppingMethod::single}) {
        ContactLoop loop(stepping(method), one_surface(make_bumpy_cavity(kRadius, 1e-3, 15e-3)));
        loop.start({0, 0, 0});
        const Vec3 probe{0.04, 0.03, 0.02};
        for (int i = 0; i < 200; ++i)
            loop.move(probe);
        const Vec3 held = loop.proxy();
        for (int i = 0; i < 5000; ++i) {
            loop.move(probe);
            ASSERT_EQ(loop.proxy(), held);
        }
    }
}

TEST(Subdivision, ForcesShiftTheTargetThatASurfaceCarriesTowards) {
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(std::make_unique<ConstantForce>(Vec3{0.0, 0.0, -1.0})); // 2 mm at 500 N/m
    ContactLoop loop(stepping(SteppingMethod::adaptive), one_surface(make_slab(0.002)),
                     std::move(effects));
    loop.start({0, 0, 0.01});
    loop.move({0, 0, 0.004});
    EXPECT_NEAR(loop.proxy().z, 0.002, 1e-17) << "free: the probe plus force over stiffness";
    loop.move({0.001, 0, 0.0015});
    EXPECT_NEAR(loop.proxy().z, 0.001, 1e-12) << "the slab's face";
    EXPECT_NEAR(loop.proxy().x, 0.001, 1e-12);
}

TEST(Subdivision, RefusesSettingsOutOfRange) {
    SteppingSettings settings;
    settings.sub_steps = 0;
    test::ScriptedClock clock;
    EXPECT_THROW(Subdivision(settings, {}, {}, clock), std::invalid_argument);
    settings.sub_steps = 1;
    settings.tolerance_m = 0.0;
    EXPECT_THROW(Subdivision(settings, {}, {}, clock), std::invalid_argument);
}

} // namespace
} // namespace palpate
