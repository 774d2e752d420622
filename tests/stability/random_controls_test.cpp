// SPDX-License-Identifier: Apache-2.0
// That each check of random_cases_test.cpp can fail: what it looks at is spoilt, and it says so.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/stability/random/long_run.h"
#include "tests/stability/random/path_maker.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

using stability::CaseEvent;
using stability::Outcome;
using stability::RandomCase;
using stability::RunOptions;
using stability::SceneTable;

constexpr int kPathFrames = 400;

/// A path down into what lies below the origin's height, held at its end.
void press_down(RandomCase& of, double from_m, double to_m, bool held) {
    constexpr int kDown = 100;
    for (int i = 0; i <= kDown; ++i)
        of.steps.push_back({{1e-3, 2e-3, from_m + (to_m - from_m) * i / kDown}, i == 0});
    if (held) of.steps.resize(of.steps.size() + stability::kHeldFrames, of.steps.back());
}

/// A plate or a ball, felt alone. Damping keeps the law of the spring out of what is spoilt.
RandomCase one_body(bool by_mesh, bool held = false) {
    RandomCase made;
    made.tables.push_back({"[coupling]", {{"damping_n_s_per_m", "0.001"}}, 1});
    if (by_mesh) {
        made.meshes["plate.ply"] = std::make_shared<const TriangleMesh>(
            test::box_mesh({-.02, -.02, -.004}, {.02, .02, 0}));
        made.tables.push_back(
            {"[surface.body]",
             {{"mesh", "\"plate.ply\""}, {"mesh_unit", "\"m\""}, {"mesh_frame", "\"LPS\""}},
             2});
    } else {
        made.tables.push_back(
            {"[volume.ball]", {{"analytic", "\"solid_sphere\""}, {"radius_mm", "10"}}, 3});
        made.tables.push_back({"[surface.body]", {{"volume", "\"ball\""}}, 2});
    }
    made.tables.push_back({"[[effect]]", {{"type", "\"surface\""}, {"surface", "\"body\""}}, 4});
    press_down(made, by_mesh ? 3e-3 : 12e-3, by_mesh ? -2e-3 : 8.5e-3, held);
    return made;
}

/// What is spoilt, on which body, and who has to notice.
struct Spoilt {
    const char* invariant;
    bool by_mesh = false, held = false;
    RunOptions options;
};

constexpr std::uint64_t kSpoiltFrame = 90; // in contact

RunOptions in_one_frame(const std::function<void(FrameReport&, std::vector<Vec3>&)>& spoil) {
    RunOptions options;
    options.spoil_first = [=](FrameReport& report, std::vector<Vec3>& path) {
        if (report.frame == kSpoiltFrame) spoil(report, path);
    };
    return options;
}

std::vector<Spoilt> spoilt_reports() {
    std::vector<Spoilt> all;
    const auto in_frame = [&](const char* name, bool by_mesh, auto spoil) {
        all.push_back({name, by_mesh, false, in_one_frame(spoil)});
    };
    in_frame("finite", false, [](FrameReport& report, std::vector<Vec3>&) {
        report.force.x = std::numeric_limits<double>::quiet_NaN();
    });
    in_frame("limits", false,
             [](FrameReport& report, std::vector<Vec3>&) { report.force.z += 6.0; });
    in_frame("flags", false,
             [](FrameReport& report, std::vector<Vec3>&) { report.flags |= kDeviceStale; });
    in_frame("path", false, [](FrameReport&, std::vector<Vec3>& path) { path.front().x += 1e-12; });
    in_frame("path", true, [](FrameReport&, std::vector<Vec3>& path) { path.back().x += 1e-12; });
    in_frame("work", false,
             [](FrameReport& report, std::vector<Vec3>&) { report.evaluations = 1000; });
    in_frame("work", false,
             [](FrameReport& report, std::vector<Vec3>&) { report.work = 1'000'000; });
    all.push_back({"follows", false, false, {}});
    all.back().options.spoil_first = [](FrameReport& report, std::vector<Vec3>&) {
        if (report.frame == 10) report.proxy.x += 1e-6; // in free space
    };
    // As if nothing held it: the proxy goes where the probe is.
    in_frame("certificate", false,
             [](FrameReport& report, std::vector<Vec3>& path) { path.push_back(report.probe); });
    in_frame("crossing", true, [](FrameReport& report, std::vector<Vec3>& path) {
        path.push_back(report.probe - Vec3{0, 0, 3e-3});
    });
    // Without a chord that says so; looked at in every eighth frame.
    all.push_back({"side", true, false, {}});
    all.back().options.spoil_first = [](FrameReport& report, std::vector<Vec3>&) {
        if (report.frame == 80) report.proxy = report.probe;
    };
    in_frame("energy", true, [](FrameReport& report, std::vector<Vec3>&) {
        report.proxy += 1e-6 * glm::normalize(report.proxy - report.probe);
    });
    all.push_back({"energy", false, true, {}}); // of a held probe
    all.back().options.spoil_first = [](FrameReport& report, std::vector<Vec3>&) {
        if (report.frame == 120)
            report.proxy += 31e-6 * glm::normalize(report.proxy - report.probe);
    };
    // It goes to and fro, in one place or with a drift.
    for (const auto& [way_m, drift_m] :
         {std::pair{2e-8, 0.0}, {2e-8, 1e-12}, {5e-6, 1e-12}, {5e-6, 1e-9}}) {
        all.push_back({"rest", false, true, {}});
        all.back().options.spoil_first = [before = Vec3{}, way_m, drift_m](
                                             FrameReport& report, std::vector<Vec3>& path) mutable {
            if (report.frame >= 120) { // the probe is held
                const auto frame = static_cast<double>(report.frame);
                report.proxy.x += drift_m * frame + (report.frame % 2 == 0 ? way_m : 0.0);
                path = {before, report.proxy};
            }
            before = report.proxy;
        };
    }
    all.push_back({"same bits", false, false, {}});
    all.back().options.spoil_twin = [](FrameReport& report) {
        if (report.frame == kSpoiltFrame) report.force.x = std::nextafter(report.force.x, 1.0);
    };
    all.push_back({"smooth", false, false, {}});
    all.back().options.spoil_beside = [](FrameReport& report) { report.proxy.x += 3e-6; };
    return all;
}

