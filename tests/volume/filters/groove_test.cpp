// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/filters/label_filters.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/label_gaps.h"
#include "tests/support/made_labels.h"

// What is left of the groove between labels that touch.
namespace palpate {
namespace {

using test::LabelSurface;
using test::made_labels;
using test::smoothed_label;

constexpr double kMm = 1e-3;
constexpr double kSigma = 1.0; // voxels
constexpr double kPi = 3.14159265358979323846;
// Each label is smoothed on a grid of its own, with a kernel that is cut at 1e-4 of its weight: so
// far may two of them differ where they are to be the same, voxels (a level's slope is about 0.4).
constexpr double kSameSurface = 2e-3;

// Over an edge of three a label ends within a cell whose corners it still has: the kink there is
// interpolated over, and takes a part of a voxel that no groove of a voxel's width comes near.
constexpr double kKinkInACell = 0.05; // voxels

const AffineTransform kFrame{Mat3(kMm), Vec3(0.0)};

/// A label's surface without grooves to all others of the volume, at a level.
LabelSurface joined(const LabelVolume& volume, std::size_t label, double level) {
    std::vector<std::size_t> all;
    for (std::size_t i = 0; i < volume.labels.size(); ++i)
        all.push_back(i);
    const std::vector<std::size_t> own{label};
    const LabelSurface alone = smoothed_label(volume, label, kSigma);
    return {without_grooves(volume, own, all, alone.field, kSigma), level};
}

/// How far along `step` (a voxel) from `from`, in free space, the first of the surfaces is met.
double height(const std::vector<LabelSurface>& surfaces, const Vec3& from, const Vec3& step) {
    constexpr double kStep = 0.02; // voxels
    double nearest = 1e9;
    for (const LabelSurface& surface : surfaces) {
        double before = surface.value(from);
        for (int n = 1; n < 1000; ++n) {
            const double value = surface.value(from + n * kStep * step);
            if (value >= surface.level) {
                const double t = (surface.level - before) / (value - before);
                nearest = std::min(nearest, kStep * (n - 1 + t));
                break;
            }
            before = value;
        }
    }
    return nearest;
}

/// Two halves of one slab, its faces at z = 5.5 and 16.5 voxels, that meet at x = 19.5.
LabelVolume halves_of_a_slab() {
    return made_labels({40, 24, 22}, kFrame, 2, [](const Vec3& p) {
        if (p.x < 4 || p.x > 35 || p.y < 4 || p.y > 19 || p.z < 6 || p.z > 16) return 0;
        return p.x < 20 ? 1 : 2;
    });
}

double unevenness_over_the_border(const std::vector<LabelSurface>& surfaces) {
    double low = 1e9, high = -1e9;
    for (double x = 17.0; x <= 22.0; x += 0.05) {
        const double down = height(surfaces, kMm * Vec3(x, 11.5, 20.0), kMm * Vec3(0, 0, -1));
        low = std::min(low, down);
        high = std::max(high, down);
    }
    return high - low;
}

TEST(WithoutGrooves, TwoHalvesOfASlabHaveOneFlatFace) {
    const LabelVolume volume = halves_of_a_slab();
    const double level = 0.48; // smoothed labels that keep their volume lie at about that
    EXPECT_LT(unevenness_over_the_border({joined(volume, 0, level), joined(volume, 1, level)}),
              kSameSurface);
    // Smoothed each for itself there is a groove.
    const std::vector<LabelSurface> apart{{smoothed_label(volume, 0, kSigma).field, level},
                                          {smoothed_label(volume, 1, kSigma).field, level}};
    EXPECT_GT(unevenness_over_the_border(apart), 0.5);
}

TEST(WithoutGrooves, ThreeSectorsOfABallHaveTheSurfaceOfTheBall) {
    const Vec3 middle(15.3, 15.4, 15.2);
    const auto ball = [&](bool sectors) {
        return made_labels({31, 31, 31}, kFrame, sectors ? 3 : 1, [&](const Vec3& p) {
            const Vec3 d = p - middle;
            if (glm::length(d) > 11.0) return 0;
            if (!sectors) return 1;
            return 1 + std::min(2, static_cast<int>((std::atan2(d.y, d.x) + kPi) / (2 * kPi / 3)));
        });
    };
    const double level = 0.48;
    const LabelVolume thirds = ball(true);
    const std::vector<LabelSurface> sectors{joined(thirds, 0, level), joined(thirds, 1, level),
                                            joined(thirds, 2, level)};
    const std::vector<LabelSurface> whole{{smoothed_label(ball(false), 0, kSigma).field, level}};
    // The pole, where all three meet, and all around it.
    for (double polar = 0.0; polar < 1.6; polar += 0.2)
        for (double around = 0.0; around < 6.2; around += 0.1) {
            const Vec3 inwards = -Vec3(std::sin(polar) * std::cos(around),
                                       std::sin(polar) * std::sin(around), std::cos(polar));
            const Vec3 from = kMm * (middle - 14.0 * inwards);
            EXPECT_NEAR(height(sectors, from, kMm * inwards), height(whole, from, kMm * inwards),
                        kKinkInACell)
                << polar << " " << around;
        }
}

TEST(WithoutGrooves, ALabelReachesAboutASigmaIntoItsNeighbour) {
    const LabelVolume volume = halves_of_a_slab();
    const double level = 0.48;
    const LabelSurface left = joined(volume, 0, level);
    // In the slab's middle the Gaussian itself is the level's share of 0.3 at 1.06 sigma.
    const double over =
        30.0 - 19.5 - height({left}, kMm * Vec3(30.0, 11.5, 11.0), kMm * Vec3(-1, 0, 0));
    EXPECT_NEAR(over, 1.06, 0.1);
}

TEST(WithoutGrooves, ALabelThatTouchesNoOtherKeepsItsBits) {
    const LabelVolume volume = made_labels({40, 16, 16}, kFrame, 2, [](const Vec3& p) {
        if (p.y < 4 || p.y > 11 || p.z < 4 || p.z > 11) return 0;
        return p.x >= 4 && p.x < 10 ? 1 : p.x >= 28 && p.x < 36 ? 2 : 0;
    });
    const LabelSurface alone = smoothed_label(volume, 0, kSigma);
    EXPECT_EQ(joined(volume, 0, alone.level).field.values, alone.field.values);
}

} // namespace
} // namespace palpate
