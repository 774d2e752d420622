// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/filters/label_filters.h>

#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/volume/filters/volume_filters.h>

#include "tests/support/made_labels.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::made_labels;
using test::middle_of;
using test::oblique_frame;
using test::sampled;
using test::sheared_frame;

constexpr double kMm = 1e-3;
constexpr double kPi = 3.14159265358979323846;

/// radius - |x - c|, c a little off the grid.
VoxelVolume ball(const std::array<int, 3>& size, const AffineTransform& frame, double radius) {
    const Vec3 c = middle_of(size, frame) + frame.direction(Vec3(0.11, 0.23, 0.37));
    return sampled(size, frame, [=](const Vec3& p) { return radius - glm::length(p - c); });
}

double ball_volume(double radius) { return 4.0 / 3.0 * kPi * radius * radius * radius; }

/// The trilinear volume above the level by counting points of a fine lattice in every cell.
double counted_volume(const VoxelVolume& v, double level, int per_axis) {
    double count = 0.0;
    for (int k = 0; k + 1 < v.size[2]; ++k)
        for (int j = 0; j + 1 < v.size[1]; ++j)
            for (int i = 0; i + 1 < v.size[0]; ++i)
                for (int n = 0; n < per_axis * per_axis * per_axis; ++n) {
                    const Vec3 t =
                        (Vec3(n % per_axis, n / per_axis % per_axis, n / per_axis / per_axis) +
                         0.5) /
                        static_cast<double>(per_axis);
                    double value = 0.0;
                    for (int corner = 0; corner < 8; ++corner) {
                        const int di = corner & 1, dj = corner >> 1 & 1, dk = corner >> 2;
                        value += (di ? t.x : 1 - t.x) * (dj ? t.y : 1 - t.y) *
                                 (dk ? t.z : 1 - t.z) * v.at(i + di, j + dj, k + dk);
                    }
                    count += value >= level ? 1.0 : 0.0;
                }
    return count / (per_axis * per_axis * per_axis) *
           std::abs(glm::determinant(v.index_to_scene.linear));
}

// --- volume --------------------------------------------------------------------------------------

TEST(VolumeAbove, OfABoxIsExactWhereTheLevelIsFlat) {
    // 5 x 4 x 3 voxels of 1 in 0: the level 0.25 lies a quarter of a voxel from the outer centres
    // but at edges and corners. Along one axis alone it is exact.
    const AffineTransform frame = sheared_frame(kMm);
    VoxelVolume slab = sampled({9, 6, 6}, AffineTransform{}, [](const Vec3& p) {
        return p.x > 2.5 && p.x < 5.5 ? 1.0 : 0.0; // voxels 3, 4, 5
    });
    slab.index_to_scene = frame;
    const double voxel = std::abs(glm::determinant(frame.linear));
    for (const double level : {0.25, 0.5, 0.9}) // 2 + 2 (1 - level) thick, 5 x 5 cells across
        EXPECT_NEAR(volume_above(slab, level), (2.0 + 2.0 * (1.0 - level)) * 25.0 * voxel,
                    1e-12 * 100.0 * voxel);
    EXPECT_NEAR(volume_above(slab, -1.0), 8.0 * 25.0 * voxel, 1e-12 * 200.0 * voxel);
    EXPECT_EQ(volume_above(slab, 1.5), 0.0);
}

TEST(VolumeAbove, EqualsCountingPointsInRandomCells) {
    SCOPED_TRACE("seed 31");
    std::mt19937 random(31);
    std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
    const VoxelVolume volume = sampled({9, 8, 7}, oblique_frame({kMm, 2 * kMm, 3 * kMm}, Vec3(0.0)),
                                       [&](const Vec3&) { return uniform(random); });
    const double cells = 8 * 7 * 6 * std::abs(glm::determinant(volume.index_to_scene.linear));
    for (const double level : {0.3, 0.5, 0.7}) {
        // Sixteen columns a cell err by up to 1/16 where a cell's level is all curves, as here, at
        // random from one of the 336 cells to the next: 1/16/sqrt(336) = 0.0034.
        EXPECT_NEAR(volume_above(volume, level), counted_volume(volume, level, 12), 0.0034 * cells);
    }
}

TEST(VolumeAbove, OfABallIsThatOfItsTrilinearInterpolation) {
    // Between voxel centres the interpolation of a concave function lies below it: the surface is
    // nearer by h^2 / (4 r) on average (h^2 |f''| / 12 along each of three axes, f'' adding up to
    // 2 / r), the volume smaller by 3 h^2 / (4 r^2). The integration adds 1e-3 at 4 voxels.
    for (const double radius : {4.0, 8.0, 12.0}) {
        const int size = 2 * static_cast<int>(radius) + 8;
        const VoxelVolume volume =
            ball({size, size, size}, AffineTransform{Mat3(kMm), Vec3(0.0)}, radius * kMm);
        const double exact = ball_volume(radius * kMm);
        const double expected = exact * (1.0 - 0.75 / (radius * radius) * 2.0 / 3.0);
        EXPECT_NEAR(volume_above(volume, 0.0), expected, (1e-3 + 0.1 / (radius * radius)) * exact);
    }
    const VoxelVolume small = ball({14, 14, 14}, AffineTransform{Mat3(kMm), Vec3(0.0)}, 4 * kMm);
    EXPECT_NEAR(volume_above(small, 0.0), counted_volume(small, 0.0, 16),
                1e-3 * ball_volume(4 * kMm));
}

