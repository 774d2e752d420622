// SPDX-License-Identifier: Apache-2.0
// What is touched, in scenes of formulas where a pencil says it, too.
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>

#include "tests/support/scene_texts.h"
#include "tests/support/scripted_clock.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

using Phase = Touch::Phase;
using Standing = SurfaceStatus::Standing;

constexpr double kStiffness = 500.0; // N/m, the default
// Frames end within 0.1 um of the balance, the default: so exactly is a force known.
constexpr double kForceError = kStiffness * 0.1e-6;

std::shared_ptr<const Scene> scene_of(const std::string& text) {
    return std::make_shared<const Scene>(parse_scene(text, "touches.toml"));
}
std::string surface_of_formula(const std::string& name, const std::string& volume) {
    return "[volume." + name + "]\n" + volume + "\n[surface." + name + "]\nvolume = \"" + name +
           "\"\n[[effect]]\ntype = \"surface\"\nsurface = \"" + name + "\"\n";
}
std::string ball(const std::string& more = "") {
    return surface_of_formula("ball", "analytic = \"solid_sphere\"\nradius_mm = 50") + more;
}

/// A loop of a scene in text, its probe, and what came of the last frame.
struct Probed {
    explicit Probed(const std::string& text) : scene(scene_of(text)), loop(scene, clock) {}

    void to(const Vec3& probe, std::uint32_t trial = 0) {
        DeviceState state;
        state.position = probe;
        state.trial = trial;
        report = loop.frame(state);
    }
    /// In steps of at most 0.1 mm.
    void along(const Vec3& from, const Vec3& end) {
        const int steps = 1 + static_cast<int>(glm::length(end - from) / 1e-4);
        for (int i = 0; i <= steps; ++i)
            to(from + (i / double(steps)) * (end - from));
    }
    SurfaceStatus status() const { return loop.surface_states()[0]; }

    std::shared_ptr<const Scene> scene;
    test::ScriptedClock clock;
    HapticLoop loop;
    FrameReport report;
};

TEST(Touches, NothingIsTouchedBeforeTheFirstFrameAndInFreeSpace) {
    Probed probed(ball());
    EXPECT_TRUE(probed.loop.touches().empty());
    EXPECT_TRUE(probed.loop.surface_states().empty());
    probed.to({0, 0, 0.06});
    EXPECT_TRUE(probed.loop.touches().empty());
    ASSERT_EQ(probed.loop.surface_states().size(), 1u);
    EXPECT_EQ(probed.status().standing, Standing::out);
    EXPECT_NEAR(probed.status().depth_m, -0.010, 1e-10);
}

TEST(Touches, ABallPushesWithStiffnessTimesDepthAlongItsRadius) {
    const Vec3 radius = glm::normalize(Vec3{1.0, -2.0, 2.0});
    for (const double depth_m : {0.1e-3, 1e-3, 5e-3}) {
        Probed probed(ball());
        probed.along(0.051 * radius, (0.05 - depth_m) * radius);
        for (int i = 0; i < 5; ++i)
            probed.to((0.05 - depth_m) * radius);
        ASSERT_EQ(probed.loop.touches().size(), 1u);
        const Touch touch = probed.loop.touches()[0];
        EXPECT_EQ(touch.surface, 0u);
        EXPECT_EQ(touch.phase, Phase::goes_on);
        EXPECT_LT(glm::length(touch.point - 0.05 * radius), 1e-7);
        EXPECT_LT(glm::length(touch.normal - radius), 1e-5);
        EXPECT_LT(glm::length(touch.force - kStiffness * depth_m * radius), kForceError);
        EXPECT_EQ(probed.status().standing, Standing::touched);
        EXPECT_NEAR(probed.status().depth_m, 0.0, 1e-7);
        EXPECT_FALSE(probed.status().guarded);
    }
}

