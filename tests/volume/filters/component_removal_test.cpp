// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/filters/volume_filters.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::sampled;
using test::sheared_frame;

bool same_bits(const VoxelNumbers<float>& a, const VoxelNumbers<float>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

// --- padding ---------------------------------------------------------------------------------

constexpr double kMm = 1e-3;

/// Brute force: sizes of 26-connected parts by flood filling, largest first; labels beside.
std::vector<std::size_t> flood_sizes(const VoxelVolume& v, double level, std::vector<int>& labels) {
    labels.assign(v.voxels(), -1);
    std::vector<std::size_t> sizes;
    for (int k = 0; k < v.size[2]; ++k)
        for (int j = 0; j < v.size[1]; ++j)
            for (int i = 0; i < v.size[0]; ++i) {
                if (!(v.at(i, j, k) >= level) || labels[v.index(i, j, k)] >= 0) continue;
                const int label = static_cast<int>(sizes.size());
                sizes.push_back(0);
                std::deque<std::array<int, 3>> open{{i, j, k}};
                labels[v.index(i, j, k)] = label;
                while (!open.empty()) {
                    const auto [x, y, z] = open.front();
                    open.pop_front();
                    ++sizes.back();
                    for (int n = 0; n < 27; ++n) {
                        const int a = x + n % 3 - 1, b = y + n / 3 % 3 - 1, c = z + n / 9 - 1;
                        if (a < 0 || b < 0 || c < 0 || a >= v.size[0] || b >= v.size[1] ||
                            c >= v.size[2] || !(v.at(a, b, c) >= level) ||
                            labels[v.index(a, b, c)] >= 0)
                            continue;
                        labels[v.index(a, b, c)] = label;
                        open.push_back({a, b, c});
                    }
                }
            }
    return sizes;
}

VoxelVolume random_crumbs(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
    VoxelVolume volume =
        sampled({30, 25, 20}, sheared_frame(kMm), [&](const Vec3&) { return uniform(random); });
    volume.values[123] = std::nanf(""); // belongs to nothing
    return volume;
}

TEST(RemoveComponents, FindsTheSamePartsAsFloodFilling) {
    for (const unsigned seed : {1U, 2U, 3U}) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        VoxelVolume volume = random_crumbs(seed);
        const VoxelVolume before = volume;
        std::vector<int> labels;
        auto sizes = flood_sizes(volume, 0.94, labels);
        std::sort(sizes.rbegin(), sizes.rend());
        const auto found = remove_components(volume, 0.94, {}, 0.1);
        ASSERT_EQ(found.size(), sizes.size());
        const double voxel_mm3 = 1e9 * std::abs(glm::determinant(volume.index_to_scene.linear));
        for (std::size_t n = 0; n < sizes.size(); ++n) {
            EXPECT_EQ(found[n].voxels, sizes[n]);
            EXPECT_DOUBLE_EQ(found[n].volume_mm3, voxel_mm3 * static_cast<double>(sizes[n]));
            EXPECT_TRUE(found[n].kept);
        }
        EXPECT_TRUE(same_bits(volume.values, before.values));
    }
}

TEST(RemoveComponents, RemovedPartsLeaveNoCornerAtTheLevelAndKeptOnesNoBitChanged) {
    SCOPED_TRACE("seed 4");
    VoxelVolume volume = random_crumbs(4);
    const VoxelVolume before = volume;
    std::vector<int> labels;
    const auto sizes = flood_sizes(before, 0.94, labels);
    ComponentPolicy policy;
    policy.kind = ComponentPolicy::Kind::largest;
    const auto found = remove_components(volume, 0.94, policy, 0.1);
    const auto largest = std::max_element(sizes.begin(), sizes.end()) - sizes.begin();
    for (std::size_t n = 0; n < labels.size(); ++n) {
        if (labels[n] >= 0 && labels[n] != largest) {
            EXPECT_EQ(volume.values[n], static_cast<float>(0.94 - 0.1));
        } else {
            EXPECT_EQ(std::memcmp(&volume.values[n], &before.values[n], sizeof(float)), 0);
        }
    }
    EXPECT_EQ(std::count_if(found.begin(), found.end(), [](const auto& c) { return c.kept; }), 1);
    std::vector<int> ignored;
    EXPECT_EQ(flood_sizes(volume, 0.94, ignored).size(), 1U);
}

