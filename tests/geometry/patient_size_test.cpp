// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/patient_size.h>

#include <limits>

#include <gtest/gtest.h>

namespace palpate {
namespace {

AffineTransform grid(double i, double j, double k, const Vec3& origin = Vec3(0.0)) {
    return {Mat3(i, 0, 0, 0, j, 0, 0, 0, k), origin};
}

TEST(PatientSize, WhatIsMeasuredIsPlausible) {
    EXPECT_FALSE(implausible_grid({512, 512, 700}, grid(4e-4, 4e-4, 1e-3, {-0.2, -0.1, -1.5})));
    EXPECT_FALSE(implausible_grid({2000, 2000, 100}, grid(1e-7, 1e-7, 5e-7))) << "a microscope";
    EXPECT_FALSE(implausible_grid({2, 2, 2}, grid(2e-8, 2e-8, 2e-8))) << "the bound itself";
    EXPECT_FALSE(implausible_grid({101, 1, 1}, grid(1.0, 1.0, 1.0))) << "the bounds themselves";
    EXPECT_FALSE(implausible_bounds({{-1, -1, 0}, {1, 1, 2}}));
    EXPECT_FALSE(implausible_bounds(Box{}));
}

TEST(PatientSize, WhatNoPatientHasIsSaidWithItsPart) {
    using Part = Implausible::Part;
    const double infinite = std::numeric_limits<double>::infinity();
    for (const AffineTransform& wrong :
         {grid(1e-33, 1e-3, 1e-3), grid(1.9e-8, 1e-5, 1e-5), grid(1e-12, 1e-3, 1e6),
          grid(1e-7, 1e-3, 1e-2), grid(2.0, 1.0, 1.0), grid(infinite, 1, 1)}) {
        const auto found = implausible_grid({4, 4, 4}, wrong);
        ASSERT_TRUE(found);
        EXPECT_EQ(found->part, Part::spacing) << found->what;
    }
    const auto large = implausible_grid({1000, 4, 4}, grid(0.5, 0.5, 0.5));
    ASSERT_TRUE(large);
    EXPECT_NE(large->what.find("at most 100 m"), std::string::npos) << large->what;
    for (const double place : {1e15, -2e3, std::numeric_limits<double>::quiet_NaN()}) {
        const auto far = implausible_grid({4, 4, 4}, grid(1e-3, 1e-3, 1e-3, {place, 0, 0}));
        ASSERT_TRUE(far) << place;
        if (std::isfinite(place)) {
            EXPECT_EQ(far->part, Part::place) << far->what;
        }
    }
    EXPECT_TRUE(implausible_bounds({{0, 0, 0}, {1e6, 1, 1}}));
    EXPECT_TRUE(implausible_bounds({{5e3, 0, 0}, {5e3, 1, 1}}));
}

} // namespace
} // namespace palpate
