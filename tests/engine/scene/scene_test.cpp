// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/scene.h>

#include <cmath>
#include <filesystem>
#include <set>

#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/devices/device_factory.h>
#include <palpate/engine/devices/orbit.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_overrides.h>
#include <palpate/engine/scene/scene_surface.h>

#include "tests/support/phantom.h"
#include "tests/support/scripted_clock.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

const char* kTwoBalls =
    "[volume.a]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n[volume.b]\nanalytic = "
    "\"solid_sphere\"\nradius_mm = 40\n"
    "[surface.skin]\nvolume = \"a\"\nstrength_n = 1.0\n[surface.bone]\nvolume = \"b\"\n";

TEST(EffectPlan, WhatNoEffectNamesIsLeftOut) {
    const Scene scene(parse_scene(
        std::string(kTwoBalls) + "[[effect]]\ntype = \"surface\"\nsurface = \"bone\"\n", "x.toml"));
    ASSERT_EQ(scene.surfaces().size(), 1u);
    EXPECT_EQ(scene.surfaces()[0].name, "bone");
    EXPECT_EQ(scene.plan().left_out.size(), 2u) << "surface skin and volume a";
}

TEST(EffectPlan, WhatCannotBeFeltIsOff) {
    SceneDescription description =
        parse_scene(std::string(kTwoBalls) +
                        "[[effect]]\ntype = \"surface\"\nsurface = \"bone\"\n[[effect]]\ntype = "
                        "\"surface\"\nsurface = \"bone\"\n"
                        "[[effect]]\ntype = \"gradient_surface\"\nvolume = \"a\"\nstrength_n = 0\n"
                        "[[effect]]\ntype = \"constant_force\"\nforce_n = [0, 0, 0]\n",
                    "x.toml");
    const EffectPlan plan = plan_effects(description, Extraction::impossible);
    ASSERT_EQ(plan.effects.size(), 4u);
    EXPECT_TRUE(plan.effects[0].on);
    for (std::size_t i = 1; i < 4; ++i)
        EXPECT_FALSE(plan.effects[i].on) << plan.effects[i].reason;
}

// Skin that yields before bone: the probe goes through the skin at its strength and stops at the
// bone (composition.md 2.3).
TEST(Scene, SkinYieldsAndBoneHolds) {
    const auto scene = std::make_shared<const Scene>(
        parse_scene(std::string(kTwoBalls) +
                        "[[effect]]\ntype = \"surface\"\nsurface = \"skin\"\n[[effect]]\ntype = "
                        "\"surface\"\nsurface = \"bone\"\n",
                    "x.toml"));
    test::ScriptedClock clock;
    std::vector<DeviceState> inputs;
    for (int i = 0; i <= 300; ++i) {
        DeviceState state;
        state.position = {0, 0, 0.055 - 0.0001 * i};
        inputs.push_back(state);
    }
    const Trace trace = run_trace(scene, inputs, clock);
    for (const FrameReport& frame : trace.frames) {
        const double z = frame.probe.z;
        const double skin =
            std::max(z, std::min(0.05, z + 0.002)); // yields 2 mm behind: 1 N / 500 N/m
        const double expected = std::max(skin, 0.04);
        ASSERT_NEAR(frame.proxy.z, expected, 1e-7) << "frame " << frame.frame;
    }
    EXPECT_EQ(trace.frames.back().contacts, 2u);
}

TEST(Scene, ALevelThatNoVoxelReachesIsRefusedWithLineAndRange) {
    const std::string text =
        "[volume.ct]\nfile = \"" + test::phantom_file() +
        "\"\n[surface.bone]\nvolume = \"ct\"\niso_value = 5000\n[[effect]]\ntype = "
        "\"surface\"\nsurface = \"bone\"\n";
    try {
        Scene scene(parse_scene(text, "x.toml"), SceneResources{.files = scene_files()});
        FAIL() << "it was accepted";
    } catch (const std::runtime_error& error) {
        const std::string message = error.what();
        EXPECT_NE(message.find("x.toml:3"), std::string::npos) << message;
        EXPECT_NE(message.find("5000"), std::string::npos) << message;
        EXPECT_NE(message.find("up to"), std::string::npos) << message;
    }
}

