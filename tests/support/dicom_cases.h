// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/volume/formats/volume_file.h>

#include "tests/support/dicom_writer.h"
#include "tests/support/expect_says.h"
#include "tests/support/test_volumes.h"

/// Volumes that are written as DICOM slices, and what a test says of reading them back.
namespace palpate::test {

inline constexpr double kMm = 1e-3;

// Decimal strings hold 10 digits or more of a position below a metre, and 12 of a direction.
inline constexpr double kSamePlace = 1e-9; // m: 1e-6 mm

inline const VolumeSelection kRepair{{}, {}, VolumeSelection::Slices::repair, {}};

inline constexpr DicomEncoding kExplicit{true, false, false};
inline constexpr DicomEncoding kImplicit{false, false, false};
inline constexpr DicomEncoding kBig{true, true, false};

inline AffineTransform straight_frame() {
    return {Mat3(0.5 * kMm, 0, 0, 0, 0.75 * kMm, 0, 0, 0, 2.5 * kMm), Vec3(-0.1, -0.12, 0.03)};
}

/// Every voxel has a value of its own, which tells where it was.
inline VoxelVolume numbered(const std::array<int, 3>& size, const AffineTransform& frame) {
    VoxelVolume volume = sampled(size, frame, [](const Vec3&) { return 0.0; });
    for (std::size_t n = 0; n < volume.values.size(); ++n)
        volume.values[n] = static_cast<float>(n);
    return volume;
}

/// Largest distance of a voxel from where the written volume has it, m.
inline double displacement(const VoxelVolume& read, const VoxelVolume& written) {
    if (read.values.size() != written.values.size()) return std::numeric_limits<double>::infinity();
    double largest = 0.0;
    for (int k = 0; k < read.size[2]; ++k)
        for (int j = 0; j < read.size[1]; ++j)
            for (int i = 0; i < read.size[0]; ++i) {
                const int n = static_cast<int>(read.at(i, j, k));
                const Vec3 index(n % written.size[0], n / written.size[0] % written.size[1],
                                 n / (written.size[0] * written.size[1]));
                const Vec3 expected = written.index_to_scene.point(index);
                const Vec3 found = read.index_to_scene.point(Vec3(i, j, k));
                largest = std::max(largest, glm::length(found - expected));
            }
    return largest;
}

/// DICOM RLE: a segment for each byte of the numbers, the most significant first, in literal runs.
inline std::string rle(const std::string& bytes) {
    std::string segments;
    std::vector<std::uint32_t> header(16, 0);
    header[0] = 2;
    for (const std::size_t part : {std::size_t{1}, std::size_t{0}}) {
        header[2 - part] = static_cast<std::uint32_t>(64 + segments.size());
        std::string plane;
        for (std::size_t at = part; at < bytes.size(); at += 2)
            plane += bytes[at];
        for (std::size_t at = 0; at < plane.size(); at += 128) {
            const std::string run = plane.substr(at, 128);
            segments += static_cast<char>(run.size() - 1) + run;
        }
        if (segments.size() % 2 != 0) segments += '\0';
    }
    std::string result;
    for (const std::uint32_t number : header)
        append(result, number);
    return result + segments;
}

inline constexpr const char* kRle = "1.2.840.10008.1.2.5";

/// One line, with a remedy, nothing of the patient in it.
inline std::string refusal_of(const std::filesystem::path& path,
                              const VolumeSelection& selection = {}) {
    std::string message;
    try {
        read_volume(path, selection);
    } catch (const std::runtime_error& error) {
        message = error.what();
    }
    EXPECT_NE(message, "") << "was read: " << path;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    EXPECT_NE(message.find("; "), std::string::npos) << "no remedy: " << message;
    EXPECT_EQ(message.find("Nobody"), std::string::npos) << message;
    return message;
}

inline std::string joined(const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines)
        text += line + "\n";
    return text;
}

/// Writes the slices of a volume after each was changed.
inline void write_changed(const std::filesystem::path& folder, const VoxelVolume& volume,
                          const std::function<void(int, DicomDataSet&)>& change,
                          const DicomSeriesOptions& options = {}) {
    for (int k = 0; k < volume.size[2]; ++k) {
        DicomDataSet slice = dicom_slice(volume, k, options);
        change(k, slice);
        make_file(folder / ("s" + std::to_string(k) + ".dcm"), dicom_file(slice, options.encoding));
    }
}

} // namespace palpate::test