TEST(VolumeAbove, WhatIsNotFiniteCountsAsTheLowestValue) {
    VoxelVolume volume = ball({20, 20, 20}, AffineTransform{Mat3(kMm), Vec3(0.0)}, 6 * kMm);
    const double whole = volume_above(volume, 0.0);
    float& voxel = volume.values[volume.index(10, 10, 10)];
    voxel = static_cast<float>(value_range(volume)[0]);
    const double without = volume_above(volume, 0.0);
    EXPECT_LT(without, whole);
    EXPECT_GT(without, whole - 8e-9); // eight cells of 1 mm3 have it at a corner
    for (const float value :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
          -std::numeric_limits<float>::infinity()}) {
        voxel = value;
        EXPECT_EQ(volume_above(volume, 0.0), without) << value;
    }
    EXPECT_THROW(volume_above(VoxelVolume{}, 0.0), std::invalid_argument);
}

// --- the level that keeps the volume
// ---------------------------------------------------------------

TEST(LevelKeepingVolume, EnclosesTheVoxelsVolumeToOneInTenThousand) {
    for (const double sigma : {0.5, 1.0, 2.0}) {
        const AffineTransform frame = oblique_frame({kMm, 1.3 * kMm, 0.8 * kMm}, {0.1, 0.2, 0.3});
        const LabelVolume labels = made_labels({30, 28, 26}, frame, 1, [](const Vec3& p) {
            return glm::length((p - Vec3(14, 13, 12)) * Vec3(0.7, 1.0, 1.2)) < 8.0 ? 1 : 0;
        });
        VoxelVolume smoothed = label_occupancy(labels, std::vector<std::size_t>{0}, 10);
        smooth(smoothed, sigma);
        const double wanted = 1e-9 * label_extents(labels)[0].volume_mm3;
        const double level = level_keeping_volume(smoothed, wanted);
        EXPECT_NEAR(volume_above(smoothed, level), wanted, 1e-4 * wanted);
        EXPECT_GT(level, 0.3);
        EXPECT_LT(level, 0.5); // convex: at one half it loses volume
        EXPECT_LT(volume_above(smoothed, 0.5), (1.0 - 1e-3) * wanted);
    }
}

TEST(LevelKeepingVolume, SaysSoWhenThereIsNone) {
    const LabelVolume labels = made_labels({5, 5, 5}, AffineTransform{Mat3(kMm), Vec3(0.0)}, 1,
                                           [](const Vec3&) { return 1; });
    VoxelVolume smoothed = label_occupancy(labels, std::vector<std::size_t>{0}, 8);
    smooth(smoothed, 1.0);
    EXPECT_THROW(level_keeping_volume(smoothed, 1.0), std::runtime_error); // a cubic metre
    EXPECT_THROW(level_keeping_volume(smoothed, 0.0), std::runtime_error);
    EXPECT_THROW(level_keeping_volume(smoothed, -1.0), std::runtime_error);
    EXPECT_THROW(level_keeping_volume(smoothed, std::nan("")), std::runtime_error);
    std::fill(smoothed.values.begin(), smoothed.values.end(), 0.0F);
    EXPECT_THROW(level_keeping_volume(smoothed, 1e-9), std::runtime_error);
}

// --- thin parts
// ------------------------------------------------------------------------------------