TEST(Touches, AGrooveHasTwoContactsWhoseForcesAddUp) {
    // Material around a groove of 120 degrees along y: its faces lean by 30 degrees.
    Probed probed(surface_of_formula("groove", "analytic = \"wedge\"\nangle_deg = 240"));
    probed.along({0.004, 0, 0.01}, {0, 0, -0.002});
    for (int i = 0; i < 5; ++i)
        probed.to({0, 0, -0.002});
    ASSERT_EQ(probed.loop.touches().size(), 2u);
    const Touch one = probed.loop.touches()[0], two = probed.loop.touches()[1];
    const double cosine = std::cos(std::numbers::pi / 6.0);
    for (const Touch& touch : {one, two}) {
        EXPECT_LT(glm::length(touch.point), 1e-6);
        EXPECT_NEAR(touch.normal.z, cosine, 1e-9);
        EXPECT_NEAR(glm::length(touch.force), 1.0 / (2.0 * cosine), 2.0 * kForceError);
        EXPECT_LT(glm::length(glm::cross(touch.force, touch.normal)), 1e-12);
    }
    EXPECT_NEAR(one.normal.x, -two.normal.x, 1e-9);
    EXPECT_LT(glm::length(one.force + two.force - Vec3(0, 0, 1.0)), 2.0 * kForceError);
}

TEST(Touches, FrictionIsThePartOfAForceAcrossItsNormal) {
    const double mu = 0.25;
    Probed probed(surface_of_formula("plate", "analytic = \"slab\"\nthickness_mm = 20") +
                  "[[effect]]\ntype = \"friction\"\nsurface = \"plate\"\nstatic = 0.25\n"
                  "dynamic = 0.25\n");
    probed.along({0, 0, 0.011}, {0, 0, 0.008});
    probed.along({0, 0, 0.008}, {0.01, 0, 0.008}); // it slides long before
    ASSERT_EQ(probed.loop.touches().size(), 1u);
    const Touch touch = probed.loop.touches()[0];
    const double pressed_n = kStiffness * 2e-3;
    EXPECT_NEAR(touch.force.z, pressed_n, kForceError);
    EXPECT_NEAR(touch.force.x, -mu * pressed_n, kForceError);
    EXPECT_NEAR(touch.force.y, 0.0, kForceError);
    EXPECT_NEAR(touch.normal.z, 1.0, 1e-12);
    EXPECT_LT(glm::length(touch.force - probed.report.force), kForceError)
        << "which is what the hand gets";
}

TEST(Touches, AContactBeginsOnceAndEndsOnceInAPressAndALift) {
    for (const char* method : {"adaptive", "fixed", "single"}) {
        SCOPED_TRACE(method);
        Probed probed(ball("[loop]\nmethod = \"" + std::string(method) + "\"\n"));
        int began = 0, ended = 0, felt = 0;
        bool holds = false;
        for (int i = 0; i <= 200; ++i) {
            const double height_m = 0.05 + 2e-3 * std::cos(i * std::numbers::pi / 100.0);
            probed.to({1e-5 * i, 0, height_m});
            ASSERT_LE(probed.loop.touches().size(), 1u);
            for (const Touch& touch : probed.loop.touches()) {
                switch (touch.phase) {
                case Phase::began:
                    EXPECT_FALSE(holds);
                    ++began;
                    break;
                case Phase::goes_on:
                    EXPECT_TRUE(holds);
                    break;
                case Phase::ended:
                    EXPECT_TRUE(holds);
                    EXPECT_EQ(touch.force, Vec3(0.0));
                    EXPECT_NEAR(glm::length(touch.point), 0.05, 30e-6);
                    EXPECT_GT(touch.normal.z, 0.99);
                    ++ended;
                    break;
                }
            }
            holds =
                !probed.loop.touches().empty() && probed.loop.touches()[0].phase != Phase::ended;
            EXPECT_EQ(holds, probed.report.surfaces_felt != 0);
            felt += holds ? 1 : 0;
        }
        EXPECT_EQ(began, 1);
        EXPECT_EQ(ended, 1);
        EXPECT_GT(felt, 90);
    }
}

