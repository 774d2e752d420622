// SPDX-License-Identifier: Apache-2.0
// An oblique MR series whose first file is malformed: 2.5 MB of zeros follow its pixels, over which
// a library spent minutes before it accepted them. scripts/fetch_data.sh gets it (set: dicom).
#include <palpate/volume/formats/volume_file.h>

#include <cmath>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

std::filesystem::path series() {
    const char* folder = std::getenv("PALPATE_REAL_DATA");
    return std::filesystem::path(folder ? folder : "") / "dicom";
}

#define PALPATE_NEEDS_SERIES()                                                                     \
    if (!std::filesystem::exists(series() / "brain_020.dcm"))                                      \
    GTEST_SKIP() << series() << " is not there; scripts/fetch_data.sh gets it"

TEST(DicomData, TheMalformedSliceIsRefusedByName) {
    PALPATE_NEEDS_SERIES();
    try {
        read_volume(series());
        ADD_FAILURE() << "was read";
    } catch (const std::runtime_error& error) {
        const std::string message = error.what();
        EXPECT_NE(message.find("brain_001.dcm: is damaged"), std::string::npos) << message;
    }
    EXPECT_THROW(read_volume(series() / "brain_001.dcm"), std::runtime_error);
}

/// Every voxel against the arithmetic of the headers, which `dcmdump` shows.
void expect_placed(const VoxelVolume& volume, int slices, double first_y_mm, double first_z_mm) {
    EXPECT_EQ(volume.size, (std::array<int, 3>{256, 256, slices}));
    EXPECT_EQ(volume.source_type, "int16");
    EXPECT_EQ(value_range(volume), (std::array<double, 2>{0.0, 1059.0}));
    const Mat3& linear = volume.index_to_scene.linear;
    // Image Orientation 1\0\0\0\0.990960\0.134..., six digits, made a rotation again.
    EXPECT_NEAR(glm::length(linear[0] - Vec3(0.859375e-3, 0, 0)), 0.0, 1e-15);
    EXPECT_NEAR(linear[1].y / 0.859375e-3, 0.990960, 1e-6);
    EXPECT_NEAR(glm::length(linear[1]), 0.859375e-3, 1e-15);
    // Positions are rounded to 0.1 mm: over 126 mm of slices, 0.1 / 126 of a radian.
    EXPECT_NEAR(glm::dot(linear[1], linear[2]), 0.0, 7e-3 * 0.86e-3 * 1e-3);
    EXPECT_NEAR(glm::length(linear[2]), 7e-3, 0.01e-3); // nominal; stated positions give 6.9966
    const Vec3 origin(-110.5e-3, first_y_mm * 1e-3, first_z_mm * 1e-3);
    EXPECT_NEAR(glm::length(volume.index_to_scene.offset - origin), 0.0, 1e-12);
}

TEST(DicomData, TheOtherSlicesAreReadWithoutIt) {
    PALPATE_NEEDS_SERIES();
    const VoxelVolume volume = read_volume(series(), {{}, {}, VolumeSelection::Slices::repair, {}});
    expect_placed(volume, 19, -79.3063, -65.7575);
    ASSERT_EQ(volume.warnings.size(), 1U);
    EXPECT_NE(volume.warnings[0].find("brain_001.dcm is damaged"), std::string::npos);
    EXPECT_EQ(list_volumes(series()).size(), 1U);
}

TEST(DicomData, TheMalformedSliceIsSoundWithoutWhatFollowsIt) {
    PALPATE_NEEDS_SERIES();
    const test::TemporaryFolder folder;
    for (const auto& entry : std::filesystem::directory_iterator(series()))
        std::filesystem::copy(entry.path(), folder.path());
    std::filesystem::resize_file(folder / "brain_001.dcm", 132914); // as long as the others are
    const VoxelVolume volume = read_volume(folder.path());
    expect_placed(volume, 20, -78.3063, -72.7575);
    EXPECT_TRUE(volume.warnings.empty());
}

} // namespace
} // namespace palpate
