// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/filters/label_filters.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/volume/filters/volume_filters.h>

#include "tests/support/label_gaps.h"
#include "tests/support/made_labels.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::gaps_between;
using test::LabelGaps;
using test::LabelSurface;
using test::made_labels;
using test::oblique_frame;
using test::quantile;
using test::sheared_frame;
using test::smoothed_label;
using test::Smoothing;

constexpr double kMm = 1e-3;
constexpr double kPi = 3.14159265358979323846;
constexpr double kAllowedGap = 0.5; // voxels

const AffineTransform kFrame{Mat3(kMm), Vec3(0.0)};
const Vec3 kMiddle(15.3, 15.4, 15.2); // off the grid in every direction
constexpr double kRadius = 11.0;

LabelVolume halves_of_a_ball() {
    const Vec3 across = glm::normalize(Vec3(0.9, 0.4, 0.2));
    return made_labels({31, 31, 31}, kFrame, 2, [=](const Vec3& p) {
        if (glm::length(p - kMiddle) > kRadius) return 0;
        return glm::dot(p - kMiddle, across) < 0.0 ? 1 : 2;
    });
}

LabelVolume sectors_of_a_ball() {
    return made_labels({31, 31, 31}, kFrame, 3, [](const Vec3& p) {
        const Vec3 d = p - kMiddle;
        if (glm::length(d) > kRadius) return 0;
        return 1 + std::min(2, static_cast<int>((std::atan2(d.y, d.x) + kPi) / (2 * kPi / 3)));
    });
}

/// Bodies 1 and 3 of 11 x 17 x 17 voxels with a sheet 2 of one voxel between them.
LabelVolume sheet_between_bodies() {
    return made_labels({31, 25, 25}, kFrame, 3, [](const Vec3& p) {
        if (p.x < 4 || p.x > 26 || p.y < 4 || p.y > 20 || p.z < 4 || p.z > 20) return 0;
        return p.x < 15 ? 1 : p.x < 16 ? 2 : 3;
    });
}

/// The formula of the header, every label smoothed as a whole on the occupancy's own grid.
VoxelVolume by_definition(const LabelVolume& volume, std::size_t chosen, double sigma, int margin) {
    const VoxelVolume occupancy = label_occupancy(volume, std::vector<std::size_t>{chosen}, margin);
    const Vec3 corner =
        volume.index_to_scene.inverse().point(occupancy.index_to_scene.point(Vec3(0.0)));
    std::map<int, VoxelVolume> fields; // by value, the background too
    for (int value = 0; value <= static_cast<int>(volume.labels.size()); ++value) {
        VoxelVolume field = padded(occupancy, margin, 0.0F);
        for (int k = 0; k < field.size[2]; ++k)
            for (int j = 0; j < field.size[1]; ++j)
                for (int i = 0; i < field.size[0]; ++i) {
                    const Vec3 at = glm::round(corner) + Vec3(i - margin, j - margin, k - margin);
                    int here = 0;
                    if (glm::all(glm::greaterThanEqual(at, Vec3(0.0))) && at.x < volume.size[0] &&
                        at.y < volume.size[1] && at.z < volume.size[2])
                        here = volume.layers[0][static_cast<std::size_t>(
                            at.x + volume.size[0] * (at.y + volume.size[1] * at.z))];
                    field.values[field.index(i, j, k)] = here == value ? 1.0F : 0.0F;
                }
        smooth(field, sigma);
        fields[value] = field;
    }
    VoxelVolume result = occupancy;
    for (int k = 0; k < result.size[2]; ++k)
        for (int j = 0; j < result.size[1]; ++j)
            for (int i = 0; i < result.size[0]; ++i) {
                double own = 0.0, powers = 0.0;
                for (const auto& [value, field] : fields) {
                    const double f = field.at(i + margin, j + margin, k + margin);
                    if (value == volume.labels[chosen].value)
                        own = f;
                    else
                        powers += std::pow(f, 4.0);
                }
                result.values[result.index(i, j, k)] =
                    static_cast<float>(own > 0.0 ? own / (own + std::pow(powers, 0.25)) : 0.0);
            }
    return result;
}