TEST(RandomCasesControl, EachInvariantNoticesWhatItIsThereFor) {
    const test::TemporaryFolder folder;
    for (const Spoilt& spoilt : spoilt_reports()) {
        SCOPED_TRACE(spoilt.invariant);
        stability::write_case(one_body(spoilt.by_mesh, spoilt.held), folder / "case");
        const Outcome good = stability::run_case(folder / "case");
        EXPECT_EQ(good.refused, "");
        ASSERT_FALSE(good.failure) << good.failure->invariant << ": " << good.failure->words;
        const Outcome bad = stability::run_case(folder / "case", spoilt.options);
        ASSERT_TRUE(bad.failure);
        EXPECT_EQ(bad.failure->invariant, spoilt.invariant) << bad.failure->words;
    }
}

// Far away the proxy may be behind the facet that it is on by a thousand roundings of its position
// (mesh_contact.md 7): 0.89 nm where a coordinate is 500 m. Who leaves there is noticed.
TEST(RandomCasesControl, FarAwayAProxyMayDipBehindItsFacetByATolerance) {
    const test::TemporaryFolder folder;
    const Vec3 place{400.0, 500.0, 300.0};
    RandomCase of = one_body(true);
    TriangleMesh plate = *of.meshes["plate.ply"];
    for (Vec3& p : plate.vertices)
        p = 0.01 * p + place; // half of it is 0.2 mm
    of.meshes["plate.ply"] = std::make_shared<const TriangleMesh>(std::move(plate));
    for (auto& step : of.steps)
        step.probe = 0.01 * step.probe + place;
    stability::write_case(of, folder / "case");
    const auto dipped = [&](double depth_m, double then_m) {
        const Outcome outcome = stability::run_case(
            folder / "case", in_one_frame([=](FrameReport&, std::vector<Vec3>& path) {
                const Vec3 on = path.back();
                path.push_back(on + Vec3{1e-6, 0, -depth_m});
                path.push_back(on + Vec3{2e-6, 0, then_m});
            }));
        return outcome.failure ? outcome.failure->invariant : std::string();
    };
    EXPECT_EQ(dipped(0.8e-9, 0.0), "path") << "by nobody, but that it ends elsewhere";
    EXPECT_EQ(dipped(1e-9, 0.0), "crossing") << "farther than that";
    EXPECT_EQ(dipped(0.8e-9, -1e-9), "crossing") << "in two steps";
}

