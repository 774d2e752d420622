// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/tissues.h>

#include <limits>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/scene/validation.h>

#include "tests/engine/scene/scene_file_fixture.h"

namespace palpate {
namespace {

using testing::HasSubstr;

class Tissues : public test::SceneFolder {
protected:
    SceneDescription with(const std::string& keys, const std::string& more = "") const {
        return parse(test::kBall + "[surface.organ]\nvolume = \"ball\"\n" + keys + more);
    }
};

// K = 2 a E / (1 - 1/4) at a = 4 mm: 0.01067 N/mm per kPa.
TEST_F(Tissues, AreMaterialsThatNeedNoTable) {
    for (const Tissue& tissue : tissues()) {
        const SceneDescription scene = with("material = \"" + std::string(tissue.name) + "\"\n");
        EXPECT_NEAR(scene.surfaces.at("organ").softness.steepest(),
                    1e3 * tissue.youngs_kpa * 8e-3 / 0.75, 1e-9)
            << tissue.name;
        EXPECT_GT(tissue.youngs_kpa, 0.0);
        EXPECT_FALSE(tissue.source.empty());
    }
    EXPECT_TRUE(with("").materials.empty());
    EXPECT_FALSE(tissue_material("gold"));
}

// docs/palpation.md tells programs to make a softness so; it was in an internal namespace.
TEST_F(Tissues, AProgramMakesASoftnessOfAModulus) {
    SceneDescription scene = with("");
    Softness& softness = scene.surfaces.at("organ").softness;
    softness = softness_of_modulus(5.0, 8.0);
    EXPECT_DOUBLE_EQ(softness.steepest(), 2.0 * 8e-3 * 5e3 / 0.75);
    EXPECT_NO_THROW(validate(scene));
    for (const double none : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::infinity()}) {
        softness = softness_of_modulus(none, 8.0);
        EXPECT_THROW(validate(scene), std::invalid_argument) << none;
    }
}

TEST_F(Tissues, ATableOfTheSceneComesFirst) {
    const SceneDescription scene =
        with("material = \"liver\"\n", "[material.liver]\nstiffness_n_per_mm = 0.4\n");
    EXPECT_DOUBLE_EQ(scene.surfaces.at("organ").softness.steepest(), 400.0);
}

TEST_F(Tissues, ASurfaceMaySayAnotherStiffness) {
    EXPECT_DOUBLE_EQ(with("material = \"spleen\"\nstiffness_n_per_mm = 0.1\n")
                         .surfaces.at("organ")
                         .softness.steepest(),
                     100.0);
}

TEST_F(Tissues, WhatIsNoneIsRefusedWithThoseThatThereAre) {
    const auto of = [&](const std::string& name, const std::string& more = "") {
        return complaint(test::kBall + "[surface.organ]\nvolume = \"ball\"\nmaterial = \"" + name +
                         "\"\n" + more);
    };
    EXPECT_THAT(of("livr"), HasSubstr("\"livr\" in [surface.organ] does not exist; did you mean "
                                      "\"liver\"?"));
    EXPECT_THAT(of("gold"),
                HasSubstr("materials and tissues: gastrocnemius, kidney_cortex, liver"));
    EXPECT_THAT(of("gold", "[material.jelly]\nstiffness_n_per_mm = 0.1\n"),
                HasSubstr("materials and tissues: jelly, gastrocnemius"));
}

} // namespace
} // namespace palpate
