// SPDX-License-Identifier: Apache-2.0
// Overviews of labels, vectors, tensors and meshes.
#include <palpate/engine/picture/overview_picture.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "tests/engine/picture/overview_pixels.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

using test::ball_png;
using test::Colour;
using test::count;
using test::decoded;
using test::for_each_pixel;
using test::kHalfTile;
using test::pixel;
using test::PngImage;
using test::Tile;

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

TEST(OverviewPicture, VerticesOfNoTriangleChangeNothing) {
    const auto plain = std::make_shared<TriangleMesh>(test::box_mesh(Vec3(-0.02), Vec3(0.02)));
    const auto stray = std::make_shared<TriangleMesh>(*plain);
    stray->vertices.push_back({3.0, -2.0, 5.0}); // m
    EXPECT_TRUE(overview_png(stray) == overview_png(plain));
}

} // namespace
} // namespace palpate