// Behind the mesh that guards a level, farther away than the leash; or behind that of contact
// `direct`, farther away than a twentieth of the ball's radius. Both are 0.5 mm.
TEST(RandomCasesControl, AProxyThatHasLeftItsMeshIsNoticed) {
    const test::TemporaryFolder folder;
    for (const auto& [contact, invariant] : {std::pair{"guarded", "leash"}, {"direct", "direct"}}) {
        SCOPED_TRACE(contact);
        RandomCase of = one_body(false);
        of.meshes["ball.ply"] = std::make_shared<const TriangleMesh>(test::icosphere(0.01, 4));
        for (SceneTable& table : of.tables) {
            if (table.header != "[surface.body]") continue;
            table.keys.insert(table.keys.end(), {{"contact", "\"" + std::string(contact) + "\""},
                                                 {"mesh", "\"ball.ply\""},
                                                 {"mesh_unit", "\"m\""},
                                                 {"mesh_frame", "\"LPS\""}});
            if (invariant == std::string("leash")) table.keys.emplace_back("leash_mm", "0.5");
        }
        stability::write_case(of, folder / "case");
        const auto behind = [&](double depth_m) { // no chord says so
            RunOptions options;
            options.spoil_first = [=](FrameReport& report, std::vector<Vec3>&) {
                if (report.frame == 88)
                    report.proxy *= (0.01 - depth_m) / glm::length(report.proxy);
            };
            return stability::run_case(folder / "case", options);
        };
        const Outcome good = behind(0.3e-3);
        ASSERT_TRUE(good.failure);
        EXPECT_EQ(good.failure->invariant, "path") << "who looks last" << good.failure->words;
        EXPECT_GT(good.checks.at(invariant), 0);
        const Outcome bad = behind(0.7e-3);
        ASSERT_TRUE(bad.failure);
        EXPECT_EQ(bad.failure->invariant, invariant) << bad.failure->words;
    }
}

// Labels that touch, and are felt alike, are felt as one, and do not stop the proxy for long.
TEST(RandomCasesControl, LabelsThatStopTheProxyOrHaveAGrooveAreNoticed) {
    const test::TemporaryFolder folder;
    Outcome good;
    RandomCase made;
    for (std::uint64_t seed = 0; seed < 400 && good.checks["goes on"] == 0; ++seed) {
        made = stability::make_case(seed, kPathFrames);
        if (made.volumes.count("joined.nrrd") == 0) continue;
        stability::write_case(made, folder / "case");
        good = stability::run_case(folder / "case");
        ASSERT_FALSE(good.failure) << good.failure->invariant << ": " << good.failure->words;
    }
    ASSERT_GT(good.checks["goes on"], 0) << "no such scene";
    EXPECT_GT(good.checks["as one"], 0);
    RunOptions options;
    options.spoil_first = [](FrameReport& report, std::vector<Vec3>&) {
        if (report.frame < 50) return;
        report.flags |= kStalled;
        report.residual_m = 1e-3;
    };
    const Outcome bad = stability::run_case(folder / "case", options);
    ASSERT_TRUE(bad.failure);
    EXPECT_EQ(bad.failure->invariant, "goes on") << bad.failure->words;
    EXPECT_EQ(bad.failure->frame, 55) << "the sixth";

    // As if nothing held it on its way to the middle.
    options.spoil_first = [&](FrameReport& report, std::vector<Vec3>& path) {
        if (report.surfaces_felt != 0) path = {made.place + Vec3(10.0 * made.size_m), made.place};
    };
    const Outcome passed = stability::run_case(folder / "case", options);
    ASSERT_TRUE(passed.failure);
    EXPECT_EQ(passed.failure->invariant, "as one") << passed.failure->words;
}

// A frame of a method that counts its steps makes all of them.
TEST(RandomCasesControl, ACapThatNothingExplainsIsNoticed) {
    const test::TemporaryFolder folder;
    RandomCase of = one_body(true);
    of.tables.push_back({"[loop]", {{"method", "\"fixed\""}, {"sub_steps", "16"}}, 5});
    stability::write_case(of, folder / "case");
    ASSERT_FALSE(stability::run_case(folder / "case").failure);
    const Outcome bad = stability::run_case(
        folder / "case", in_one_frame([](FrameReport& report, std::vector<Vec3>&) {
            report.flags |= kEvaluationCap;
        }));
    ASSERT_TRUE(bad.failure);
    EXPECT_EQ(bad.failure->invariant, "work");
}

// The law of the spring, where nothing else is added to it.
TEST(RandomCasesControl, AForceThatIsNotTheSpringsIsNoticed) {
    const test::TemporaryFolder folder;
    RandomCase of = one_body(false);
    of.tables.erase(of.tables.begin()); // the damping
    stability::write_case(of, folder / "case");
    ASSERT_FALSE(stability::run_case(folder / "case").failure);
    const Outcome bad = stability::run_case(
        folder / "case",
        in_one_frame([](FrameReport& report, std::vector<Vec3>&) { report.force *= 1.0 + 1e-6; }));
    ASSERT_TRUE(bad.failure);
    EXPECT_EQ(bad.failure->invariant, "coupling");
}

