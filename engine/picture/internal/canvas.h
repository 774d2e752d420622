// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace palpate::internal {

/// Red, green, blue, sRGB, as a picture's file has them.
using Rgb = std::array<std::uint8_t, 3>;

/// A PNG file of `rgb`, three bytes a pixel, rows from the top.                        [setup]
/// Throws std::runtime_error where libpng cannot.
std::string png_bytes(int width, int height, std::span<const std::uint8_t> rgb);

/// A picture that is put together from tiles and letters. Places are pixels from the upper left
/// corner; what lies outside is cut off.                                               [setup]
class Canvas {
public:
    Canvas(int width, int height, const Rgb& color);

    int width() const noexcept { return width_; }
    int height() const noexcept { return height_; }

    void set(int x, int y, const Rgb& color) noexcept;

    /// Puts a picture of `width` pixels, three bytes each, with its upper left corner at x, y.
    void put(int x, int y, int width, std::span<const std::uint8_t> rgb) noexcept;

    /// A letter around that place, white with a dark rim so that it can be read on anything. Of the
    /// letters that name patient directions: R, L, A, P, S, I; others leave no trace.
    void draw_letter(char letter, int x, int y) noexcept;

    std::string png() const { return png_bytes(width_, height_, rgb_); }

private:
    int width_;
    int height_;
    std::vector<std::uint8_t> rgb_;
};

/// Pixels from a letter's middle to the farthest of its rim, across and down.
inline constexpr int kLetterReach = 13;

} // namespace palpate::internal
