// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/label_file.h>
#include <palpate/volume/label_volume.h>

#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/test_volumes.h"

// Segmentations as 3D Slicer writes them, .seg.nrrd.
namespace palpate {
namespace {

using test::make_file;
using test::TemporaryFolder;

/// 4 x 3 x 2 voxels; layers > 0: as a list of so many, those of one voxel side by side.
std::string header(int layers, const std::string& keys) {
    const bool list = layers > 0;
    return "NRRD0004\n# Complete NRRD file format specification at:\n"
           "# http://teem.sourceforge.net/nrrd/format.html\ntype: unsigned char\n"
           "dimension: " +
           std::string(list ? "4" : "3") + "\nspace: left-posterior-superior\nsizes: " +
           (list ? std::to_string(layers) + " " : "") +
           "4 3 2\nspace directions: " + (list ? "none " : "") +
           "(0.5,0,0) (0,1,0) (0,0,2)\nkinds: " + (list ? "list " : "") +
           "domain domain domain\nencoding: raw\nspace origin: (10,20,30)\n" + keys + "\n";
}

std::string segment(int number, const std::string& name, int value, int layer) {
    const std::string prefix = "Segment" + std::to_string(number) + "_";
    return prefix + "Color:=0.501961 1 0\n" + prefix + "Extent:=0 3 0 2 0 1\n" + prefix +
           "ID:=Segment_" + std::to_string(number) + "\n" + prefix +
           "LabelValue:=" + std::to_string(value) + "\n" + prefix +
           "Layer:=" + std::to_string(layer) + "\n" + prefix + "Name:=" + name + "\n";
}

LabelVolume read(const std::string& bytes, const std::string& table = {}) {
    const TemporaryFolder folder;
    make_file(folder / "s.seg.nrrd", bytes);
    if (table.empty()) return read_label_volume(folder / "s.seg.nrrd");
    make_file(folder / "given.txt", table);
    return read_label_volume(folder / "s.seg.nrrd", folder / "given.txt");
}

std::string refusal(const std::string& bytes) {
    try {
        read(bytes);
    } catch (const std::runtime_error& error) {
        const std::string message = error.what();
        EXPECT_NE(message.find("s.seg.nrrd: "), std::string::npos) << message;
        EXPECT_NE(message.find("; "), std::string::npos) << "no remedy: " << message;
        return message;
    }
    return "was read";
}

std::string voxels(const std::vector<int>& values) {
    std::string bytes;
    for (const int value : values)
        bytes += static_cast<char>(value);
    return bytes;
}

const std::vector<int> kOneLayer{0, 1, 1, 0, 0, 2, 2, 0, 0, 0, 0, 0,
                                 0, 1, 1, 0, 0, 2, 2, 0, 5, 0, 0, 0};

TEST(Segmentation, OneLayerHasNamesValuesAndColours) {
    const LabelVolume volume =
        read(header(0, segment(0, "left lobe", 1, 0) + segment(1, "tumour: core", 2, 0) +
                           segment(2, "cyst", 5, 0)) +
             voxels(kOneLayer));
    ASSERT_EQ(volume.labels.size(), 3U);
    EXPECT_EQ(volume.labels[0].name, "left lobe");
    EXPECT_EQ(volume.labels[1].name, "tumour: core");
    EXPECT_EQ(volume.labels[2].value, 5);
    EXPECT_EQ(volume.labels[0].color, (std::array<std::uint8_t, 3>{128, 255, 0}));
    ASSERT_EQ(volume.layers.size(), 1U);
    for (std::size_t n = 0; n < kOneLayer.size(); ++n)
        EXPECT_EQ(volume.layers[0][n], kOneLayer[n]);
    EXPECT_TRUE(volume.warnings.empty());
    EXPECT_EQ(volume.source_type, "uint8");
    const Vec3 expected = 1e-3 * Vec3(11.5, 22, 32);
    EXPECT_LT(glm::length(volume.index_to_scene.point({3, 2, 1}) - expected), 1e-15);
}

TEST(Segmentation, LayersKeepOverlappingSegmentsApart) {
    std::vector<int> values;
    for (const int value : kOneLayer) { // voxel by voxel: layer 0, layer 1
        values.push_back(value == 5 ? 0 : value);
        values.push_back(value == 0 ? 0 : 1);
    }
    const LabelVolume volume =
        read(header(2, segment(0, "a", 1, 0) + segment(7, "b", 2, 0) + segment(12, "all", 1, 1)) +
             voxels(values));
    ASSERT_EQ(volume.layers.size(), 2U);
    ASSERT_EQ(volume.labels.size(), 3U);
    EXPECT_EQ(volume.labels[2].name, "all");
    EXPECT_EQ(volume.labels[2].layer, 1U);
    EXPECT_EQ(volume.labels[2].value, 1);
    for (std::size_t n = 0; n < kOneLayer.size(); ++n)
        EXPECT_EQ(volume.layers[1][n], kOneLayer[n] == 0 ? 0 : 1);
    const auto extents = label_extents(volume);
    EXPECT_EQ(extents[0].voxels, 4U);
    EXPECT_EQ(extents[2].voxels, 9U);
    EXPECT_NEAR(extents[2].volume_mm3, 9.0, 1e-12); // voxels of 0.5 x 1 x 2 mm
    // Segments of both layers as one: their voxels count once.
    const VoxelVolume both = label_occupancy(volume, std::vector<std::size_t>{0, 2}, 1);
    EXPECT_EQ(std::count(both.values.begin(), both.values.end(), 1.0F), 9);
}

TEST(Segmentation, FilesWithoutValueAndLayerHaveALayerForEachSegment) {
    std::vector<int> values;
    for (const int value : kOneLayer) {
        values.push_back(value == 1 ? 1 : 0);
        values.push_back(value == 2 ? 1 : 0);
    }
    const LabelVolume volume =
        read(header(2, "Segment0_ID:=Segment_1\nSegment0_Name:=one\nSegment1_ID:=only an ID\n") +
             voxels(values));
    ASSERT_EQ(volume.labels.size(), 2U);
    EXPECT_EQ(volume.labels[0].name, "one");
    EXPECT_EQ(volume.labels[1].name, "only an ID");
    EXPECT_EQ(volume.labels[1].layer, 1U);
    EXPECT_EQ(label_extents(volume)[1].voxels, 4U);
}

TEST(Segmentation, EmptySegmentsAndUndescribedValuesAreWarnedOf) {
    const LabelVolume volume = read(header(0, segment(0, "left", 1, 0) + segment(1, "none", 3, 0) +
                                                  segment(2, "naught", 4, 0)) +
                                    voxels(kOneLayer));
    ASSERT_EQ(volume.labels.size(), 3U);
    EXPECT_EQ(volume.labels[1].name, "2");
    EXPECT_EQ(volume.labels[2].name, "5");
    ASSERT_EQ(volume.warnings.size(), 2U);
    EXPECT_NE(volume.warnings[0].find("none, naught"), std::string::npos);
    EXPECT_NE(volume.warnings[1].find("2 in layer 0, 5 in layer 0"), std::string::npos);
}

TEST(Segmentation, TwoSegmentsOfOneNameAreBothFound) {
    const LabelVolume volume =
        read(header(0, segment(0, "cyst", 1, 0) + segment(1, "cyst", 2, 0)) + voxels(kOneLayer));
    EXPECT_EQ(find_labels(volume, std::vector<std::string>{"cyst"}),
              (std::vector<std::size_t>{0, 1}));
}

TEST(Segmentation, AGivenTableGoesBeforeTheFilesOwnNames) {
    const LabelVolume volume =
        read(header(0, segment(0, "mine", 1, 0) + segment(1, "own", 2, 0)) + voxels(kOneLayer),
             "1 theirs\n");
    EXPECT_EQ(volume.labels[0].name, "theirs");
    EXPECT_EQ(volume.labels[1].name, "own");
}

TEST(Segmentation, AColourThatIsNoneIsLeftOut) {
    const LabelVolume volume = read(header(0, "Segment0_Name:=a\nSegment0_LabelValue:=1\n"
                                              "Segment0_Color:=1 2\n"
                                              "Segment1_Name:=b\nSegment1_LabelValue:=2\n"
                                              "Segment1_Color:=0.5 0.5 1.5\n") +
                                    voxels(kOneLayer));
    EXPECT_FALSE(volume.labels[0].color);
    EXPECT_FALSE(volume.labels[1].color);
}

TEST(Segmentation, RefusesAHeaderThatContradictsItself) {
    EXPECT_NE(refusal(header(0, segment(0, "a", 1, 0) + segment(1, "b", 1, 0)) + voxels(kOneLayer))
                  .find("Segment1 of its header has value 1 of layer 0, as has \"a\""),
              std::string::npos);
    EXPECT_NE(refusal(header(0, segment(0, "a", 1, 1)) + voxels(kOneLayer)).find("layer \"1\""),
              std::string::npos);
    EXPECT_NE(refusal(header(0, segment(0, "a", 0, 0)) + voxels(kOneLayer)).find("value \"0\""),
              std::string::npos);
    EXPECT_NE(
        refusal(header(0, "Segment0_LabelValue:=many\n") + voxels(kOneLayer)).find("\"many\""),
        std::string::npos);
    EXPECT_NE(refusal(header(0, segment(0, "a", 100, 0) +
                                    "Segmentation_SourceRepresentation:=Fractional labelmap\n") +
                      voxels(kOneLayer))
                  .find("fractional"),
              std::string::npos);
    const std::vector<int> two(48, 1);
    EXPECT_NE(refusal(header(2, "Segment0_Name:=a\nSegment5_Name:=b\n") + voxels(two))
                  .find("layer \"5\""),
              std::string::npos);
    EXPECT_NE(refusal(header(2, segment(0, "a", 1, 0)) + voxels(kOneLayer)).find("truncated"),
              std::string::npos);
}

TEST(Segmentation, KeysThatOnlyLookLikeSegmentsAreNone) {
    const LabelVolume volume = read(header(0, "Segmentation_ReferenceImageExtentOffset:=1 2 3\n"
                                              "SegmentX_Name:=x\nSegment-1_Name:=y\n"
                                              "Segment99999999999999999999_Name:=z\n") +
                                    voxels(kOneLayer));
    EXPECT_EQ(volume.labels.size(), 3U);
    EXPECT_EQ(volume.labels[0].name, "1");
}

} // namespace
} // namespace palpate