/// Blocks of 27, 8, 8 and 1 voxels that touch nothing.
VoxelVolume blocks() {
    VoxelVolume volume = sampled({16, 8, 8}, AffineTransform{Mat3(2 * kMm), Vec3(0.0)},
                                 [](const Vec3&) { return -100.0; });
    const auto fill = [&](int i0, int edge) {
        for (int k = 1; k < 1 + edge; ++k)
            for (int j = 1; j < 1 + edge; ++j)
                for (int i = i0; i < i0 + edge; ++i)
                    volume.values[volume.index(i, j, k)] = 50.0F;
    };
    fill(1, 3);
    fill(6, 2);
    fill(9, 2);
    fill(13, 1);
    return volume;
}

std::vector<bool> kept_after(const ComponentPolicy& policy) {
    VoxelVolume volume = blocks();
    std::vector<bool> kept;
    for (const auto& component : remove_components(volume, 0.0, policy, 1.0))
        kept.push_back(component.kept);
    return kept;
}

TEST(RemoveComponents, FollowsThePolicy) {
    using Kind = ComponentPolicy::Kind;
    EXPECT_EQ(kept_after({Kind::all, 1, 0.0}), (std::vector<bool>{true, true, true, true}));
    EXPECT_EQ(kept_after({Kind::largest, 1, 0.0}), (std::vector<bool>{true, false, false, false}));
    EXPECT_EQ(kept_after({Kind::count, 2, 0.0}), (std::vector<bool>{true, true, false, false}));
    EXPECT_EQ(kept_after({Kind::count, 9, 0.0}), (std::vector<bool>{true, true, true, true}));
    // 8 voxels of 8 mm3 are 64 mm3 within rounding: the thresholds lie off that value.
    EXPECT_EQ(kept_after({Kind::volume, 1, 63.9}), (std::vector<bool>{true, true, true, false}));
    EXPECT_EQ(kept_after({Kind::volume, 1, 64.1}), (std::vector<bool>{true, false, false, false}));
}

TEST(RemoveComponents, OfEqualsTheFirstInTheVolumeComesFirstAndSamplesLieInside) {
    VoxelVolume volume = blocks();
    const auto found = remove_components(volume, 0.0, {}, 1.0);
    ASSERT_EQ(found.size(), 4U);
    EXPECT_EQ(found[1].sample, volume.index_to_scene.point({6, 1, 1}));
    EXPECT_EQ(found[2].sample, volume.index_to_scene.point({9, 1, 1}));
    EXPECT_EQ(found[3].sample, volume.index_to_scene.point({13, 1, 1}));
}

TEST(RemoveComponents, CornersConnect) {
    VoxelVolume volume = blocks();
    volume.values[volume.index(4, 4, 4)] = 50.0F; // diagonal neighbour of the block's last voxel
    const auto found = remove_components(volume, 0.0, {}, 1.0);
    ASSERT_EQ(found.size(), 4U);
    EXPECT_EQ(found[0].voxels, 28U);
}

TEST(RemoveComponents, WithoutMaterialThereIsNothingToDo) {
    VoxelVolume volume = blocks();
    EXPECT_TRUE(remove_components(volume, 60.0, {}, 1.0).empty());
}

// A pressure in Pa, for one: 101325 - 0.002 is 101325 in float, and is no material all the same.
TEST(RemoveComponents, OfALevelFarAboveItsMarginTakesTheNextValueBelowIt) {
    VoxelVolume volume = blocks();
    for (float& value : volume.values)
        value = value < 0.0F ? 101324.0F : 101326.0F;
    const std::vector<float> before(volume.values.begin(), volume.values.end());
    ComponentPolicy largest;
    largest.kind = ComponentPolicy::Kind::largest;
    remove_components(volume, 101325.0, largest, 0.002);
    std::size_t removed = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
        if (volume.values[i] == before[i]) continue;
        ++removed;
        EXPECT_LT(volume.values[i], 101325.0);
        EXPECT_GT(volume.values[i], 101324.9);
    }
    EXPECT_GT(removed, 0u);
}

TEST(RemoveComponents, RefusesAMarginThatLeavesTheLevelReached) {
    VoxelVolume volume = blocks();
    EXPECT_THROW(remove_components(volume, 0.0, {}, 0.0), std::invalid_argument);
    EXPECT_THROW(remove_components(volume, 0.0, {}, -1.0), std::invalid_argument);
    EXPECT_THROW(remove_components(volume, std::nan(""), {}, 1.0), std::invalid_argument);
    ComponentPolicy none;
    none.kind = ComponentPolicy::Kind::count;
    none.count = 0;
    EXPECT_THROW(remove_components(volume, 0.0, none, 1.0), std::invalid_argument);
}

} // namespace
} // namespace palpate
