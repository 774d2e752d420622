// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/picture/overview_picture.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/engine/picture/overview_pixels.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

using test::ball_png;
using test::bounds_of;
using test::Canvas;
using test::Colour;
using test::count;
using test::decoded;
using test::for_each_pixel;
using test::is_grey;
using test::kHalfTile;
using test::kLetterReach;
using test::Mask;
using test::pixel;
using test::pixel_m;
using test::PngImage;
using test::Spot;
using test::spot_of;
using test::Tile;

struct Frame {
    const char* name;
    AffineTransform index_to_scene;
};

/// Axis-aligned ones of either hand, one with exchanged axes, and oblique ones of either hand.
std::vector<Frame> frames() {
    const Vec3 offset(0.01, -0.07, 0.3);
    AffineTransform right_handed = test::oblique_frame({1e-3, 2e-3, 1.5e-3}, offset);
    right_handed.linear[2] = -right_handed.linear[2];
    return {{"LPS", {1e-3 * Mat3({1, 0, 0}, {0, 1.5, 0}, {0, 0, 2}), offset}},
            {"RAS", {1e-3 * Mat3({-1, 0, 0}, {0, -1.5, 0}, {0, 0, 2}), offset}},
            {"left-handed", {1e-3 * Mat3({-1, 0, 0}, {0, 1.5, 0}, {0, 0, 2}), offset}},
            {"k to the left", {1e-3 * Mat3({0, 1, 0}, {0, 0, -1.5}, {2, 0, 0}), offset}},
            {"oblique, left-handed", test::oblique_frame({1e-3, 2e-3, 1.5e-3}, offset)},
            {"oblique, right-handed", right_handed}};
}

/// 0 everywhere but in one voxel.
VoxelVolume marked(const AffineTransform& frame) {
    VoxelVolume volume;
    volume.size = {21, 16, 12};
    volume.index_to_scene = frame;
    volume.values.assign(volume.voxels(), 0.0F);
    volume.values[volume.index(4, 11, 9)] = 1.0F;
    return volume;
}

TEST(OverviewPicture, MarkedVoxelIsAtItsPlaceInThePatientInEverySlice) {
    for (const Frame& frame : frames()) {
        SCOPED_TRACE(frame.name);
        const VoxelVolume volume = marked(frame.index_to_scene);
        const PngImage image = decoded(overview_png(volume, otsu_threshold(volume)));
        const Box box = bounds_of(volume);
        // Pixels that its voxel lies left of, behind and above the middle.
        const Vec3 off = (frame.index_to_scene.point({4, 11, 9}) - box.center()) / pixel_m(box);
        // Trilinear interpolation lights the voxel's surroundings symmetrically, over some 20
        // pixels: their common centre is good to well below a pixel.
        constexpr double kTolerance = 0.5;
        const Spot axial = spot_of(image, Tile::axial);
        EXPECT_NEAR(axial.x, kHalfTile + off.x, kTolerance);
        EXPECT_NEAR(axial.y, kHalfTile + off.y, kTolerance);
        const Spot coronal = spot_of(image, Tile::coronal);
        EXPECT_NEAR(coronal.x, kHalfTile + off.x, kTolerance);
        EXPECT_NEAR(coronal.y, kHalfTile - off.z, kTolerance);
        const Spot sagittal = spot_of(image, Tile::sagittal);
        EXPECT_NEAR(sagittal.x, kHalfTile + off.y, kTolerance);
        EXPECT_NEAR(sagittal.y, kHalfTile - off.z, kTolerance);
    }
}

// --- Letters

/// The white pixels around a place.
Mask ink_around(const std::function<Colour(int, int)>& at, int x, int y) {
    Mask ink;
    for (int dy = -kLetterReach; dy <= kLetterReach; ++dy)
        for (int dx = -kLetterReach; dx <= kLetterReach; ++dx)
            ink.push_back(at(x + dx, y + dy) == Colour{255, 255, 255});
    return ink;
}

Mask ink_of(char letter) {
    constexpr int kSide = 2 * kLetterReach + 1;
    Canvas canvas(kSide, kSide, {0, 0, 0});
    canvas.draw_letter(letter, kLetterReach, kLetterReach);
    const PngImage image = decoded(canvas.png());
    return ink_around([&](int x, int y) { return image.at(x, y); }, kLetterReach, kLetterReach);
}

