// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <png.h>

namespace palpate::test {

/// A picture to look into, pixel by pixel.
struct PngImage {
    int width = 0;
    int height = 0;
    std::vector<std::uint8_t> rgb;

    std::array<int, 3> at(int x, int y) const {
        const auto first = 3 * static_cast<std::size_t>(y * width + x);
        return {rgb[first], rgb[first + 1], rgb[first + 2]};
    }
};

/// Reads the bytes of a PNG file; what is none fails the test.
inline PngImage decoded(const std::string& bytes) {
    png_image png;
    std::memset(&png, 0, sizeof png);
    png.version = PNG_IMAGE_VERSION;
    PngImage image;
    if (png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) == 0) {
        ADD_FAILURE() << png.message;
        return image;
    }
    png.format = PNG_FORMAT_RGB;
    image.width = static_cast<int>(png.width);
    image.height = static_cast<int>(png.height);
    image.rgb.resize(PNG_IMAGE_SIZE(png));
    EXPECT_NE(png_image_finish_read(&png, nullptr, image.rgb.data(), 0, nullptr), 0);
    return image;
}

} // namespace palpate::test
