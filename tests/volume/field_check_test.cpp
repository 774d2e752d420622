// SPDX-License-Identifier: Apache-2.0
// What a field of a program's own is looked at for before a scene takes it.
#include <palpate/volume/volume_check.h>

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include <palpate/volume/fields/analytic_fields.h>
#include <palpate/volume/fields/grid_field.h>

#include "tests/support/formula_fields.h"
#include "tests/support/host_fields.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using Spoil = test::HostBall::Spoil;

std::string complaint(const std::function<void(Spoil&)>& change, double radius_m = 0.02) {
    Spoil spoil;
    change(spoil);
    try {
        require_field("field", test::HostBall(radius_m, spoil));
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return "";
}

TEST(FieldCheck, TakesWhatTheEngineItselfFeels) {
    EXPECT_EQ(complaint([](Spoil&) {}), "");
    EXPECT_NO_THROW(require_field("cavity", *make_sphere_cavity(0.05)));
    EXPECT_NO_THROW(require_field("ball", *make_solid_sphere(0.02)));
    EXPECT_NO_THROW(require_field("bumpy", *make_bumpy_cavity(0.05, 0.002, 0.02)));
    EXPECT_NO_THROW(require_field("slab", *make_slab(0.01)));
    EXPECT_NO_THROW(require_field("wedge", *make_wedge(70.0)));
    EXPECT_NO_THROW(require_field("notch", *make_wedge(250.0)));
    EXPECT_NO_THROW(require_field("torus", *make_torus(0.03, 0.01)));
    EXPECT_NO_THROW(require_field(
        "grid",
        GridField(test::random_volume(test::oblique_frame(Vec3(1e-3), Vec3(0.0))), -1000.0F)));
    EXPECT_NO_THROW(require_field("helix", *make_helix(0.03, 0.02)));
}

TEST(FieldCheck, NamesThePromiseThatIsBroken) {
    const auto begins = [](const std::string& message, const std::string& words) {
        EXPECT_TRUE(message.starts_with(words)) << message;
        EXPECT_NE(message.find("; "), std::string::npos) << "no remedy: " << message;
    };
    begins(complaint([](Spoil& s) { s.is_finite = false; }), "field.sample() is not finite at (");
    begins(complaint([](Spoil& s) { s.value_offset_m = 1e-3; }), "field.value() is ");
    begins(complaint([](Spoil& s) { s.slope_factor = 1e-3; }), "field.sample() has a slope of ");
    begins(complaint([](Spoil& s) { s.slope_factor = -1.0; }), "field.sample() has a slope of ");
    begins(complaint([](Spoil& s) { s.has_roots = false; }), "field.first_root() from (");
    begins(complaint([](Spoil& s) { s.root_factor = 1.05; }), "field.first_root() from (");
    begins(complaint([](Spoil& s) { s.root_factor = -1.0; }), "field.first_root() from (");
    begins(complaint([](Spoil& s) { s.has_sampler = false; }), "field.make_sampler() gives none");
    begins(complaint([](Spoil& s) { s.has_bounds = false; }), "field.bounds() has no volume");
    begins(complaint([](Spoil& s) { s.feature_size_m = -1.0; }),
           "field.feature_size_m() = -1 is out of range");
}

// Details of 0.3 mm in a field of 0.1 m: over a step that is short for them, the value changes by
// no more than what counts as rounding of the values' range, as if the field were flat.
TEST(FieldCheck, LooksAtTheSlopesOfAFieldThatIsFineForItsSize) {
    const auto said_of_factor = [](double slope_factor) {
        return complaint(
            [&](Spoil& s) {
                s.feature_size_m = 0.3e-3;
                s.slope_factor = slope_factor;
            },
            0.05);
    };
    EXPECT_EQ(said_of_factor(1.0), "");
    for (const double factor : {1e-3, -1.0})
        EXPECT_TRUE(said_of_factor(factor).starts_with("field.sample() has a slope of "))
            << factor << ": " << said_of_factor(factor);
}

TEST(FieldCheck, RefusesVectorsThatAreNotFinite) {
    const test::FormulaVectorField field([](const Vec3& p) {
        return VectorSample{Vec3(1.0 / std::max(0.0, p.x), 0.0, 0.0), Mat3(0.0), true};
    });
    try {
        require_field("flow", field);
        FAIL() << "it was accepted";
    } catch (const std::invalid_argument& error) {
        EXPECT_TRUE(std::string(error.what()).starts_with("flow.sample() is not finite at ("))
            << error.what();
    }
}

} // namespace
} // namespace palpate
