// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/picture/internal/canvas.h>

#include <cstring>
#include <stdexcept>

#include <fmt/format.h>
#include <png.h>

#include <palpate/engine/text/internal/png_mark.h>

namespace palpate::internal {
namespace {

constexpr int kGlyphWidth = 5;
constexpr int kGlyphHeight = 7;
constexpr int kGlyphScale = 3; // pixels of the picture for one of the glyph

struct Glyph {
    char letter;
    std::array<const char*, kGlyphHeight> rows;
};
constexpr std::array<Glyph, 6> kGlyphs{
    {{'R', {"####.", "#...#", "#...#", "####.", "#.#..", "#..#.", "#...#"}},
     {'L', {"#....", "#....", "#....", "#....", "#....", "#....", "#####"}},
     {'A', {"..#..", ".#.#.", "#...#", "#...#", "#####", "#...#", "#...#"}},
     {'P', {"####.", "#...#", "#...#", "####.", "#....", "#....", "#...."}},
     {'S', {".####", "#....", "#....", ".###.", "....#", "....#", "####."}},
     {'I', {".###.", "..#..", "..#..", "..#..", "..#..", "..#..", ".###."}}}};

const Glyph* glyph_of(char letter) noexcept {
    for (const Glyph& glyph : kGlyphs)
        if (glyph.letter == letter) return &glyph;
    return nullptr;
}

} // namespace

std::string png_bytes(int width, int height, std::span<const std::uint8_t> rgb) {
    png_image image;
    std::memset(&image, 0, sizeof image);
    image.version = PNG_IMAGE_VERSION;
    image.format = PNG_FORMAT_RGB;
    image.width = static_cast<png_uint_32>(width);
    image.height = static_cast<png_uint_32>(height);
    // The bound is above what any picture takes: no second compression just to learn the size.
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
    std::string bytes(size, '\0');
    if (png_image_write_to_memory(&image, bytes.data(), &size, 0, rgb.data(), 0, nullptr) == 0)
        throw std::runtime_error(fmt::format("libpng cannot make a picture ({})", image.message));
    bytes.resize(size);
    bytes.insert(kPngMarkAt, kPngMark);
    return bytes;
}

Canvas::Canvas(int width, int height, const Rgb& color) : width_(width), height_(height) {
    rgb_.reserve(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (int pixel = 0; pixel < width * height; ++pixel)
        rgb_.insert(rgb_.end(), color.begin(), color.end());
}

void Canvas::set(int x, int y, const Rgb& color) noexcept {
    if (x < 0 || x >= width_ || y < 0 || y >= height_) return;
    const auto pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                       static_cast<std::size_t>(x);
    std::copy(color.begin(), color.end(), rgb_.begin() + static_cast<std::ptrdiff_t>(3 * pixel));
}

void Canvas::put(int x, int y, int width, std::span<const std::uint8_t> rgb) noexcept {
    int column = 0;
    int row = 0;
    for (std::size_t i = 0; i + 2 < rgb.size(); i += 3) {
        set(x + column, y + row, {rgb[i], rgb[i + 1], rgb[i + 2]});
        if (++column < width) continue;
        column = 0;
        ++row;
    }
}

void Canvas::draw_letter(char letter, int x, int y) noexcept {
    const Glyph* glyph = glyph_of(letter);
    if (!glyph) return;
    constexpr Rgb kInk{255, 255, 255};
    constexpr Rgb kRim{20, 22, 28};
    constexpr int kRimWidth = 2; // pixels
    const int left = x - kGlyphWidth * kGlyphScale / 2;
    const int top = y - kGlyphHeight * kGlyphScale / 2;
    const auto fill = [&](int rim, const Rgb& color) {
        for (int row = 0; row < kGlyphHeight; ++row)
            for (int column = 0; column < kGlyphWidth; ++column) {
                if (glyph->rows[static_cast<std::size_t>(row)][column] != '#') continue;
                for (int dy = -rim; dy < kGlyphScale + rim; ++dy)
                    for (int dx = -rim; dx < kGlyphScale + rim; ++dx)
                        set(left + column * kGlyphScale + dx, top + row * kGlyphScale + dy, color);
            }
    };
    fill(kRimWidth, kRim);
    fill(0, kInk);
}

} // namespace palpate::internal
