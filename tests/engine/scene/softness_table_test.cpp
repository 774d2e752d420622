// SPDX-License-Identifier: Apache-2.0
// How scenes say that a surface is soft, and what is refused beside it.
#include <palpate/engine/scene/soft_surfaces.h>

#include <limits>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/scene/effect_plan.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/validation.h>

#include "tests/engine/scene/scene_file_fixture.h"

namespace palpate {
namespace {

using test::kBall;
using testing::HasSubstr;

/// A ball with keys of its surface, felt. Lines: 1 to 3 the volume, 4 the surface, 5 its volume,
/// then the keys.
std::string felt(const std::string& keys, const std::string& more = "") {
    return kBall + "[surface.skin]\nvolume = \"ball\"\n" + keys +
           "[[effect]]\ntype = \"surface\"\nsurface = \"skin\"\n" + more;
}

class SoftnessTable : public test::SceneFolder {
protected:
    Softness softness(const std::string& keys) const {
        return parse(felt(keys)).surfaces.at("skin").softness;
    }
    /// What `palpate explain` says of the surface.
    std::string reason(const std::string& keys) const {
        return plan_effects(parse(felt(keys)), Extraction::impossible).effects.front().reason;
    }
};

TEST_F(SoftnessTable, ASurfaceIsHardUnlessItSaysOtherwise) {
    EXPECT_TRUE(softness("").none());
    EXPECT_TRUE(softness("stiffness_n_per_mm = inf\n").none());
    EXPECT_THAT(reason(""), testing::Not(HasSubstr("soft")));
}

TEST_F(SoftnessTable, EachWayToSayItGivesTheLaw) {
    EXPECT_DOUBLE_EQ(softness("stiffness_n_per_mm = 0.2\n").steepest(), 200.0);
    const Softness table = softness("stiffness_mm_n = [[4, 0.2], [8, 1.0]]\n");
    ASSERT_EQ(table.count, 2u);
    EXPECT_DOUBLE_EQ(table.knots[1].press_m, 8e-3);
    EXPECT_DOUBLE_EQ(table.knots[1].force_n, 1.0);
    // 2 a E / (1 - 1/4): 4 mm, 10 kPa.
    const Softness young = softness("youngs_kpa = 10\ncontact_radius_mm = 4\n");
    EXPECT_NEAR(young.steepest(), 2.0 * 4e-3 * 10e3 / 0.75, 1e-9);
    EXPECT_DOUBLE_EQ(softness("stiffness_n_per_mm = 0.2\npress_damping_n_s_per_m = 7\n").damping,
                     7.0);
}

TEST_F(SoftnessTable, WhatASurfaceDoesNotSayItsMaterialSays) {
    const auto of = [&](const std::string& material, const std::string& surface) {
        const SceneDescription scene =
            parse("[material.m]\n" + material + kBall + "[surface.skin]\nvolume = \"ball\"\n" +
                  "material = \"m\"\n" + surface);
        return scene.surfaces.at("skin").softness;
    };
    const std::string m = "stiffness_n_per_mm = 0.1\npress_damping_n_s_per_m = 3\n";
    EXPECT_DOUBLE_EQ(of(m, "").steepest(), 100.0);
    EXPECT_DOUBLE_EQ(of(m, "").damping, 3.0);
    EXPECT_DOUBLE_EQ(of(m, "stiffness_n_per_mm = 0.3\n").steepest(), 300.0);
    EXPECT_DOUBLE_EQ(of(m, "stiffness_n_per_mm = 0.3\n").damping, 3.0);
    EXPECT_DOUBLE_EQ(of(m, "press_damping_n_s_per_m = 5\n").damping, 5.0);
    EXPECT_TRUE(of(m, "stiffness_n_per_mm = inf\n").none());
}

TEST_F(SoftnessTable, MistakesAreRefusedWithLineValueAndRemedy) {
    EXPECT_EQ(complaint(felt("stiffness_n_per_mm = 0\n")),
              "scene.toml:6: stiffness_n_per_mm = 0 in [surface.skin] is out of range; give a "
              "number in (0, 100] or inf");
    EXPECT_EQ(complaint(felt("stiffness_n_per_mm = 0.2\nyoungs_kpa = 5\n")),
              "scene.toml:7: youngs_kpa in [surface.skin] does not go with stiffness_n_per_mm; say "
              "in one way how soft it is");
    EXPECT_EQ(complaint(felt("stiffness_mm_n = [[4, 0.2], [4, 1.0]]\n")),
              "scene.toml:6: stiffness_mm_n[1][0] = 4 in [surface.skin] is not above the depth "
              "before it, 4, by 1 nm or more; give depths in mm that rise");
    EXPECT_EQ(complaint(felt("stiffness_mm_n = [[4, 0.2], [5, 0.1]]\n")),
              "scene.toml:6: stiffness_mm_n[1][1] = 0.1 in [surface.skin] is below the force "
              "before it, 0.2; give forces in N that do not fall");
    EXPECT_THAT(complaint(felt("stiffness_mm_n = [[4, 0]]\n")), HasSubstr("is 0 N everywhere"));
    EXPECT_THAT(complaint(felt("stiffness_mm_n = []\n")), HasSubstr("has 0 pairs"));
    EXPECT_THAT(complaint(felt("stiffness_mm_n = [[1, 2, 3]]\n")), HasSubstr("is not a pair"));
    EXPECT_THAT(complaint(felt("youngs_kpa = 5\n")),
                HasSubstr("key \"contact_radius_mm\" is missing"));
    EXPECT_THAT(complaint(felt("contact_radius_mm = 5\n")), HasSubstr("is for youngs_kpa"));
    EXPECT_THAT(complaint(felt("press_damping_n_s_per_m = 5\n")),
                HasSubstr("scene.toml:6: press_damping_n_s_per_m in [surface.skin] is of what is "
                          "soft; give stiffness_n_per_mm, too"));
}

TEST_F(SoftnessTable, ExplainSaysWhatTheHandFeels) {
    EXPECT_THAT(
        reason("stiffness_n_per_mm = 0.2\n"),
        HasSubstr(
            "soft: 0.2 N/mm at the hand (0.333 N/mm of tissue behind the coupling's 0.5 N/mm); 5 "
            "N with the hand 25 mm behind the surface"));
    EXPECT_THAT(reason("stiffness_n_per_mm = 0.2\nstrength_n = 1\npress_damping_n_s_per_m = 2\n"),
                HasSubstr("1 N with the hand 5 mm behind the surface; damped with 2 N s/m"));
    EXPECT_THAT(reason("stiffness_n_per_mm = 0.6\n"),
                HasSubstr("hard: 0.6 N/mm is not softer than the coupling's 0.5 N/mm; raise "
                          "[coupling] stiffness_n_per_m above 600 to feel it"));
    EXPECT_THAT(reason("stiffness_mm_n = [[2, 0.1], [3, 0.9]]\n"),
                HasSubstr("0.05 N/mm to 0.5 N/mm by 2 points; stiffer pieces, up to 0.8 N/mm, are "
                          "felt as the coupling's 0.5 N/mm: raise"));
}

// What is not alone has a tip that others hold, too: what would act on its front is refused.
TEST_F(SoftnessTable, BesideOthersASoftSurfaceIsPlain) {
    const std::string bone = "[surface.bone]\nvolume = \"ball\"\niso_value = 0.005\n"
                             "[[effect]]\ntype = \"surface\"\nsurface = \"bone\"\n";
    const std::string soft = "stiffness_n_per_mm = 0.2\n";
    EXPECT_EQ(complaint(felt(soft, bone)), "");
    EXPECT_EQ(complaint(felt(soft + "strength_n = 2\n")), "");
    EXPECT_EQ(
        complaint(felt(soft + "strength_n = 2\n", bone)),
        "scene.toml:8: effects[0].surface = \"skin\" is soft, and not all that is felt: then it "
        "cannot yield (strength_n = 2); remove strength_n, or let a table of stiffness_mm_n end "
        "flat, or make it hard: stiffness_n_per_mm = inf");
    EXPECT_THAT(complaint(felt(soft + "moves = true\n", bone)),
                HasSubstr("it cannot move (moves = true); remove moves"));
    EXPECT_THAT(complaint("[loop]\nmethod = \"fixed\"\n" + felt(soft, bone)),
                HasSubstr("the method cannot be fixed; take method = \"adaptive\""));
    EXPECT_EQ(complaint("[loop]\nmethod = \"fixed\"\n" + felt(soft)), "");
    const std::string rubs = "[[effect]]\ntype = \"friction\"\nsurface = \"skin\"\nstatic = 0.3\n";
    EXPECT_EQ(complaint(felt(soft, rubs)), "");
    EXPECT_THAT(complaint(felt(soft, rubs + bone)),
                HasSubstr("it cannot rub; leave friction on it out"));
    const std::string of_bone =
        "[[effect]]\ntype = \"friction\"\nsurface = \"bone\"\nstatic = 0.3\n";
    EXPECT_EQ(complaint(felt(soft, bone + of_bone)), "");
    EXPECT_THAT(complaint(felt(
                    soft, "[[effect]]\ntype = \"magnet\"\nsurface = \"skin\"\nstrength_n = 1\n")),
                HasSubstr("it cannot draw; leave the magnet out"));
    for (const std::string_view effect :
         {"type = \"viscosity\"\ndamping_n_s_per_m = 1\n",
          "type = \"workspace\"\nradius_mm = 60\ncenter_mm = [0, 0, 0]\n",
          "type = \"guide\"\npoints_mm = [[0, 0, 50]]\nstrength_n = 1\n",
          "type = \"gradient_force\"\nvolume = \"ball\"\nstrength_n = 1\n",
          "type = \"texture\"\nsurface = \"skin\"\nheight_mm = 0.1\nwavelength_mm = 3\n",
          "type = \"constant_force\"\nforce_n = [0, 0, 1]\n"})
        EXPECT_EQ(complaint(felt(soft, "[[effect]]\n" + std::string(effect))), "") << effect;
}

// Each has a front of its own, and there is room for the touches of so many.
TEST_F(SoftnessTable, MoreSoftSurfacesThanCanBeFeltBesideEachOtherAreRefused) {
    const auto many = [](int count) {
        std::string text = "[volume.ball]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n";
        for (int i = 0; i < count; ++i)
            text += fmt::format("[surface.s{0}]\nvolume = \"ball\"\niso_value = {1}\n"
                                "stiffness_n_per_mm = 0.01\n"
                                "[[effect]]\ntype = \"surface\"\nsurface = \"s{0}\"\n",
                                i, 1e-5 * i);
        return text;
    };
    EXPECT_EQ(complaint(many(32)), "");
    EXPECT_THAT(complaint(many(33)),
                HasSubstr("is soft, and not all that is felt: then at most 32 such surfaces can be "
                          "felt, and there are 33; leave some of them out"));
}

// What is made in code is checked for the same reasons.
TEST_F(SoftnessTable, ASceneInCodeIsCheckedAsOneFromAFile) {
    const auto why = [](const SceneDescription& scene) -> std::string {
        try {
            validate(scene);
        } catch (const std::exception& error) {
            return error.what();
        }
        return {};
    };
    SceneDescription scene = parse(felt("stiffness_n_per_mm = 0.2\n"));
    scene.file.clear();
    EXPECT_EQ(why(scene), "");
    scene.surfaces.at("skin").softness.damping = 101.0;
    EXPECT_THAT(why(scene), HasSubstr("surfaces[\"skin\"].softness.damping = 101 is out of range"));
    scene.surfaces.at("skin").softness.damping = 0.0;
    scene.surfaces.at("skin").softness.knots[0].force_n = -1.0;
    EXPECT_THAT(why(scene), HasSubstr("surfaces[\"skin\"].softness"));
    scene.surfaces.at("skin").softness = Softness::linear(200.0);
    scene.surfaces["bone"] = scene.surfaces.at("skin");
    scene.effects.push_back(effects::Surface{.surface = "bone"});
    EXPECT_EQ(why(scene), "");
    scene.surfaces.at("bone").strength_n = 1.0;
    EXPECT_THAT(why(scene), HasSubstr("surface = \"bone\" is soft, and not all that is felt"));
}

} // namespace
} // namespace palpate
