// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/slice_voxels.h>

#include <limits>

#include <gtest/gtest.h>

namespace palpate {
namespace {

/// A value that grows along i; voxels of 1, 2 and 3 mm.
VoxelVolume ramp(const std::array<int, 3>& size) {
    VoxelVolume volume;
    volume.size = size;
    volume.index_to_scene.linear = Mat3(1e-3, 0, 0, 0, 2e-3, 0, 0, 0, 3e-3);
    volume.index_to_scene.offset = {0.1, 0.2, 0.3};
    for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j)
            for (int i = 0; i < size[0]; ++i)
                volume.values.push_back(static_cast<float>(10 * i));
    return volume;
}

TEST(SliceVoxels, KeepTheirValuesToHalfAStep) {
    const VoxelVolume volume = ramp({100, 3, 2});
    const SliceVoxels slices = slice_voxels("v", volume);
    EXPECT_EQ(slices.shape, volume.size);
    const double step = (slices.high - slices.low) / 255.0;
    for (std::size_t at = 0; at < slices.values.size(); ++at) {
        const double value = volume.values[at];
        if (value < slices.low || value > slices.high) continue;
        EXPECT_NEAR(slices.low + step * slices.values[at], value, 0.51 * step);
    }
    EXPECT_LE(slices.window[0], slices.window[1]);
}

TEST(SliceVoxels, OfALargeVolumeAreMeansThatLieInTheirMiddle) {
    const SliceVoxels slices = slice_voxels("v", ramp({300, 2, 1}), 128);
    EXPECT_EQ(slices.shape, (std::array<int, 3>{100, 2, 1})); // blocks of three
    // The mean of voxels 0, 1, 2 is at voxel 1.
    const Vec3 first = slices.index_to_scene.point(Vec3(0.0));
    EXPECT_NEAR(first.x, 0.101, 1e-15);
    EXPECT_NEAR(slices.index_to_scene.point(Vec3(99, 1, 0)).x, 0.1 + 0.298, 1e-15);
    const double step = (slices.high - slices.low) / 255.0;
    EXPECT_NEAR(slices.low + step * slices.values[50], 10.0 * 151.0, 0.51 * step);
}

TEST(SliceVoxels, LeaveOutWhatIsNoNumber) {
    VoxelVolume volume = ramp({4, 1, 1});
    volume.values[1] = std::numeric_limits<float>::quiet_NaN();
    volume.values[2] = std::numeric_limits<float>::infinity();
    const SliceVoxels slices = slice_voxels("v", volume);
    EXPECT_EQ(slices.low, 0.0);
    EXPECT_GT(slices.high, slices.low);
    EXPECT_EQ(slices.values[1], 0);
    VoxelVolume none = ramp({2, 1, 1});
    none.values[0] = none.values[1] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(slice_voxels("v", none).values, (std::vector<std::uint8_t>{0, 0}));
}

} // namespace
} // namespace palpate
