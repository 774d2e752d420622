// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include <palpate/volume/formats/volume_file.h>
#include <palpate/volume/voxel_volume.h>

#include "tests/support/temporary_folder.h"

/// Volumes made from formulas, and a place for their files.
namespace palpate::test {

/// An oblique, anisotropic, left-handed frame without a zero in it: what readers and filters must
/// not confuse. Columns are perpendicular; m.
inline AffineTransform oblique_frame(const Vec3& spacing_m, const Vec3& offset_m) {
    const Vec3 x = glm::normalize(Vec3(0.8, 0.5, -0.2));
    const Vec3 y = glm::normalize(glm::cross(Vec3(0.1, 0.3, 0.9), x));
    const Vec3 z = -glm::cross(x, y);
    return {Mat3(spacing_m.x * x, spacing_m.y * y, spacing_m.z * z), offset_m};
}

/// A frame whose axes are neither perpendicular nor of one length, m.
inline AffineTransform sheared_frame(double spacing_m) {
    return {spacing_m * Mat3(Vec3(1.0, 0.1, 0.0), Vec3(0.3, -0.9, 0.2), Vec3(0.2, 0.1, 1.4)),
            Vec3(0.01, -0.02, 0.03)};
}

/// A volume with value(scene point) at every voxel.
template <class Function>
VoxelVolume sampled(const std::array<int, 3>& size, const AffineTransform& frame,
                    const Function& value) {
    VoxelVolume volume;
    volume.size = size;
    volume.index_to_scene = frame;
    volume.values.resize(volume.voxels());
    for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j)
            for (int i = 0; i < size[0]; ++i)
                volume.values[volume.index(i, j, k)] =
                    static_cast<float>(value(frame.point(Vec3(i, j, k))));
    return volume;
}

/// Scene point of the middle of a volume of that size.
inline Vec3 middle_of(const std::array<int, 3>& size, const AffineTransform& frame) {
    return frame.point(0.5 * Vec3(size[0] - 1, size[1] - 1, size[2] - 1));
}

/// The message of reading that file; it must be one line that begins with the file's name, and
/// nothing may be printed meanwhile.
inline std::string refusal(const std::filesystem::path& file) {
    testing::internal::CaptureStderr();
    testing::internal::CaptureStdout();
    std::string message;
    try {
        read_volume(file);
    } catch (const std::runtime_error& error) {
        message = error.what();
    }
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "") << file;
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << file;
    EXPECT_NE(message, "") << "was read: " << file;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    EXPECT_LT(message.size(), 600U) << message;
    EXPECT_NE(message.find("; "), std::string::npos) << "no remedy: " << message;
    return message;
}

#define EXPECT_REFUSED(file, words)                                                                \
    do {                                                                                           \
        const std::string message_ = palpate::test::refusal(file);                                 \
        EXPECT_NE(message_.find(words), std::string::npos) << message_;                            \
        EXPECT_EQ(message_.find((file).parent_path().string()), 0U) << message_;                   \
    } while (false)

/// Largest distance of two maps over ten voxels along each axis, m.
inline double distance(const AffineTransform& a, const AffineTransform& b) {
    double largest = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3 index(10 * (corner & 1), 10 * (corner >> 1 & 1), 10 * (corner >> 2));
        largest = std::max(largest, glm::length(a.point(index) - b.point(index)));
    }
    return largest;
}

/// 11 x 7 x 5 values of a fixed seed.
inline VoxelVolume random_volume(const AffineTransform& frame) {
    std::mt19937 random(11);
    std::uniform_real_distribution<float> uniform(-1000.0F, 3000.0F);
    return sampled({11, 7, 5}, frame, [&](const Vec3&) { return uniform(random); });
}

template <class T>
void append(std::string& bytes, T value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

/// The bytes of an int16 volume 0, 1, 2 ...
inline std::string counting(int voxels) {
    std::string bytes;
    for (int n = 0; n < voxels; ++n)
        append<std::int16_t>(bytes, static_cast<std::int16_t>(n));
    return bytes;
}

/// A frame stated in mm.
inline AffineTransform frame_mm(const Mat3& linear, const Vec3& offset) {
    return {1e-3 * linear, 1e-3 * offset};
}

} // namespace palpate::test
