// SPDX-License-Identifier: Apache-2.0
// What is shared by effects and surfaces, as the query counters of frames see it and as the plan
// says it.
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/geometry/formats/mesh_file.h>

#include "tests/support/scripted_clock.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

constexpr const char* kBall = "[volume.ball]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n";
constexpr const char* kStream =
    "[volume.stream]\nanalytic = \"helix\"\nradius_mm = 20\npitch_mm = 30\n";
constexpr int kSubSteps = 4;

std::string effect_of(const std::string& type, const std::string& volume) {
    return fmt::format("[[effect]]\ntype = \"{}\"\nvolume = \"{}\"\n{} = 0.2\n", type, volume,
                       type == "viscosity" ? "damping_n_s_per_m" : "strength_n");
}

std::string surface_of(const std::string& name, double iso_value) {
    return fmt::format("[surface.{}]\nvolume = \"ball\"\niso_value = {}\n[[effect]]\ntype = "
                       "\"surface\"\nsurface = \"{}\"\n",
                       name, iso_value, name);
}

const std::string kFixed = fmt::format("[loop]\nmethod = \"fixed\"\nsub_steps = {}\n", kSubSteps);

/// A hand that goes into the ball and along it, never twice at one place.
std::vector<FrameReport> frames_of(const std::string& text) {
    const auto scene = std::make_shared<const Scene>(parse_scene(text, "x.toml"),
                                                     SceneResources{.files = scene_files()});
    test::ScriptedClock clock;
    HapticLoop loop(scene, clock);
    std::vector<FrameReport> frames;
    for (int i = 0; i < 60; ++i) {
        DeviceState state;
        state.time_s = 1e-3 * i;
        state.position = {0.1e-3 * i, 0.2e-3 * i, 0.052 - 0.12e-3 * i};
        frames.push_back(loop.frame(state));
    }
    return frames;
}

/// A plan asks no more of a file than that it is there.
std::string volume_file(const test::TemporaryFolder& folder, const std::string& name) {
    const std::filesystem::path file = folder / (name + ".nrrd");
    std::ofstream{file};
    return fmt::format("[volume.{}]\nfile = \"{}\"\n", name, file.string());
}

EffectPlan plan_of(const std::string& text) {
    return plan_effects(parse_scene(text, "x.toml"), Extraction::impossible);
}

// The frame's start is where its first evaluation is, so that what samples there adds nothing.
TEST(SampleSharing, AnyNumberOfGradientEffectsCostsOneSampleInEachEvaluation) {
    for (const int count : {1, 2, 4}) {
        std::string text = std::string(kBall) + kFixed + effect_of("viscosity", "ball");
        for (int i = 0; i < count; ++i)
            text += effect_of("gradient_force", "ball") + effect_of("gradient_surface", "ball");
        for (const FrameReport& frame : frames_of(text)) {
            ASSERT_EQ(frame.evaluations, static_cast<std::uint32_t>(kSubSteps));
            // The first frame begins where the hand is, and does not move.
            if (frame.frame > 1) {
                ASSERT_EQ(frame.field_samples, frame.evaluations) << count;
            }
        }
    }
}

TEST(SampleSharing, EffectsOfTheFramesStartCostOneSampleInEachFrame) {
    const std::string text = std::string(kBall) + kFixed + effect_of("gradient_force", "ball") +
                             effect_of("viscosity", "ball") + effect_of("gradient_force", "ball");
    for (const FrameReport& frame : frames_of(text))
        if (frame.frame > 1) {
            ASSERT_EQ(frame.field_samples, 1u);
        }
}

TEST(SampleSharing, VectorEffectsHaveTheSampleOfTheFramesStartInCommon) {
    const auto samples = [](const std::string& effects) {
        const auto frames = frames_of(std::string(kStream) + kFixed + effects);
        return frames[30].field_samples;
    };
    const std::string force = effect_of("vector_force", "stream");
    const std::string front = effect_of("front_shape", "stream");
    EXPECT_EQ(samples(force + force + force), 1u);
    EXPECT_EQ(samples(front + force), samples(front));
    EXPECT_EQ(samples(force + front), samples(front));
}

