// SPDX-License-Identifier: Apache-2.0
// Textures, from a scene to its frames.
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_overrides.h>
#include <palpate/geometry/formats/mesh_file.h>

#include "tests/support/scripted_clock.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

const std::string kPlate = "[volume.plate]\nanalytic = \"slab\"\nthickness_mm = 20\n";
const std::string kGround = "[volume.ground]\nanalytic = \"solid_sphere\"\nradius_mm = 30\n";
constexpr double kTop = 10e-3; // m

std::string surface(const std::string& name, const std::string& more = "") {
    return fmt::format("[surface.{0}]\nvolume = \"plate\"\niso_value = 0\n{1}[[effect]]\ntype = "
                       "\"surface\"\nsurface = \"{0}\"\n",
                       name, more);
}

std::string texture(const std::string& surface, const std::string& keys) {
    return fmt::format("[[effect]]\ntype = \"texture\"\nsurface = \"{}\"\n{}\n", surface, keys);
}

const std::string kGrating =
    "pattern = \"grating\"\ndirection = [2, 0, 0]\nwavelength_mm = 2\nheight_mm = 0.1";

std::shared_ptr<const Scene> scene_of(const std::string& text) {
    return std::make_shared<const Scene>(parse_scene(text, "x.toml"),
                                         SceneResources{.files = scene_files()});
}

/// A stroke along x, 0.5 mm deep; of frames after the first contact.
std::vector<FrameReport> stroke(const std::string& text, int frames = 400) {
    test::ScriptedClock clock;
    HapticLoop loop(scene_of(text), clock);
    std::vector<FrameReport> reports;
    for (int i = 0; i < frames; ++i) {
        DeviceState state;
        state.position = {0.02e-3 * i, 0.1e-3, kTop + 1e-3 - 1.5e-3 * std::min(1.0, i / 50.0)};
        const FrameReport report = loop.frame(state);
        if (i > 60) reports.push_back(report);
    }
    return reports;
}

double grating_height(double x) {
    return 0.05e-3 * (1.0 - std::cos(2.0 * std::numbers::pi * x / 2e-3));
}

