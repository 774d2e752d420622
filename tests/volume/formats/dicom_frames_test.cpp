// SPDX-License-Identifier: Apache-2.0
// A DICOM file of several frames.
#include <palpate/volume/formats/volume_file.h>

#include <cstddef>

#include <gtest/gtest.h>

#include "tests/support/dicom_cases.h"

namespace palpate {
namespace {

using test::dicom_enhanced;
using test::dicom_file;
using test::DicomDataSet;
using test::DicomEncoding;
using test::DicomSeriesOptions;
using test::displacement;
using test::joined;
using test::kBig;
using test::kExplicit;
using test::kImplicit;
using test::kMm;
using test::kRle;
using test::kSamePlace;
using test::make_file;
using test::numbered;
using test::oblique_frame;
using test::refusal_of;
using test::rle;
using test::straight_frame;
using test::TemporaryFolder;

TEST(DicomFrames, FramesOfAnEnhancedFileAreStackedByPosition) {
    const VoxelVolume volume =
        numbered({6, 5, 4}, oblique_frame(Vec3(0.3, 0.9, 1.7) * kMm, Vec3(-0.12, 0.034, 0.21)));
    DicomSeriesOptions options;
    options.slope = 0.25;
    options.intercept = 3.0;
    for (const DicomEncoding& encoding :
         {kExplicit, kImplicit, kBig, DicomEncoding{true, false, true}}) {
        const TemporaryFolder folder;
        make_file(folder / "all.dcm",
                  dicom_file(dicom_enhanced(volume, {2, 0, 3, 1}, options), encoding));
        for (const auto& path : {folder / "all.dcm", folder.path()}) {
            const VoxelVolume read = read_volume(path);
            EXPECT_LT(displacement(read, volume), kSamePlace);
            EXPECT_TRUE(read.warnings.empty()) << joined(read.warnings);
        }
    }
}

TEST(DicomFrames, AFrameThatStatesNoRescaleHasNone) {
    const VoxelVolume volume = numbered({6, 5, 4}, straight_frame());
    DicomSeriesOptions options;
    options.slope = 0.25;
    options.intercept = 3.0;
    DicomDataSet file = dicom_enhanced(volume, {0, 1, 2, 3}, options);
    auto& frames = file.elements.at(0x52009230).items;
    frames[2].elements.at(0x00289145).items[0] = DicomDataSet{};
    const TemporaryFolder folder;
    make_file(folder / "all.dcm", dicom_file(file));
    const VoxelVolume read = read_volume(folder / "all.dcm");
    for (std::size_t n = 0; n < volume.values.size(); ++n)
        ASSERT_EQ(read.values[n],
                  n / 30 == 2 ? (volume.values[n] - 3.0F) / 0.25F : volume.values[n])
            << n;
}

TEST(DicomFrames, CompressedFramesAreDecodedOneByOne) {
    const VoxelVolume volume = numbered({6, 5, 4}, straight_frame());
    DicomDataSet file = dicom_enhanced(volume, {0, 1, 2, 3});
    auto& pixels = file.elements.at(0x7FE00010);
    pixels.vr = "OB";
    pixels.fragments = {""};
    for (std::size_t k = 0; k < 4; ++k)
        pixels.fragments.push_back(rle(pixels.bytes.substr(60 * k, 60)));
    pixels.bytes.clear();
    const TemporaryFolder folder;
    make_file(folder / "all.dcm", dicom_file(file, {}, kRle));
    EXPECT_EQ(read_volume(folder / "all.dcm").values, volume.values);
}

TEST(DicomFrames, FramesWithoutAPositionEachAreRefusedWithAWayOut) {
    const TemporaryFolder folder;
    DicomDataSet file = dicom_enhanced(numbered({6, 5, 4}, straight_frame()), {0, 1, 2, 3});
    file.remove(0x52009230);
    make_file(folder / "all.dcm", dicom_file(file));
    EXPECT_SAYS(refusal_of(folder / "all.dcm"), "4 frames that do not state a position each");
    EXPECT_SAYS(refusal_of(folder / "all.dcm"), "dcm2niix");
}

} // namespace
} // namespace palpate
