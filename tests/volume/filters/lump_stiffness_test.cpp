// SPDX-License-Identifier: Apache-2.0
// The closed kernel of what a lump adds, and its sums over voxels (docs/palpation.md).
#include <palpate/volume/filters/lump_stiffness.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace palpate {
namespace {

constexpr double kMm = 1e-3;
constexpr double kContact = 4.0 * kMm;
constexpr double kPi = std::numbers::pi;
const Vec3 kDown{0.0, 0.0, 1.0};

/// Midpoint sum of the kernel over a ball, its centre at depth `z` and `aside`, m.
double share_of_ball(double radius, double z, double aside, int cells) {
    const double h = 2.0 * radius / cells;
    double sum = 0.0;
    for (int k = 0; k < cells; ++k)
        for (int j = 0; j < cells; ++j)
            for (int i = 0; i < cells; ++i) {
                const Vec3 p = Vec3{-radius} + h * (Vec3(i, j, k) + 0.5);
                if (glm::dot(p, p) > radius * radius) continue;
                const double x = p.x + aside;
                sum += contact_energy_share(z + p.z, x * x + p.y * p.y, kContact);
            }
    return sum * h * h * h;
}

/// Voxels of 1 inside of a ball around `centre`, m, on a lattice of `spacing`, m.
LabelVolume ball_of_voxels(const Vec3& centre, double radius, const Vec3& spacing) {
    LabelVolume volume;
    volume.index_to_scene.linear = Mat3(0.0);
    for (int axis = 0; axis < 3; ++axis) {
        volume.size[static_cast<std::size_t>(axis)] =
            static_cast<int>(std::ceil(2.0 * radius / spacing[axis])) + 3;
        volume.index_to_scene.linear[axis][axis] = spacing[axis];
    }
    volume.index_to_scene.offset = centre - Vec3{radius} - 1.3 * spacing;
    volume.layers.resize(1);
    for (int k = 0; k < volume.size[2]; ++k)
        for (int j = 0; j < volume.size[1]; ++j)
            for (int i = 0; i < volume.size[0]; ++i)
                volume.layers[0].push_back(
                    glm::length(volume.index_to_scene.point({i, j, k}) - centre) <= radius ? 1 : 0);
    match_labels_to_voxels(volume);
    return volume;
}

InclusionSum sum_of(const LabelVolume& volume, double ratio, double contact = kContact) {
    const std::vector<Inclusion> inclusions{{{0}, ratio}};
    return {volume, inclusions, contact};
}

// ---- the kernel --------------------------------------------------------------------------------

// In cylinders, with steps that grow outwards: the integrand is smooth, and what lies beyond 60 a
// is 4 a / (pi 60 a) = 2 %, known in closed form for a half ball.
TEST(ContactKernel, IntegratesToOneOverTheHalfSpace) {
    for (const double a : {1.0 * kMm, 4.0 * kMm, 15.0 * kMm}) {
        const int angles = 200, radii = 4000;
        double sum = 0.0;
        for (int n = 0; n < radii; ++n) {
            const double u = 0.5 * kPi * (n + 0.5) / radii, rho = a * std::tan(u);
            const double drho = a / (std::cos(u) * std::cos(u)) * 0.5 * kPi / radii;
            for (int m = 0; m < angles; ++m) {
                const double angle = 0.5 * kPi * (m + 0.5) / angles;
                const double z = rho * std::cos(angle), r = rho * std::sin(angle);
                sum += contact_energy_share(z, r * r, a) * 2.0 * kPi * r * rho * drho * 0.5 * kPi /
                       angles;
            }
        }
        EXPECT_NEAR(sum, 1.0, 1e-4) << a; // midpoints: (pi/2 / 200)^2
    }
}

TEST(ContactKernel, IsZeroOutsideOfTheTissueAndAPointLoadsEnergyFarAway) {
    EXPECT_EQ(contact_energy_share(0.0, 0.0, kContact), 0.0);
    EXPECT_EQ(contact_energy_share(-3e-3, 1e-6, kContact), 0.0);
    // Energy density of a point load over F^2 / (2 K), K = 2 a E / (1 - 1/4): what it is a share
    // of.
    const double z = 0.3, r = 0.4, far = z * z + r * r;
    const double point_load = 9.0 * z * z / (8.0 * kPi * kPi * far * far * far); // F^2 / E
    const double all = 0.5 * 0.75 / (2.0 * kContact);                            // F^2 / E
    EXPECT_NEAR(contact_energy_share(z, r * r, kContact) / (point_load / all), 1.0, 2e-4);
}

TEST(ContactKernel, AnInclusionCountsAsEshelbysSphere) {
    EXPECT_EQ(inclusion_factor(1.0), 0.0);
    EXPECT_NEAR(inclusion_factor(10.0), 45.0 / 23.0, 1e-15);
    EXPECT_NEAR(inclusion_factor(1e12), 2.5, 1e-10);
    EXPECT_NEAR(inclusion_factor(1e-12), -5.0 / 3.0, 1e-10);
}

struct Case {
    double top_mm, radius_mm, ratio, aside_mm, k;
};

// The column "kernel" of the table in docs/palpation.md, which scripts/fe_lump.py makes by another
// quadrature; off the axis the published numbers have three digits.
TEST(ContactKernel, OfLumpsIsWhatTheTableSays) {
    for (const Case& c : {Case{5, 5, 10, 0, 1.210},
                          {2, 5, 10, 0, 1.575},
                          {10, 5, 10, 0, 1.047},
                          {5, 2.5, 10, 0, 1.064},
                          {5, 7.5, 10, 0, 1.352},
                          {5, 5, 2, 0, 1.077},
                          {5, 5, 100, 0, 1.262},
                          {3, 3, 10, 0, 1.202},
                          {5, 5, 10, 3, 1.167},
                          {5, 5, 10, 6, 1.091},
                          {5, 5, 10, 9, 1.040},
                          {5, 5, 10, 12, 1.017}}) {
        const double share =
            share_of_ball(c.radius_mm * kMm, (c.top_mm + c.radius_mm) * kMm, c.aside_mm * kMm, 80);
        const double gain = inclusion_factor(c.ratio) * share;
        EXPECT_NEAR(gain, c.k - 1.0, 0.02 * (c.k - 1.0) + 5e-4)
            << c.top_mm << " " << c.radius_mm << " " << c.ratio << " " << c.aside_mm;
    }
}

// ---- sums over voxels --------------------------------------------------------------------------

TEST(InclusionSum, OfTissueLikeTheOneAroundItIsNothingToTheBit) {
    const LabelVolume volume = ball_of_voxels({0, 0, 10e-3}, 5e-3, Vec3{1e-3});
    EXPECT_EQ(sum_of(volume, 1.0).gain({0, 0, 0}, kDown), 0.0);
    EXPECT_TRUE(sum_of(volume, 1.0).bounds().empty());
}

/// Midpoints of 6 x 6 x 6 pieces of each voxel of a label.
double integral_over_voxels(const LabelVolume& volume) {
    constexpr int pieces = 6;
    const double piece_m3 =
        std::abs(glm::determinant(volume.index_to_scene.linear)) / (pieces * pieces * pieces);
    double sum = 0.0;
    for (int k = 0; k < volume.size[2]; ++k)
        for (int j = 0; j < volume.size[1]; ++j)
            for (int i = 0; i < volume.size[0]; ++i) {
                const auto voxel =
                    static_cast<std::size_t>(i + volume.size[0] * (j + volume.size[1] * k));
                if (volume.layers[0][voxel] != 1) continue;
                for (int n = 0; n < pieces * pieces * pieces; ++n) {
                    const Vec3 piece =
                        (Vec3(n % pieces, n / pieces % pieces, n / (pieces * pieces)) + 0.5) /
                        static_cast<double>(pieces);
                    const Vec3 p = volume.index_to_scene.point(Vec3(i, j, k) + piece - 0.5);
                    sum += contact_energy_share(p.z, p.x * p.x + p.y * p.y, kContact);
                }
            }
    return sum * piece_m3;
}

// Pieces of a quarter of the contact leave some (1 mm)^2 / 24 times the kernel's Laplacian over the
// kernel, 8 / (7 mm)^2 for the nearest voxels: below 1 %. Parts add what the next test allows.
TEST(InclusionSum, OfVoxelsIsTheIntegralOverThem) {
    for (const Vec3& spacing : {Vec3{0.5e-3}, Vec3{1e-3}, Vec3{2e-3}, Vec3{0.7e-3, 1.1e-3, 3e-3}})
        for (const double aside : {0.0, 6e-3}) {
            const LabelVolume volume = ball_of_voxels({aside, 0, 10e-3}, 5e-3, spacing);
            const double wanted = inclusion_factor(10.0) * integral_over_voxels(volume);
            EXPECT_NEAR(sum_of(volume, 10.0).gain({0, 0, 0}, kDown), wanted, 0.015 * wanted)
                << spacing.x << " " << spacing.z;
            EXPECT_GT(wanted, 0.08);
        }
}

// Parts that count as one point leave out what lump_stiffness.cpp says: 2 %, and no more than 5e-5
// of the surface's stiffness where little is added.
TEST(InclusionSum, OfPartsIsThatOfAllPointsOneByOne) {
    SCOPED_TRACE("seed 7");
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const LabelVolume volume = ball_of_voxels({0, 0, 30e-3}, 15e-3, Vec3{1e-3});
    const InclusionSum sum = sum_of(volume, 10.0);
    double largest = 0.0;
    for (int i = 0; i < 500; ++i) {
        const double x = unit(random), y = unit(random), z = unit(random);
        const Vec3 point{60e-3 * x, 60e-3 * y, 12e-3 * z};
        const Vec3 inward = glm::normalize(Vec3{0.5 * y, 0.5 * z, 1.0 + 0.5 * x});
        const double one_by_one = sum.gain_point_by_point(point, inward);
        EXPECT_NEAR(sum.gain(point, inward), one_by_one, 0.02 * one_by_one + 5e-5);
        largest = std::max(largest, one_by_one);
    }
    EXPECT_GT(largest, 0.1);
}

TEST(InclusionSum, BeyondItsReachAddsLess) {
    const LabelVolume volume = ball_of_voxels({0, 0, 10e-3}, 5e-3, Vec3{1e-3});
    const InclusionSum sum = sum_of(volume, 10.0);
    const double reach = sum.reach_m(1e-3);
    EXPECT_LT(sum.gain({0, 0, sum.bounds().lower.z - reach}, kDown), 1e-3);
    EXPECT_GT(reach, 10e-3);
    EXPECT_LT(reach, 60e-3);
}

TEST(InclusionSum, SeveralLumpsAddUp) {
    LabelVolume volume = ball_of_voxels({0, 0, 10e-3}, 5e-3, Vec3{1e-3});
    const double whole = sum_of(volume, 10.0).gain({1e-3, 0, 0}, kDown);
    for (std::size_t i = 0; i < volume.voxels(); i += 2)
        if (volume.layers[0][i] == 1) volume.layers[0][i] = 2;
    volume.labels.clear();
    match_labels_to_voxels(volume);
    const std::vector<Inclusion> halves{{{0}, 10.0}, {{1}, 10.0}};
    // Other parts: within what these leave out.
    EXPECT_NEAR(InclusionSum(volume, halves, kContact).gain({1e-3, 0, 0}, kDown), whole,
                0.01 * whole);
}

TEST(InclusionSum, RefusesRatiosAndContactsThatAreNotAboveZero) {
    const LabelVolume volume = ball_of_voxels({0, 0, 10e-3}, 5e-3, Vec3{2e-3});
    EXPECT_THROW(sum_of(volume, 0.0), std::invalid_argument);
    EXPECT_THROW(sum_of(volume, -2.0), std::invalid_argument);
    EXPECT_THROW(sum_of(volume, 2.0, 0.0), std::invalid_argument);
    const std::vector<Inclusion> unknown{{{3}, 2.0}};
    EXPECT_THROW(InclusionSum(volume, unknown, kContact), std::invalid_argument);
}

// 2000 pieces along each side of a voxel: their number in one voxel would not fit into an int.
TEST(InclusionSum, RefusesMorePiecesThanMemoryHolds) {
    const LabelVolume volume = ball_of_voxels({0, 0, 10e-3}, 5e-3, Vec3{5e-3});
    try {
        sum_of(volume, 10.0, 1e-5);
        FAIL() << "accepted";
    } catch (const std::invalid_argument& error) {
        const std::string message = error.what();
        EXPECT_NE(message.find("more than 20,000,000 pieces"), std::string::npos) << message;
        EXPECT_NE(message.find("; give a larger contact radius"), std::string::npos) << message;
    }
}

} // namespace
} // namespace palpate
