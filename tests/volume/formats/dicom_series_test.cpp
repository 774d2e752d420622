// SPDX-License-Identifier: Apache-2.0
// Folders of DICOM slices: where voxels land, which series is read, what is refused or repaired.
#include <palpate/volume/formats/volume_file.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/dicom_cases.h"

namespace palpate {
namespace {

using test::dicom_file;
using test::dicom_slice;
using test::DicomDataSet;
using test::DicomSeriesOptions;
using test::displacement;
using test::joined;
using test::kMm;
using test::kRepair;
using test::kSamePlace;
using test::make_file;
using test::numbered;
using test::oblique_frame;
using test::refusal_of;
using test::straight_frame;
using test::TemporaryFolder;
using test::write_changed;
using test::write_dicom_series;

// --- geometry ------------------------------------------------------------------------------------

struct NamedFrame {
    const char* name;
    AffineTransform frame;
};

std::vector<NamedFrame> frames() {
    const AffineTransform left_handed =
        oblique_frame(Vec3(0.3, 0.9, 1.7) * kMm, Vec3(-0.12, 0.034, 0.21));
    AffineTransform right_handed = left_handed;
    right_handed.linear[2] = -right_handed.linear[2];
    const AffineTransform straight = straight_frame();
    AffineTransform sagittal = straight;
    sagittal.linear = Mat3(Vec3(0, 0.5, 0) * kMm, Vec3(0, 0, -0.75) * kMm, Vec3(-3, 0, 0) * kMm);
    AffineTransform head_first = straight;
    head_first.linear[2] = -head_first.linear[2];
    return {{"straight", straight},
            {"slices from head to foot", head_first},
            {"sagittal", sagittal},
            {"oblique, left-handed", left_handed},
            {"oblique, right-handed", right_handed}};
}

TEST(DicomSeries, EveryVoxelLandsWhereItsSliceSays) {
    for (const NamedFrame& f : frames())
        for (const bool reverse : {false, true}) {
            SCOPED_TRACE(std::string(f.name) + (reverse ? ", names in reverse" : ""));
            const TemporaryFolder folder;
            const VoxelVolume written = numbered({7, 5, 4}, f.frame);
            DicomSeriesOptions options;
            options.names_in_reverse = reverse;
            write_dicom_series(folder.path(), written, options);
            const VoxelVolume read = read_volume(folder.path());
            EXPECT_EQ(read.size, written.size);
            EXPECT_LT(displacement(read, written), kSamePlace);
            EXPECT_EQ(read.source_type, "int16");
            EXPECT_TRUE(read.warnings.empty()) << joined(read.warnings);
            EXPECT_GT(glm::determinant(read.index_to_scene.linear), 0.0);
        }
}

TEST(DicomSeries, TiltedGantryShearsTheAxesAndSaysHowFar) {
    const TemporaryFolder folder;
    AffineTransform frame = frames()[4].frame;
    const double degrees = 17.0;
    frame.linear[2] += std::tan(degrees / 57.29577951308232) * glm::length(frame.linear[2]) *
                       glm::normalize(frame.linear[1]);
    const VoxelVolume written = numbered({6, 5, 4}, frame);
    write_dicom_series(folder.path(), written);
    const VoxelVolume read = read_volume(folder.path());
    EXPECT_LT(displacement(read, written), kSamePlace);
    ASSERT_EQ(read.warnings.size(), 1U);
    EXPECT_SAYS(read.warnings[0], "lean by 17 degrees");
}

TEST(DicomSeries, RoundedDirectionsAreMadePerpendicularUnitsAgain) {
    const TemporaryFolder folder;
    write_changed(folder.path(), numbered({4, 3, 3}, straight_frame()), [](int, DicomDataSet& s) {
        s.text(0x00200037, "DS", "0.99144\\0.13053\\0.0003\\-0.1305\\0.99145\\0");
    });
    const Mat3 map = read_volume(folder.path()).index_to_scene.linear;
    EXPECT_NEAR(glm::length(map[0]), 0.5 * kMm, 1e-15); // rounding of sums of three squares
    EXPECT_NEAR(glm::length(map[1]), 0.75 * kMm, 1e-15);
    EXPECT_NEAR(glm::dot(map[0], map[1]), 0.0, 1e-20);
}

TEST(DicomSeries, DirectionsThatAreNoRotationAreRefused) {
    for (const char* directions :
         {"1\\0\\0\\0.002\\1\\0", "1.01\\0\\0\\0\\1\\0", "0\\0\\0\\0\\0\\0", "1\\0\\0\\0\\1e9\\0",
          "1e308\\1e308\\0\\0\\1\\0"}) {
        const TemporaryFolder folder;
        write_changed(folder.path(), numbered({4, 3, 3}, straight_frame()),
                      [&](int k, DicomDataSet& s) {
                          if (k == 1) s.text(0x00200037, "DS", directions);
                      });
        EXPECT_SAYS(refusal_of(folder.path()), "s1.dcm: states an orientation whose directions");
    }
}

// --- which series --------------------------------------------------------------------------------

class DicomFolderOfTwo : public testing::Test {
protected:
    void SetUp() override {
        DicomSeriesOptions options;
        options.description = "first one";
        write_dicom_series(folder_.path(), first_, options);
        options.series_uid = "1.2.826.0.1.3680043.10.54.77";
        options.description = "the other";
        options.modality = "MR";
        options.number = 12;
        options.prefix = "other_";
        write_dicom_series(folder_.path(), second_, options);
    }