/// Voxels that are lost, as the header defines them, by plain search; parts by flood filling a set.
std::vector<std::size_t> sizes_of_lost_parts(const VoxelVolume& occupancy,
                                             const VoxelVolume& smoothed, double level) {
    const auto [ni, nj, nk] = occupancy.size;
    const auto value = [&](const Vec3& p) {
        double sum = 0.0;
        for (int corner = 0; corner < 8; ++corner) {
            const Vec3 base = glm::floor(p);
            const Vec3 at = base + Vec3(corner & 1, corner >> 1 & 1, corner >> 2);
            const Vec3 weight = 1.0 - glm::abs(p - at);
            if (at.x < 0 || at.y < 0 || at.z < 0 || at.x >= ni || at.y >= nj || at.z >= nk)
                continue;
            sum +=
                std::max(0.0, weight.x) * std::max(0.0, weight.y) * std::max(0.0, weight.z) *
                smoothed.at(static_cast<int>(at.x), static_cast<int>(at.y), static_cast<int>(at.z));
        }
        return sum;
    };
    std::set<std::array<int, 3>> lost;
    for (int k = 0; k < nk; ++k)
        for (int j = 0; j < nj; ++j)
            for (int i = 0; i < ni; ++i) {
                bool is_lost = occupancy.at(i, j, k) == 1.0F && smoothed.at(i, j, k) < level;
                for (int n = 0; n < 27 && is_lost; ++n) {
                    const Vec3 d(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
                    if (n != 13 && value(Vec3(i, j, k) + 0.5 * glm::normalize(d)) >= level)
                        is_lost = false;
                }
                if (is_lost) lost.insert({i, j, k});
            }
    std::vector<std::size_t> sizes;
    while (!lost.empty()) {
        std::vector<std::array<int, 3>> part{*lost.begin()};
        lost.erase(lost.begin());
        for (std::size_t n = 0; n < part.size(); ++n)
            for (int d = 0; d < 27; ++d) {
                const auto next = lost.find(
                    {part[n][0] + d % 3 - 1, part[n][1] + d / 3 % 3 - 1, part[n][2] + d / 9 - 1});
                if (next == lost.end()) continue;
                part.push_back(*next);
                lost.erase(next);
            }
        sizes.push_back(part.size());
    }
    std::sort(sizes.rbegin(), sizes.rend());
    return sizes;
}

struct Smoothed {
    VoxelVolume occupancy;
    VoxelVolume smoothed;
};

Smoothed smoothed_label(const LabelVolume& labels, double sigma) {
    Smoothed result;
    result.occupancy = label_occupancy(labels, std::vector<std::size_t>{0}, 8);
    result.smoothed = result.occupancy;
    smooth(result.smoothed, sigma);
    return result;
}

/// A body of 12 x 12 x 12 voxels with a fin of one voxel, 6 x 8, and a rod of one voxel, 7 long.
LabelVolume body_with_fin_and_rod(const AffineTransform& frame) {
    return made_labels({30, 20, 16}, frame, 1, [](const Vec3& p) {
        const bool body = p.x >= 8 && p.x < 20 && p.y >= 2 && p.y < 14 && p.z >= 2 && p.z < 14;
        const bool fin = p.x >= 20 && p.x < 26 && p.y == 8 && p.z >= 4 && p.z < 12;
        const bool rod = p.x >= 1 && p.x < 8 && p.y == 8 && p.z == 8;
        return body || fin || rod ? 1 : 0;
    });
}

TEST(ThinParts, AreTheFinAndTheRodButNotTheRoundedRim) {
    const AffineTransform frame = oblique_frame({kMm, 2 * kMm, 0.5 * kMm}, {0.1, 0, 0});
    const LabelVolume labels = body_with_fin_and_rod(frame);
    const Smoothed label = smoothed_label(labels, 1.0);
    const auto parts = thin_parts(label.occupancy, label.smoothed, 0.5);
    ASSERT_EQ(parts.size(), 2U);
    // The body lifts what is beside it: the fin's first two rows and the rod's first voxel may be
    // within half a voxel of the surface.
    EXPECT_GE(parts[0].voxels, 4U * 8U);
    EXPECT_LE(parts[0].voxels, 6U * 8U);
    EXPECT_GE(parts[1].voxels, 6U);
    EXPECT_LE(parts[1].voxels, 7U);
    EXPECT_NEAR(parts[0].volume_mm3, static_cast<double>(parts[0].voxels), 1e-9); // 1 mm3 each
    const Vec3 in_fin = frame.inverse().point(parts[0].sample);
    const Vec3 in_rod = frame.inverse().point(parts[1].sample);
    EXPECT_LT(glm::length(in_fin - glm::round(in_fin)), 1e-9);
    EXPECT_GT(in_fin.x, 19.5);
    EXPECT_LT(in_rod.x, 7.5);
    // What is smaller than asked for is left out; without smoothing nothing is lost.
    EXPECT_EQ(thin_parts(label.occupancy, label.smoothed, 0.5, 10).size(), 1U);
    EXPECT_TRUE(thin_parts(label.occupancy, label.occupancy, 0.5, 1).empty());
}

TEST(ThinParts, EqualBruteForceOnCrumbs) {
    SCOPED_TRACE("seed 17");
    std::mt19937 random(17);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    const LabelVolume labels = made_labels({16, 14, 12}, sheared_frame(kMm), 1, [&](const Vec3& p) {
        return uniform(random) < 0.25 + 0.04 * p.x ? 1 : 0; // from crumbs to holes
    });
    const Smoothed label = smoothed_label(labels, 0.8);
    for (const double level : {0.4, 0.5, 0.6}) {
        const auto expected = sizes_of_lost_parts(label.occupancy, label.smoothed, level);
        const auto parts = thin_parts(label.occupancy, label.smoothed, level, 1);
        std::vector<std::size_t> sizes;
        for (const ThinPart& part : parts)
            sizes.push_back(part.voxels);
        EXPECT_EQ(sizes, expected);
        EXPECT_GT(expected.size(), 3U);
    }
}

TEST(ThinParts, RefuseVolumesOfDifferentSize) {
    const VoxelVolume a = sampled({5, 5, 5}, AffineTransform{}, [](const Vec3&) { return 0.0; });
    const VoxelVolume b = sampled({5, 5, 6}, AffineTransform{}, [](const Vec3&) { return 0.0; });
    EXPECT_THROW(thin_parts(a, b, 0.5), std::invalid_argument);
    EXPECT_THROW(thin_parts(VoxelVolume{}, VoxelVolume{}, 0.5), std::invalid_argument);
}

} // namespace
} // namespace palpate
