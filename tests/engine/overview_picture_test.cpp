// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/overview_picture.h>

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

#include <palpate/engine/internal/canvas.h>

#include "tests/support/png_image.h"
#include "tests/support/test_meshes.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using internal::Canvas;
using internal::kLetterReach;
using test::decoded;
using test::PngImage;
using Colour = std::array<int, 3>;
using Mask = std::vector<bool>;

constexpr double kHalfTile = 0.5 * kOverviewTile;

enum class Tile { axial, coronal, sagittal, surface };

/// Upper left corner of a tile.
std::array<int, 2> corner_of(Tile tile) {
    constexpr int kNext = kOverviewTile + kOverviewGap;
    switch (tile) {
    case Tile::axial:
        return {0, 0};
    case Tile::coronal:
        return {0, kNext};
    case Tile::sagittal:
        return {kNext, 0};
    case Tile::surface:
        break;
    }
    return {kNext, kNext};
}

Colour pixel(const PngImage& image, Tile tile, double x, double y) {
    const auto [left, top] = corner_of(tile);
    return image.at(left + static_cast<int>(x), top + static_cast<int>(y));
}

/// Calls visit(x, y, colour) for a tile's pixels away from its letters.
template <class Visit>
void for_each_pixel(const PngImage& image, Tile tile, const Visit& visit) {
    for (int y = kOverviewMargin; y < kOverviewTile - kOverviewMargin; ++y)
        for (int x = kOverviewMargin; x < kOverviewTile - kOverviewMargin; ++x)
            visit(x, y, pixel(image, tile, x, y));
}

int count(const PngImage& image, Tile tile, const std::function<bool(const Colour&)>& is) {
    int sum = 0;
    for_each_pixel(image, tile, [&](int, int, const Colour& c) { sum += is(c) ? 1 : 0; });
    return sum;
}

bool is_grey(const Colour& c) { return c[0] == c[1] && c[1] == c[2]; }

struct Spot {
    double x = 0.0;
    double y = 0.0;
    double light = 0.0;
};

/// Where the light of a tile is; black counts nothing, and what is outside of the volume is not
/// grey.
Spot spot_of(const PngImage& image, Tile tile) {
    Spot spot;
    for_each_pixel(image, tile, [&](int x, int y, const Colour& c) {
        if (!is_grey(c)) return;
        spot.x += c[0] * (x + 0.5);
        spot.y += c[0] * (y + 0.5);
        spot.light += c[0];
    });
    spot.x /= spot.light;
    spot.y /= spot.light;
    return spot;
}

/// Bounds of a volume's voxels, borders included.
Box bounds_of(const VoxelVolume& volume) {
    Box box;
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 q;
        for (int axis = 0; axis < 3; ++axis)
            q[axis] = corner >> axis & 1 ? volume.size[static_cast<std::size_t>(axis)] - 0.5 : -0.5;
        box.add(volume.index_to_scene.point(q));
    }
    return box;
}

double pixel_m(const Box& content) {
    const Vec3 extent = content.extent();
    return std::max({extent.x, extent.y, extent.z}) / (kOverviewTile - 2 * kOverviewMargin);
}

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

