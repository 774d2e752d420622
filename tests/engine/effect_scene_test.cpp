// SPDX-License-Identifier: Apache-2.0
// Effects on volumes, from a scene to its frames.
#include <cmath>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <palpate/engine/scene_file.h>
#include <palpate/engine/trace.h>

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

// numerics: below 2 um after 2 s with 2 evaluations per frame.
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