/// The letters at the left, right, upper and lower edge of a tile.
std::string letters_of(const PngImage& image, Tile tile) {
    constexpr int kMiddle = kOverviewTile / 2;
    constexpr int kNear = kLetterReach + 2;
    constexpr int kFar = kOverviewTile - kNear;
    constexpr std::array<std::array<int, 2>, 4> kPlaces{
        {{kNear, kMiddle}, {kFar, kMiddle}, {kMiddle, kNear}, {kMiddle, kFar}}};
    std::string letters;
    for (const auto& place : kPlaces) {
        const Mask ink =
            ink_around([&](int x, int y) { return pixel(image, tile, x, y); }, place[0], place[1]);
        char found = '?';
        for (const char letter : std::string("RLAPSI"))
            if (ink == ink_of(letter)) found = letter;
        letters += found;
    }
    return letters;
}

TEST(OverviewPicture, LettersAreSixDifferentOnesAndOthersLeaveNoTrace) {
    std::set<Mask> seen;
    for (const char letter : std::string("RLAPSI"))
        seen.insert(ink_of(letter));
    EXPECT_EQ(seen.size(), 6U);
    const Mask none(seen.begin()->size(), false);
    EXPECT_EQ(ink_of('X'), none);
    EXPECT_EQ(seen.count(none), 0U);
    // An L is no mirrored one: its upright is on the left.
    const Mask l = ink_of('L');
    constexpr std::size_t kSide = 2 * kLetterReach + 1;
    std::size_t left = 0;
    std::size_t right = 0;
    for (std::size_t i = 0; i < l.size(); ++i)
        (i % kSide < kSide / 2 ? left : right) += l[i] ? 1 : 0;
    EXPECT_GT(left, 2 * right);
}

TEST(OverviewPicture, SlicesAreLetteredAsRadiologistsLook) {
    for (const Frame& frame : frames()) {
        SCOPED_TRACE(frame.name);
        const PngImage image = decoded(overview_png(marked(frame.index_to_scene), std::nullopt));
        EXPECT_EQ(letters_of(image, Tile::axial), "RLAP");
        EXPECT_EQ(letters_of(image, Tile::coronal), "RLSI");
        EXPECT_EQ(letters_of(image, Tile::sagittal), "APSI");
    }
}

TEST(OverviewPicture, MeshIsLetteredFromFrontLeftAndAbove) {
    const PngImage image = decoded(ball_png());
    EXPECT_EQ(letters_of(image, Tile::axial), "RLSI");
    EXPECT_EQ(letters_of(image, Tile::sagittal), "APSI");
    EXPECT_EQ(letters_of(image, Tile::coronal), "LRAP");
    EXPECT_EQ(letters_of(image, Tile::surface), "????");
}

// --- Grey volumes

TEST(OverviewPicture, ProportionsAreTrueWhateverTheSpacing) {
    // 40 x 20 x 80 mm of 1, 2 and 8 mm voxels.
    const AffineTransform frame{1e-3 * Mat3({1, 0, 0}, {0, 2, 0}, {0, 0, 8}), Vec3(0.0)};
    const VoxelVolume volume =
        test::sampled({40, 10, 10}, frame, [](const Vec3& p) { return p.x; });
    const PngImage image = decoded(overview_png(volume, std::nullopt));
    const auto grey = [&](Tile tile) { return count(image, tile, is_grey); };
    constexpr int kLongest = kOverviewTile - 2 * kOverviewMargin; // 80 mm
    // Whole numbers of pixels, and borders of the volume run between two.
    EXPECT_EQ(grey(Tile::axial), kLongest / 2 * kLongest / 4);
    EXPECT_EQ(grey(Tile::coronal), kLongest / 2 * kLongest);
    EXPECT_EQ(grey(Tile::sagittal), kLongest / 4 * kLongest);
}

TEST(OverviewPicture, GreyGoesFromTheFirstToTheLastPercentileWhateverTheOutliers) {
    const AffineTransform frame{1e-3 * Mat3(1.0), Vec3(0.0)};
    VoxelVolume volume =
        test::sampled({101, 20, 20}, frame, [](const Vec3& p) { return 1e3 * p.x; });
    volume.values.front() = -1e30F;
    volume.values.back() = 1e30F;
    const PngImage image = decoded(overview_png(volume, std::nullopt));
    // Values 1 and 99, the percentiles of 0 ... 100, are black and white; a pixel is 0.24 of a
    // voxel, hence 0.6 of a grey level.
    const double pixels_per_voxel = 420.0 / 101.0;
    for (const double value : {0.0, 1.0, 25.0, 50.0, 75.0, 99.0, 100.0}) {
        const double x = kHalfTile + (value - 50.0) * pixels_per_voxel;
        const double wanted = std::clamp(255.0 * (value - 1.0) / 98.0, 0.0, 255.0);
        EXPECT_NEAR(pixel(image, Tile::axial, x, kHalfTile)[0], wanted, 2.0) << value;
    }
}