TEST(Touches, ASilenceOfTheDeviceNeitherBeginsNorEndsAContact) {
    Probed probed(ball());
    probed.along({0, 0, 0.051}, {0, 0, 0.049});
    DeviceState stale;
    stale.freshness = Freshness::stale;
    probed.loop.frame(stale);
    EXPECT_TRUE(probed.loop.touches().empty());
    probed.to({0, 0, 0.049});
    ASSERT_EQ(probed.loop.touches().size(), 1u);
    EXPECT_EQ(probed.loop.touches()[0].phase, Phase::goes_on);
}

TEST(Touches, ANewTrialElsewhereEndsWhatTheLastOneTouched) {
    Probed probed(ball());
    probed.along({0, 0, 0.051}, {0, 0, 0.049});
    probed.to({0, 0.06, 0}, 1);
    ASSERT_EQ(probed.loop.touches().size(), 1u);
    EXPECT_EQ(probed.loop.touches()[0].phase, Phase::ended);
    EXPECT_NEAR(probed.loop.touches()[0].point.z, 0.05, 30e-6) << "where it was";
    probed.to({0, 0.06, 0}, 1);
    EXPECT_TRUE(probed.loop.touches().empty());
}

TEST(Touches, AreOnlyOfWhatTheLoopHasComputedSinceARestore) {
    Probed probed(ball());
    probed.along({0, 0, 0.051}, {0, 0, 0.0501});
    const LoopState before = probed.loop.save();
    probed.to({0, 0, 0.049});
    ASSERT_EQ(probed.loop.touches().size(), 1u);
    const Touch began = probed.loop.touches()[0];
    EXPECT_EQ(began.phase, Phase::began);
    const LoopState touching = probed.loop.save();
    probed.loop.restore(before);
    EXPECT_TRUE(probed.loop.touches().empty());
    probed.to({0, 0, 0.049});
    ASSERT_EQ(probed.loop.touches().size(), 1u);
    EXPECT_EQ(probed.loop.touches()[0], began);
    probed.loop.restore(touching);
    probed.to({0, 0, 0.06});
    ASSERT_EQ(probed.loop.touches().size(), 1u);
    EXPECT_EQ(probed.loop.touches()[0].phase, Phase::ended);
    EXPECT_NEAR(probed.loop.touches()[0].point.z, 0.05, 1e-6);
}

TEST(Touches, AskingChangesNeitherFramesNorTheirCounts) {
    Probed asked(ball()), silent(ball());
    for (int i = 0; i <= 400; ++i) {
        const Vec3 probe{2e-5 * i, 1e-5 * i, 0.05 + 1e-3 * std::cos(0.05 * i)};
        asked.to(probe);
        silent.to(probe);
        asked.loop.touches();
        asked.loop.surface_states();
        ASSERT_EQ(asked.report.proxy, silent.report.proxy);
        ASSERT_EQ(asked.report.force, silent.report.force);
        ASSERT_EQ(asked.report.field_samples, silent.report.field_samples);
        ASSERT_EQ(asked.report.evaluations, silent.report.evaluations);
    }
}

