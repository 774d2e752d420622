// SPDX-License-Identifier: Apache-2.0
// What tables of effects may say: strengths and their limits, volumes, guides, workspaces.
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/engine/scene/scene_file_fixture.h"

namespace palpate {
namespace {

using test::kBall;
using test::kHead;
using test::kSkin;
using EffectTable = test::SceneFolder;

const std::string kHelix = "[volume.flow]\nanalytic = \"helix\"\nradius_mm = 20\npitch_mm = 30\n";

std::string effect(const std::string& type, const std::string& keys) {
    return "[[effect]]\ntype = \"" + type + "\"\n" + keys;
}

/// Effects as far as their strength, which is to follow.
const std::vector<std::pair<std::string, bool>> kStrengths{
    // text, may it be infinite
    {kBall + effect("gradient_force", "volume = \"ball\"\nstrength_n = "), false},
    {kBall + effect("gradient_surface", "volume = \"ball\"\nstrength_n = "), true},
    {kHelix + effect("vector_force", "volume = \"flow\"\nstrength_n = "), false},
    {kHelix + effect("vector_follow", "volume = \"flow\"\nstrength_n = "), true},
    {kHelix + effect("front_shape", "volume = \"flow\"\nstrength_n = "), true},
    {kHelix + effect("vortex", "volume = \"flow\"\nstrength_n = "), true},
    {kSkin + effect("magnet", "surface = \"skin\"\nstrength_n = "), false},
    {effect("guide", "points_mm = [[0, 0, 0]]\nstrength_n = "), true},
    {effect("workspace", "radius_mm = 9\ncenter_mm = [0, 0, 0]\nstrength_n = "), true},
    {effect("viscosity", "damping_n_s_per_m = "), false},
    {kSkin + "strength_n = ", true},
    {"[material.m]\nstrength_n = ", true},
    {"[material.m]\ndamping_n_s_per_m = ", false},
};

// What draws ends at the limit of forces; what holds may be as good as hard, in functions, too.
TEST_F(EffectTable, NumbersEndAtTheLimitOfForceAndDamping) {
    for (const auto& [begin, may_be_infinite] : kStrengths) {
        EXPECT_EQ(complaint(begin + (may_be_infinite ? "1e6\n" : "1e3\n")), "");
        EXPECT_EQ(complaint(begin + "inf\n").empty(), may_be_infinite) << begin;
        const std::string range =
            may_be_infinite ? "give a number in [0, 1000000] or inf" : "give a number in [0, 1000]";
        for (const char* beyond : {may_be_infinite ? "1.1e6" : "1000.5", "1e300", "-3"}) {
            const std::string message = complaint(begin + beyond + "\n");
            EXPECT_TRUE(message.ends_with("is out of range; " + range)) << message;
        }
    }
}

TEST_F(EffectTable, FunctionsEndAtTheSameLimits) {
    for (auto [begin, may_be_infinite] : kStrengths) {
        if (begin.find("[material.m]\ndamping") != std::string::npos) continue; // a number alone
        if (begin.find("volume.") == std::string::npos && begin.find("[[effect]]") == 0)
            begin.insert(begin.rfind('\n') + 1, "volume = \"ball\"\n").insert(0, kBall);
        if (begin.find("magnet") != std::string::npos)
            begin.insert(begin.rfind('\n') + 1, "volume = \"ball\"\n");
        EXPECT_EQ(complaint(begin + "[[0, 0], [1, 1000]]\n"), "") << begin;
        const std::string range =
            may_be_infinite ? "give a number in [0, 1000000]" : "give a number in [0, 1000]";
        for (const char* beyond : {may_be_infinite ? "5e6" : "5000", "inf"}) {
            const std::string message = complaint(begin + "[[0, 1], [1, " + beyond + "]]\n");
            EXPECT_NE(message.find("[1][1] = "), std::string::npos) << begin << message;
            EXPECT_TRUE(message.ends_with("out of range; " + range)) << message;
        }
    }
}

// It was felt twice as strongly: the effect was made once for each name.
TEST_F(EffectTable, ASurfaceIsNamedOnce) {
    for (const char* type : {"vibration", "viscosity", "friction"})
        EXPECT_THAT(complaint(kBall + "[surface.s]\nvolume = \"ball\"\n[[effect]]\ntype = \"" +
                              type + "\"\nsurface = [\"s\", \"s\"]\n"),
                    testing::HasSubstr("names \"s\" twice"));
}

TEST_F(EffectTable, AFunctionNeedsAVolume) {
    EXPECT_EQ(complaint(effect("viscosity", "damping_n_s_per_m = [[0, 0], [1, 4]]\n")),
              "scene.toml:3: damping_n_s_per_m in [[effect]] is a function, and no volume says of "
              "what; name the volume with volume = \"...\", or give a number of N s/m");
}

// Between the numbers of two labels are those of others.
TEST_F(EffectTable, LabelsAreNotInterpolated) {
    const std::string labels = kHead + "labels = \"probe.csv\"\n"; // lines 1 to 3
    const std::string volume = "volume = \"head\"\n";
    const std::string nodes = "strength_n = [[36, 0], [37, 5]]\n";
    const std::string remedy = "\"head\" in [[effect]] is a label volume, whose values are names "
                               "and not to be interpolated; make surfaces of its labels with label "
                               "= \"...\" and a material each, or remove labels from the volume";
    EXPECT_EQ(complaint(labels + effect("gradient_force", volume + nodes)),
              "scene.toml:6: volume " + remedy);
    for (const std::string& text :
         {effect("gradient_surface", volume + nodes),
          effect("viscosity", volume + "damping_n_s_per_m = 1\n"),
          effect("guide", "points_mm = [[0, 0, 0]]\n" + volume + nodes),
          effect("workspace", "radius_mm = 9\ncenter_mm = [0, 0, 0]\n" + volume + nodes)})
        EXPECT_TRUE(complaint(labels + text).ends_with("volume " + remedy))
            << complaint(labels + text);
    for (const std::string& text :
         {effect("magnet", "surface = \"skin\"\n" + volume + nodes),
          effect("texture", "surface = \"skin\"\nheight_mm = 1\n" + volume)})
        EXPECT_TRUE(complaint(labels + kSkin + text).ends_with("volume " + remedy));
    EXPECT_TRUE(complaint(labels + kSkin + "strength_volume = \"head\"\n" + nodes)
                    .starts_with("scene.toml:9: strength_volume \"head\" in [surface.skin] is a "
                                 "label volume"));
}

TEST_F(EffectTable, AWorkspaceIsABallOrABox) {
    const std::string box = "box_mm = [[0, 0, 0], [1, 1, 1]]\n";
    EXPECT_EQ(complaint(effect("workspace", box + "center_mm = [0, 0, 0]\n")),
              "scene.toml:4: center_mm and box_mm in [[effect]] exclude each other: a workspace is "
              "either a ball or a box; give radius_mm with center_mm, or box_mm with two corners");
    EXPECT_TRUE(complaint(effect("workspace", box + "radius_mm = 40\ncenter_mm = [0, 0, 0]\n"))
                    .starts_with("scene.toml:4: radius_mm and box_mm in [[effect]] exclude"));
    EXPECT_EQ(complaint(effect("workspace", box)), "");
}

std::string ball(const std::string& center, const std::string& more = "") {
    return effect("workspace", "radius_mm = 10\ncenter_mm = " + center + "\n" + more);
}

std::string box(const std::string& corners, const std::string& more = "") {
    return effect("workspace", "box_mm = " + corners + "\n" + more);
}

TEST_F(EffectTable, WorkspacesThatNeverYieldHaveAPlaceInCommon) {
    const std::string cube = box("[[0, 0, 0], [20, 20, 20]]");
    const std::vector<std::pair<std::string, std::string>> apart{
        {ball("[-30, 0, 0]"), ball("[30, 0, 0]")},
        {cube, box("[[0, 0, 21], [20, 20, 30]]")},
        // Its bounds share (13..20)^3 with the cube, but the corner is 10 sqrt(3) > 10 mm away.
        {cube, ball("[30, 30, 30]")},
        {ball("[30, 30, 30]"), cube},
    };
    for (const auto& [first, second] : apart) {
        const std::string message = complaint(first + second);
        EXPECT_NE(message.find(": the workspace in [[effect]] has no place in common with that of "
                               "line 1, and neither yields; move or enlarge one of them, or give "
                               "one a finite strength_n"),
                  std::string::npos)
            << message;
        EXPECT_EQ(complaint(first + second + "strength_n = 5\n"), "");
    }
    EXPECT_EQ(complaint(ball("[-9, 0, 0]") + ball("[9, 0, 0]") + cube), "");
    EXPECT_EQ(complaint(cube + ball("[25, 25, 25]") + box("[[20, 0, 0], [30, 20, 20]]")), "");
    EXPECT_EQ(
        complaint(ball("[-9, 0, 0]") + ball("[9, 0, 0]") + ball("[0, 25, 0]", "strength_n = 1\n")),
        "");
}

TEST_F(EffectTable, AGuideWithoutPointsIsToldBothWays) {
    EXPECT_EQ(complaint(effect("guide", "strength_n = 1\n")),
              "scene.toml:1: key \"points_mm\" is missing in [[effect]]; give points [[x, y, z], "
              "...] in mm, scene frame (LPS), or name a CSV file of them with file = \"...\"");
}

} // namespace
} // namespace palpate
