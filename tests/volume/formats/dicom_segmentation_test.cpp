// SPDX-License-Identifier: Apache-2.0
// DICOM segmentations: where each voxel lands, whatever the grid, the coding and the frames.
#include <palpate/volume/formats/label_file.h>

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/support/axis_orders.h"
#include "tests/support/damaged_copies.h"
#include "tests/support/dicom_cases.h"
#include "tests/support/dicom_labels_writer.h"

namespace palpate {
namespace {

using test::dicom_file;
using test::dicom_segmentation;
using test::DicomDataSet;
using test::make_file;
using test::SegmentationForm;
using test::WrittenSegment;
using Type = SegmentationForm::Type;

constexpr std::array<int, 3> kSize{7, 5, 6}; // 35 pixels: frames begin within bytes

/// Voxels that no symmetry maps onto each other; nothing in the first slice and in slice 3.
bool in_bone(int i, int j, int k) {
    return (k == 1 || k == 2 || k == 4) && (i + 2 * j + 3 * k) % 5 < 2 && i > 0;
}
bool in_skin(int i, int j, int k) { return k >= 1 && k != 3 && (3 * i + j + k) % 7 < 3; }
bool in_lump(int i, int j, int k) { return k == 5 && i == 6 && j == 4; }

std::vector<WrittenSegment> segments() {
    return {{"Bone", in_bone, {}}, {"Haut \xC3\xA4", in_skin, {}}, {"Lump", in_lump, {}}};
}

const std::vector<bool (*)(int, int, int)>& truths() {
    static const std::vector<bool (*)(int, int, int)> all{in_bone, in_skin, in_lump};
    return all;
}

AffineTransform columns(const Mat3& directions, const Vec3& spacing_mm) {
    return {1e-3 * Mat3(spacing_mm.x * directions[0], spacing_mm.y * directions[1],
                        spacing_mm.z * directions[2]),
            1e-3 * Vec3(-100.5, 37.25, 12.125)};
}

class DicomSegmentation : public testing::Test {
protected:
    LabelVolume read(const DicomDataSet& data, const test::DicomEncoding& encoding = {}) const {
        make_file(folder_ / "seg.dcm", dicom_file(data, encoding));
        return read_label_volume(folder_ / "seg.dcm");
    }

    std::string refusal(const DicomDataSet& data) const {
        try {
            read(data);
        } catch (const std::runtime_error& error) {
            const std::string message = error.what();
            EXPECT_TRUE(message.starts_with((folder_ / "seg.dcm").string() + ": ")) << message;
            EXPECT_EQ(message.find('\n'), std::string::npos) << message;
            EXPECT_NE(message.find("; "), std::string::npos) << "no remedy: " << message;
            EXPECT_EQ(message.find("Nobody"), std::string::npos) << message;
            return message;
        }
        return "was read";
    }