TEST(Touches, AMeshAlonePushesAsItsFacetsLie) {
    const test::TemporaryFolder folder;
    test::SceneTextDraw::make_meshes(folder.path()); // a box up to x = 9, y = 8 mm among them
    const auto scene = std::make_shared<const Scene>(
        parse_scene("[surface.box]\nmesh = \"box.ply\"\nmesh_unit = \"mm\"\nmesh_frame = \"LPS\"\n"
                    "[[effect]]\ntype = \"surface\"\nsurface = \"box\"\n",
                    folder.path() / "scene.toml"),
        SceneResources{.files = scene_files()});
    test::ScriptedClock clock;
    HapticLoop loop(scene, clock);
    DeviceState state;
    state.position = {0.012, 0.001, 0.0005};
    loop.frame(state);
    EXPECT_NEAR(loop.surface_states()[0].depth_m, -0.003, 1e-9);
    for (int i = 0; i < 30; ++i) { // pressed 2 mm deep, and along
        state.position = {0.007, 0.001 + 1e-4 * i, 0.0005};
        loop.frame(state);
        ASSERT_EQ(loop.touches().size(), 1u);
        const Touch touch = loop.touches()[0];
        EXPECT_LT(glm::length(touch.force - Vec3(kStiffness * 2e-3, 0, 0)), 1e-6);
        EXPECT_LT(glm::length(touch.normal - Vec3(1, 0, 0)), 1e-6);
        EXPECT_LT(glm::length(touch.point - Vec3(0.009, state.position.y, 0.0005)), 1e-8);
        EXPECT_NEAR(loop.surface_states()[0].depth_m, 0.0, 1e-8);
    }
}

TEST(SurfaceStates, ATrialInsideIsNotFeltUntilItHasBeenLeft) {
    Probed probed(ball());
    probed.to({0, 0, 0.045});
    EXPECT_EQ(probed.status().standing, Standing::began_inside);
    EXPECT_NEAR(probed.status().depth_m, 5e-3, 1e-10);
    EXPECT_TRUE(probed.loop.touches().empty());
    const LoopState inside = probed.loop.save();
    probed.to({0, 0, 0.055});
    EXPECT_EQ(probed.status().standing, Standing::out);
    probed.loop.restore(inside);
    probed.to({0, 0, 0.045});
    EXPECT_EQ(probed.status().standing, Standing::began_inside) << "it is a part of the state";
}

TEST(SurfaceStates, WhatYieldsSaysHowDeepTheProxyIsBehindItsOwnLevel) {
    Probed probed(surface_of_formula("ball", "analytic = \"solid_sphere\"\nradius_mm = 50") + "");
    SceneDescription weak = probed.scene->description();
    weak.surfaces.at("ball").strength_n = 1.0;
    HapticLoop loop(std::make_shared<const Scene>(weak), probed.clock);
    DeviceState state;
    for (int i = 0; i <= 120; ++i) { // from 1 mm in front to 5 mm behind: 1 N is reached at 2 mm
        state.position = {0, 0, 0.051 - 5e-5 * i};
        loop.frame(state);
    }
    const SurfaceStatus status = loop.surface_states()[0];
    EXPECT_EQ(status.standing, Standing::yielding);
    EXPECT_NEAR(status.depth_m, 3e-3, 60e-6) << "5 mm less what 1 N stretches the coupling";
    ASSERT_EQ(loop.touches().size(), 1u);
    EXPECT_NEAR(loop.touches()[0].force.z, 1.0, 1e-3);
}

TEST(SurfaceStates, AMembraneIsOpenAndASurfaceOfGainZeroIsOff) {
    SceneDescription scene = scene_of(ball())->description();
    scene.surfaces.at("ball").strength_n = 1.0;
    scene.surfaces.at("ball").yielding = Yielding::opens;
    test::ScriptedClock clock;
    HapticLoop loop(std::make_shared<const Scene>(scene), clock);
    DeviceState state;
    for (int i = 0; i <= 100; ++i) {
        state.position = {0, 0, 0.051 - 5e-5 * i};
        loop.frame(state);
    }
    EXPECT_EQ(loop.surface_states()[0].standing, Standing::open);
    EXPECT_NEAR(loop.surface_states()[0].depth_m, 4e-3, 1e-9);
    EXPECT_TRUE(loop.touches().empty());
    ASSERT_TRUE(loop.set_gain(0, 0.0));
    for (int i = 0; i < 60; ++i) // 50 ms
        loop.frame(state);
    EXPECT_EQ(loop.surface_states()[0].standing, Standing::off);
}

} // namespace
} // namespace palpate
