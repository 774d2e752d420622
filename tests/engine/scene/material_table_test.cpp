// SPDX-License-Identifier: Apache-2.0
// Materials, and the effects that take from them what they do not say themselves.
#include <algorithm>
#include <string>

#include <gtest/gtest.h>

#include <palpate/engine/scene/effect_plan.h>
#include <palpate/engine/scene/scene.h>

#include "tests/engine/scene/scene_file_fixture.h"

namespace palpate {
namespace {

using test::kBall;
using test::kHead;

class MaterialTable : public test::SceneFolder {
protected:
    /// A ball of a material, felt, with an effect on it.
    static std::string felt(const std::string& material, const std::string& effect) {
        return "[material.m]\n" + material + kBall +
               "[surface.skin]\nvolume = \"ball\"\nmaterial = \"m\"\n"
               "[[effect]]\ntype = \"surface\"\nsurface = \"skin\"\n"
               "[[effect]]\nsurface = \"skin\"\n" +
               effect;
    }
    effects::Friction friction(const std::string& material, const std::string& keys) const {
        return std::get<effects::Friction>(
            parse(felt(material, "type = \"friction\"\n" + keys)).effects[1].settings);
    }
    EffectPlan plan(const std::string& text) const {
        return plan_effects(parse(text), Extraction::impossible);
    }
};

TEST_F(MaterialTable, EachCoefficientIsOfTheEffectOrElseOfTheMaterial) {
    const std::string both = "static = 0.5\ndynamic = 0.2\n";
    EXPECT_EQ(friction(both, "").static_mu, 0.5);
    EXPECT_EQ(friction(both, "").dynamic_mu, 0.2);
    EXPECT_EQ(friction(both, "dynamic = 0.1\n").static_mu, 0.5);
    EXPECT_EQ(friction(both, "dynamic = 0.1\n").dynamic_mu, 0.1);
    EXPECT_EQ(friction(both, "static = 0.3\n").dynamic_mu, 0.2);
    EXPECT_EQ(friction("static = 0.5\n", "static = 0.3\n").dynamic_mu, 0.3);
    const std::string above = complaint(felt(both, "type = \"friction\"\nstatic = 0.1\n"));
    EXPECT_EQ(above,
              "scene.toml:16: dynamic = 0.2 of the surface's material is above static = 0.1; "
              "give at most as much friction while sliding as at rest");
    EXPECT_NE(complaint(felt("", "type = \"friction\"\n")).find("key \"static\" is missing"),
              std::string::npos);
}

TEST_F(MaterialTable, AZeroIsAValue) {
    const EffectPlan smooth = plan(felt("static = 0\n", "type = \"friction\"\n"));
    EXPECT_FALSE(smooth.effects[1].on);
    EXPECT_EQ(smooth.effects[1].reason, "static is 0: it cannot be felt");
    const EffectPlan flat =
        plan(felt("texture_wavelength_mm = 2\ntexture_height_mm = 0\n", "type = \"texture\"\n"));
    EXPECT_EQ(flat.effects[1].reason, "height_mm is 0: it cannot be felt");
}

// Without the wavelength 2 mm were assumed, without the damping none.
TEST_F(MaterialTable, WhatNeitherSaysIsMissed) {
    EXPECT_NE(complaint(felt("texture_height_mm = 0.3\n", "type = \"texture\"\n"))
                  .find("scene.toml:12: key \"wavelength_mm\" is missing in [[effect]]; "),
              std::string::npos);
    EXPECT_NE(complaint(felt("texture_wavelength_mm = 3\n", "type = \"texture\"\n"))
                  .find("scene.toml:12: key \"height_mm\" is missing in [[effect]]; "),
              std::string::npos);
    EXPECT_EQ(
        complaint(felt("texture_height_mm = 0.3\n", "type = \"texture\"\nwavelength_mm = 3\n")),
        "");
    EXPECT_EQ(
        complaint(felt("static = 0.2\n", "type = \"viscosity\"\n")),
        "scene.toml:12: key \"damping_n_s_per_m\" is missing in [[effect]]; give it in N s/m, "
        "here or in [material.m]");
    EXPECT_EQ(complaint(felt("damping_n_s_per_m = 2\n", "type = \"viscosity\"\n")), "");
}

TEST_F(MaterialTable, AStrengthThatItsSurfaceCannotHaveIsShownWhereItStands) {
    const std::string text = "[material.m]\nstrength_n = [[0, 1], [1, 2]]\n" + kHead +
                             "labels = \"probe.csv\"\n[surface.t]\nvolume = \"head\"\nlabel = "
                             "\"Thalamus_L\"\nmaterial = \"m\"\n";
    EXPECT_EQ(complaint(text),
              "scene.toml:2: strength_n in [material.m], used in [surface.t], is a function of a "
              "volume's value, and a label has none; name the volume with strength_volume = "
              "\"...\", or give a number of N");
}

TEST_F(MaterialTable, AFunctionOfOneNodeNeedsNoVolume) {
    EXPECT_EQ(complaint(kBall + "[surface.skin]\nvolume = \"ball\"\nstrength_volume = \"ball\"\n"
                                "strength_n = [[0, 2]]\n"),
              "scene.toml:6: strength_volume in [surface.skin] is for a strength_n that is a "
              "function of its value; give strength_n = [[value, N], [value, N], ...], or remove "
              "strength_volume");
}

TEST_F(MaterialTable, ThePlanSaysWhatDoesNothing) {
    const auto says = [](const EffectPlan& plan, const std::string& words) {
        return std::find(plan.left_out.begin(), plan.left_out.end(), words) != plan.left_out.end();
    };
    const std::string surface = kBall + "[surface.skin]\nvolume = \"ball\"\nmaterial = \"m\"\n"
                                        "[[effect]]\ntype = \"surface\"\nsurface = \"skin\"\n";
    const EffectPlan idle =
        plan("[material.m]\nyield = \"opens\"\n[material.other]\nstatic = 0.1\n" + surface);
    EXPECT_TRUE(says(idle, "material other: no surface names it"));
    EXPECT_TRUE(says(idle, "yield = \"opens\" of surface skin: without strength_n it opens at no "
                           "force"));
    EXPECT_EQ(idle.left_out.size(), 2u);
    EXPECT_TRUE(
        plan("[material.m]\nyield = \"opens\"\nstrength_n = 2\n" + surface).left_out.empty());
}

} // namespace
} // namespace palpate
