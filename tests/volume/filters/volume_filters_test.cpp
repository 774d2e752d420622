// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/filters/volume_filters.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <limits>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::middle_of;
using test::oblique_frame;
using test::sampled;
using test::sheared_frame;

constexpr double kMm = 1e-3;

bool same_bits(const VoxelNumbers<float>& a, const VoxelNumbers<float>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

// --- padding ---------------------------------------------------------------------------------

TEST(Padded, VoxelsKeepTheirPlacesAndBackgroundSurroundsThem) {
    const auto frame = sheared_frame(kMm);
    const VoxelVolume volume =
        sampled({3, 4, 5}, frame, [](const Vec3& p) { return 1e3 * (p.x + 2 * p.y + 5 * p.z); });
    const VoxelVolume wide = padded(volume, 2, -7.0F);
    EXPECT_EQ(wide.size, (std::array<int, 3>{7, 8, 9}));
    for (int k = 0; k < 9; ++k)
        for (int j = 0; j < 8; ++j)
            for (int i = 0; i < 7; ++i) {
                const bool inside = i >= 2 && i < 5 && j >= 2 && j < 6 && k >= 2 && k < 7;
                EXPECT_EQ(wide.at(i, j, k), inside ? volume.at(i - 2, j - 2, k - 2) : -7.0F);
            }
    const Vec3 before = volume.index_to_scene.point({1, 2, 3});
    const Vec3 after = wide.index_to_scene.point({3, 4, 5});
    EXPECT_LT(glm::length(before - after), 1e-16); // a few roundings of coordinates of 0.03 m
    EXPECT_THROW(padded(volume, -1, 0.0F), std::invalid_argument);
    EXPECT_THROW(padded(VoxelVolume{}, 2, 0.0F), std::invalid_argument);
}

// --- cropping --------------------------------------------------------------------------------

TEST(Cropped, KeepsTheVoxelsOfTheRegionInTheirPlaces) {
    for (const AffineTransform& frame :
         {sheared_frame(kMm), oblique_frame({kMm, 2 * kMm, 3 * kMm}, {0.1, -0.2, 0.3})}) {
        const std::array<int, 3> size{12, 11, 10};
        const VoxelVolume volume =
            sampled(size, frame, [](const Vec3& p) { return 1e3 * (p.x + 2 * p.y + 5 * p.z); });
        const Vec3 middle = middle_of(size, frame);
        Box region;
        region.add(middle - Vec3(1.2 * kMm));
        region.add(middle + Vec3(1.2 * kMm));
        const VoxelVolume part = cropped(volume, region);
        EXPECT_LT(part.voxels(), volume.voxels());
        // Every voxel is one of the original's, at its place: the values are the places.
        for (int k = 0; k < part.size[2]; ++k)
            for (int j = 0; j < part.size[1]; ++j)
                for (int i = 0; i < part.size[0]; ++i) {
                    const Vec3 p = part.index_to_scene.point(Vec3(i, j, k));
                    // Floats of up to about 2e3 have steps of 1.2e-4.
                    EXPECT_NEAR(part.at(i, j, k), 1e3 * (p.x + 2 * p.y + 5 * p.z), 3e-4);
                }
        // And none of the region is missing: its corners lie within the box of voxel centres.
        const AffineTransform to_index = part.index_to_scene.inverse();
        for (int corner = 0; corner < 8; ++corner) {
            const Vec3 index = to_index.point({(corner & 1 ? region.upper : region.lower).x,
                                               (corner & 2 ? region.upper : region.lower).y,
                                               (corner & 4 ? region.upper : region.lower).z});
            for (int axis = 0; axis < 3; ++axis) {
                EXPECT_GE(index[axis], -1e-9);
                EXPECT_LE(index[axis], part.size[static_cast<std::size_t>(axis)] - 1 + 1e-9);
            }
        }
    }
}

TEST(Cropped, ARegionBesideTheVolumeIsRefusedWithTheVolumesBox) {
    VoxelVolume volume =
        sampled({10, 10, 10}, {Mat3(kMm), Vec3(0.0)}, [](const Vec3&) { return 1; });
    EXPECT_EQ(cropped(volume, {Vec3(-1.0), Vec3(1.0)}).size, volume.size) << "all of it";
    try {
        cropped(volume, {Vec3(0.1), Vec3(0.2)});
        FAIL() << "accepted";
    } catch (const std::invalid_argument& error) {
        EXPECT_NE(std::string(error.what()).find("0 to 9, 0 to 9, 0 to 9 mm (LPS)"),
                  std::string::npos)
            << error.what();
    }
}

TEST(Cropped, ARegionWithoutAnEndIsSaidNotToBeFinite) {
    const VoxelVolume volume =
        sampled({10, 10, 10}, {Mat3(kMm), Vec3(0.0)}, [](const Vec3&) { return 1; });
    const double infinity = std::numeric_limits<double>::infinity();
    for (const Box& region :
         {Box{Vec3(-infinity), Vec3(infinity)}, Box{Vec3(-1.0), Vec3(1.0, 1.0, infinity)}}) {
        try {
            cropped(volume, region);
            FAIL() << "accepted";
        } catch (const std::invalid_argument& error) {
            const std::string message = error.what();
            EXPECT_NE(message.find("not finite"), std::string::npos) << message;
            EXPECT_NE(message.find("0 to 9, 0 to 9, 0 to 9 mm (LPS)"), std::string::npos)
                << message;
        }
    }
}

// --- clearing --------------------------------------------------------------------------------

TEST(ClearFarFromLevel, ChangesNothingThatAStencilOfTheSurfaceSees) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> noise(0.0F, 0.9F);
    VoxelVolume volume =
        sampled({37, 30, 29}, {Mat3(kMm), Vec3(0.0)}, [](const Vec3&) { return 0; });
    for (float& value : volume.values)
        value = noise(random);
    for (const std::array<int, 3>& at : {std::array{3, 4, 5}, {20, 15, 16}, {36, 29, 28}})
        volume.values[volume.index(at[0], at[1], at[2])] = 2.0F;
    VoxelVolume cleared = volume;
    clear_far_from_level(cleared, 1.0, -5.0F);

    std::size_t background = 0;
    for (int k = 0; k < volume.size[2]; ++k)
        for (int j = 0; j < volume.size[1]; ++j)
            for (int i = 0; i < volume.size[0]; ++i) {
                bool near = false; // the definition, voxel by voxel
                for (const std::array<int, 3>& at :
                     {std::array{3, 4, 5}, {20, 15, 16}, {36, 29, 28}}) {
                    const auto reaches = [](int block_of, int at_axis) {
                        const int first = block_of / 8 * 8;
                        return at_axis + 3 >= first && at_axis - 3 < first + 8;
                    };
                    near = near || (reaches(i, at[0]) && reaches(j, at[1]) && reaches(k, at[2]));
                }
                const float expected = near ? volume.at(i, j, k) : -5.0F;
                ASSERT_EQ(cleared.at(i, j, k), expected) << i << ' ' << j << ' ' << k;
                background += near ? 0 : 1;
            }
    EXPECT_GT(background, volume.voxels() / 4) << "otherwise nothing was tested";
}