TEST(SampleSharing, SurfacesOfAFormulaShareWithEachOtherAndWithEffects) {
    const std::vector<FrameReport> frames = frames_of(
        std::string(kBall) + kFixed + surface_of("deep", 0.002) + surface_of("skin", 0.0) +
        effect_of("gradient_force", "ball") + effect_of("viscosity", "ball"));
    for (const FrameReport& frame : frames) {
        // At first each surface asks for the value where the proxy is put, which nobody shares.
        const std::uint32_t values = frame.frame == 0 ? 2 : 0;
        ASSERT_GT(frame.field_samples, 0u);
        ASSERT_LE(frame.field_samples, frame.evaluations + values);
    }
    EXPECT_GT(frames.back().contacts, 0u);
}

TEST(SampleSharing, ASceneOfMeshesSamplesNoField) {
    const test::TemporaryFolder folder;
    write_ply(test::icosphere(0.05, 4), folder / "ball.ply");
    const std::string text = fmt::format("[surface.ball]\nmesh = \"{}\"\nmesh_unit = \"mm\"\n"
                                         "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n",
                                         (folder / "ball.ply").string());
    std::uint64_t queries = 0;
    for (const FrameReport& frame : frames_of(text)) {
        ASSERT_EQ(frame.field_samples + frame.root_queries, 0u);
        queries += frame.surface_queries;
    }
    EXPECT_GT(queries, 0u) << "it flew at least to the mesh";
}

TEST(SampleSharing, ASceneOfVolumesQueriesNoMesh) {
    const std::string text = std::string(kBall) + kStream + surface_of("skin", 0.0) +
                             effect_of("gradient_surface", "ball") +
                             effect_of("vector_follow", "stream");
    std::uint64_t samples = 0;
    for (const FrameReport& frame : frames_of(text)) {
        ASSERT_EQ(frame.surface_queries, 0u);
        samples += frame.field_samples;
    }
    EXPECT_GT(samples, 0u);
}

// Each loop has samplers of its own: two over one scene, frame by frame in turn, do what one does.
TEST(SampleSharing, LoopsOverOneSceneDoNotShare) {
    const auto scene = std::make_shared<const Scene>(parse_scene(
        std::string(kBall) + surface_of("skin", 0.0) + effect_of("gradient_force", "ball"),
        "x.toml"));
    test::ScriptedClock clock;
    HapticLoop alone(scene, clock), one(scene, clock), other(scene, clock);
    for (int i = 0; i < 30; ++i) {
        DeviceState state;
        state.position = {0.1e-3 * i, 0.0, 0.051 - 0.1e-3 * i};
        const FrameReport expected = alone.frame(state);
        for (HapticLoop* loop : {&one, &other}) {
            const FrameReport frame = loop->frame(state);
            ASSERT_EQ(frame.proxy, expected.proxy);
            ASSERT_EQ(frame.field_samples, expected.field_samples);
        }
    }
}

TEST(SampleSharingPlan, CountsASampleForTheFirstWhoNeedsItAndNamesItForTheOthers) {
    const EffectPlan plan =
        plan_of(std::string(kBall) + effect_of("gradient_force", "ball") +
                effect_of("gradient_surface", "ball") + surface_of("skin", 0.0) +
                effect_of("gradient_surface", "ball") + effect_of("viscosity", "ball"));
    const auto& effects = plan.effects;
    ASSERT_EQ(effects.size(), 5u);
    double samples = 0.0, start_samples = 0.0;
    for (const PlannedEffect& planned : effects) {
        samples += planned.samples;
        start_samples += planned.start_samples;
    }
    EXPECT_EQ(samples, 1.0);
    EXPECT_EQ(start_samples, 0.0);
    EXPECT_EQ(effects[0].sharing,
              "shares its sample with the frame's first of effect 2 (gradient_surface of ball)");
    EXPECT_EQ(effects[1].samples, 1.0);
    EXPECT_EQ(effects[1].sharing, "");
    EXPECT_EQ(effects[2].sharing, "shares its sample with effect 2 (gradient_surface of ball)");
    EXPECT_EQ(effects[3].sharing, "shares its sample with effect 2 (gradient_surface of ball)");
    EXPECT_EQ(effects[4].start_samples, 0.0);
}

