// SPDX-License-Identifier: Apache-2.0
// A field that is made of a function's value and gradient alone: its roots are the first ones, its
// derivatives are the function's, and it says what the function breaks.
#include <palpate/volume/fields/function_field.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include <palpate/volume/fields/analytic_fields.h>
#include <palpate/volume/volume_check.h>

namespace palpate {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// What an analytic field says, as a program's function would; each call has a sampler of its own.
ScalarFunction function_of(const std::shared_ptr<const ScalarField>& field) {
    return [field](const Vec3& p) -> std::optional<FunctionSample> {
        const FieldSample sample = field->make_sampler()->sample(p);
        return FunctionSample{sample.value, sample.gradient};
    };
}

struct Shape {
    std::shared_ptr<const ScalarField> field;
    FunctionFieldSettings settings;
};

/// Bounds that their formulas allow: |gradient| <= steepest, and by |Hessian| at their surfaces.
Shape ball() { return {make_solid_sphere(0.02), {{Vec3(-0.03), Vec3(0.03)}, 1.0, 0.02, nullptr}}; }
Shape ring() {
    // The circle's own curvature, and that of the tube, where the value is below 0.
    return {make_torus(0.02, 0.006), {{Vec3(-0.03), Vec3(0.03)}, 1.0, 0.006, nullptr}};
}
Shape bumps() {
    // r'' of 0.5 mm sin(2 pi x / 15 mm) products: at most 3 (2 pi / 15 mm)^2 0.5 mm = 263 / m; and
    // gradients of 1 + 3 (2 pi / 15 mm) 0.5 mm = 1.63 at most.
    return {make_bumpy_cavity(0.02, 0.0005, 0.015),
            {{Vec3(-0.03), Vec3(0.03)}, 1.63, 1.63 / 263.0, nullptr}};
}

TEST(FunctionField, FirstRootsAreThoseOfTheFormulas) {
    constexpr unsigned kSeed = 11;
    SCOPED_TRACE(kSeed);
    std::mt19937 random(kSeed);
    std::uniform_real_distribution<double> place(-0.029, 0.029);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    for (const Shape& shape : {ball(), ring(), bumps()}) {
        const auto field = make_function_field("field", function_of(shape.field), shape.settings);
        const auto sampler = field->make_sampler();
        const auto truth = shape.field->make_sampler();
        int roots = 0;
        for (int i = 0; i < 3000; ++i) {
            const Vec3 from(place(random), place(random), place(random));
            const Vec3 to = from + std::pow(share(random), 3.0) *
                                       (Vec3(place(random), place(random), place(random)) - from);
            const auto expected = truth->first_root(from, to, 0.0);
            const auto found = sampler->first_root(from, to, 0.0);
            const double length_m = glm::length(to - from);
            if (!expected) {
                // Where a search ends without a proof it stops short of nothing: within rounding.
                ASSERT_FALSE(found) << i;
                continue;
            }
            ASSERT_TRUE(found) << i << ": a wall was passed";
            // A root along a slope s is known to the rounding of the value, 1e-17 m, over s; rays
            // that graze have s down to 1e-4 here.
            ASSERT_NEAR(*found * length_m, *expected * length_m, 1e-12) << i;
            if (*found > 0.0) {
                ASSERT_LT(sampler->value(from + *found * (to - from)), 0.0) << i;
            }
            roots += *found > 0.0 ? 1 : 0;
        }
        EXPECT_GT(roots, 50);
    }
}

TEST(FunctionField, NoChordOfManySmallStepsMeetsWhatTheRootDenies) {
    constexpr unsigned kSeed = 12;
    SCOPED_TRACE(kSeed);
    std::mt19937 random(kSeed);
    std::uniform_real_distribution<double> place(-0.029, 0.029);
    const Shape shape = bumps();
    // Brute force: a march in steps of 10 um.
    const auto field = make_function_field("field", function_of(shape.field), shape.settings);
    const auto asked = field->make_sampler();
    for (int i = 0; i < 100; ++i) {
        const Vec3 from(place(random), place(random), place(random));
        const Vec3 to(place(random), place(random), place(random));
        const double end = asked->first_root(from, to, 0.0).value_or(1.0);
        const int steps = static_cast<int>(glm::length(to - from) * end / 10e-6);
        for (int n = 1; n < steps; ++n)
            ASSERT_LT(asked->value(from + end * n / steps * (to - from)), 0.0) << i;
    }
}

TEST(FunctionField, DerivativesAreThoseOfTheFormula) {
    const Shape shape = ball();
    const auto field = make_function_field("field", function_of(shape.field), shape.settings);
    const auto sampler = field->make_sampler();
    const auto truth = shape.field->make_sampler();
    for (const Vec3& p :
         {Vec3(0.02, 0.0, 0.0), Vec3(-0.01, 0.013, 0.02), Vec3(0.05, -0.02, 0.01)}) {
        const FieldSample a = sampler->sample(p), b = truth->sample(p);
        EXPECT_TRUE(a.valid);
        EXPECT_EQ(a.value, b.value);
        EXPECT_EQ(a.slope, b.slope);
        EXPECT_EQ(a.gradient, b.gradient);
        EXPECT_EQ(sampler->value(p), b.value);
        // Central differences over e = 20 um: e^2 / r^2 of 1/r, r >= 2 cm, and 1e-16 / e of
        // rounding.
        for (int column = 0; column < 3; ++column)
            EXPECT_LT(glm::length(a.hessian[column] - b.hessian[column]), 1e-4) << column;
    }
    EXPECT_NEAR(field->typical_slope(0.0), 1.0, 1e-12);
    EXPECT_EQ(field->typical_slope(0.05), 0.0) << "nowhere is deeper than 2 cm";
    EXPECT_NO_THROW(require_field("field", *field));
}

TEST(FunctionField, AThinPlateHasATypicalSlope) {
    // 1 mm thick between the points of any lattice over its bounds.
    const FunctionFieldSettings settings{{Vec3(-0.1), Vec3(0.1)}, 2.0, 1.0, nullptr};
    const auto field = make_function_field(
        "field",
        [](const Vec3& p) -> std::optional<FunctionSample> {
            const double z = p.z - 0.0031;
            return FunctionSample{2.0 * (0.0005 - std::abs(z)),
                                  Vec3(0.0, 0.0, z > 0.0 ? -2.0 : 2.0)};
        },
        settings);
    EXPECT_NEAR(field->typical_slope(0.0), 2.0, 1e-12);
}

TEST(FunctionField, WhereThereIsNoValueNothingIsFelt) {
    const auto failures = std::make_shared<std::atomic<std::uint64_t>>(0);
    const auto has_failed = std::make_shared<bool>(false);
    const FunctionFieldSettings settings{{Vec3(-0.03), Vec3(0.03)}, 1.0, 0.02, failures};
    const auto field = make_function_field(
        "field",
        [has_failed](const Vec3& p) -> std::optional<FunctionSample> {
            if (p.x < 0.0) return std::nullopt;
            const double r = glm::length(p);
            return FunctionSample{*has_failed ? kNan : 0.02 - r, r > 0.0 ? -p / r : Vec3(0.0)};
        },
        settings);
    const auto sampler = field->make_sampler();
    EXPECT_FALSE(sampler->sample(Vec3(-0.01, 0.0, 0.0)).valid);
    EXPECT_LT(sampler->value(Vec3(-0.01, 0.0, 0.0)), -0.03) << "below all values within the bounds";
    EXPECT_FALSE(sampler->first_root(Vec3(-0.03, 0.0, 0.0), Vec3(-0.001, 0.0, 0.0), 0.0));
    EXPECT_TRUE(sampler->first_root(Vec3(0.03, 0.0, 0.0), Vec3(0.001, 0.0, 0.0), 0.0));
    EXPECT_FALSE(sampler->sample(Vec3(kNan)).valid);
    EXPECT_EQ(sampler->first_root(Vec3(kNan), Vec3(0.0), 0.0), 0.0) << "it leads nowhere";
    EXPECT_EQ(failures->load(), 0u);
    *has_failed = true;
    EXPECT_FALSE(sampler->sample(Vec3(0.01, 0.0, 0.0)).valid);
    EXPECT_FALSE(sampler->first_root(Vec3(0.03, 0.0, 0.0), Vec3(0.001, 0.0, 0.0), 0.0));
    EXPECT_GT(failures->load(), 1u);
}

TEST(FunctionField, VectorsHaveTheirDerivative) {
    const FunctionFieldSettings settings{{Vec3(-0.03), Vec3(0.03)}, 0.0, 0.02, nullptr};
    const auto field = make_function_field(
        "field",
        [](const Vec3& p) -> std::optional<Vec3> {
            if (p.z > 0.02) return std::nullopt;
            return Vec3(-3.0 * p.y, 3.0 * p.x, 1.0);
        },
        settings);
    const auto sampler = field->make_sampler();
    const VectorSample sample = sampler->sample(Vec3(0.01, 0.02, 0.0));
    EXPECT_TRUE(sample.valid);
    EXPECT_EQ(sample.value, Vec3(-0.06, 0.03, 1.0));
    EXPECT_NEAR(curl(sample.derivative).z, 6.0, 1e-9) << "1e-17 of rounding over 20 um";
    EXPECT_FALSE(sampler->sample(Vec3(0.0, 0.0, 0.021)).valid);
    EXPECT_FALSE(sampler->sample(Vec3(kNan)).valid);
}

TEST(FunctionField, WhatItCannotBeIsRefusedByItsName) {
    const auto complaint = [](const FunctionFieldSettings& settings, const ScalarFunction& what) {
        try {
            make_function_field("volumes[\"own\"].scalar_field", what, settings);
        } catch (const std::invalid_argument& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    const Shape good = ball();
    const ScalarFunction function = function_of(good.field);
    EXPECT_EQ(complaint(good.settings, function), "");
    FunctionFieldSettings settings = good.settings;
    settings.steepest_per_m = 0.99;
    EXPECT_NE(complaint(settings, function).find("scalar_field: steepest_per_m = 0.99, and the "),
              std::string::npos);
    settings = good.settings;
    settings.feature_size_m = -1.0;
    EXPECT_NE(complaint(settings, function).find("scalar_field: feature_size_m = -1"),
              std::string::npos);
    settings = good.settings;
    settings.bounds.upper.y = kNan;
    EXPECT_NE(complaint(settings, function).find("scalar_field: bounds have no volume"),
              std::string::npos);
    EXPECT_NE(complaint(good.settings,
                        [](const Vec3&) {
                            return FunctionSample{kNan, Vec3(0.0)};
                        })
                  .find("its function is not finite at (-0.03, "),
              std::string::npos);
    EXPECT_NE(complaint(good.settings, [](const Vec3&) { return std::optional<FunctionSample>(); })
                  .find("no value anywhere"),
              std::string::npos);
}

} // namespace
} // namespace palpate