TEST(SmoothAgainstNeighbours, IsWhatItsFormulaSays) {
    SCOPED_TRACE("seed 41");
    std::mt19937 random(41);
    std::uniform_real_distribution<double> uniform(0.0, 16.0);
    std::vector<Vec3> sites;
    for (int n = 0; n < 12; ++n)
        sites.emplace_back(uniform(random), uniform(random), uniform(random));
    const LabelVolume volume = made_labels({17, 15, 16}, sheared_frame(kMm), 8, [&](const Vec3& p) {
        const auto nearest =
            std::min_element(sites.begin(), sites.end(), [&](const Vec3& a, const Vec3& b) {
                return glm::length(a - p) < glm::length(b - p);
            });
        const auto site = static_cast<int>(nearest - sites.begin());
        return site < 8 ? site + 1 : 0; // the rest is background
    });
    for (const auto& [sigma, labels] :
         std::vector<std::pair<double, std::vector<std::size_t>>>{{0.7, {0, 3}}, {1.5, {5}}}) {
        const int margin = static_cast<int>(std::ceil(4.0 * sigma)) + 2;
        for (const std::size_t label : labels) {
            const std::vector<std::size_t> chosen{label};
            const VoxelVolume expected = by_definition(volume, label, sigma, margin);
            const VoxelVolume found = smooth_against_neighbours(
                volume, chosen, label_occupancy(volume, chosen, margin), sigma);
            ASSERT_EQ(found.size, expected.size);
            for (std::size_t n = 0; n < found.values.size(); ++n)
                // A kernel that is cut at 1e-4 of its weight; where all are that small, at the far
                // border, their ratio is nothing but that.
                if (expected.values[n] > 0.05F || found.values[n] > 0.05F) {
                    EXPECT_NEAR(found.values[n], expected.values[n], 2e-3);
                }
        }
    }
}

TEST(SmoothAgainstNeighbours, IsThePlainGaussianWhereThereIsNothingButBackground) {
    const LabelVolume volume = made_labels({31, 31, 31}, kFrame, 1, [](const Vec3& p) {
        return glm::length(p - kMiddle) < kRadius ? 1 : 0;
    });
    const std::vector<std::size_t> chosen{0};
    const VoxelVolume occupancy = label_occupancy(volume, chosen, 6);
    VoxelVolume gaussian = occupancy;
    smooth(gaussian, 1.0);
    const VoxelVolume found = smooth_against_neighbours(volume, chosen, occupancy, 1.0);
    for (std::size_t n = 0; n < found.values.size(); ++n)
        EXPECT_NEAR(found.values[n], gaussian.values[n], 1e-6); // float rounding
    EXPECT_EQ(smooth_against_neighbours(volume, chosen, occupancy, 0.0).values, occupancy.values);
}

