// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <palpate/engine/picture/internal/canvas.h>
#include <palpate/engine/picture/overview_picture.h>

#include "tests/support/png_image.h"
#include "tests/support/test_meshes.h"
#include "tests/support/test_volumes.h"

namespace palpate::test {

using internal::Canvas;
using internal::kLetterReach;

using Colour = std::array<int, 3>;
using Mask = std::vector<bool>;

inline constexpr double kHalfTile = 0.5 * kOverviewTile;

enum class Tile { axial, coronal, sagittal, surface };

/// Upper left corner of a tile.
inline std::array<int, 2> corner_of(Tile tile) {
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

inline Colour pixel(const PngImage& image, Tile tile, double x, double y) {
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

inline int count(const PngImage& image, Tile tile, const std::function<bool(const Colour&)>& is) {
    int sum = 0;
    for_each_pixel(image, tile, [&](int, int, const Colour& c) { sum += is(c) ? 1 : 0; });
    return sum;
}

inline bool is_grey(const Colour& c) { return c[0] == c[1] && c[1] == c[2]; }

struct Spot {
    double x = 0.0;
    double y = 0.0;
    double light = 0.0;
};

/// Where the light of a tile is; black counts nothing, and what is outside of the volume is not
/// grey.
inline Spot spot_of(const PngImage& image, Tile tile) {
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
inline Box bounds_of(const VoxelVolume& volume) {
    Box box;
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 q;
        for (int axis = 0; axis < 3; ++axis)
            q[axis] = corner >> axis & 1 ? volume.size[static_cast<std::size_t>(axis)] - 0.5 : -0.5;
        box.add(volume.index_to_scene.point(q));
    }
    return box;
}

inline double pixel_m(const Box& content) {
    const Vec3 extent = content.extent();
    return std::max({extent.x, extent.y, extent.z}) / (kOverviewTile - 2 * kOverviewMargin);
}

/// The picture of a ball, which several tests compare with: drawn once.
inline const std::string& ball_png() {
    static const std::string bytes =
        overview_png(std::make_shared<const TriangleMesh>(test::icosphere(0.02, 3)));
    return bytes;
}

} // namespace palpate::test
