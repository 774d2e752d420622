// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/label_slices.h>

#include <map>
#include <memory>
#include <set>

#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/view/view_document.h>

#include "tests/engine/view/container_reader.h"

namespace palpate {
namespace {

/// Voxels of 1, 2 and 3 mm, all background.
LabelVolume background(const std::array<int, 3>& size, std::size_t layers = 1) {
    LabelVolume volume;
    volume.size = size;
    volume.index_to_scene.linear = Mat3(1e-3, 0, 0, 0, 2e-3, 0, 0, 0, 3e-3);
    volume.index_to_scene.offset = {0.1, 0.2, 0.3};
    const auto voxels = static_cast<std::size_t>(size[0] * size[1] * size[2]);
    for (std::size_t layer = 0; layer < layers; ++layer)
        volume.layers.emplace_back(std::vector<std::int32_t>(voxels, 0));
    return volume;
}

TEST(LabelSlices, OfASmallVolumeAreItsLabelsByTheirPlaceInTheList) {
    LabelVolume volume = background({4, 3, 2});
    volume.labels = {{"b", 37, 0, std::array<std::uint8_t, 3>{1, 128, 255}}, {"a", -5, 0, {}}};
    volume.layers[0][7] = 37;
    volume.layers[0][8] = -5;
    volume.layers[0][9] = 4; // in no list
    const LabelSlices slices = label_slices("v", volume);
    EXPECT_EQ(slices.shape, volume.size);
    for (std::size_t at = 0; at < slices.values.size(); ++at)
        EXPECT_EQ(slices.values[at], at == 7 ? 1 : at == 8 ? 2 : 0) << at;
    ASSERT_EQ(slices.labels.size(), 2u);
    EXPECT_EQ(slices.labels[0].name, "b");
    EXPECT_EQ(slices.labels[0].color, "#0180ff");
    EXPECT_EQ(slices.labels[1].structure, -1);
}

TEST(LabelSlices, OfALargeVolumeAreWhatCoversMostOfEachBlock) {
    // A brute-force twin: counts of each block of 3 x 3 x 3, the last ones cut off.
    LabelVolume volume = background({8, 7, 4});
    for (int value = 1; value <= 5; ++value)
        volume.labels.push_back({"l", value, 0, {}});
    std::uint32_t random = 1;
    for (std::size_t at = 0; at < volume.layers[0].size(); ++at) {
        random = random * 1664525u + 1013904223u;
        volume.layers[0][at] = static_cast<std::int32_t>(random >> 24) % 6;
    }
    const LabelSlices slices = label_slices("v", volume, 3);
    ASSERT_EQ(slices.shape, (std::array<int, 3>{3, 3, 2})); // of 3, 3 and 2 voxels
    std::size_t at = 0;
    for (int k = 0; k < 4; k += 2)
        for (int j = 0; j < 7; j += 3)
            for (int i = 0; i < 8; i += 3) {
                std::map<int, int> counts;
                for (int dk = k; dk < std::min(k + 2, 4); ++dk)
                    for (int dj = j; dj < std::min(j + 3, 7); ++dj)
                        for (int di = i; di < std::min(i + 3, 8); ++di)
                            ++counts[volume.layers[0][static_cast<std::size_t>(di +
                                                                               8 * (dj + 7 * dk))]];
                int best = 0;
                for (const auto& [value, count] : counts)
                    if (count >= counts[best]) best = value;
                EXPECT_EQ(slices.values[at++], best) << i << ' ' << j << ' ' << k;
            }
    // The middle of the first block: voxel (1, 1, 0.5).
    const Vec3 first = slices.index_to_scene.point(Vec3(0.0));
    EXPECT_LT(glm::length(first - Vec3(0.101, 0.202, 0.3015)), 1e-15);
}

TEST(LabelSlices, WhereSegmentsOverlapTheLastLayerIsSeen) {
    LabelVolume volume = background({3, 1, 1}, 2);
    volume.labels = {{"below", 1, 0, {}}, {"above", 1, 1, {}}};
    volume.layers[0][0] = volume.layers[0][1] = 1;
    volume.layers[1][1] = volume.layers[1][2] = 1;
    EXPECT_EQ(label_slices("v", volume).values, (std::vector<std::uint16_t>{1, 2, 2}));
}

TEST(LabelSlices, GiveEachLabelWithoutAColorAnother) {
    LabelVolume volume = background({1, 1, 1});
    for (int value = 1; value <= 116; ++value)
        volume.labels.push_back({std::to_string(value), value, 0, {}});
    std::set<std::string> colors;
    for (const SliceLabel& label : label_slices("v", volume).labels) {
        EXPECT_EQ(label.color.size(), 7u) << label.color;
        colors.insert(label.color);
    }
    EXPECT_EQ(colors.size(), 116u);
}

/// Two blocks of 10 mm in a volume of 20 x 20 x 40 voxels, one of them felt, over a volume of
/// numbers that nothing feels.
TEST(ViewDocument, HasLabelsForSlicesWithTheColoursOfWhatIsFelt) {
    auto labels = std::make_shared<LabelVolume>(background({20, 20, 40}));
    labels->index_to_scene = {Mat3(1e-3), Vec3(0.0)};
    labels->labels = {{"cord", 3, 0, {}}, {"disc", 9, 0, std::array<std::uint8_t, 3>{9, 8, 7}}};
    for (int k = 5; k < 35; ++k)
        for (int j = 5; j < 15; ++j)
            for (int i = 5; i < 15; ++i)
                labels->layers[0][static_cast<std::size_t>(i + 20 * (j + 20 * k))] = k < 20 ? 3 : 9;
    auto image = std::make_shared<VoxelVolume>();
    image->size = {2, 2, 2};
    image->index_to_scene = {Mat3(1e-2), Vec3(0.0)};
    for (int i = 0; i < 8; ++i)
        image->values.push_back(static_cast<float>(i));

    SceneDescription description;
    description.volumes["atlas"].label_volume = labels;
    description.volumes["image"].voxels = image;
    description.surfaces["felt"].volume = "atlas";
    description.surfaces["felt"].labels = {"cord"};
    description.surfaces["felt"].contact = ContactKind::volume;
    description.effects.push_back(effects::Surface{.surface = "felt"});
    SceneResources resources;
    resources.files = scene_files();
    const ViewDocument document = view_document(Scene(description, resources), ViewMode::live);

    ASSERT_EQ(document.structures.size(), 1u);
    ASSERT_EQ(document.volumes.size(), 1u);
    EXPECT_EQ(document.volumes[0].name, "image");
    ASSERT_EQ(document.labels.size(), 1u);
    const LabelSlices& slices = document.labels[0];
    EXPECT_EQ(slices.labels[0].structure, 0);
    EXPECT_EQ(slices.labels[0].color, document.structures[0].color);
    EXPECT_EQ(slices.labels[1].structure, -1);
    EXPECT_EQ(slices.labels[1].color, "#090807");

    const std::string bytes = scene_message(document, {});
    const test::ContainerReader read(bytes);
    const auto& sent = read.document.at("label_volumes").at(0);
    EXPECT_EQ(sent.at("name"), "atlas");
    EXPECT_EQ(sent.at("shape"), (std::vector<int>{20, 20, 40}));
    EXPECT_EQ(sent.at("labels").at(1).at("name"), "disc");
    EXPECT_EQ(sent.at("labels").at(0).at("structure"), 0);
    EXPECT_EQ(read.blob<std::uint16_t>(sent.at("voxels"), "u16"), slices.values);
    EXPECT_EQ(sent.at("to_scene").size(), 16u);
    EXPECT_EQ(sent.at("to_scene").at(10), 1e-3);
}

} // namespace
} // namespace palpate