TEST(ClearFarFromLevel, VoxelsThatAreNotNumbersCountAsNear) {
    VoxelVolume volume = sampled({24, 8, 8}, {Mat3(kMm), Vec3(0.0)}, [](const Vec3&) { return 0; });
    volume.values[volume.index(4, 4, 4)] = std::nanf("");
    clear_far_from_level(volume, 1.0, -5.0F);
    EXPECT_EQ(volume.at(0, 0, 0), 0.0F);
    EXPECT_EQ(volume.at(8, 0, 0), -5.0F) << "the next block is out of its reach";
}

// --- smoothing -------------------------------------------------------------------------------

/// The discrete Gaussian exp(-t) I_n(t), t = sigma^2, far enough out to be exact in float.
std::vector<double> discrete_gaussian(double sigma) {
    std::vector<double> half;
    for (int n = 0; n <= 40; ++n)
        half.push_back(std::exp(-sigma * sigma) * std::cyl_bessel_i(n, sigma * sigma));
    return half;
}

TEST(Smooth, EqualsDirectConvolutionAlongEveryAxis) {
    const double sigma = 0.7;
    SCOPED_TRACE("seed 5");
    std::mt19937 random(5);
    std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
    VoxelVolume volume = sampled({9, 8, 7}, oblique_frame(Vec3(kMm, 2 * kMm, 3 * kMm), Vec3(0.0)),
                                 [&](const Vec3&) { return uniform(random); });
    VoxelVolume twin = volume;
    const auto weights = discrete_gaussian(sigma);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const VoxelVolume from = twin;
        for (int k = 0; k < 7; ++k)
            for (int j = 0; j < 8; ++j)
                for (int i = 0; i < 9; ++i) {
                    double sum = 0.0;
                    for (int n = -40; n <= 40; ++n) {
                        std::array<int, 3> at{i, j, k}; // the border's value goes on outside
                        at[axis] = std::clamp(at[axis] + n, 0, from.size[axis] - 1);
                        sum += weights[static_cast<std::size_t>(std::abs(n))] *
                               from.at(at[0], at[1], at[2]);
                    }
                    twin.values[twin.index(i, j, k)] = static_cast<float>(sum);
                }
    }
    smooth(volume, sigma);
    // The kernel may lack 1e-4 of its weight per axis, which its normalisation moves to the rest.
    for (std::size_t n = 0; n < volume.values.size(); ++n)
        EXPECT_NEAR(volume.values[n], twin.values[n], 3 * 2e-4);
}