TEST(SmoothAgainstNeighbours, TakesPartOfAnOccupancyAndSeveralLabelsAndLayers) {
    LabelVolume volume = sectors_of_a_ball();
    const std::vector<std::size_t> both{0, 1};
    const VoxelVolume whole =
        smooth_against_neighbours(volume, both, label_occupancy(volume, both, 6), 1.0);
    // Two labels as one: in the middle of the face between them nothing stands against them.
    const Vec3 between = whole.index_to_scene.inverse().point(
        kFrame.point(kMiddle + 5.0 * Vec3(std::cos(-kPi / 3), std::sin(-kPi / 3), 0.0)));
    const auto at = glm::round(between);
    EXPECT_GT(whole.at(static_cast<int>(at.x), static_cast<int>(at.y), static_cast<int>(at.z)),
              0.99F);

    // A segment in a layer of its own that lies inside the ball: the others are no neighbours.
    volume.layers.push_back(volume.layers[0]);
    for (std::int32_t& value : volume.layers[1])
        value = value == 0 ? 0 : 9;
    Label ball;
    ball.name = "ball";
    ball.value = 9;
    ball.layer = 1;
    volume.labels.push_back(ball);
    const std::vector<std::size_t> overlapping{3};
    const VoxelVolume occupancy = label_occupancy(volume, overlapping, 6);
    VoxelVolume gaussian = occupancy;
    smooth(gaussian, 1.0);
    const VoxelVolume found = smooth_against_neighbours(volume, overlapping, occupancy, 1.0);
    for (std::size_t n = 0; n < found.values.size(); ++n)
        EXPECT_NEAR(found.values[n], gaussian.values[n], 1e-6);

    // A part of an occupancy, with free space where it was cut.
    VoxelVolume part = label_occupancy(volume, std::vector<std::size_t>{0}, 0);
    part.index_to_scene.offset = part.index_to_scene.point(Vec3(0, 0, 3));
    const std::size_t slice = part.voxels() / static_cast<std::size_t>(part.size[2]);
    part.values.erase(part.values.begin(),
                      part.values.begin() + static_cast<std::ptrdiff_t>(3 * slice));
    part.size[2] -= 3;
    EXPECT_NO_THROW(
        smooth_against_neighbours(volume, std::vector<std::size_t>{0}, padded(part, 6, 0.0F), 1.0));
}

TEST(SmoothAgainstNeighbours, RefusesAnOccupancyOfOtherVoxels) {
    const LabelVolume volume = halves_of_a_ball();
    const std::vector<std::size_t> chosen{0};
    const VoxelVolume good = label_occupancy(volume, chosen, 6);
    VoxelVolume shifted = good;
    shifted.index_to_scene.offset.x += 0.3 * kMm;
    EXPECT_THROW(smooth_against_neighbours(volume, chosen, shifted, 1.0), std::invalid_argument);
    VoxelVolume coarser = good;
    coarser.index_to_scene.linear = 1.5 * coarser.index_to_scene.linear;
    EXPECT_THROW(smooth_against_neighbours(volume, chosen, coarser, 1.0), std::invalid_argument);
    VoxelVolume turned = good; // j and k exchanged
    std::swap(turned.index_to_scene.linear[1], turned.index_to_scene.linear[2]);
    std::swap(turned.size[1], turned.size[2]);
    EXPECT_THROW(smooth_against_neighbours(volume, chosen, turned, 1.0), std::invalid_argument);
    EXPECT_THROW(smooth_against_neighbours(volume, chosen, good, -1.0), std::invalid_argument);
    const std::vector<std::size_t> wrong{7};
    EXPECT_THROW(smooth_against_neighbours(volume, wrong, good, 1.0), std::invalid_argument);
    LabelVolume hollow = volume;
    hollow.layers[0].pop_back();
    EXPECT_THROW(smooth_against_neighbours(hollow, chosen, good, 1.0), std::invalid_argument);
}

// --- gaps ----------------------------------------------------------------------------------------
//
// Where only labels meet, no gap is wider than half a voxel. At the rim, where the background is a
// voxel away, each label is rounded off and the background takes the groove between them; that is
// no matter of these tests.

struct TouchingLabels {
    double largest_gap = -10.0;  ///< where only labels are near, voxels
    double wide_rim_share = 0.0; ///< of the rim's gaps, those that are wider than allowed
};