    const TemporaryFolder folder_;
    const VoxelVolume first_ = numbered({6, 5, 3}, straight_frame());
    const VoxelVolume second_ = numbered({4, 3, 5}, straight_frame());
};

TEST_F(DicomFolderOfTwo, AreListedAndOneIsChosenByNumberDescriptionOrUid) {
    const std::string message = refusal_of(folder_.path());
    EXPECT_SAYS(message, "1 (\"first one\", CT, 3 slices of 6x5)");
    EXPECT_SAYS(message, "12 (\"the other\", MR, 5 slices of 4x3)");
    EXPECT_SAYS(message, "--series");
    for (const char* name : {"12", "the other", "1.2.826.0.1.3680043.10.54.77"})
        EXPECT_EQ(read_volume(folder_.path(), {name, {}, {}, {}}).values, second_.values) << name;
    EXPECT_EQ(read_volume(folder_.path(), {"1", {}, {}, {}}).values, first_.values);
    EXPECT_SAYS(refusal_of(folder_.path(), {"13", {}, {}, {}}), "has no series \"13\" but: 1 (");

    const std::vector<VolumeEntry> entries = list_volumes(folder_.path());
    ASSERT_EQ(entries.size(), 2U);
    EXPECT_EQ(entries[0].selector, "1");
    EXPECT_EQ(entries[1].selector, "12");
    EXPECT_EQ(entries[1].text, "\"the other\", MR, 5 slices of 4x3");
    EXPECT_TRUE(entries[0].readable && entries[1].readable);
}

TEST_F(DicomFolderOfTwo, DamageInOneLeavesTheOtherReadable) {
    const auto damaged = folder_ / "other_0002.dcm";
    const std::string whole = test::content_of(damaged);
    make_file(damaged, whole.substr(0, whole.size() - 3)); // within the pixels: its series is known
    EXPECT_EQ(read_volume(folder_.path(), {"1", {}, {}, {}}).values, first_.values);
    EXPECT_SAYS(refusal_of(folder_.path(), {"12", {}, {}, {}}), "other_0002.dcm: is truncated");
    make_file(damaged, whole.substr(0, 200)); // before its series is stated: it could be either's
    EXPECT_SAYS(refusal_of(folder_.path(), {"1", {}, {}, {}}), "other_0002.dcm: is truncated");
}

TEST(DicomSeries, OrientationsOfALocaliserAreSeparateVolumes) {
    const TemporaryFolder folder;
    const auto all = frames();
    for (const std::size_t n : {0U, 2U, 4U}) {
        DicomSeriesOptions options;
        options.prefix = "view" + std::to_string(n) + "_";
        write_dicom_series(folder.path(), numbered({6, 5, 3}, all[n].frame), options);
    }
    EXPECT_SAYS(refusal_of(folder.path()), "1/1 (");
    const auto entries = list_volumes(folder.path());
    ASSERT_EQ(entries.size(), 3U);
    for (std::size_t n = 0; n < 3; ++n) {
        EXPECT_EQ(entries[n].selector, "1/" + std::to_string(n + 1));
        const VoxelVolume read = read_volume(folder.path(), {entries[n].selector, {}, {}, {}});
        EXPECT_LT(displacement(read, numbered({6, 5, 3}, all[2 * n].frame)), kSamePlace);
    }
    EXPECT_SAYS(refusal_of(folder.path(), {"generated", {}, {}, {}}), "several series called");
}

TEST(DicomSeries, EchoesAtOnePositionAreSeparateVolumes) {
    const TemporaryFolder folder;
    for (const int echo : {1, 2}) {
        DicomSeriesOptions options;
        options.series_uid += "." + std::to_string(echo); // for the instances
        VoxelVolume volume = numbered({4, 3, 4}, straight_frame());
        for (float& value : volume.values)
            value += 1000.0F * static_cast<float>(echo);
        for (int k = 0; k < 4; ++k) {
            DicomDataSet slice = dicom_slice(volume, k, options);
            slice.text(0x0020000E, "UI", "1.2.3");
            slice.decimals(0x00180081, {echo == 1 ? 4.6 : 92.0});
            make_file(folder / ("e" + std::to_string(echo) + std::to_string(k)), dicom_file(slice));
        }
    }
    EXPECT_SAYS(refusal_of(folder.path()), "echo time 92");
    EXPECT_EQ(read_volume(folder.path(), {"1/2", {}, {}, {}}).values[0], 2000.0F);
}

TEST(DicomSeries, ImagesThatNothingTellsApartAreRefusedByName) {
    const TemporaryFolder folder;
    const VoxelVolume volume = numbered({4, 3, 4}, straight_frame());
    write_dicom_series(folder.path(), volume);
    DicomDataSet again = dicom_slice(volume, 2);
    again.text(0x00080018, "UI", "1.2.3.4.5");
    make_file(folder / "again.dcm", dicom_file(again));
    const std::string message = refusal_of(folder.path());
    EXPECT_SAYS(message, "again.dcm (at 35 mm) and slice_0002.dcm (at 35 mm)");
    EXPECT_SAYS(message, "nothing that is known");
}

TEST(DicomSeries, CopiesOfFilesAreReadOnce) {
    const TemporaryFolder folder;
    const VoxelVolume volume = numbered({4, 3, 4}, straight_frame());
    const auto files = write_dicom_series(folder.path(), volume);
    std::filesystem::copy_file(files[1], folder / "copy of it");
    const VoxelVolume read = read_volume(folder.path());
    EXPECT_EQ(read.values, volume.values);
    EXPECT_SAYS(joined(read.warnings), "1 file is a copy");
}

// --- what lies beside the slices -----------------------------------------------------------------

TEST(DicomSeries, OtherFilesArePassedOver) {
    const TemporaryFolder folder;
    const VoxelVolume volume = numbered({4, 3, 4}, straight_frame());
    const char* endings[] = {"", ".DCM", ".IMA", ".0004"};
    for (int k = 0; k < 4; ++k)
        make_file(folder / ("IM" + std::to_string(k) + endings[k]),
                  dicom_file(dicom_slice(volume, k)));
    make_file(folder / "readme.txt", "about these slices");
    make_file(folder / "notes", std::string("\x08\0\x05\0", 4) + std::string(300, 'x'));
    make_file(folder / "DICOMDIR", "whatever it holds");
    make_file(folder / "empty", "");
    DicomDataSet report;
    report.text(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.88.11"); // a text report
    report.text(0x00080060, "CS", "SR");
    make_file(folder / "report.dcm", dicom_file(report));
    DicomSeriesOptions other;
    other.series_uid = "1.2.3";
    write_dicom_series(folder / "deeper", volume, other);
    const VoxelVolume read = read_volume(folder.path());
    EXPECT_EQ(read.values, volume.values);
    EXPECT_TRUE(read.warnings.empty()) << joined(read.warnings);
}

TEST(DicomSeries, WhatClaimsToBeDicomAndIsNotIsRefusedByName) {
    const TemporaryFolder folder;
    const VoxelVolume volume = numbered({4, 3, 4}, straight_frame());
    write_dicom_series(folder.path(), volume);
    for (const auto& [name, bytes] :
         {std::pair{"a.dcm", std::string("text")}, std::pair{"b.ima", std::string()},
          std::pair{"c", std::string(128, '\0') + "DICM and nothing else"}}) {
        make_file(folder / name, bytes);
        EXPECT_SAYS(refusal_of(folder.path()), name);
        const VoxelVolume read = read_volume(folder.path(), kRepair);
        EXPECT_EQ(read.values, volume.values);
        EXPECT_SAYS(joined(read.warnings), name);
        std::filesystem::remove(folder / name);
    }
}

TEST(DicomSeries, FilesWithoutPreambleAreRead) {
    for (const bool explicit_vr : {true, false}) {
        const TemporaryFolder folder;
        const VoxelVolume volume = numbered({4, 3, 4}, straight_frame());
        test::DicomEncoding encoding;
        encoding.explicit_vr = explicit_vr;
        for (int k = 0; k < 4; ++k)
            make_file(folder / ("IM" + std::to_string(k)), dicom_slice(volume, k).bytes(encoding));
        EXPECT_EQ(read_volume(folder.path()).values, volume.values);
    }
}

TEST(DicomSeries, PicturesAndSingleSlicesBesideTheVolumeAreNamedInAWarning) {
    const TemporaryFolder folder;
    const VoxelVolume volume = numbered({4, 3, 4}, straight_frame());
    write_dicom_series(folder.path(), volume);
    DicomSeriesOptions other;
    other.number = 900;
    other.description = "dose report";
    other.series_uid = "1.2.3";
    DicomDataSet picture = dicom_slice(volume, 0, other);
    picture.us(0x00280002, {3});
    picture.text(0x00280004, "CS", "RGB");
    make_file(folder / "dose.dcm", dicom_file(picture));
    other.series_uid = "1.2.4";
    other.number = 7;
    other.description = "scout";
    make_file(folder / "scout.dcm", dicom_file(dicom_slice(volume, 0, other)));
    const VoxelVolume read = read_volume(folder.path());
    EXPECT_EQ(read.values, volume.values);
    EXPECT_SAYS(joined(read.warnings), "dose report");
    EXPECT_SAYS(joined(read.warnings), "scout");
    EXPECT_SAYS(refusal_of(folder.path(), {"900", {}, {}, {}}),
                "dose.dcm: is a colour image (RGB)");
    EXPECT_SAYS(refusal_of(folder.path(), {"7", {}, {}, {}}), "no series of two or more slices");
    const auto entries = list_volumes(folder.path());
    ASSERT_EQ(entries.size(), 3U);
    EXPECT_TRUE(entries[0].readable);
    EXPECT_FALSE(entries[1].readable || entries[2].readable);
}

TEST(DicomSeries, ASingleSliceFileIsSentToItsFolder) {
    const TemporaryFolder folder;
    const auto files = write_dicom_series(folder.path(), numbered({4, 3, 4}, straight_frame()));
    EXPECT_SAYS(refusal_of(files[0]), "is one slice of a volume; name the folder");
    std::filesystem::rename(files[0], folder / "without_ending");
    EXPECT_SAYS(refusal_of(folder / "without_ending"), "is one slice of a volume");
}

TEST(DicomSeries, AFolderWithoutSlicesIsRefused) {
    const TemporaryFolder folder;
    EXPECT_SAYS(refusal_of(folder.path()), "is a folder without a DICOM image");
    EXPECT_THROW(list_volumes(folder.path()), std::runtime_error);
}

TEST(DicomSeries, AChoiceThatAFileDoesNotOfferIsRefused) {
    const TemporaryFolder folder;
    write_volume(numbered({4, 3, 4}, straight_frame()), folder / "a.nrrd");
    EXPECT_SAYS(refusal_of(folder / "a.nrrd", {"3", {}, {}, {}}), "has no series \"3\"");
    EXPECT_SAYS(refusal_of(folder / "a.nrrd", {{}, "density", {}, {}}), "has no grid \"density\"");
    const auto entries = list_volumes(folder / "a.nrrd");
    ASSERT_EQ(entries.size(), 1U);
    EXPECT_EQ(entries[0].text, "float32, 4x3x4");
    EXPECT_TRUE(entries[0].readable);
}

} // namespace
} // namespace palpate
