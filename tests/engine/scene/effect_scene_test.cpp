// SPDX-License-Identifier: Apache-2.0
// Effects on volumes, from a scene to its frames.
#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>

#include "tests/support/scripted_clock.h"

namespace palpate {
namespace {

constexpr const char* kHelix = "[volume.stream]\nanalytic = \"helix\"\nradius_mm = 20\npitch_mm = "
                               "31.4159265358979\n"; // 5 mm rise a radian
constexpr const char* kBall = "[volume.ball]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n";

Trace traced(const std::string& text, const std::vector<DeviceState>& inputs) {
    test::ScriptedClock clock;
    return run_trace(std::make_shared<const Scene>(parse_scene(text, "x.toml")), inputs, clock);
}

std::string complaint(const std::string& text) {
    try {
        const Scene scene(parse_scene(text, "x.toml"));
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "";
}

Vec3 on_helix(double radius, double angle) {
    return {radius * std::cos(angle), radius * std::sin(angle), 0.005 * angle};
}

// Below 2 um after 2 s with 2 evaluations per frame (numerics 3.6).
TEST(EffectScene, AStreamIsFollowed) {
    std::vector<DeviceState> inputs;
    for (int i = 0; i <= 2000; ++i) {
        DeviceState state;
        state.time_s = 1e-3 * i;
        // 0.2 m/s along a helix 2 mm outside of the one that the proxy begins on
        state.position = on_helix(i == 0 ? 0.020 : 0.022, 0.2e-3 * i / std::hypot(0.022, 0.005));
        inputs.push_back(state);
    }
    const Trace trace = traced(std::string(kHelix) + "[[effect]]\ntype = \"vector_follow\"\nvolume "
                                                     "= \"stream\"\nstrength_n = 5\n",
                               inputs);
    const Vec3 end = trace.frames.back().proxy;
    EXPECT_LE(std::abs(std::hypot(end.x, end.y) - 0.020), 2e-6);
    double evaluations = 0.0;
    for (const FrameReport& frame : trace.frames)
        evaluations += frame.evaluations;
    EXPECT_LE(evaluations / static_cast<double>(trace.frames.size()), 2.1);
}

// In steady movement the hand feels b v.
TEST(EffectScene, AMediumResistsInProportionToTheVelocity) {
    std::vector<DeviceState> inputs;
    for (int i = 0; i < 500; ++i) {
        DeviceState state;
        state.time_s = 1e-3 * i;
        state.position = {0.1e-3 * i, 0, 0}; // 0.1 m/s
        inputs.push_back(state);
    }
    const Trace trace = traced("[[effect]]\ntype = \"viscosity\"\ndamping_n_s_per_m = 5\n", inputs);
    EXPECT_NEAR(trace.frames.back().force.x, -0.5, 1e-9);
    EXPECT_EQ(trace.frames.back().field_samples, 0u);
}

TEST(EffectScene, EveryModeOfAVolumeIsBuiltAndFelt) {
    struct Mode {
        const char* type;
        const char* volume;
    };
    for (const Mode& mode : {Mode{"gradient_force", "ball"},
                             {"gradient_surface", "ball"},
                             {"vector_force", "stream"},
                             {"vector_follow", "stream"},
                             {"front_shape", "stream"},
                             {"vortex", "stream"}}) {
        std::vector<DeviceState> inputs;
        for (int i = 0; i < 50; ++i) {
            DeviceState state;
            state.time_s = 1e-3 * i;
            // across streams, fronts and tubes, and into the ball
            state.position = {0.020 - 0.05e-3 * i, 0.05e-3 * i, -0.05e-3 * i};
            inputs.push_back(state);
        }
        const std::string effect =
            fmt::format("[[effect]]\ntype = \"{}\"\nvolume = \"{}\"\nstrength_n = 0.5\n", mode.type,
                        mode.volume);
        const std::string volume = std::string(mode.volume) == "ball" ? kBall : kHelix;
        const Trace trace = traced(volume + effect, inputs);
        EXPECT_GT(glm::length(trace.frames.back().force), 0.05) << mode.type;
        EXPECT_GT(trace.frames.back().field_samples, 0u) << mode.type;
    }
}

constexpr const char* kPlate = "[volume.plate]\nanalytic = \"slab\"\nthickness_mm = 10\n"
                               "[surface.top]\nvolume = \"plate\"\niso_value = 0\n";

/// Down onto the plate, 2 mm deep, and along x at 0.1 m/s.
std::vector<DeviceState> stroke(int frames) {
    std::vector<DeviceState> inputs;
    for (int i = 0; i < frames; ++i) {
        DeviceState state;
        state.time_s = 1e-3 * i;
        state.position = {i < 20 ? 0.0 : 0.1e-3 * (i - 20), 0.0, std::max(6e-3 - 0.3e-3 * i, 3e-3)};
        inputs.push_back(state);
    }
    return inputs;
}

constexpr const char* kTouch = "[[effect]]\ntype = \"surface\"\nsurface = \"top\"\n";

// k = 500 N/m, 2 mm deep: 1 N on the plate.
TEST(EffectScene, FrictionIsFeltAlongItsSurface) {
    const Trace trace = traced(std::string(kPlate) + kTouch +
                                   "[[effect]]\ntype = \"friction\"\nsurface = \"top\"\nstatic = "
                                   "0.4\ndynamic = 0.3\n",
                               stroke(200));
    EXPECT_NEAR(trace.frames.back().force.x, -0.3, 1e-6); // 500 N/m times the tolerance: 5e-5
    EXPECT_NEAR(trace.frames.back().force.z, 1.0, 1e-6);
    EXPECT_EQ(trace.frames.back().surface_queries, 0u);
    const Trace without = traced(std::string(kPlate) + kTouch, stroke(200));
    EXPECT_NEAR(without.frames.back().force.x, 0.0, 1e-6);
}

TEST(EffectScene, FrictionWithoutItsSurfaceIsLeftOut) {
    const EffectPlan plan = plan_effects(
        parse_scene(std::string(kPlate) +
                        "[[effect]]\ntype = \"friction\"\nsurface = \"top\"\nstatic = 0.4\n",
                    "x.toml"),
        Extraction::impossible);
    EXPECT_FALSE(plan.effects[0].on);
    EXPECT_EQ(plan.effects[0].reason, "surface top is not felt");
}

TEST(EffectScene, AGuideAWorkspaceAndGravityCompensationAreFelt) {
    const std::string guide =
        "[[effect]]\ntype = \"guide\"\npoints_mm = [[0, 0, 20], [100, 0, 20]]\n"
        "strength_n = 50\n";
    const Trace led = traced(guide, stroke(100));
    EXPECT_NEAR(led.frames.back().proxy.z, 20e-3, 1e-12);
    EXPECT_NEAR(led.frames.back().proxy.x, 7.9e-3, 1e-12);

    const std::string box =
        "[[effect]]\ntype = \"workspace\"\nbox_mm = [[-5, -5, -5], [5, 5, 10]]\n";
    EXPECT_NEAR(traced(box, stroke(100)).frames.back().proxy.x, 5e-3, 1e-15);
    const std::string ball =
        "[[effect]]\ntype = \"workspace\"\nradius_mm = 4\ncenter_mm = [0, 0, 3]\n";
    EXPECT_NEAR(traced(ball, stroke(100)).frames.back().proxy.x, 4e-3, 1e-12);

    const Trace carried =
        traced("[[effect]]\ntype = \"gravity_compensation\"\nmass_kg = 0.1\ndown = [0, 0, -2]\n",
               stroke(2000));
    EXPECT_NEAR(carried.frames.back().force.z, 0.980665, 1e-12);
}

TEST(EffectScene, AContactIsHeardThroughItsVibration) {
    const std::string hit = "[[effect]]\ntype = \"vibration\"\nsurface = \"top\"\n";
    const Trace with = traced(std::string(kPlate) + kTouch + hit, stroke(100));
    const Trace without = traced(std::string(kPlate) + kTouch, stroke(100));
    double most = 0.0;
    for (std::size_t i = 0; i < with.frames.size(); ++i) {
        EXPECT_EQ(with.frames[i].proxy, without.frames[i].proxy);
        most = std::max(most, std::abs(with.frames[i].force.z - without.frames[i].force.z));
    }
    // 0.3 m/s times 5 N s/m, after a quarter of a period of 150 Hz and a decay of 20 ms
    EXPECT_GT(most, 1.0);
    EXPECT_LT(most, 1.5);
}

// k = 500 N/m: 0.2 N hold the proxy on the plate until the hand is 0.4 mm above it.
TEST(EffectScene, AMagnetHoldsTheProxyOnItsSurface) {
    const std::string magnet =
        "[[effect]]\ntype = \"magnet\"\nsurface = \"top\"\nstrength_n = 0.2\ncapture_mm = 2\n";
    std::vector<DeviceState> inputs;
    for (int i = 0; i <= 60; ++i) {
        DeviceState state;
        state.time_s = 1e-3 * i;
        state.position = {0, 0, 5.001e-3 + (i < 5 ? 0.0 : 0.02e-3 * (i - 5))};
        inputs.push_back(state);
    }
    const Trace trace = traced(std::string(kPlate) + kTouch + magnet, inputs);
    for (const FrameReport& frame : trace.frames)
        EXPECT_NEAR(frame.proxy.z, std::max(5e-3, frame.probe.z - 0.4e-3), 0.2e-6) << frame.frame;
    for (const FrameReport& frame : trace.frames)
        EXPECT_LE(frame.field_samples, frame.evaluations + 1) << frame.frame; // the plate's own
}

TEST(EffectScene, ASurfaceOutsideOfTheWorkspaceIsLeftOut) {
    const std::string mesh_free =
        std::string("[volume.a]\nanalytic = \"solid_sphere\"\nradius_mm = 5\n"
                    "[surface.near]\nvolume = \"a\"\niso_value = 0\n"
                    "[[effect]]\ntype = \"surface\"\nsurface = \"near\"\n");
    const std::string friction =
        "[[effect]]\ntype = \"friction\"\nsurface = \"near\"\nstatic = 0.3\n";
    const auto scene_with = [&](const std::string& workspace) {
        return Scene(parse_scene(mesh_free + friction + workspace, "x.toml"));
    };
    const Scene beside =
        scene_with("[[effect]]\ntype = \"workspace\"\nradius_mm = 10\ncenter_mm = [900, 0, 0]\n");
    const Scene yielding =
        scene_with("[[effect]]\ntype = \"workspace\"\nradius_mm = 10\ncenter_mm = "
                   "[900, 0, 0]\nstrength_n = 3\n");
    EXPECT_EQ(yielding.surfaces().size(), 1u);
    EXPECT_EQ(beside.surfaces().size(), 0u);
    for (int i : {0, 1}) {
        EXPECT_FALSE(beside.plan().effects[i].on);
        EXPECT_EQ(
            beside.plan().effects[i].reason,
            "surface near is outside of the workspace: a trial that begins in it stays there");
    }
}

TEST(EffectScene, TheOrderInASceneDoesNotMatter) {
    const std::vector<std::string> effects{
        kTouch,
        "[[effect]]\ntype = \"friction\"\nsurface = \"top\"\nstatic = 0.3\n",
        "[[effect]]\ntype = \"constant_force\"\nforce_n = [0.1, 0.2, -0.3]\n",
        "[[effect]]\ntype = \"constant_force\"\nforce_n = [0.3, -0.7, 0.1]\n",
        "[[effect]]\ntype = \"viscosity\"\ndamping_n_s_per_m = 2\n",
        "[[effect]]\ntype = \"workspace\"\nradius_mm = 12\ncenter_mm = [0, 0, 0]\n",
        "[[effect]]\ntype = \"guide\"\npoints_mm = [[-9, 1, 5.1], [30, 2, 5.2]]\nstrength_n = "
        "0.2\n",
        "[[effect]]\ntype = \"guide\"\npoints_mm = [[3, 1, 6]]\nstrength_n = 0.1\n"};
    std::string forwards = kPlate, backwards = kPlate;
    for (std::size_t i = 0; i < effects.size(); ++i) {
        forwards += effects[i];
        backwards += effects[effects.size() - 1 - i];
    }
    const Trace a = traced(forwards, stroke(300));
    const Trace b = traced(backwards, stroke(300));
    for (std::size_t i = 0; i < a.frames.size(); ++i) {
        ASSERT_EQ(a.frames[i].proxy, b.frames[i].proxy) << i;
        ASSERT_EQ(a.frames[i].force, b.frames[i].force) << i;
    }
    EXPECT_GT(std::abs(a.frames.back().force.y), 0.01);
}

TEST(EffectScene, WhatAGuideOrAWorkspaceCannotBeIsRefusedWithItsLine) {
    const auto expect = [&](const std::string& text, const std::string& wanted) {
        EXPECT_NE(complaint(text).find(wanted), std::string::npos) << complaint(text);
    };
    expect("[[effect]]\ntype = \"guide\"\npoints_mm = []\nstrength_n = 1\n",
           "x.toml:3: points_mm in [[effect]] has 0 points");
    expect("[[effect]]\ntype = \"guide\"\npoints_mm = [[1, 2]]\nstrength_n = 1\n",
           "x.toml:3: points_mm in [[effect]] has a point of other than three numbers");
    expect("[[effect]]\ntype = \"guide\"\npoints_mm = [[1, 2, 3], [1, 2, 3]]\nstrength_n = 1\n",
           "x.toml:3: points_mm in [[effect]]: ");
    expect("[[effect]]\ntype = \"guide\"\npoints_mm = [[1, 2, 3]]\nends = \"closed\"\nstrength_n = "
           "1\n",
           "x.toml:4: ends = \"closed\" in [[effect]] needs 3 points");
    expect("[[effect]]\ntype = \"workspace\"\n", "x.toml:1: a workspace in [[effect]] is either");
    expect("[[effect]]\ntype = \"workspace\"\nbox_mm = [[0, 0, 0], [1, 0, 1]]\n",
           "x.toml:3: box_mm in [[effect]] has no volume");
    expect("[[effect]]\ntype = \"vibration\"\nfrequency_hz = 600\n",
           "x.toml:1: frequency_hz = 600 in [[effect]] is not below half of [loop] rate_hz = 1000");
    expect(std::string(kPlate) +
               "[[effect]]\ntype = \"friction\"\nsurface = \"top\"\nstatic = 0.2\ndynamic = 0.3\n",
           "x.toml:11: dynamic = 0.3 in [[effect]] is above static = 0.2");
}

TEST(EffectScene, AVolumeOfTheWrongKindIsRefusedWithItsLine) {
    const auto expect = [&](const std::string& text, const std::string& wanted) {
        EXPECT_NE(complaint(text).find(wanted), std::string::npos) << complaint(text);
    };
    expect(std::string(kBall) +
               "[[effect]]\ntype = \"vector_follow\"\nvolume = \"ball\"\nstrength_n = 1\n",
           "x.toml:6: volume \"ball\" in [[effect]] is a formula of scalars");
    expect(std::string(kHelix) +
               "[[effect]]\ntype = \"gradient_force\"\nvolume = \"stream\"\nstrength_n = 1\n",
           "x.toml:7: volume \"stream\" in [[effect]] is a formula of vectors");
    expect(std::string(kHelix) + "[surface.s]\nvolume = \"stream\"\niso_value = 0\n",
           "x.toml:6: volume \"stream\" in [surface.s] is a formula of vectors");
}

TEST(EffectScene, StrengthsThatCannotBeAreRefused) {
    EXPECT_NE(
        complaint(std::string(kHelix) +
                  "[[effect]]\ntype = \"vector_force\"\nvolume = \"stream\"\nstrength_n = inf\n")
            .find("x.toml:8: strength_n = inf"),
        std::string::npos);
    EXPECT_NE(complaint("[[effect]]\ntype = \"viscosity\"\n")
                  .find("key \"damping_n_s_per_m\" is missing"),
              std::string::npos);
    EXPECT_NE(
        complaint(std::string(kHelix) + "[[effect]]\ntype = \"vortex\"\nvolume = \"stream\"\n")
            .find("key \"strength_n\" is missing"),
        std::string::npos);
}

TEST(EffectScene, WhatCannotBeFeltIsLeftOut) {
    const EffectPlan plan = plan_effects(
        parse_scene(std::string(kHelix) +
                        "[[effect]]\ntype = \"viscosity\"\ndamping_n_s_per_m = 0\n"
                        "[[effect]]\ntype = \"vortex\"\nvolume = \"stream\"\nstrength_n = 0\n",
                    "x.toml"),
        Extraction::impossible);
    for (const PlannedEffect& planned : plan.effects)
        EXPECT_FALSE(planned.on) << planned.reason;
    ASSERT_EQ(plan.left_out.size(), 1u);
    EXPECT_NE(plan.left_out[0].find("volume stream"), std::string::npos);
}

} // namespace
} // namespace palpate