// What the hand feels of a soft surface is its law, to rounding.
TEST(RandomCasesControl, ATipThatIsNotWhereTheLawPutsItIsNoticed) {
    const test::TemporaryFolder folder;
    RandomCase of = one_body(false);
    for (SceneTable& table : of.tables)
        if (table.header == "[surface.body]")
            table.keys.emplace_back("stiffness_mm_n", "[[1, 0.1], [2, 0.3]]");
    stability::write_case(of, folder / "case");
    const Outcome good = stability::run_case(folder / "case");
    ASSERT_FALSE(good.failure) << good.failure->words;
    EXPECT_GT(good.checks.at("press"), 30);
    const Outcome bad = stability::run_case(
        folder / "case", in_one_frame([](FrameReport& report, std::vector<Vec3>&) {
            report.proxy += 1e-9 * glm::normalize(report.front - report.probe);
        }));
    ASSERT_TRUE(bad.failure);
    EXPECT_EQ(bad.failure->invariant, "press");
}

// The second hand has checks of its own.
TEST(RandomCasesControl, WhatTheSecondHandDoesWrongIsNoticed) {
    const test::TemporaryFolder folder;
    RandomCase of = one_body(true);
    of.second_steps = of.steps;
    stability::write_case(of, folder / "case");
    const Outcome good = stability::run_case(folder / "case");
    EXPECT_EQ(good.refused, "");
    ASSERT_FALSE(good.failure) << good.failure->invariant << ": " << good.failure->words;
    EXPECT_EQ(good.checks.at("second hand"), good.frames);
    RunOptions options;
    options.spoil_second = [](FrameReport& report, std::vector<Vec3>& path) {
        if (report.frame == kSpoiltFrame) path.push_back(report.probe - Vec3{0, 0, 3e-3});
    };
    const Outcome bad = stability::run_case(folder / "case", options);
    ASSERT_TRUE(bad.failure);
    EXPECT_EQ(bad.failure->invariant, "crossing");
    EXPECT_NE(bad.failure->words.find("of the second hand"), std::string::npos);
}

// A thin wedge that a chord goes through from free space to free space.
TEST(RandomCasesControl, AWedgeIsNotPassedBetweenTheEndsOfAChord) {
    const test::TemporaryFolder folder;
    RandomCase of;
    of.tables.push_back({"[coupling]", {{"damping_n_s_per_m", "0.001"}}, 1});
    of.tables.push_back({"[volume.w]", {{"analytic", "\"wedge\""}, {"angle_deg", "5"}}, 3});
    of.tables.push_back({"[surface.body]", {{"volume", "\"w\""}}, 2});
    of.tables.push_back({"[[effect]]", {{"type", "\"surface\""}, {"surface", "\"body\""}}, 4});
    for (int i = 0; i <= 100; ++i)
        of.steps.push_back({{1e-3, 0, 1e-3 - 3e-5 * i}, i == 0});
    stability::write_case(of, folder / "case");
    const Outcome good = stability::run_case(folder / "case");
    ASSERT_FALSE(good.failure) << good.failure->words;
    const Outcome bad = stability::run_case(
        folder / "case", in_one_frame([](FrameReport&, std::vector<Vec3>& path) {
            const Vec3 from = path.back(); // beside the wedge, on its right
            path.push_back({-from.x, from.y, from.z});
        }));
    ASSERT_TRUE(bad.failure);
    EXPECT_EQ(bad.failure->invariant, "certificate") << bad.failure->words;
}

// A loop that restores all but its count of frames.
TEST(RandomCasesControl, ARestoredLoopThatCountsTheDetourIsNoticed) {
    const test::TemporaryFolder folder;
    RandomCase of = one_body(false);
    CaseEvent detour;
    detour.frame = 50;
    of.events.push_back(detour);
    stability::write_case(of, folder / "case");
    ASSERT_FALSE(stability::run_case(folder / "case").failure);
    RunOptions options;
    options.spoil_twin = [](FrameReport& report) { report.frame += report.frame > 50 ? 12 : 0; };
    const Outcome bad = stability::run_case(folder / "case", options);
    ASSERT_TRUE(bad.failure);
    EXPECT_EQ(bad.failure->frame, 51);
}

} // namespace
} // namespace palpate
