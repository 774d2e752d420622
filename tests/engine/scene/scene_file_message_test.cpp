// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/engine/scene/scene_file_fixture.h"

namespace palpate {
namespace {

using test::kBall;
using test::kBone;
using test::kHead;
using test::kSkin;
using SceneFileMessage = test::SceneFolder;

TEST_F(SceneFileMessage, FunctionsOfTheValueAreChecked) {
    const std::string begin =
        kBone + "[[effect]]\ntype = \"gradient_surface\"\nvolume = \"head\"\nstrength_n = ";
    std::string too_many;
    for (int i = 0; i < 33; ++i)
        too_many += fmt::format("[{}, 1],", i);
    const std::vector<std::pair<std::string, std::string>> wrong{
        {"[]", "has 0 nodes"},
        {"[" + too_many + "]", "has 33 nodes"},
        {"[[0, 1], [0, 2]]",
         "strength_n[1][0] = 0 in [[effect]] is not above the value before it, 0"},
        {"[[5, 1], [4, 2]]", "give strictly increasing values"},
        {"[[0, -1]]",
         "strength_n[0][1] = -1 in [[effect]] is out of range; give a number in [0, 1000000]"},
        {"[[0, inf]]", "strength_n[0][1] = inf"},
        {"[[nan, 1]]", "strength_n[0][0] = nan in [[effect]] is not a number"},
        {"[[inf, 1]]", "strength_n[0][0] = inf"},
        {"[0, 1]", "strength_n[0] in [[effect]] is not a pair"},
        {"[[0, 1, 2]]", "is not a pair"},
        {"[[0, \"1\"]]", "strength_n[0][1] in [[effect]] is a string"},
        {"\"strong\"", "strength_n in [[effect]] is a string"},
        {"nan",
         "strength_n = nan in [[effect]] is not a number; give a number in [0, 1000000] or inf"},
        {"-1",
         "strength_n = -1 in [[effect]] is out of range; give a number in [0, 1000000] or inf"},
    };
    for (const auto& [value, what] : wrong) {
        const std::string message = complaint(begin + value + "\n");
        EXPECT_TRUE(message.starts_with("scene.toml:9: ")) << value << ": " << message;
        EXPECT_NE(message.find(what), std::string::npos) << value << ": " << message;
    }
    EXPECT_TRUE(complaint(begin + "[[0, 1],\n [1, 2],\n [1, 3]]\n").starts_with("scene.toml:11: "))
        << "a node's own line";
}

TEST_F(SceneFileMessage, UnknownKeysAreAnsweredWithTheNearestName) {
    EXPECT_EQ(
        complaint(kHead + "[surface.bone]\nvolume = \"head\"\niso_valeu = 226\n"),
        "scene.toml:5: unknown key \"iso_valeu\" in [surface.bone]; did you mean \"iso_value\"?");
    EXPECT_EQ(complaint("[lop]\nrate_hz = 1000\n"),
              "scene.toml:1: unknown key \"lop\" at the top of the scene; did you mean \"loop\"?");
    EXPECT_EQ(complaint("[limits]\nforce = 5\n"),
              "scene.toml:2: unknown key \"force\" in [limits]; did you mean \"force_n\"?");
    EXPECT_EQ(complaint("[coupling]\nspring = 5\n"),
              "scene.toml:2: unknown key \"spring\" in [coupling]; valid keys: stiffness_n_per_m, "
              "damping_n_s_per_m");
    EXPECT_EQ(complaint("[loop]\nmethod = \"adaptve\"\n"),
              "scene.toml:2: unknown method = \"adaptve\" in [loop]; did you mean \"adaptive\"?");
    EXPECT_EQ(complaint("[volume.a]\nfiel = \"skull.nhdr\"\n"),
              "scene.toml:2: unknown key \"fiel\" in [volume.a]; did you mean \"file\"?");
    EXPECT_EQ(complaint("[[effect]]\ntype = \"surfaces\"\n"),
              "scene.toml:2: unknown type = \"surfaces\" in [[effect]]; did you mean \"surface\"?");
    EXPECT_EQ(complaint("[device]\ntype = \"path\"\nfile = \"probe.csv\"\nturns = 3\n"),
              "scene.toml:4: unknown key \"turns\" in [device] with type = \"path\"; valid keys: "
              "type, file");
}

TEST_F(SceneFileMessage, NamesThatDoNotExistAreAnsweredWithTheNearestName) {
    EXPECT_EQ(
        complaint(kBone + "[[effect]]\ntype = \"surface\"\nsurface = \"bnoe\"\n"),
        "scene.toml:8: surface \"bnoe\" in [[effect]] does not exist; did you mean \"bone\"?");
    EXPECT_EQ(complaint(kBone + "[[effect]]\ntype = \"surface\"\nsurface = \"liver\"\n"),
              "scene.toml:8: surface \"liver\" in [[effect]] does not exist; surfaces: bone");
    EXPECT_EQ(
        complaint("[[effect]]\ntype = \"surface\"\nsurface = \"liver\"\n"),
        "scene.toml:3: surface \"liver\" in [[effect]] does not exist; there are no surfaces");
    EXPECT_EQ(
        complaint(kHead + "[surface.bone]\nvolume = \"haed\"\niso_value = 1\n"),
        "scene.toml:4: volume \"haed\" in [surface.bone] does not exist; did you mean \"head\"?");
    EXPECT_TRUE(complaint(kBone + "[device]\ntype = \"orbit\"\nsurface = \"bones\"\n")
                    .ends_with("did you mean \"bone\"?"));
}

TEST_F(SceneFileMessage, WrongTypesSayWhatIsThereAndWhatShouldBe) {
    const std::vector<std::pair<std::string, std::string>> wrong{
        {kHead + "[surface.bone]\nvolume = \"head\"\niso_value = \"226\"\n",
         "scene.toml:5: iso_value in [surface.bone] is a string; give a number in (-inf, inf)"},
        {"[volume.a]\nfile = 3\n",
         "scene.toml:2: file in [volume.a] is an integer; give a string in quotes"},
        {"[loop]\nsub_steps = 8.0\n", "scene.toml:2: sub_steps in [loop] is a number with a "
                                      "fraction; give an integer in [1, 4096]"},
        {"[loop]\nmethod = true\n",
         "scene.toml:2: method in [loop] is true or false; give a string in quotes"},
        {"loop = 3\n",
         "scene.toml:1: loop at the top of the scene is an integer; give a table [loop]"},
        {"[effect]\ntype = \"surface\"\n", "scene.toml:1: effect at the top of the scene is a "
                                           "table; give tables, each begun by [[effect]]"},
        {"effect = [1]\n", "scene.toml:1: an element of effect at the top of the scene is an "
                           "integer; give tables, each begun by [[effect]]"},
        {"[volume]\nfile = \"skull.nhdr\"\n", "scene.toml:2: volume.file at the top of the scene "
                                              "is a string; give a table [volume.NAME]"},
        {"[[surface]]\nvolume = \"head\"\n", "scene.toml:1: surface at the top of the scene is a "
                                             "list of tables; give tables [surface.NAME]"},
        {"[[effect]]\ntype = \"constant_force\"\nforce_n = 3\n",
         "scene.toml:3: force_n in [[effect]] is an integer; give three numbers [x, y, z] in N, "
         "scene frame (LPS)"},
        {"[[effect]]\ntype = \"constant_force\"\nforce_n = [1, 2]\n",
         "scene.toml:3: force_n in [[effect]] has 2 elements; give three numbers [x, y, z] in N, "
         "scene frame (LPS)"},
    };
    for (const auto& [text, message] : wrong)
        EXPECT_EQ(complaint(text), message);
}

TEST_F(SceneFileMessage, ValuesOutOfRangeNameKeyValueAndRange) {
    const std::vector<std::pair<std::string, std::string>> wrong{
        {"[coupling]\nstiffness_n_per_m = 0\n",
         "stiffness_n_per_m = 0 in [coupling] is out of range; give a number in (0, 100000]"},
        {"[coupling]\ndamping_n_s_per_m = -1\n",
         "damping_n_s_per_m = -1 in [coupling] is out of range; give a number in [0, 1000]"},
        {"[limits]\nforce_n = 1000.5\n",
         "force_n = 1000.5 in [limits] is out of range; give a number in (0, 1000]"},
        {"[limits]\nforce_n = inf\n",
         "force_n = inf in [limits] is out of range; give a number in (0, 1000]"},
        {"[limits]\nforce_n = nan\n",
         "force_n = nan in [limits] is not a number; give a number in (0, 1000]"},
        {"[limits]\nslew_n_per_s = 0\n",
         "slew_n_per_s = 0 in [limits] is out of range; give a number in (0, 10000000]"},
        {"[loop]\nrate_hz = 49\n",
         "rate_hz = 49 in [loop] is out of range; give a number in [50, 20000]"},
        {"[loop]\nbudget_us = 1001\n",
         "budget_us = 1001 in [loop] is out of range; give a number in (0, 1000]"},
        {"[loop]\nsub_steps = 0\n",
         "sub_steps = 0 in [loop] is out of range; give an integer in [1, 4096]"},
        {"[loop]\nevaluation_cap = 257\n",
         "evaluation_cap = 257 in [loop] is out of range; give an integer in [1, 256]"},
        {"[loop]\ntolerance_um = 0\n",
         "tolerance_um = 0 in [loop] is out of range; give a number in (0, 1000]"},
        {"[volume.a]\nanalytic = \"slab\"\nthickness_mm = -1\n",
         "thickness_mm = -1 in [volume.a] is out of range; give a number in [1e-06, 1000000]"},
        {"[volume.a]\nanalytic = \"wedge\"\nangle_deg = 360\n",
         "angle_deg = 360 in [volume.a] is out of range; give a number in (0, 360)"},
        {"[volume.a]\nanalytic = \"wedge\"\nangle_deg = 180\n",
         "angle_deg = 180 in [volume.a] has no edge; give an angle in (0, 180) or (180, 360)"},
        {"[volume.a]\nanalytic = \"torus\"\nradius_mm = 20\ntube_mm = 20\n",
         "tube_mm = 20 in [volume.a] is out of range; give a number in (0, 20), below radius_mm"},
        {kBone + "smooth_voxels = 5.1\n",
         "smooth_voxels = 5.1 in [surface.bone] is out of range; give a number in [0, 5]"},
        {kBone + "facet_size_mm = 0\n",
         "facet_size_mm = 0 in [surface.bone] is out of range; give a number in (0, 50]"},
        {kBone + "facet_distance_mm = 11\n",
         "facet_distance_mm = 11 in [surface.bone] is out of range; give a number in (0, 10]"},
        {kHead + "[surface.bone]\nvolume = \"head\"\niso_value = nan\n",
         "iso_value = nan in [surface.bone] is not a number; give a number in (-inf, inf)"},
        {kHead + "[surface.bone]\nvolume = \"head\"\niso_value = inf\n",
         "iso_value = inf in [surface.bone] is out of range; give a number in (-inf, inf)"},
        {"[[effect]]\ntype = \"constant_force\"\nforce_n = [0, 2e3, 0]\n",
         "force_n[1] = 2000 in [[effect]] is out of range; give a number in [-1000, 1000]"},
        {kSkin + "[device]\ntype = \"orbit\"\ndepth_min_mm = 6\ndepth_max_mm = 5\n",
         "depth_max_mm = 5 in [device] is out of range; give a number in [6, 50]"},
        {kSkin + "[device]\ntype = \"orbit\"\nturns = 501\n",
         "turns = 501 in [device] is out of range; give an integer in [1, 500]"},
    };
    for (const auto& [text, what] : wrong) {
        const std::string message = complaint(text);
        EXPECT_TRUE(message.starts_with("scene.toml:")) << message;
        EXPECT_TRUE(message.ends_with(": " + what)) << "got  " << message << "\nwant " << what;
    }
}

TEST_F(SceneFileMessage, KeysThatExcludeEachOtherAndMissingOnes) {
    EXPECT_EQ(complaint("[volume.a]\nfile = \"skull.nhdr\"\nanalytic = \"slab\"\n"),
              "scene.toml:2: file and analytic in [volume.a] exclude each other; keep one of them");
    EXPECT_EQ(complaint("\n[volume.a]\n"),
              "scene.toml:2: key \"file\" is missing in [volume.a]; name a "
              "volume file, or a formula with analytic = \"...\"");
    EXPECT_TRUE(
        complaint("[volume.a]\nfile = \"skull.nhdr\"\nradius_mm = 5\n")
            .starts_with("scene.toml:3: unknown key \"radius_mm\" in [volume.a] with file; "));
    EXPECT_EQ(complaint("[[effect]]\nsurface = \"bone\"\n"),
              "scene.toml:1: key \"type\" is missing in [[effect]]; give one of surface, "
              "gradient_surface, constant_force, gradient_force, viscosity, vector_force, "
              "vector_follow, fibre_follow, front_shape, vortex, friction, stick_slip, guide, "
              "workspace, vibration, gravity_compensation, magnet, texture");
    EXPECT_EQ(complaint(kBone + "[[effect]]\ntype = \"surface\"\n"),
              "scene.toml:6: key \"surface\" is missing in [[effect]]; surfaces: bone");
    EXPECT_TRUE(complaint(kBone + "[[effect]]\ntype = \"gradient_surface\"\nvolume = \"head\"\n")
                    .starts_with("scene.toml:6: key \"strength_n\" is missing in [[effect]]; "));
    EXPECT_TRUE(complaint("[[effect]]\ntype = \"constant_force\"\n")
                    .starts_with("scene.toml:1: key \"force_n\" is missing in [[effect]]; "));
    EXPECT_TRUE(
        complaint("[device]\n").starts_with("scene.toml:1: key \"type\" is missing in [device]; "));
    EXPECT_TRUE(complaint("[device]\ntype = \"path\"\n")
                    .starts_with("scene.toml:1: key \"file\" is missing in [device]; "));
}

TEST_F(SceneFileMessage, FilesThatDoNotExistAreNamedWithTheirLine) {
    EXPECT_EQ(complaint("[volume.a]\nfile = \"none.nhdr\"\n"),
              "scene.toml:2: file = \"none.nhdr\" in [volume.a] does not exist; put it at "
              "none.nhdr or correct the path");
    EXPECT_TRUE(complaint("[device]\ntype = \"path\"\nfile = \"none.csv\"\n")
                    .starts_with("scene.toml:3: file = \"none.csv\""));
}

TEST_F(SceneFileMessage, LabelsAndRegionsAreChecked) {
    const std::string part = kHead + "[surface.part]\nvolume = \"head\"\n"; // lines 1 to 4
    const std::vector<std::pair<std::string, std::string>> wrong{
        {kBone + "label = \"Hippocampus_L\"\n",
         "scene.toml:6: label and iso_value in [surface.bone] exclude each other; keep one of "
         "them"},
        {part,
         "scene.toml:3: key \"iso_value\" is missing in [surface.part]; give the level of the "
         "surface in the volume's unit, or the name of a label"},
        {part + "label = []\n", "scene.toml:5: label in [surface.part] is empty"},
        {part + "label = 1.5\n", "a label's name or number, or a list of them"},
        {part + "label = \"\"\n", "a label's name or number, or a list of them"},
        {kSkin + "label = 1\n", "scene.toml:6: label in [surface.skin] does not go with the "
                                "analytic volume \"ball\""},
        {kBone + "iso_after_smoothing = \"keep_volume\"\n",
         "scene.toml:6: iso_after_smoothing = \"keep_volume\" in [surface.bone] is for labels"},
        {kHead + "labels = \"probe.csv\"\n[surface.bone]\nvolume = \"head\"\niso_value = 1\n",
         "scene.toml:6: iso_value in [surface.bone] is of the label volume \"head\""},
        {kBone + "region_mm = [[0, 0, 0]]\n", "is not a pair of corners"},
        {kBone + "region_mm = [[0, 0, 0], [1, 1]]\n", "has a corner of other than three numbers"},
        {kBone + "region_mm = [[0, 0, 0], [1, 0, 1]]\n",
         "region_mm in [surface.bone] has no volume"},
        {kBone + "region_mm = [[0, 0, 0], [1, nan, 1]]\n", "region_mm = nan"},
        {kSkin + "region_mm = [[0, 0, 0], [1, 1, 1]]\n",
         "region_mm in [surface.skin] does not go with the analytic volume \"ball\""},
        {kHead + "slices = \"mend\"\n",
         "scene.toml:3: unknown slices = \"mend\" in [volume.head]; valid values: refuse, repair"},
        {kBall + "series = \"3\"\n", "unknown key \"series\""},
    };
    for (const auto& [text, what] : wrong) {
        const std::string message = complaint(text);
        EXPECT_NE(message.find(what), std::string::npos) << text << ": " << message;
    }
}

TEST_F(SceneFileMessage, SyntaxAndDuplicateNamesHaveTheirLine) {
    EXPECT_TRUE(complaint("[loop]\nrate_hz = = 3\n").starts_with("scene.toml:2: not TOML: "));
    const std::string twice = complaint(kHead + kHead);
    EXPECT_TRUE(twice.starts_with("scene.toml:")) << twice;
    EXPECT_NE(twice.find("cannot redefine existing table 'volume.head'"), std::string::npos)
        << twice;
    EXPECT_TRUE(
        complaint("[loop]\nrate_hz = 50\nrate_hz = 60\n").starts_with("scene.toml:3: not TOML: "));
    EXPECT_TRUE(complaint("\n\"\xff\" = 1\n").starts_with("scene.toml:2: not TOML: "));
}

TEST_F(SceneFileMessage, MessagesStayOnOneLine) {
    for (const std::string& text : {std::string("\"a\\nb\" = 1\n"), std::string("x = \"\n\""),
                                    std::string("[volume.\"a\\nb\"]\nfile = \"skull.nhdr\"\n"),
                                    kBall + "[surface.\"to\\np\"]\nvolume = \"ball\"\n",
                                    std::string("[loop]\nmethod = \"a\\r\\nb\"\n"),
                                    std::string("[volume.a]\nfile = \"a\\nb\"\n")}) {
        const std::string message = complaint(text);
        EXPECT_FALSE(message.empty());
        EXPECT_EQ(message.find_first_of("\r\n"), std::string::npos) << message;
        EXPECT_NE(message.find("; "), std::string::npos) << message;
    }
}

} // namespace
} // namespace palpate
