// SPDX-License-Identifier: Apache-2.0
// DICOM slices that are cut short or have a wrong byte: read, or refused with one line; nothing
// else. Of use under the sanitizers above all.
#include <palpate/volume/formats/volume_file.h>

#include <algorithm>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/dicom_cases.h"

namespace palpate {
namespace {

using test::dicom_enhanced;
using test::dicom_file;
using test::dicom_slice;
using test::DicomDataSet;
using test::DicomEncoding;
using test::make_file;
using test::numbered;
using test::straight_frame;
using test::TemporaryFolder;

constexpr std::size_t kStep = 97; // bytes between two cuts
constexpr int kCorruptions = 300;

/// True when the folder was read; else its refusal must be one line.
bool survives(const std::filesystem::path& path, VolumeSelection::Slices slices) {
    try {
        const VoxelVolume volume = read_volume(path, {{}, {}, slices, {}});
        EXPECT_EQ(volume.values.size(), volume.voxels());
        return true;
    } catch (const std::runtime_error& error) {
        const std::string message = error.what();
        EXPECT_EQ(message.find(path.string()), 0U) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        EXPECT_NE(message.find("; "), std::string::npos) << "no remedy: " << message;
    } // anything else ends the test
    return false;
}

class DamagedDicom : public testing::TestWithParam<DicomEncoding> {
protected:
    DamagedDicom() {
        for (int k : {0, 2, 3})
            make_file(folder_ / ("s" + std::to_string(k) + ".dcm"),
                      dicom_file(slice(k), GetParam()));
    }

    /// With sequences, and a size that cuts fall into everywhere.
    DicomDataSet slice(int k) const {
        DicomDataSet result = dicom_slice(volume_, k);
        DicomDataSet inner;
        inner.text(0x00080100, "SH", "code");
        inner.sequence(0x00080104, {inner, inner});
        result.sequence(0x00081115, {inner, inner});
        return result;
    }

    bool survives_with(const std::string& bytes, VolumeSelection::Slices slices) {
        make_file(folder_ / "s1.dcm", bytes);
        return survives(folder_.path(), slices);
    }

    const VoxelVolume volume_ = numbered({8, 6, 4}, straight_frame());
    const TemporaryFolder folder_;
};

TEST_P(DamagedDicom, CutsAreRefusedAndRepaired) {
    const std::string whole = dicom_file(slice(1), GetParam());
    ASSERT_TRUE(survives_with(whole, VolumeSelection::Slices::refuse));
    for (std::size_t cut = 0; cut < whole.size(); cut += kStep) {
        SCOPED_TRACE("cut at " + std::to_string(cut));
        EXPECT_FALSE(survives_with(whole.substr(0, cut), VolumeSelection::Slices::refuse));
        EXPECT_TRUE(survives_with(whole.substr(0, cut), VolumeSelection::Slices::repair));
    }
    EXPECT_FALSE(survives_with(whole.substr(0, whole.size() - 1), VolumeSelection::Slices::refuse));
}

TEST_P(DamagedDicom, WrongBytesAreReadOrRefused) {
    const std::string whole = dicom_file(slice(1), GetParam());
    std::mt19937 random(97);
    SCOPED_TRACE("seed 97");
    int read = 0;
    for (int n = 0; n < kCorruptions; ++n) {
        std::string damaged = whole;
        const std::size_t at = 128 + random() % (whole.size() - 128); // the preamble is free
        damaged[at] = static_cast<char>(random());
        SCOPED_TRACE("byte " + std::to_string(at));
        read += survives_with(damaged, n % 2 == 0 ? VolumeSelection::Slices::refuse
                                                  : VolumeSelection::Slices::repair);
    }
    EXPECT_GT(read, 0);
    EXPECT_LT(read, kCorruptions);
}

TEST_P(DamagedDicom, EnhancedFilesAreReadOrRefused) {
    const auto file = folder_ / "enhanced";
    const std::string whole = dicom_file(dicom_enhanced(volume_, {3, 1, 0, 2}), GetParam());
    make_file(file, whole);
    ASSERT_TRUE(survives(file, VolumeSelection::Slices::refuse));
    for (std::size_t cut = 132; cut < whole.size(); cut += kStep) {
        SCOPED_TRACE("cut at " + std::to_string(cut));
        make_file(file, whole.substr(0, cut));
        EXPECT_FALSE(survives(file, VolumeSelection::Slices::repair));
    }
    std::mt19937 random(5);
    SCOPED_TRACE("seed 5");
    for (int n = 0; n < kCorruptions; ++n) {
        std::string damaged = whole;
        damaged[132 + random() % (whole.size() - 132)] = static_cast<char>(random());
        make_file(file, damaged);
        survives(file,
                 n % 2 == 0 ? VolumeSelection::Slices::refuse : VolumeSelection::Slices::repair);
    }
}

INSTANTIATE_TEST_SUITE_P(Encodings, DamagedDicom,
                         testing::Values(DicomEncoding{true, false, false},
                                         DicomEncoding{true, false, true},
                                         DicomEncoding{false, false, true},
                                         DicomEncoding{true, true, false}));

TEST(DamagedDicomRuns, WrongBytesInCompressedPixelsAreReadOrRefused) {
    const TemporaryFolder folder;
    DicomDataSet slice = dicom_slice(numbered({8, 6, 4}, straight_frame()), 1);
    std::string segments("\2\0\0\0\x40\0\0\0\x72\0\0\0", 12); // two, of 50 bytes each
    segments += std::string(52, '\0') + "\x2F" + std::string(48, 'a') + '\0' + "\x2F" +
                std::string(48, 'b') + '\0';
    auto& pixels = slice.elements.at(0x7FE00010);
    pixels = {"OB", "", {}, {"", segments}};
    const std::string whole = dicom_file(slice, {}, "1.2.840.10008.1.2.5");
    DicomDataSet next = slice;
    next.decimals(0x00200032, {-100.0, -120.0, 35.0});
    make_file(folder / "next", dicom_file(next, {}, "1.2.840.10008.1.2.5"));
    make_file(folder / "one", whole);
    ASSERT_TRUE(survives(folder.path(), VolumeSelection::Slices::refuse));
    const std::size_t start = whole.size() - segments.size() - 16;
    std::mt19937 random(6);
    SCOPED_TRACE("seed 6");
    testing::internal::CaptureStderr();
    for (int n = 0; n < kCorruptions; ++n) {
        std::string damaged = whole;
        damaged[start + random() % (whole.size() - start)] = static_cast<char>(random());
        make_file(folder / "one", damaged);
        survives(folder.path(), VolumeSelection::Slices::refuse);
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

} // namespace
} // namespace palpate