    const test::TemporaryFolder folder_;
};

/// How many voxels of the grid that was written are not, or wrongly, in the label of that value:
/// looked up by their place in the patient. What lies outside of the volume has no label.
int wrong_voxels(const LabelVolume& volume, const AffineTransform& frame, std::int32_t value,
                 bool (*is_inside)(int, int, int)) {
    const AffineTransform to_index = volume.index_to_scene.inverse();
    std::size_t layer = volume.layers.size();
    for (const Label& label : volume.labels)
        if (label.value == value) layer = label.layer;
    if (layer == volume.layers.size()) return -1;
    int wrong = 0;
    for (int k = 0; k < kSize[2]; ++k)
        for (int j = 0; j < kSize[1]; ++j)
            for (int i = 0; i < kSize[0]; ++i) {
                const Vec3 index = to_index.point(frame.point(Vec3(i, j, k)));
                std::array<int, 3> at{};
                bool is_there = true;
                for (int axis = 0; axis < 3; ++axis) {
                    const auto a = static_cast<std::size_t>(axis);
                    at[a] = static_cast<int>(std::lround(index[axis]));
                    // 10 digits of a position: far nearer to a voxel than to its border.
                    wrong += std::abs(index[axis] - at[a]) > 1e-4;
                    is_there = is_there && at[a] >= 0 && at[a] < volume.size[a];
                }
                VoxelVolume shape;
                shape.size = volume.size;
                const bool has_it =
                    is_there && volume.layers[layer][shape.index(at[0], at[1], at[2])] == value;
                wrong += has_it != is_inside(i, j, k);
            }
    return wrong;
}

void expect_all_right(const LabelVolume& volume, const AffineTransform& frame) {
    for (std::size_t n = 0; n < truths().size(); ++n)
        EXPECT_EQ(wrong_voxels(volume, frame, static_cast<std::int32_t>(n) + 1, truths()[n]), 0)
            << "segment " << n + 1;
}

TEST_F(DicomSegmentation, OrientationMatrix) {
    std::vector<AffineTransform> frames;
    for (const Mat3& order : test::axis_orders())
        frames.push_back(columns(order, {0.5, 0.75, 1.25}));
    for (const Mat3& turn :
         {test::quaternion_rotation(2, 1, 1, 1), test::quaternion_rotation(1, -2, 1, 1)})
        for (const int order : {0, 13, 27, 47})
            frames.push_back(columns(turn * test::axis_orders()[static_cast<std::size_t>(order)],
                                     {0.875, 1.75, 2.1875}));
    frames.push_back(columns(Mat3(1.0), {0.5, 0.75, 1.25}));
    frames.back().linear[2].y = 0.25e-3; // a leaning third axis
    for (std::size_t n = 0; n < frames.size(); ++n) {
        SCOPED_TRACE(n);
        SegmentationForm form;
        form.type = n % 2 == 0 ? Type::binary : Type::fractional;
        form.backwards = n % 3 == 0;
        expect_all_right(read(dicom_segmentation(kSize, frames[n], segments(), form)), frames[n]);
    }
}

TEST_F(DicomSegmentation, EveryEncodingAndCodingGivesTheSameVoxels) {
    const AffineTransform frame = columns(Mat3(1.0), {0.5, 0.75, 1.25});
    for (const test::DicomEncoding& encoding :
         {test::DicomEncoding{true, false, false}, test::DicomEncoding{true, false, true},
          test::DicomEncoding{false, false, true}, test::DicomEncoding{true, true, false}})
        for (const Type type : {Type::binary, Type::fractional})
            for (const bool keeps_empty : {false, true}) {
                SegmentationForm form;
                form.type = type;
                form.keeps_empty_frames = keeps_empty;
                form.stated_step = keeps_empty ? 1.25 : 0.0;
                const LabelVolume volume =
                    read(dicom_segmentation(kSize, frame, segments(), form), encoding);
                expect_all_right(volume, frame);
                EXPECT_EQ(volume.layers.size(), 2U) << "bone and skin overlap, the lump does not";
                EXPECT_EQ(volume.size[2], keeps_empty ? 6 : 5);
                EXPECT_EQ(volume.warnings.size(), type == Type::fractional ? 1U : 0U);
            }
}

TEST_F(DicomSegmentation, LabelMapsAreReadByTheirNumbers) {
    const AffineTransform frame = columns(Mat3(1.0), {0.5, 0.75, 1.25});
    SegmentationForm form;
    form.type = Type::label_map;
    std::vector<WrittenSegment> apart = segments();
    apart[1].is_inside = [](int i, int j, int k) {
        return in_skin(i, j, k) && !in_bone(i, j, k) && !in_lump(i, j, k);
    };
    apart[2].is_inside = [](int i, int j, int k) { return in_lump(i, j, k) && !in_skin(i, j, k); };
    const LabelVolume volume = read(dicom_segmentation(kSize, frame, apart, form));
    EXPECT_EQ(volume.layers.size(), 1U);
    EXPECT_EQ(wrong_voxels(volume, frame, 1, in_bone), 0);
}

TEST_F(DicomSegmentation, NamesAndColours) {
    std::vector<WrittenSegment> named = segments();
    // White, and red (Lab 53.23, 80.11, 67.22 of D65; of D50 54.29, 80.80, 69.89).
    named[0].lab = {65535, 32896, 32896};
    named[1].lab = {static_cast<unsigned>(54.29 / 100.0 * 65535.0),
                    static_cast<unsigned>((80.80 + 128.0) / 255.0 * 65535.0),
                    static_cast<unsigned>((69.89 + 128.0) / 255.0 * 65535.0)};
    const LabelVolume volume =
        read(dicom_segmentation(kSize, columns(Mat3(1.0), {1, 1, 2}), named));
    std::map<std::string, Label> by_name;
    for (const Label& label : volume.labels)
        by_name[label.name] = label;
    ASSERT_EQ(by_name.size(), 3U);
    EXPECT_EQ(by_name["Haut \xC3\xA4"].value, 2);
    const auto near = [](std::array<std::uint8_t, 3> color, std::array<int, 3> expected) {
        for (std::size_t n = 0; n < 3; ++n) // rounding of 16-bit numbers and of the matrix
            EXPECT_NEAR(color[n], expected[n], 1) << n;
    };
    near(*by_name["Bone"].color, {255, 255, 255});
    near(*by_name["Haut \xC3\xA4"].color, {255, 0, 0});
    EXPECT_EQ(read_label_volume(folder_ / "seg.dcm").labels.size(), 3U);
    make_file(folder_ / "names.txt", "1 Skull\n");
    EXPECT_EQ(read_label_volume(folder_ / "seg.dcm", folder_ / "names.txt").labels[0].name,
              "Skull");
}

TEST_F(DicomSegmentation, WhatIsWrongIsSaid) {
    const AffineTransform frame = columns(Mat3(1.0), {0.5, 0.75, 1.25});
    const auto written = [&] { return dicom_segmentation(kSize, frame, segments()); };
    const auto frames = [](DicomDataSet& data) -> std::vector<DicomDataSet>& {
        return data.elements.at(0x52009230).items;
    };
    DicomDataSet data = written();
    data.elements.at(0x52009229).items.front().remove(0x00209116);
    EXPECT_SAYS(refusal(data), "states no orientation in the patient");
    data = written();
    frames(data)[2].remove(0x00209113);
    EXPECT_SAYS(refusal(data), "states no position in the patient for its frame 3");
    data = written();
    frames(data).pop_back();
    EXPECT_SAYS(refusal(data), "frames that do not state a position each");
    data = written();
    data.elements.at(0x7FE00010).bytes.resize(20);
    EXPECT_SAYS(refusal(data), "is truncated: it has 20 bytes of pixels where");
    data = written();
    frames(data)[1]
        .elements.at(0x00209113)
        .items.front()
        .decimals(0x00200032, {-100.5, 37.25, 15.3});
    EXPECT_SAYS(refusal(data), "frames that are not evenly spaced");
    EXPECT_SAYS(refusal(data), ".seg.nrrd");
    data = written();
    frames(data)[1] = frames(data)[0];
    EXPECT_SAYS(refusal(data), "has two frames of segment 1 in one slice, frame 1 and frame 2");
    data = written();
    frames(data)[0].elements.at(0x0062000A).items.front().us(0x0062000B, {9});
    EXPECT_SAYS(refusal(data), "of segment 9, which it does not describe");
    data = written();
    data.text(0x00620001, "CS", "SOLID");
    EXPECT_SAYS(refusal(data), "unknown type \"SOLID\"");
    const auto lump = [&](const SegmentationForm& form) {
        return dicom_segmentation(kSize, frame, {{"Lump", in_lump, {}}}, form);
    };
    EXPECT_SAYS(refusal(lump({})), "has a single slice and does not say how thick it is");
    SegmentationForm thick;
    thick.thickness = 2.0;
    EXPECT_DOUBLE_EQ(read(lump(thick)).index_to_scene.linear[2].z, 2e-3);

    // What takes no labels says what it is; beside slices it is passed over.
    EXPECT_SAYS(test::refusal_of(folder_ / "seg.dcm"), "is a segmentation (DICOM SEG)");
    EXPECT_SAYS(test::refusal_of(folder_ / "seg.dcm", test::kRepair), "leave slices out");
    test::write_dicom_series(folder_ / "both", test::numbered({4, 4, 4}, test::straight_frame()));
    make_file(folder_ / "both" / "seg.dcm", dicom_file(written()));
    EXPECT_TRUE(read_volume(folder_ / "both").warnings.empty());
    EXPECT_TRUE(holds_labels(folder_ / "both" / "seg.dcm"));
    EXPECT_FALSE(holds_labels(folder_ / "both" / "slice_0000.dcm"));
    EXPECT_FALSE(holds_labels(folder_ / "both"));
}

TEST_F(DicomSegmentation, StatedStepsThatDoNotFitGiveWayToTheFrames) {
    const AffineTransform frame = columns(Mat3(1.0), {0.5, 0.75, 1.25});
    SegmentationForm form;
    form.stated_step = 2.0; // the slices' thickness, in files of some programs
    const LabelVolume volume = read(dicom_segmentation(kSize, frame, segments(), form));
    expect_all_right(volume, frame);
    EXPECT_SAYS(test::joined(volume.warnings), "states slices 2 mm apart");
    // Where it fits it counts: two slices that are two steps apart.
    form.stated_step = 1.25;
    const LabelVolume two = read(dicom_segmentation(
        kSize, frame, {{"a", [](int, int, int k) { return k == 0 || k == 2; }, {}}}, form));
    EXPECT_EQ(two.size[2], 3);
}

TEST_F(DicomSegmentation, DamagedFilesAreReadOrRefused) {
    for (const Type type : {Type::binary, Type::fractional}) {
        SegmentationForm form;
        form.type = type;
        const std::string whole = dicom_file(
            dicom_segmentation(kSize, columns(Mat3(1.0), {0.5, 0.75, 1.25}), segments(), form));
        test::expect_damage_is_survived(whole, 61, 3, [&](const std::string& bytes) {
            make_file(folder_ / "a.dcm", bytes);
            const LabelVolume volume = read_label_volume(folder_ / "a.dcm");
            for (const auto& layer : volume.layers)
                EXPECT_EQ(layer.size(), volume.voxels());
        });
    }
}

TEST_F(DicomSegmentation, FramesFarApartThatStateNoStepAreWarnedOf) {
    SegmentationForm form;
    form.thickness = 1.25;
    const auto warned = [&](int second) {
        return test::joined(
            read(dicom_segmentation(
                     kSize, columns(Mat3(1.0), {0.5, 0.75, 1.25}),
                     {{"a", [&](int, int, int k) { return k == 0 || k == second; }, {}}}, form))
                .warnings);
    };
    EXPECT_SAYS(warned(5), "6.25 mm apart and 1.25 mm thick");
    EXPECT_EQ(warned(1).find("mm thick"), std::string::npos);
}

} // namespace
} // namespace palpate