TEST(SampleSharingPlan, WhatIsOffSharesNothingAndIsSharedByNobody) {
    const EffectPlan plan =
        plan_of(std::string(kBall) +
                "[[effect]]\ntype = \"gradient_surface\"\nvolume = \"ball\"\nstrength_n = 0\n" +
                effect_of("gradient_force", "ball") + effect_of("gradient_force", "ball"));
    EXPECT_FALSE(plan.effects[0].on);
    EXPECT_EQ(plan.effects[0].samples, 0.0);
    EXPECT_EQ(plan.effects[1].start_samples, 1.0);
    EXPECT_EQ(plan.effects[2].sharing,
              "shares its sample at the frame's start with effect 2 (gradient_force of ball)");
}

TEST(SampleSharingPlan, VectorsWithAndWithoutSenseAreTwoFields) {
    const test::TemporaryFolder folder;
    const EffectPlan plan = plan_of(volume_file(folder, "v") + effect_of("vector_force", "v") +
                                    effect_of("fibre_follow", "v") + effect_of("vortex", "v") +
                                    effect_of("front_shape", "v"));
    EXPECT_EQ(plan.effects[0].start_samples, 1.0);
    EXPECT_EQ(plan.effects[1].start_samples, 1.0);
    // At points of their own, which nobody shares, up to two each.
    EXPECT_EQ(plan.effects[2].start_samples, 2.0);
    EXPECT_EQ(plan.effects[3].start_samples, 2.0);
    EXPECT_NE(plan.effects[3].sharing.find("effect 1 (vector_force of v)"), std::string::npos);
}

// A surface's field is smoothed, and cleared where its level is not: other numbers than the volume.
TEST(SampleSharingPlan, ABakedFieldIsAnotherOneThanItsVolume) {
    const test::TemporaryFolder folder;
    const EffectPlan plan = plan_of(volume_file(folder, "ct") +
                                    "[surface.bone]\nvolume = \"ct\"\niso_value = 226\n"
                                    "[[effect]]\ntype = \"surface\"\nsurface = \"bone\"\n" +
                                    effect_of("gradient_force", "ct"));
    EXPECT_EQ(plan.effects[0].samples, 1.0);
    EXPECT_EQ(plan.effects[1].start_samples, 1.0);
    EXPECT_EQ(plan.effects[1].sharing,
              "shares nothing with surface bone, which is felt in a field baked from ct");
}

// It asks for the value behind the surface, in the field that the surface is felt in.
TEST(SampleSharingPlan, ViscosityInsideASurfaceSharesTheSurfacesSample) {
    const test::TemporaryFolder folder;
    const EffectPlan plan = plan_of(
        volume_file(folder, "ct") +
        "[surface.bone]\nvolume = \"ct\"\niso_value = 226\nstrength_n = 1\n[[effect]]\ntype = "
        "\"surface\"\nsurface = \"bone\"\n[[effect]]\ntype = \"viscosity\"\nsurface = "
        "\"bone\"\ndamping_n_s_per_m = 2\n");
    EXPECT_EQ(plan.effects[0].samples, 1.0);
    EXPECT_EQ(plan.effects[1].start_samples, 0.0);
    EXPECT_EQ(plan.effects[1].sharing,
              "shares its sample with the frame's first of effect 1 (surface of bone)");
}

} // namespace
} // namespace palpate