TEST(Scene, ALevelThatAFormulaNeverHasIsRefusedWithLineAndRange) {
    const auto complaint = [](const std::string& formula, const std::string& level) {
        try {
            Scene scene(parse_scene("[volume.v]\nanalytic = " + formula +
                                        "\n[surface.s]\nvolume = \"v\"\niso_value = " + level +
                                        "\n[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n",
                                    "x.toml"));
        } catch (const std::runtime_error& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_EQ(complaint("\"slab\"\nthickness_mm = 20", "5"),
              "x.toml:4: [surface.s]: iso_value 5 is reached nowhere by analytic = \"slab\", whose "
              "values in m go up to 0.01; choose one below it");
    EXPECT_EQ(complaint("\"slab\"\nthickness_mm = 20", "0.009"), "");
    EXPECT_NE(complaint("\"torus\"\nradius_mm = 30\ntube_mm = 8", "0.5").find("go up to 0.008; "),
              std::string::npos);
    EXPECT_NE(complaint("\"solid_sphere\"\nradius_mm = 30", "0.5").find("go up to 0.03; "),
              std::string::npos);
    EXPECT_NE(complaint("\"sphere_cavity\"\nradius_mm = 30", "-0.5")
                  .find("begin at -0.03; choose one above it"),
              std::string::npos);
}

TEST(Scene, TheCacheGivesTheSameField) {
    const test::TemporaryFolder folder;
    const std::string text = "[volume.ct]\nfile = \"" + test::phantom_file() +
                             "\"\n[surface.bone]\nvolume = \"ct\"\niso_value = 226\nsmooth_voxels "
                             "= 0.7\nkeep = \"largest\"\n"
                             "[[effect]]\ntype = \"surface\"\nsurface = \"bone\"\n";
    SceneResources resources;
    resources.files = scene_files(folder.path());
    const Scene first(parse_scene(text, "x.toml"), resources);
    const Scene second(parse_scene(text, "x.toml"), resources);
    const BakedSurface& baked = first.surfaces()[0].baked;
    const BakedSurface& cached = second.surfaces()[0].baked;
    EXPECT_FALSE(baked.from_cache);
    EXPECT_TRUE(cached.from_cache);
    EXPECT_EQ(baked.level, cached.level);
    EXPECT_EQ(baked.components.size(), cached.components.size());
    EXPECT_LE(std::abs(baked.shift.mean_m), 0.02e-3)
        << "keep_position: the surface stays where it was on average";
    const auto a = baked.field->make_sampler();
    const auto b = cached.field->make_sampler();
    for (int i = 0; i < 20000; ++i) {
        const Vec3 p = 0.04 * Vec3{std::sin(1.1 * i), std::sin(1.7 * i + 1), std::sin(2.3 * i + 2)};
        const FieldSample x = a->sample(p);
        const FieldSample y = b->sample(p);
        ASSERT_EQ(x.value, y.value);
        ASSERT_EQ(x.gradient, y.gradient);
    }
}

TEST(Scene, OtherSettingsAreOtherCacheEntries) {
    const test::TemporaryFolder folder;
    SceneResources resources;
    resources.files = scene_files(folder.path());
    std::set<std::string> keys;
    for (const char* more :
         {"", "smooth_voxels = 0.7\n", "smooth_voxels = 0.7\niso_after_smoothing = \"as_given\"\n",
          "keep = \"largest\"\n", "keep = 2\n"}) {
        const std::string text = "[volume.ct]\nfile = \"" + test::phantom_file() +
                                 "\"\n[surface.bone]\nvolume = \"ct\"\niso_value = 226\n" + more +
                                 "[[effect]]\ntype = \"surface\"\nsurface = \"bone\"\n";
        keys.insert(Scene(parse_scene(text, "x.toml"), resources).surfaces()[0].baked.key);
    }
    EXPECT_EQ(keys.size(), 5u);
}

/// What a scene without a reader of files is refused with.
std::string refusal(const SceneDescription& scene) {
    try {
        const Scene made(scene);
        device_states(made);
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return {};
}

TEST(Scene, AFileWithoutAReaderIsRefusedWithWhatToLink) {
    SceneDescription volume;
    volume.volumes["v"].file = "head.nrrd";
    volume.surfaces["s"].volume = "v";
    volume.effects.push_back(effects::Surface{.surface = "s"});
    EXPECT_TRUE(refusal(volume).starts_with(
        "volumes[\"v\"]: nothing here reads head.nrrd: link palpate::files and "));

    SceneDescription field;
    field.volumes["v"].file = "flow.nrrd";
    field.effects.push_back(effects::VectorFollow{.volume = "v"});
    EXPECT_TRUE(refusal(field).starts_with("volumes[\"v\"]: nothing here reads flow.nrrd: "));

    SceneDescription mesh;
    mesh.surfaces["s"].mesh = "bone.ply";
    mesh.effects.push_back(effects::Surface{.surface = "s"});
    EXPECT_TRUE(refusal(mesh).starts_with("surfaces[\"s\"]: nothing here reads bone.ply: "));

    SceneDescription recording;
    recording.device.kind = DeviceDescription::Kind::recording;
    recording.device.file = "run.h5";
    EXPECT_TRUE(refusal(recording).starts_with("device: nothing here reads run.h5: "))
        << refusal(recording);
}

TEST(Orbit, IsSmoothAtTheGivenSpeedAndNeverTooDeep) {
    const auto scene = test::phantom_scene("volume", "adaptive");
    const SceneSurface& surface = scene->surfaces().front();
    DeviceDescription orbit;
    orbit.duration_s = 20.0;
    const auto states = make_orbit(*surface.baked.field, surface.level.level, orbit, 1000.0);
    ASSERT_GT(states.size(), 5000u);
    const auto sampler = surface.baked.field->make_sampler();
    EXPECT_LT(sampler->value(states.front().position), surface.level.level)
        << "begins in free space";
    const double step_m = 0.2e-3;
    for (std::size_t i = 1; i < states.size(); ++i)
        if (states[i].trial == states[i - 1].trial)
            ASSERT_LE(glm::length(states[i].position - states[i - 1].position),
                      step_m * (1 + 1e-9));
        else
            ASSERT_LT(sampler->value(states[i].position), surface.level.level)
                << "a trial begins in free space";
    // From a probe that is pressed in it is no farther to the surface than to what holds it.
    test::ScriptedClock clock(1.0);
    const Trace trace = run_trace(scene, states, clock);
    std::size_t deep_enough = 0, deeper = 0;
    for (const FrameReport& frame : trace.frames) {
        if (frame.contacts == 0) continue;
        const double depth = glm::distance(frame.probe, frame.proxy);
        ASSERT_LE(depth, 1.25 * 5e-3) << frame.frame;
        if (depth > std::hypot(5e-3, step_m) + 25e-6) ++deeper;
        if (depth > 1e-3) ++deep_enough;
    }
    EXPECT_GT(deep_enough, states.size() / 4);
    EXPECT_LE(deeper, states.size() / 500);
}

TEST(Orbit, FeelsACavityFromInside) {
    const Scene scene(parse_scene(
        "[volume.v]\nanalytic = \"sphere_cavity\"\nradius_mm = 50\n[surface.s]\nvolume = \"v\"\n"
        "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n",
        "x.toml"));
    DeviceDescription orbit;
    const auto states = make_orbit(*scene.surfaces()[0].baked.field, 0.0, orbit, 1000.0);
    double furthest = 0.0;
    for (const DeviceState& state : states)
        furthest = std::max(furthest, glm::length(state.position));
    EXPECT_LE(furthest, 0.055 + 1e-6);
    EXPECT_GE(furthest, 0.054);
    EXPECT_LT(glm::length(states.front().position), 0.05);
}

TEST(SceneOverrides, SurviveTheRecording) {
    SceneOverrides overrides;
    overrides.method = "fixed";
    overrides.sub_steps = 46;
    overrides.tolerance_um = 0.25;
    const SceneOverrides back = overrides_from_json(to_json(overrides));
    SceneDescription scene = parse_scene("", "x.toml");
    apply(back, scene);
    EXPECT_EQ(scene.loop.method, SteppingMethod::fixed);
    EXPECT_EQ(scene.loop.sub_steps, 46);
    EXPECT_DOUBLE_EQ(scene.loop.tolerance_um, 0.25);
}

TEST(SceneOverrides, RefuseWhatSceneFilesRefuse) {
    SceneDescription scene = parse_scene("", "x.toml");
    SceneOverrides overrides;
    overrides.method = "runge";
    EXPECT_THROW(apply(overrides, scene), std::invalid_argument);
    overrides = {};
    overrides.sub_steps = 0;
    EXPECT_THROW(apply(overrides, scene), std::invalid_argument);
}

// Wall-clock runs are replayed from their recorded decisions, bit for bit, whatever the clock says
// then.
TEST(Trace, PaperIsReplayedBitForBit) {
    const auto scene = test::phantom_scene("volume", "paper", "budget_us = 60\n");
    std::vector<DeviceState> inputs;
    for (int i = 0; i < 400; ++i) {
        DeviceState state;
        state.position = (0.04 - 0.00003 * i) * Vec3{std::cos(0.005 * i), std::sin(0.005 * i), 0.1};
        if (i == 200) state.position.x = NAN;
        inputs.push_back(state);
    }
    SteadyClock clock;
    const Trace first = run_trace(scene, inputs, clock);
    test::ScriptedClock other(123.0);
    const Trace second = run_again(scene, first);
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        ASSERT_EQ(first.frames[i].evaluations, second.frames[i].evaluations) << i;
        ASSERT_EQ(first.frames[i].proxy, second.frames[i].proxy) << i;
        ASSERT_EQ(first.frames[i].flags, second.frames[i].flags) << i;
    }
}

} // namespace
} // namespace palpate
