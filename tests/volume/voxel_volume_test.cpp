// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/voxel_volume.h>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

VoxelVolume with_axes(const Vec3& i, const Vec3& j, const Vec3& k) {
    VoxelVolume volume;
    volume.size = {4, 5, 6};
    volume.index_to_scene = {Mat3(i, j, k), Vec3(1.0, 2.0, 3.0)};
    return volume;
}

TEST(VoxelVolume, FirstIndexRunsFastest) {
    VoxelVolume volume;
    volume.size = {2, 3, 4};
    volume.values.resize(volume.voxels());
    std::size_t expected = 0;
    for (int k = 0; k < 4; ++k)
        for (int j = 0; j < 3; ++j)
            for (int i = 0; i < 2; ++i)
                EXPECT_EQ(volume.index(i, j, k), expected++);
    EXPECT_EQ(expected, volume.voxels());
}

TEST(ValueRange, IgnoresWhatIsNotFinite) {
    VoxelVolume volume;
    volume.values = {std::nanf(""), 3.0F,  -std::numeric_limits<float>::infinity(),
                     7.0F,          -2.0F, std::numeric_limits<float>::infinity()};
    EXPECT_EQ(value_range(volume), (std::array<double, 2>{-2.0, 7.0}));
    volume.values = {5.0F};
    EXPECT_EQ(value_range(volume), (std::array<double, 2>{5.0, 5.0}));
}

TEST(ValueRange, IsZeroWhereNothingIsFinite) {
    VoxelVolume volume;
    EXPECT_EQ(value_range(volume), (std::array<double, 2>{0.0, 0.0}));
    volume.values = {std::nanf("")};
    EXPECT_EQ(value_range(volume), (std::array<double, 2>{0.0, 0.0}));
}

TEST(OrientationInWords, NamesCornerAndDirectionsOfLps) {
    EXPECT_EQ(orientation_in_words(with_axes({1, 0, 0}, {0, 1, 0}, {0, 0, 1})),
              "voxel 0,0,0 lies right, anterior, inferior; i runs to the patient's left, j "
              "posterior, k superior");
}

TEST(OrientationInWords, NamesTheOppositeForRasDirections) {
    EXPECT_EQ(orientation_in_words(with_axes({-1, 0, 0}, {0, -1, 0}, {0, 0, 1})),
              "voxel 0,0,0 lies left, posterior, inferior; i runs to the patient's right, j "
              "anterior, k superior");
}

TEST(OrientationInWords, CornerStaysInPatientOrderWhenAxesArePermuted) {
    // A sagittal series: i to posterior, j to inferior, k to the left.
    EXPECT_EQ(orientation_in_words(with_axes({0, 1, 0}, {0, 0, -1}, {1, 0, 0})),
              "voxel 0,0,0 lies right, anterior, superior; i runs to the patient's posterior, j "
              "inferior, k left");
}

TEST(OrientationInWords, SaysByHowManyDegreesAnAxisIsOff) {
    // tan(10 degrees) = 0.17633: j and k turned about the x axis.
    const double t = 0.17632698;
    EXPECT_EQ(orientation_in_words(with_axes({0.5, 0, 0}, {0, 1, t}, {0, -t, 1})),
              "voxel 0,0,0 lies right, anterior, inferior; i runs to the patient's left, j "
              "posterior (10.0 degrees off), k superior (10.0 degrees off)");
}

TEST(OrientationInWords, EachPatientAxisIsNamedOnceHoweverObliqueTheVolume) {
    // All three axes are nearest to z: only a choice for all of them together keeps words distinct.
    const std::string words =
        orientation_in_words(with_axes({0.6, 0.0, 0.8}, {-0.3, 0.52, 0.8}, {-0.3, -0.52, 0.8}));
    EXPECT_NE(words.find("left"), std::string::npos) << words;
    EXPECT_TRUE(words.find("posterior") != std::string::npos ||
                words.find("anterior") != std::string::npos)
        << words;
    EXPECT_NE(words.find("superior"), std::string::npos) << words;
}

} // namespace
} // namespace palpate