/// The picture of a ball, which several tests compare with: drawn once.
const std::string& ball_png() {
    static const std::string bytes =
        overview_png(std::make_shared<const TriangleMesh>(test::icosphere(0.02, 3)));
    return bytes;
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

/// Two cubes of 6 voxels: value 3 to the patient's right, 5 to the left, in one layer or in two.
LabelVolume two_cubes(std::size_t layers) {
    LabelVolume volume;
    volume.size = {20, 10, 10};
    volume.index_to_scene = {1e-3 * Mat3(1.0), Vec3(0.0)};
    volume.layers.assign(layers, std::vector<std::int32_t>(2000, 0));
    for (int k = 2; k < 8; ++k)
        for (int j = 2; j < 8; ++j)
            for (int i = 0; i < 6; ++i) {
                const auto at = static_cast<std::size_t>(i + 20 * (j + 10 * k));
                volume.layers.front()[at + 2] = 3;
                volume.layers.back()[at + 12] = 5;
            }
    volume.labels = {{"right", 3, 0, {}}, {"left", 5, layers - 1, {}}};
    return volume;
}

TEST(OverviewPicture, LabelsHaveTheirOwnColoursWhereTheyAre) {
    LabelVolume volume = two_cubes(1);
    volume.labels[0].color = {10, 200, 30};
    volume.labels[1].color = {220, 40, 60};
    const PngImage image = decoded(overview_png(volume));
    const Colour first{10, 200, 30};
    const Colour second{220, 40, 60};
    // Content of 16 x 6 x 6 mm; between the cubes there is nothing.
    const double mm = 420.0 / 16.0;
    for (const Tile tile : {Tile::axial, Tile::coronal}) {
        EXPECT_EQ(pixel(image, tile, kHalfTile - 5 * mm, kHalfTile), first);
        EXPECT_EQ(pixel(image, tile, kHalfTile + 5 * mm, kHalfTile), second);
        EXPECT_EQ(pixel(image, tile, kHalfTile, kHalfTile), (Colour{0, 0, 0}));
        const auto is = [](const Colour& wanted) {
            return [wanted](const Colour& c) { return c == wanted; };
        };
        // 6 x 6 mm each, 157.5 pixels wide: 157 or 158, as borders fall on pixels.
        for (const Colour& wanted : {first, second})
            EXPECT_NEAR(count(image, tile, is(wanted)), 157.5 * 157.5, 158.0);
    }
    // Their surfaces have the hues of the labels.
    const auto greenish = [](const Colour& c) { return c[1] > 2 * c[0] && c[1] > 2 * c[2]; };
    const auto reddish = [](const Colour& c) { return c[0] > 2 * c[1] && c[0] > 2 * c[2]; };
    EXPECT_GT(count(image, Tile::surface, greenish), 2000);
    EXPECT_GT(count(image, Tile::surface, reddish), 2000);
}

TEST(OverviewPicture, LabelsWithoutColoursAreToldApartAndTheLastLayerIsOnTop) {
    LabelVolume volume = two_cubes(2);
    // The second layer's cube reaches over the first one's.
    for (std::size_t i = 0; i < volume.layers[1].size(); ++i)
        if (volume.layers[0][i] == 3 && i % 20 < 5) volume.layers[1][i] = 5;
    const PngImage image = decoded(overview_png(volume));
    const double mm = 420.0 / 16.0;
    const Colour over = pixel(image, Tile::axial, kHalfTile - 7 * mm, kHalfTile);
    const Colour alone = pixel(image, Tile::axial, kHalfTile - 3 * mm, kHalfTile);
    EXPECT_EQ(over, pixel(image, Tile::axial, kHalfTile + 5 * mm, kHalfTile));
    EXPECT_NE(over, alone);
    EXPECT_NE(alone, (Colour{0, 0, 0}));
}

TEST(OverviewPicture, LabelsThinnerThanTheirSmoothingStillHaveASurfaceAndNoneHaveNone) {
    LabelVolume volume = two_cubes(1);
    const auto is_surface = [](const Colour& c) { return c[0] > c[2] + 20; };
    std::fill(volume.layers[0].begin(), volume.layers[0].end(), 0);
    volume.layers[0][555] = 3;
    volume.labels.pop_back();
    EXPECT_GT(count(decoded(overview_png(volume)), Tile::surface, is_surface), 1000);
    volume.layers[0][555] = 0;
    volume.labels.clear();
    EXPECT_EQ(count(decoded(overview_png(volume)), Tile::surface, is_surface), 0);
}

// --- Vectors

VectorVolume vectors(VectorVolume::Kind kind, const std::vector<float>& components) {
    VectorVolume volume;
    volume.kind = kind;
    volume.size = {6, 6, 6};
    volume.components = static_cast<int>(components.size());
    // Components are in the patient's axes already: the voxels' own must not matter.
    volume.index_to_scene = {1e-3 * Mat3({0, 1, 0}, {0, 0, -1}, {1, 0, 0}), Vec3(0.0)};
    for (std::size_t voxel = 0; voxel < volume.voxels(); ++voxel)
        volume.values.insert(volume.values.end(), components.begin(), components.end());
    return volume;
}

constexpr std::array<Tile, 3> kSlices{Tile::axial, Tile::coronal, Tile::sagittal};

TEST(OverviewPicture, VectorsAreRedGreenAndBlueByPatientAxisWhateverTheirSign) {
    using Kind = VectorVolume::Kind;
    const std::vector<std::pair<std::vector<float>, Colour>> cases{
        {{-2.0F, 0.0F, 0.0F}, {255, 0, 0}},
        {{0.0F, 3.0F, 0.0F}, {0, 255, 0}},
        {{0.0F, 0.0F, -0.1F}, {0, 0, 255}},
        {{0.0F, 0.6F, -0.8F}, {0, 153, 204}}};
    for (const auto& [components, wanted] : cases) {
        const PngImage image = decoded(overview_png(vectors(Kind::vector, components)));
        for (const Tile tile : kSlices)
            EXPECT_EQ(pixel(image, tile, kHalfTile + 50, kHalfTile + 50), wanted);
    }
}

TEST(OverviewPicture, TensorsHaveTheColourOfTheirPrincipalDirectionAndIsotropicOnesNone) {
    using Kind = VectorVolume::Kind;
    // xx, xy, xz, yy, yz, zz; anisotropy 1 with a single eigenvalue that is not 0.
    const std::vector<std::pair<std::vector<float>, Colour>> cases{
        {{0, 0, 0, 1e-3F, 0, 0}, {0, 255, 0}},
        {{0, 0, 0, 0, 0, 5.0F}, {0, 0, 255}},
        {{0.36F, 0, 0.48F, 0, 0, 0.64F}, {153, 0, 204}},
        {{2.0F, 0, 0, 2.0F, 0, 2.0F}, {0, 0, 0}}};
    for (const auto& [components, wanted] : cases) {
        const PngImage image = decoded(overview_png(vectors(Kind::symmetric_tensor, components)));
        for (const Tile tile : kSlices) {
            const Colour seen = pixel(image, tile, kHalfTile + 50, kHalfTile + 50);
            // The file's floats turn the direction by 1e-7: a grey level of rounding.
            for (std::size_t i = 0; i < 3; ++i)
                EXPECT_NEAR(seen[i], wanted[i], 1);
        }
    }
}

TEST(OverviewPicture, VectorsThatAreNotFiniteAreBlack) {
    VectorVolume volume = vectors(VectorVolume::Kind::vector, {1.0F, 0.0F, 0.0F});
    for (std::size_t i = 0; i < volume.values.size() / 2; i += 3)
        volume.values[i] = std::numeric_limits<float>::quiet_NaN();
    const PngImage image = decoded(overview_png(volume));
    const auto red = [](const Colour& c) { return c == Colour{255, 0, 0}; };
    EXPECT_GT(count(image, Tile::coronal, red), 0);
    std::fill(volume.values.begin(), volume.values.end(), 0.0F);
    EXPECT_EQ(count(decoded(overview_png(volume)), Tile::coronal, red), 0);
}

// --- Meshes

bool is_red(const Colour& c) { return c[0] > 180 && c[1] < 60 && c[2] < 60; }
bool is_blue(const Colour& c) { return c[2] > c[0] + 50; }

PngImage picture_of(TriangleMesh mesh) {
    return decoded(overview_png(std::make_shared<const TriangleMesh>(std::move(mesh))));
}

TEST(OverviewPicture, OpenEdgesOfAMeshAreRedAndThereAloneInAllFourViews) {
    const TriangleMesh box = test::box_mesh(Vec3(-0.02), Vec3(0.02));
    TriangleMesh open = box;
    open.triangles.erase(open.triangles.begin() + 4); // at the front, y lowest: hidden from nowhere
    const PngImage sound = picture_of(box);
    const PngImage holed = picture_of(open);
    for (const Tile tile : {Tile::axial, Tile::sagittal, Tile::coronal, Tile::surface}) {
        EXPECT_EQ(count(sound, tile, is_red), 0);
        EXPECT_GT(count(holed, tile, is_red), 100);
    }
}

TEST(OverviewPicture, SidesThatFaceAwayFromFreeSpaceAreBlue) {
    const PngImage sound = decoded(ball_png());
    const PngImage inside_out = picture_of(test::reversed(test::icosphere(0.02, 3)));
    for (const Tile tile : {Tile::axial, Tile::sagittal, Tile::coronal, Tile::surface}) {
        EXPECT_EQ(count(sound, tile, is_blue), 0);
        EXPECT_GT(count(inside_out, tile, is_blue), 10000);
    }
}

TEST(OverviewPicture, MeshIsNotMirrored) {
    // A ball with a small one on the patient's left, in front and above.
    TriangleMesh mesh = test::icosphere(0.02, 3);
    test::append(mesh, test::icosphere(0.005, 2, Vec3(0.03, -0.04, 0.05)));
    const PngImage image = picture_of(mesh);
    const auto is_bone = [](const Colour& c) { return c[0] > c[2]; };
    const auto upper = [&](Tile tile, bool right) {
        int sum = 0;
        for_each_pixel(image, tile, [&](int x, int y, const Colour& c) {
            if (y < 100 && (x >= kOverviewTile / 2) == right) sum += is_bone(c) ? 1 : 0;
        });
        return sum;
    };
    EXPECT_GT(upper(Tile::axial, true), 0); // front: left is right
    EXPECT_EQ(upper(Tile::axial, false), 0);
    EXPECT_GT(upper(Tile::sagittal, false), 0); // from the left: front is left
    EXPECT_EQ(upper(Tile::sagittal, true), 0);
    EXPECT_GT(upper(Tile::coronal, false), 0); // from above, front up: left is left
    EXPECT_EQ(upper(Tile::coronal, true), 0);
}

TEST(OverviewPicture, MeshWithoutAnAreaIsRefused) {
    const auto mesh = std::make_shared<TriangleMesh>();
    mesh->vertices = {Vec3(0.0), Vec3(0.01), Vec3(0.02)};
    mesh->triangles = {{0, 1, 2}};
    EXPECT_THROW(overview_png(mesh), std::invalid_argument);
}

} // namespace
} // namespace palpate