TEST(OverviewPicture, ValuesThatAreNotFiniteAreShownAsNothing) {
    VoxelVolume volume = test::sampled({20, 20, 20}, {1e-3 * Mat3(1.0), Vec3(0.0)},
                                       [](const Vec3& p) { return p.x; });
    for (int k = 0; k < 20; ++k)
        for (int j = 0; j < 20; ++j)
            for (int i = 0; i < 10; ++i)
                volume.values[volume.index(i, j, k)] = i % 2
                                                           ? std::numeric_limits<float>::quiet_NaN()
                                                           : std::numeric_limits<float>::infinity();
    const PngImage image = decoded(overview_png(volume, otsu_threshold(volume)));
    EXPECT_FALSE(is_grey(pixel(image, Tile::axial, kHalfTile - 100, kHalfTile)));
    EXPECT_TRUE(is_grey(pixel(image, Tile::axial, kHalfTile + 100, kHalfTile)));
}

TEST(OverviewPicture, SurfaceIsAtTheLevelAndSeenFromFrontLeftAndAbove) {
    // A ball with a smaller one beside it, to the patient's left, behind and above, on the right of
    // the picture then; a wall of the volume's border would fill the tile.
    const auto balls = [](const Vec3& p) {
        return std::max(0.012 - glm::length(p), 0.005 - glm::length(p - Vec3(0.0, 0.018, 0.018)));
    };
    const VoxelVolume volume =
        test::sampled({40, 40, 40}, {1.5e-3 * Mat3(1.0), Vec3(-0.02925)}, balls);
    const PngImage image = decoded(overview_png(volume, 0.0));
    const auto bone = [&](bool right, bool up) {
        int sum = 0;
        for_each_pixel(image, Tile::surface, [&](int x, int y, const Colour& c) {
            const bool counts = (x >= kOverviewTile / 2) == right && (y < 150) == up;
            if (counts && c[0] > c[2]) ++sum;
        });
        return sum;
    };
    // Its middle is 12 mm to the right of the large one's and 22 mm above: at 332, 97 of the tile
    // with a radius of 49 pixels. The large one begins at row 196.
    EXPECT_GT(bone(true, true), 7000);
    EXPECT_EQ(bone(false, true), 0);
    EXPECT_GT(bone(false, false), 10000);
}

TEST(OverviewPicture, VolumeOfOneValueHasNoSurfaceAndOtherLevelsAreRefused) {
    VoxelVolume volume = marked({1e-3 * Mat3(1.0), Vec3(0.0)});
    EXPECT_THROW(overview_png(volume, 0.0), std::invalid_argument);
    EXPECT_THROW(overview_png(volume, 1.5), std::invalid_argument);
    EXPECT_THROW(overview_png(volume, std::numeric_limits<double>::quiet_NaN()),
                 std::invalid_argument);
    std::fill(volume.values.begin(), volume.values.end(), 7.0F);
    EXPECT_FALSE(otsu_threshold(volume).has_value());
    const PngImage image = decoded(overview_png(volume, otsu_threshold(volume)));
    const Colour first = pixel(image, Tile::surface, 1, 1);
    EXPECT_EQ(count(image, Tile::surface, [&](const Colour& c) { return c == first; }),
              (kOverviewTile - 2 * kOverviewMargin) * (kOverviewTile - 2 * kOverviewMargin));
}

TEST(OverviewPicture, SameInputGivesTheSameBytes) {
    const VoxelVolume volume = test::random_volume(test::oblique_frame(Vec3(1e-3), Vec3(0.0)));
    EXPECT_EQ(overview_png(volume, 1000.0), overview_png(volume, 1000.0));
    const auto ball = std::make_shared<const TriangleMesh>(test::icosphere(0.02, 3));
    EXPECT_EQ(overview_png(ball), ball_png());
}

// --- Labels

} // namespace
} // namespace palpate