TouchingLabels touching(const LabelVolume& volume, double sigma, Smoothing smoothing) {
    std::vector<LabelSurface> surfaces;
    for (std::size_t label = 0; label < volume.labels.size(); ++label)
        surfaces.push_back(smoothed_label(volume, label, sigma, smoothing));
    const int near = static_cast<int>(std::ceil(sigma));
    TouchingLabels result;
    double rim = 0.0, wide = 0.0;
    for (std::size_t a = 0; a < surfaces.size(); ++a)
        for (std::size_t b = a + 1; b < surfaces.size(); ++b) {
            const LabelGaps gaps = gaps_between(volume, a, b, surfaces[a], surfaces[b], near);
            for (const auto* distances : {&gaps.between_two, &gaps.near_third})
                if (!distances->empty())
                    result.largest_gap = std::max(result.largest_gap, distances->back());
            for (const double gap : gaps.near_background) {
                rim += 1.0;
                wide += gap > kAllowedGap ? 1.0 : 0.0;
            }
        }
    EXPECT_GT(result.largest_gap, -10.0) << "no point where only labels are near";
    result.wide_rim_share = wide / rim;
    return result;
}

void expect_volumes_kept(const LabelVolume& volume, double sigma) {
    const auto extents = label_extents(volume);
    for (std::size_t label = 0; label < volume.labels.size(); ++label) {
        const LabelSurface surface = smoothed_label(volume, label, sigma);
        const double wanted = 1e-9 * extents[label].volume_mm3;
        EXPECT_NEAR(volume_above(surface.field, surface.level), wanted, 1e-4 * wanted);
    }
}

TEST(SmoothAgainstNeighbours, HalvesOfABallKeepTouchingAndTheirVolume) {
    const LabelVolume volume = halves_of_a_ball();
    for (const double sigma : {0.7, 1.0, 1.5}) {
        EXPECT_LE(touching(volume, sigma, Smoothing::against_neighbours).largest_gap, kAllowedGap)
            << sigma;
        expect_volumes_kept(volume, sigma);
    }
    // Of two alone the Gaussian makes no gap either, but the groove at their rim is less often
    // wide.
    const auto rim = touching(volume, 1.0, Smoothing::against_neighbours).wide_rim_share;
    EXPECT_LT(rim, 0.5 * touching(volume, 1.0, Smoothing::plain_gaussian).wide_rim_share);
}

TEST(SmoothAgainstNeighbours, SectorsKeepTouchingAtTheEdgeWhereThreeMeet) {
    const LabelVolume volume = sectors_of_a_ball();
    for (const double sigma : {0.7, 1.0, 1.5}) {
        EXPECT_LE(touching(volume, sigma, Smoothing::against_neighbours).largest_gap, kAllowedGap)
            << sigma;
        expect_volumes_kept(volume, sigma);
    }
    for (const double sigma : {1.0, 1.5})
        EXPECT_GT(touching(volume, sigma, Smoothing::plain_gaussian).largest_gap, 2.0 * kAllowedGap)
            << sigma;
}

TEST(SmoothAgainstNeighbours, ASheetBetweenTwoBodiesStays) {
    const LabelVolume volume = sheet_between_bodies();
    for (const double sigma : {0.7, 1.0, 1.5}) {
        EXPECT_LE(touching(volume, sigma, Smoothing::against_neighbours).largest_gap, kAllowedGap)
            << sigma;
        expect_volumes_kept(volume, sigma);
    }
    // At one half, the middle of the Gaussian's sheet is gone, and that of the other is there.
    const std::vector<std::size_t> sheet{1};
    const VoxelVolume occupancy = label_occupancy(volume, sheet, 6);
    VoxelVolume gaussian = occupancy;
    smooth(gaussian, 1.0);
    const VoxelVolume smoothed = smooth_against_neighbours(volume, sheet, occupancy, 1.0);
    EXPECT_GE(thin_parts(occupancy, gaussian, 0.5).front().voxels, 13U * 13U);
    for (const ThinPart& part : thin_parts(occupancy, smoothed, 0.5)) // its rim, at the most
        EXPECT_LE(part.voxels, 4U * 17U * 2U);
    const int middle = 6 + 8;
    EXPECT_LT(gaussian.at(6, middle, middle), 0.5F);
    EXPECT_GT(smoothed.at(6, middle, middle), 0.5F);
}

} // namespace
} // namespace palpate
