// SPDX-License-Identifier: Apache-2.0
// How a scene says what lies beneath a soft surface, and what is refused.
#include <palpate/engine/scene/scene_file.h>

#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/scene/soft_surfaces.h>
#include <palpate/engine/scene/validation.h>

#include "tests/engine/scene/scene_file_fixture.h"

namespace palpate {
namespace {

using testing::HasSubstr;

const std::string kSoft = "stiffness_n_per_mm = 0.15\n";
const std::string kNodule = "beneath = { Nodule = 10.0, 7 = 0.5 }\n";

/// Lines: 1 to 2 the volume, 3 the surface, 4 its volume, 5 its labels, then the keys.
std::string felt(const std::string& keys, const std::string& more = "") {
    return "[volume.v]\nfile = \"skull.nhdr\"\n[surface.body]\nvolume = \"v\"\nlabel = [\"Organ\", "
           "\"Nodule\", \"7\"]\n" +
           keys + "[[effect]]\ntype = \"surface\"\nsurface = \"body\"\n" + more;
}

class BeneathTable : public test::SceneFolder {};

TEST_F(BeneathTable, NamesLabelsAndTheirRatios) {
    const SurfaceDescription body = parse(felt(kSoft + kNodule)).surfaces.at("body");
    ASSERT_EQ(body.beneath.size(), 2u);
    EXPECT_EQ(body.beneath.at("Nodule"), 10.0);
    EXPECT_EQ(body.beneath.at("7"), 0.5);
    EXPECT_EQ(body.contact_radius_mm, 4.0);
    EXPECT_EQ(parse(felt(kSoft + kNodule + "contact_radius_mm = 6\n"))
                  .surfaces.at("body")
                  .contact_radius_mm,
              6.0);
    EXPECT_TRUE(parse(felt(kSoft)).surfaces.at("body").beneath.empty());
}

// It was dropped: the stiffness was that of a contact of 8 mm, the lumps those of one of 4 mm.
TEST_F(BeneathTable, TheMaterialsContactIsTheFingers) {
    const std::string material = "[material.tissue]\nyoungs_kpa = 10\ncontact_radius_mm = 8\n";
    const auto contact_of = [&](const std::string& keys) {
        return parse(felt("material = \"tissue\"\n" + keys + kNodule, material))
            .surfaces.at("body")
            .contact_radius_mm;
    };
    EXPECT_EQ(contact_of(""), 8.0);
    EXPECT_EQ(contact_of("contact_radius_mm = 6\n"), 6.0) << "the surface's own comes first";
}

TEST_F(BeneathTable, TheContactOfAMaterialInCodeIsChecked) {
    SceneDescription scene = parse(felt(kSoft + kNodule));
    scene.materials["tissue"].contact_radius_mm = 16.0;
    try {
        validate(scene);
        ADD_FAILURE() << "16 mm was taken";
    } catch (const std::invalid_argument& error) {
        EXPECT_THAT(error.what(),
                    testing::AllOf(HasSubstr("materials[\"tissue\"]"),
                                   HasSubstr("contact_radius_mm"), HasSubstr("[1, 15]")));
    }
}

// It said how much of a lump is felt, and that fingers notice it, where the surface is hard.
TEST_F(BeneathTable, OfAHardSurfaceNothingBeneathIsFelt) {
    const SceneDescription hard = parse(felt("stiffness_n_per_mm = 0.8\n" + kNodule));
    EXPECT_THAT(softness_in_words(hard, hard.surfaces.at("body")),
                HasSubstr("; until then nothing beneath is felt"));
    const SceneDescription soft = parse(felt(kSoft + kNodule));
    EXPECT_THAT(softness_in_words(soft, soft.surfaces.at("body")),
                testing::Not(HasSubstr("until then")));
}

TEST_F(BeneathTable, RefusesWhatItCannotBe) {
    EXPECT_THAT(complaint(felt(kSoft + "beneath = { Nodule = 0.05 }\n")),
                testing::AllOf(HasSubstr("scene.toml:7: "), HasSubstr("beneath.Nodule = 0.05"),
                               HasSubstr("[0.1, 1000]")));
    EXPECT_THAT(complaint(felt(kSoft + "beneath = { Nodule = 2000 }\n")), HasSubstr("[0.1, 1000]"));
    EXPECT_THAT(complaint(felt(kSoft + "beneath = { Nodule = \"hard\" }\n")),
                HasSubstr("a number in"));
    EXPECT_THAT(complaint(felt(kSoft + "beneath = {}\n")), HasSubstr("names no labels"));
    EXPECT_THAT(complaint(felt(kSoft + "beneath = [\"Nodule\"]\n")), HasSubstr("names no labels"));
    EXPECT_THAT(complaint(felt(kNodule)), HasSubstr("the surface is hard"));
    for (const char* radius : {"0.5", "16"})
        EXPECT_THAT(complaint(felt(kSoft + kNodule + "contact_radius_mm = " + radius + "\n")),
                    HasSubstr("[1, 15]"));
    EXPECT_THAT(complaint(felt(kSoft + "contact_radius_mm = 4\n")),
                HasSubstr("is for youngs_kpa or beneath"));
    EXPECT_THAT(complaint("[volume.v]\nfile = \"skull.nhdr\"\n[surface.body]\nvolume = "
                          "\"v\"\niso_value = 3\n" +
                          kSoft + kNodule),
                HasSubstr("is of labels, and the surface is not made of any"));
    EXPECT_THAT(complaint(felt(kSoft + kNodule + "strength_n = 3\n")),
                HasSubstr("does not go with a strength_n"));
    EXPECT_THAT(complaint(felt(kSoft + kNodule + "moves = true\n")),
                HasSubstr("does not go with a surface that moves"));
}

TEST_F(BeneathTable, RefusesWhatItWouldHaveToGoWith) {
    EXPECT_THAT(complaint(felt(kSoft + kNodule,
                               "[[effect]]\ntype = \"friction\"\nsurface = \"body\"\nstatic = "
                               "0.3\n")),
                HasSubstr("beneath"));
    EXPECT_THAT(complaint(felt(
                    kSoft + kNodule,
                    "[[effect]]\ntype = \"workspace\"\nradius_mm = 60\ncenter_mm = [0, 0, 0]\n")),
                HasSubstr("remove beneath"));
    EXPECT_THAT(complaint(felt(kSoft + kNodule, "[surface.lump]\nvolume = \"v\"\nlabel = "
                                                "\"Nodule\"\nstiffness_n_per_mm = 0.3\n")),
                HasSubstr("it would count twice"));
    // It was said of a lump that it is a soft surface as well: the one around it.
    EXPECT_THAT(complaint(felt(kSoft + "beneath = { Organ = 3.0, Nodule = 10.0, 7 = 0.5 }\n")),
                testing::AllOf(HasSubstr("has all labels of the surface"),
                               HasSubstr("leave out the label that the lumps lie in")));
}

TEST_F(BeneathTable, TheSameIsRefusedOfASceneInCode) {
    SceneDescription scene = parse(felt(kSoft + kNodule));
    SurfaceDescription& body = scene.surfaces.at("body");
    const auto complaint_of = [&] {
        try {
            validate(scene);
        } catch (const std::invalid_argument& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_EQ(complaint_of(), "");
    body.beneath["Nodule"] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THAT(complaint_of(), HasSubstr("surfaces[\"body\"].beneath[\"Nodule\"]"));
    body.beneath["Nodule"] = 10.0;
    body.contact_radius_mm = 0.0;
    EXPECT_THAT(complaint_of(), HasSubstr("surfaces[\"body\"].contact_radius_mm"));
    body.contact_radius_mm = 4.0;
    body.softness = {};
    EXPECT_THAT(complaint_of(), HasSubstr("the surface is hard"));
}

} // namespace
} // namespace palpate
