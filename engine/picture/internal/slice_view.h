// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <optional>

#include <palpate/engine/picture/internal/canvas.h>
#include <palpate/geometry/vec.h>

namespace palpate::internal {

/// A plane through the patient and how it is laid on a square tile.
struct SliceView {
    Vec3 middle;    ///< scene point in the middle of the tile, m
    Vec3 right;     ///< unit, scene frame, along the tile's rows
    Vec3 down;      ///< unit, scene frame, along its columns
    double pixel_m; ///< m per pixel

    /// Scene point of a place on a tile of `size` pixels, m.
    Vec3 point(double x, double y, int size) const noexcept {
        return middle + right * ((x - 0.5 * size) * pixel_m) + down * ((y - 0.5 * size) * pixel_m);
    }
};

/// Axial, coronal and sagittal views of `content`, of one scale, through a point; as radiologists
/// look: the patient's right on the left, anterior up or on the left, superior up.       [setup]
std::array<SliceView, 3> slice_views(const Box& content, const Vec3& through, int size, int margin);

/// What a slice shows at a scene point; nothing outside of the image.
using SliceColor = std::function<std::optional<Rgb>(const Vec3&)>;

/// Draws a slice as a tile of `size` pixels, letters included.                         [setup]
void draw_slice(Canvas& canvas, int left, int top, int size, const SliceView& view,
                const SliceColor& color);

/// The letter of the patient direction that `direction` runs along; a blank when it is oblique.
/// [any]
char direction_letter(const Vec3& direction) noexcept;

/// Letters at the middles of a tile's edges for the directions along its rows and columns; none for
/// oblique ones. [setup]
void draw_edge_letters(Canvas& canvas, int left, int top, int size, const Vec3& right,
                       const Vec3& down);

} // namespace palpate::internal