TEST(Smooth, VarianceOfAPointIsSigmaSquaredInVoxelsOfEachAxis) {
    const double sigma = 2.5;
    VoxelVolume volume =
        sampled({51, 51, 51}, oblique_frame(Vec3(kMm, 2 * kMm, 0.3 * kMm), Vec3(0.0)),
                [](const Vec3&) { return 0.0; });
    volume.values[volume.index(25, 25, 25)] = 1000.0F;
    smooth(volume, sigma);
    Vec3 variance(0.0);
    double sum = 0.0;
    for (int k = 0; k < 51; ++k)
        for (int j = 0; j < 51; ++j)
            for (int i = 0; i < 51; ++i) {
                const Vec3 d(i - 25, j - 25, k - 25);
                sum += volume.at(i, j, k);
                variance += static_cast<double>(volume.at(i, j, k)) * d * d;
            }
    EXPECT_NEAR(sum, 1000.0, 1e-3); // 1e5 float roundings of 1e-6 at most
    // Cut where 1e-4 of the weight is left, at about 4 sigma: 16 sigma^2 * 1e-4.
    for (int axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(variance[axis] / sum, sigma * sigma, 0.003 * sigma * sigma);
}

TEST(Smooth, LeavesConstantsAndInnerPartsOfRampsAlone) {
    VoxelVolume volume =
        sampled({30, 20, 20}, AffineTransform{}, [](const Vec3& p) { return p.x; });
    smooth(volume, 0.7);
    for (int i = 8; i < 22; ++i) // away from the border, whose value goes on outside
        EXPECT_NEAR(volume.at(i, 10, 10), i, 1e-5 * i);
    VoxelVolume constant = sampled({9, 9, 9}, AffineTransform{}, [](const Vec3&) { return 300.0; });
    smooth(constant, 1.5);
    for (const float value : constant.values)
        EXPECT_NEAR(value, 300.0, 300.0 * 1e-6); // float rounding of three normalised sums
}

TEST(Smooth, SigmaZeroChangesNoBitAndRepetitionGivesTheSameBits) {
    SCOPED_TRACE("seed 6");
    std::mt19937 random(6);
    std::uniform_real_distribution<float> uniform(-1000.0F, 2000.0F);
    const VoxelVolume volume =
        sampled({40, 37, 33}, AffineTransform{}, [&](const Vec3&) { return uniform(random); });
    VoxelVolume same = volume;
    smooth(same, 0.0);
    EXPECT_TRUE(same_bits(same.values, volume.values));
    VoxelVolume first = volume;
    smooth(first, 0.7);
    for (int run = 0; run < 5; ++run) {
        VoxelVolume again = volume;
        smooth(again, 0.7);
        EXPECT_TRUE(same_bits(again.values, first.values));
    }
}

TEST(Smooth, RefusesWhatIsNoStandardDeviation) {
    VoxelVolume volume = sampled({3, 3, 3}, AffineTransform{}, [](const Vec3&) { return 0.0; });
    EXPECT_THROW(smooth(volume, -0.1), std::invalid_argument);
    EXPECT_THROW(smooth(volume, std::nan("")), std::invalid_argument);
    VoxelVolume empty;
    EXPECT_THROW(smooth(empty, 0.7), std::invalid_argument);
}

// The kernel's width would not fit into an int.
TEST(Smooth, RefusesAKernelBeyondAnyUse) {
    VoxelVolume volume = sampled({3, 3, 3}, AffineTransform{}, [](const Vec3&) { return 1.0; });
    for (const double sigma : {26.0, 1e9})
        EXPECT_THROW(smooth(volume, sigma), std::invalid_argument) << sigma;
    for (const float value : volume.values)
        EXPECT_EQ(value, 1.0F);
}

// --- shift of a surface ------------------------------------------------------------------------

/// radius - |x - middle|: a solid sphere; a distance, so that levels are places.
VoxelVolume sphere(const std::array<int, 3>& size, const AffineTransform& frame, double radius) {
    const Vec3 c = middle_of(size, frame);
    return sampled(size, frame, [=](const Vec3& p) { return radius - glm::length(p - c); });
}

TEST(SurfaceShift, OfAFieldAgainstItselfIsZero) {
    const VoxelVolume volume = sphere({40, 40, 32}, sheared_frame(kMm), 9 * kMm);
    const SurfaceShift shift = surface_shift(volume, 0.0, volume, 0.0);
    EXPECT_GT(shift.points, 1000U);
    // Points lie on the trilinear level by construction: only bisection is left.
    EXPECT_LT(std::abs(shift.mean_m), 1e-9);
    EXPECT_LT(shift.deviation_m, 1e-9);
}

TEST(SurfaceShift, IsTheDistanceBetweenLevelsOfADistanceFieldAndPositiveWhenMaterialGrows) {
    const double radius = 12 * kMm;
    for (const AffineTransform& frame :
         {sheared_frame(kMm), oblique_frame(Vec3(0.6, 1.0, 1.4) * kMm, Vec3(0.1, 0.2, -0.3))}) {
        const VoxelVolume volume = sphere({60, 48, 40}, frame, radius);
        for (const double grown : {-1.0 * kMm, -0.2 * kMm, 0.3 * kMm, 1.0 * kMm}) {
            const SurfaceShift shift = surface_shift(volume, 0.0, volume, -grown);
            // A trilinear sphere lies off by at most (voxel diagonal)^2 / (8 radius), 45 um for a
            // diagonal of 2.1 mm, on either surface to the same side: less than half of that is
            // left in their difference. The normal's error enters squared.
            EXPECT_NEAR(shift.mean_m, grown, 20e-6) << grown;
            EXPECT_LT(shift.deviation_m, 45e-6) << grown;
        }
    }
}

TEST(SurfaceShift, CountsOnlyPointsWithinTwoVoxels) {
    const VoxelVolume volume =
        sphere({60, 60, 60}, AffineTransform{Mat3(kMm), Vec3(0.0)}, 15 * kMm);
    const std::size_t all = surface_shift(volume, 0.0, volume, 0.0).points;
    EXPECT_EQ(surface_shift(volume, 0.0, volume, -1.5 * kMm).points, all);
    const SurfaceShift far = surface_shift(volume, 0.0, volume, -3.8 * kMm);
    EXPECT_EQ(far.points, 0U); // a voxel along a diagonal is sqrt(3) mm long, two of them 3.5 mm
    EXPECT_EQ(far.mean_m, 0.0);
}

TEST(SurfaceShift, AveragesOverAreaNotOverCrossings) {
    // The second surface is moved by amount * n_x^4: 1/5 of it over a sphere's area. Crossings lie
    // denser where the surface is oblique to the grid and where voxels are small: their plain mean
    // differs, which the unweighted twin below confirms.
    const double radius = 15 * kMm, amount = 0.4 * kMm;
    const std::array<int, 3> size{84, 44, 30};
    const AffineTransform frame{
        Mat3(Vec3(0.5 * kMm, 0, 0), Vec3(0, 1.0 * kMm, 0), Vec3(0, 0, 1.5 * kMm)), Vec3(0.0)};
    const Vec3 c = middle_of(size, frame) + Vec3(0.07, 0.11, 0.13) * kMm;
    const auto quartic = [&](const Vec3& p) {
        return std::pow(glm::dot(glm::normalize(p - c), Vec3(1.0, 0.0, 0.0)), 4);
    };
    const VoxelVolume plain =
        sampled(size, frame, [&](const Vec3& p) { return radius - glm::length(p - c); });
    const VoxelVolume moved = sampled(size, frame, [&](const Vec3& p) {
        return radius - glm::length(p - c) + amount * quartic(p);
    });

    double crossings = 0.0, unweighted = 0.0;
    for (int k = 0; k + 1 < size[2]; ++k)
        for (int j = 0; j + 1 < size[1]; ++j)
            for (int i = 0; i + 1 < size[0]; ++i)
                for (int axis = 0; axis < 3; ++axis) {
                    const Vec3 a(i, j, k);
                    Vec3 b = a;
                    b[axis] += 1.0;
                    const float fa = plain.at(i, j, k);
                    const float fb = plain.at(static_cast<int>(b.x), static_cast<int>(b.y),
                                              static_cast<int>(b.z));
                    if ((fa >= 0) == (fb >= 0)) continue;
                    crossings += 1.0;
                    unweighted += amount * quartic(frame.point(0.5 * (a + b)));
                }
    const double expected = amount / 5.0;
    EXPECT_GT(std::abs(unweighted / crossings - expected), 0.1 * expected);

    const SurfaceShift shift = surface_shift(plain, 0.0, moved, 0.0);
    // Lattice noise of a sphere of ~10 000 crossings and the trilinear difference of n_x^4: 2 %.
    EXPECT_NEAR(shift.mean_m, expected, 0.02 * expected);
    // Standard deviation of n_x^4 over the sphere: sqrt(1/9 - 1/25).
    EXPECT_NEAR(shift.deviation_m, amount * std::sqrt(1.0 / 9.0 - 1.0 / 25.0), 0.03 * amount);
}

TEST(SurfaceShift, RefusesVolumesOfDifferentSize) {
    const VoxelVolume a = sphere({20, 20, 20}, AffineTransform{}, 5.0);
    const VoxelVolume b = sphere({20, 20, 21}, AffineTransform{}, 5.0);
    EXPECT_THROW(surface_shift(a, 0.0, b, 0.0), std::invalid_argument);
    EXPECT_THROW(level_keeping_position(a, 0.0, b), std::invalid_argument);
}

// --- the level that keeps a surface in its place -----------------------------------------------

/// CT-like: 1000 inside, -1000 outside, a steep edge of 0.8 voxel; seen at a level near its foot.
VoxelVolume ct_like_sphere(double radius_voxels) {
    const std::array<int, 3> size{44, 44, 44};
    const AffineTransform frame{Mat3(kMm), Vec3(0.0)};
    const Vec3 c = middle_of(size, frame);
    return sampled(size, frame, [=](const Vec3& p) {
        return 1000.0 * std::erf((radius_voxels - glm::length(p - c) / kMm) / 0.8);
    });
}

TEST(LevelKeepingPosition, LeavesAMeanShiftBelowAMicrometre) {
    for (const double level : {-800.0, -500.0, 0.0, 600.0})
        for (const double sigma : {0.5, 0.7, 1.0}) {
            const VoxelVolume original = ct_like_sphere(12.0);
            VoxelVolume smoothed = original;
            smooth(smoothed, sigma);
            const KeptLevel kept = level_keeping_position(original, level, smoothed);
            const SurfaceShift shift = surface_shift(original, level, smoothed, kept.level);
            EXPECT_LE(std::abs(shift.mean_m), 1e-6);
            EXPECT_EQ(kept.shift.mean_m, shift.mean_m) << "what it says is what it is";
            EXPECT_EQ(kept.shift.deviation_m, shift.deviation_m);
            EXPECT_EQ(kept.shift.points, shift.points);
            if (level <= -500.0) { // at the foot of the edge smoothing grows: a higher level is due
                EXPECT_GT(surface_shift(original, level, smoothed, level).mean_m, 20e-6);
                EXPECT_GT(kept.level, level);
            }
        }
}

TEST(LevelKeepingPosition, MovesTheLevelOfAFlatEdgeAsTheErrorFunctionSays) {
    // A flat edge erf(x/a) smoothed by sigma is erf(x/sqrt(a^2 + 2 sigma^2)): the place x of level
    // c keeps if the level becomes that value at x. Tilted off the grid by a little.
    const double a = 2.0, sigma = 0.7;
    const Vec3 n = glm::normalize(Vec3(0.9, 0.3, 0.2));
    const std::array<int, 3> size{48, 40, 40};
    const Vec3 c = middle_of(size, AffineTransform{});
    const VoxelVolume original = sampled(
        size, AffineTransform{}, [&](const Vec3& p) { return std::erf(glm::dot(p - c, n) / a); });
    VoxelVolume smoothed = original;
    smooth(smoothed, sigma);
    // Only the inner part is an edge without a border.
    const auto inner = [](const VoxelVolume& v) {
        VoxelVolume part = v;
        part.size = {v.size[0] - 16, v.size[1] - 16, v.size[2] - 16};
        part.values = {};
        for (int k = 8; k < v.size[2] - 8; ++k)
            for (int j = 8; j < v.size[1] - 8; ++j)
                for (int i = 8; i < v.size[0] - 8; ++i)
                    part.values.push_back(v.at(i, j, k));
        part.index_to_scene.offset = v.index_to_scene.point(Vec3(8.0));
        return part;
    };
    const double x = -1.0; // voxels; level erf(-1/2)
    const double level = std::erf(x / a);
    const double expected = std::erf(x / std::sqrt(a * a + 2.0 * sigma * sigma));
    const double kept = level_keeping_position(inner(original), level, inner(smoothed)).level;
    // Trilinear values of a curved profile are off by h^2 |f''| / 8 = 0.027 at most, on both
    // fields alike (f'' falls by a fifth): what is left is a quarter of that.
    EXPECT_NEAR(kept, expected, 0.007);
    EXPECT_GT(std::abs(expected - level), 0.04); // not met by leaving the level alone
}

// A hundredth of such a range is a step over all of the ball's edge, to levels where it has no
// surface.
TEST(LevelKeepingPosition, MetalElsewhereMakesLittleDifference) {
    const std::array<int, 3> size{48, 40, 40};
    const VoxelVolume ball = sampled(size, {Mat3(kMm), Vec3(0.0)}, [](const Vec3& p) {
        const double depth = 12.0 - glm::length(p / kMm - Vec3(18.0)); // voxels
        return 40.0 + 90.0 * (1.0 + std::erf(depth / 0.8));            // 220 within, 40 around
    });
    VoxelVolume with_metal = ball; // 3 x 3 x 3 voxels, 10 voxels beside the ball
    for (int n = 0; n < 27; ++n)
        with_metal.values[with_metal.index(40 + n % 3, 18 + n / 3 % 3, 18 + n / 9)] = 20000.0F;
    const auto kept = [](const VoxelVolume& original, double level, double sigma) {
        VoxelVolume smoothed = original;
        smooth(smoothed, sigma);
        return level_keeping_position(original, level, smoothed);
    };
    for (const double level : {80.0, 130.0, 180.0}) // to either side of the ball's edge
        for (const double sigma : {0.7, 1.0}) {
            SCOPED_TRACE(testing::Message() << level << ", sigma " << sigma);
            const KeptLevel metal = kept(with_metal, level, sigma);
            EXPECT_LE(std::abs(metal.shift.mean_m), 1e-6);
            // The metal has 54 mm^2 of surface, the ball 1810 mm^2: 3 %, which may seem to move by
            // two voxels. The ball's edge rises by at most 80 per voxel: 0.03 * 2 * 80.
            EXPECT_NEAR(metal.level, kept(ball, level, sigma).level, 5.0);
        }
}

TEST(LevelKeepingPosition, SaysSoWhenThereIsNone) {
    const VoxelVolume original = ct_like_sphere(12.0);
    EXPECT_THROW(level_keeping_position(original, 5000.0, original), std::runtime_error);
    VoxelVolume nothing = original;
    std::fill(nothing.values.begin(), nothing.values.end(), 0.0F);
    EXPECT_THROW(level_keeping_position(original, 0.0, nothing), std::runtime_error);
    // A ball that smoothing dissolves: its surface is not to be found any more.
    const VoxelVolume crumb = ct_like_sphere(1.0);
    VoxelVolume dissolved = crumb;
    smooth(dissolved, 6.0);
    EXPECT_THROW(level_keeping_position(crumb, 0.0, dissolved), std::runtime_error);
}

} // namespace
} // namespace palpate