std::string complaint(const std::string& text) {
    try {
        const Scene scene(parse_scene(text, "x.toml"), SceneResources{.files = scene_files()});
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "";
}

EffectPlan plan_of(const std::string& text) {
    return plan_effects(parse_scene(text, "x.toml"), Extraction::impossible);
}

// 0.1 um is the tolerance of a frame.
TEST(TextureScene, AGratingIsFeltOnItsSurface) {
    double lowest = 1.0, highest = 0.0;
    for (const FrameReport& frame : stroke(kPlate + surface("top") + texture("top", kGrating))) {
        EXPECT_NEAR(frame.proxy.z, kTop + grating_height(frame.proxy.x), 0.1e-6) << frame.frame;
        lowest = std::min(lowest, frame.proxy.z - kTop);
        highest = std::max(highest, frame.proxy.z - kTop);
    }
    EXPECT_LT(lowest, 0.01e-3);
    EXPECT_GT(highest, 0.09e-3);
}

TEST(TextureScene, TheOrderInASceneDoesNotMatter) {
    const std::string volume = kPlate + "[surface.top]\nvolume = \"plate\"\niso_value = 0\n";
    const std::string felt = "[[effect]]\ntype = \"surface\"\nsurface = \"top\"\n";
    const auto a = stroke(volume + felt + texture("top", kGrating));
    const auto b = stroke(volume + texture("top", kGrating) + felt);
    for (std::size_t i = 0; i < a.size(); ++i)
        ASSERT_EQ(a[i].proxy, b[i].proxy) << i;
}

TEST(TextureScene, AMaterialSaysWhatItsSurfacesAreLike) {
    const std::string cork =
        "[material.cork]\ntexture_wavelength_mm = 2\ntexture_height_mm = 0.1\n";
    const std::string by_material = kPlate + cork + surface("top", "material = \"cork\"\n") +
                                    texture("top", "pattern = \"grating\"\ndirection = [1, 0, 0]");
    const auto a = stroke(by_material);
    const auto b = stroke(kPlate + surface("top") + texture("top", kGrating));
    for (std::size_t i = 0; i < a.size(); ++i)
        ASSERT_EQ(a[i].proxy, b[i].proxy) << i;
    // A key of the effect's own goes before.
    const SceneDescription scene = parse_scene(
        kPlate + cork + surface("top", "material = \"cork\"\n") + texture("top", "height_mm = 0.2"),
        "x.toml");
    const auto& read = std::get<effects::Texture>(scene.effects[1].settings);
    EXPECT_DOUBLE_EQ(read.height_m, 0.2e-3);
    EXPECT_DOUBLE_EQ(read.wavelength_m, 2e-3);
    EXPECT_EQ(read.pattern, TexturePattern::bumps);
}

std::uint64_t samples_of(const std::vector<FrameReport>& frames) {
    std::uint64_t sum = 0;
    for (const FrameReport& frame : frames)
        sum += frame.field_samples;
    return sum;
}

// In frames that stay on the surface: a pattern asks for nothing, a volume for one sample in each
// evaluation, however many textures and effects are of it.
TEST(TextureScene, AVolumesSampleIsSharedAndAPatternNeedsNone) {
    const std::string loop = "[loop]\nmethod = \"fixed\"\nsub_steps = 4\n";
    const std::string of_ground = "volume = \"ground\"\nheight_mm = [[0, 0], [30, 0.01]]";
    const std::string plate = kPlate + kGround + surface("a") + loop;
    const auto samples = [&](const std::string& more) { return samples_of(stroke(plate + more)); };
    const auto evaluations = static_cast<std::uint64_t>(4 * stroke(plate).size());
    EXPECT_EQ(samples(""), evaluations);
    EXPECT_EQ(samples(texture("a", "wavelength_mm = 5\nheight_mm = 0.01")), evaluations);
    EXPECT_EQ(samples(texture("a", of_ground)), 2 * evaluations);
    const std::string second = surface("b") + texture("b", of_ground);
    EXPECT_EQ(samples(texture("a", of_ground) + second), 2 * evaluations);
    const std::string viscous =
        "[[effect]]\ntype = \"viscosity\"\nvolume = \"ground\"\ndamping_n_s_per_m = 0.1\n";
    EXPECT_EQ(samples(texture("a", of_ground) + second + viscous), 2 * evaluations);
}

TEST(TextureScene, ThePlanSaysWhatIsShared) {
    const std::string of_ground = "volume = \"ground\"\nheight_mm = [[0, 0], [30, 0.01]]";
    const EffectPlan plan = plan_of(kPlate + kGround + surface("a") + texture("a", of_ground) +
                                    surface("b") + texture("b", of_ground) + surface("c") +
                                    texture("c", "wavelength_mm = 5\nheight_mm = 0.01"));
    EXPECT_EQ(plan.effects[1].samples, 1.0);
    EXPECT_EQ(plan.effects[3].samples, 0.0);
    EXPECT_EQ(plan.effects[3].sharing, "shares its sample with effect 2 (texture of ground)");
    EXPECT_EQ(plan.effects[5].samples, 0.0);
    EXPECT_TRUE(plan.left_out.empty());
}

TEST(TextureScene, WhatCannotBeFeltIsLeftOut) {
    const auto reason = [](const std::string& text, std::size_t effect) {
        const EffectPlan plan = plan_of(text);
        EXPECT_FALSE(plan.effects[effect].on);
        return plan.effects[effect].reason;
    };
    const std::string flat = texture("top", "wavelength_mm = 2\nheight_mm = 0");
    EXPECT_EQ(reason(kPlate + surface("top") + flat, 1), "height_mm is 0: it cannot be felt");
    const std::string twice = texture("top", kGrating) + texture("top", kGrating);
    EXPECT_EQ(reason(kPlate + surface("top") + twice, 2), "the same surface has a texture already");
    const std::string alone = kPlate + kGround +
                              "[surface.top]\nvolume = \"plate\"\niso_value = 0\n" +
                              texture("top", "volume = \"ground\"\nheight_mm = 0.01");
    EXPECT_EQ(reason(alone, 0), "surface top is not felt");
    EXPECT_EQ(plan_of(alone).left_out.size(), 3u) << "the volume of its heights is not read either";
}

TEST(TextureScene, AMeshHasNoTexture) {
    const test::TemporaryFolder folder;
    write_ply(test::icosphere(0.05, 2), folder / "ball.ply");
    const std::string mesh =
        "[surface.ball]\nmesh = \"" + (folder / "ball.ply").string() + "\"\nmesh_unit = \"mm\"\n";
    const std::string felt = "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n";
    EXPECT_EQ(
        complaint(mesh + felt + texture("ball", kGrating)),
        "x.toml:9: surface \"ball\" in [[effect]] is felt with contact \"mesh\", which has no "
        "texture; give the surface a volume, and contact = \"volume\" or \"guarded\"");
    // Where it is not the scene that says so, the rest of the scene is felt.
    SceneDescription both =
        parse_scene("[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n" + mesh +
                        "volume = \"v\"\niso_value = 0\n" + felt + texture("ball", kGrating),
                    "x.toml");
    SceneOverrides overrides;
    overrides.contact = "direct";
    EXPECT_TRUE(Scene(both, SceneResources{.files = scene_files()}).plan().effects[1].on);
    apply(overrides, both);
    const Scene scene(both, SceneResources{.files = scene_files()});
    EXPECT_FALSE(scene.plan().effects[1].on);
    EXPECT_EQ(scene.plan().effects[1].reason, "contact direct has no texture");
    EXPECT_EQ(scene.plan().warnings,
              std::vector<std::string>{"effect 2 (texture) is left out: contact direct has no "
                                       "texture; take contact volume or guarded"});
}

TEST(TextureScene, WhatATextureCannotBeIsRefusedWithItsLine) {
    const std::string plate = kPlate + kGround + surface("top"); // lines 1 to 12
    const auto expect = [&](const std::string& keys, const std::string& wanted) {
        const std::string message = complaint(plate + texture("top", keys));
        EXPECT_NE(message.find(wanted), std::string::npos) << message;
    };
    expect("wavelength_mm = 2", "x.toml:13: key \"height_mm\" is missing in [[effect]]");
    expect("height_mm = 0.1", "x.toml:13: key \"wavelength_mm\" is missing in [[effect]]");
    expect("wavelength_mm = 2\nheight_mm = 0.4",
           "x.toml:17: height_mm = 0.4 in [[effect]] is above wavelength_mm / (2 pi) = 0.3183; ");
    expect("wavelength_mm = 2\nheight_mm = -1", "x.toml:17: height_mm = -1 in [[effect]] ");
    expect("wavelength_mm = 2\nheight_mm = 0.1\npattern = \"grid\"",
           "x.toml:18: unknown pattern = \"grid\" in [[effect]]; ");
    expect("wavelength_mm = 2\nheight_mm = 0.1\npattern = \"grating\"",
           "x.toml:13: key \"direction\" is missing in [[effect]]");
    expect("wavelength_mm = 2\nheight_mm = 0.1\ndirection = [1, 0, 0]",
           "x.toml:18: direction in [[effect]] is of a grating; ");
    expect("volume = \"ground\"\nwavelength_mm = 2\nheight_mm = 0.1",
           "x.toml:17: wavelength_mm in [[effect]] is of a pattern");
    // A ball of 30 mm tells from within 30 mm where it is.
    const std::string ball =
        "[surface.ball]\nvolume = \"ground\"\niso_value = 0\n[[effect]]\ntype = "
        "\"surface\"\nsurface = \"ball\"\n";
    const std::string message =
        complaint(plate + ball + texture("ball", "volume = \"plate\"\nheight_mm = 31"));
    EXPECT_TRUE(
        message.starts_with("x.toml:19: [[effect]]: texture: its height of 31 mm is above 30 mm, "))
        << message;
    // Made in code it has no line.
    SceneDescription in_code =
        parse_scene(plate + ball + texture("ball", "volume = \"plate\"\nheight_mm = 31"), "x.toml");
    for (EffectDescription& effect : in_code.effects)
        effect.line = 0;
    try {
        Scene{in_code};
        FAIL() << "it is too high";
    } catch (const std::runtime_error& error) {
        EXPECT_EQ(std::string(error.what()).find("effects[2]: texture: its height of 31 mm"), 0u)
            << error.what();
    }
    // One of 20 mm bears half of that.
    const std::string over_ground = "volume = \"ground\"\nheight_mm = ";
    EXPECT_EQ(complaint(plate + texture("top", over_ground + "9.9")), "");
    EXPECT_NE(complaint(plate + texture("top", over_ground + "10.5"))
                  .find("x.toml:13: [[effect]]: texture: its height of 10.5 mm is above 10 mm, "),
              std::string::npos);
    expect("volume = \"ground\"\nheight_mm = [[0, 0], [1, 1001]]", "give a number in [0, 1000]");
    EXPECT_NE(complaint("[material.m]\ntexture_wavelength_mm = 1\ntexture_height_mm = 1\n")
                  .find("x.toml:3: texture_height_mm = 1 in [material.m] is above "
                        "texture_wavelength_mm / (2 pi) = 0.1592"),
              std::string::npos);
}

/// A hand over a crest of the grating.
struct OverACrest {
    OverACrest() { to(kTop + 1e-3); }
    FrameReport to(double z) {
        state.position.z = z;
        return loop.frame(state);
    }

    test::ScriptedClock clock;
    HapticLoop loop{scene_of(kPlate + surface("top") + texture("top", kGrating)), clock};
    DeviceState state{.position = {1e-3, 0, 0}};
};

// Off, the plate is bare, and nothing of the way there is a step.
TEST(TextureScene, ItsGainIsItsOwn) {
    OverACrest hand;
    const auto pressed = [&] {
        FrameReport report;
        for (int i = 0; i < 100; ++i)
            report = hand.to(kTop - 0.2e-3);
        return report;
    };
    EXPECT_NEAR(pressed().proxy.z, kTop + 0.1e-3, 0.1e-6);
    EXPECT_TRUE(hand.loop.set_gain(1, 0.0));
    EXPECT_NEAR(pressed().proxy.z, kTop, 0.1e-6);
    EXPECT_TRUE(pressed().flags & kLiveGain);
    EXPECT_TRUE(hand.loop.set_gain(1, 1.0));
    EXPECT_NEAR(pressed().proxy.z, kTop + 0.1e-3, 1e-6);
    EXPECT_FALSE(pressed().flags & kLiveGain);
}

// A trial begins with the gains that were set last: also where it is to be said whether the place
// is inside. Beneath a crest it is, and where the plate is bare it is not.
TEST(TextureScene, ATrialBeginsWithTheGainThatWasSetLast) {
    OverACrest hand;
    for (const double gain : {0.0, 1.0, 0.0}) {
        ASSERT_TRUE(hand.loop.set_gain(1, gain));
        ++hand.state.trial;
        const FrameReport report = hand.to(kTop + 0.05e-3); // crests are 0.1 mm high
        EXPECT_EQ((report.flags & kInsideAtStart) != 0, gain == 1.0) << gain;
        EXPECT_EQ(report.force, Vec3{0.0}) << gain;
        hand.to(kTop + 1e-3);
    }
}

// What is off is not there: nothing begins inside of it.
TEST(TextureScene, ATrialDoesNotBeginInsideOfWhatIsOff) {
    OverACrest hand;
    for (const double gain : {1.0, 0.0, 1.0}) {
        ASSERT_TRUE(hand.loop.set_gain(0, gain));
        ++hand.state.trial;
        EXPECT_EQ((hand.to(0.0).flags & kInsideAtStart) != 0, gain == 1.0) << gain;
    }
}

} // namespace
} // namespace palpate
