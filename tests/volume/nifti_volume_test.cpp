// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/volume_file.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::content_of;
using test::counting;
using test::distance;
using test::frame_mm;
using test::make_file;
using test::oblique_frame;
using test::random_volume;
using test::refusal;
using test::TemporaryFolder;

constexpr double kMm = 1e-3;

/// A NIfTI-1 header of 4 x 3 x 2 int16 whose fields can be set by their offset.
struct Nifti {
    Nifti() : bytes(352, '\0') {
        set<std::int32_t>(0, 348);
        for (const auto& [offset, value] :
             {std::pair{40, 3}, {42, 4}, {44, 3}, {46, 2}, {48, 1}, {50, 1}, {52, 1}, {54, 1}})
            set<std::int16_t>(static_cast<std::size_t>(offset), static_cast<std::int16_t>(value));
        type(4, 16);
        set<float>(76, 1.0F);
        set<float>(80, 0.5F);
        set<float>(84, 1.0F);
        set<float>(88, 2.0F);
        set<float>(108, 352.0F);
        set<char>(123, 2); // mm
        std::memcpy(bytes.data() + 344, "n+1", 4);
    }
    template <class T>
    void set(std::size_t offset, T value) {
        std::memcpy(bytes.data() + offset, &value, sizeof(T));
    }
    void type(std::int16_t code, std::int16_t bits) {
        set(70, code);
        set(72, bits);
    }
    /// Spacing .5 1 2 as a sform; RAS, mm.
    void sform(float x, float y, float z) {
        set<std::int16_t>(254, 1);
        const float rows[3][4] = {{0.5F, 0, 0, x}, {0, 1.0F, 0, y}, {0, 0, 2.0F, z}};
        std::memcpy(bytes.data() + 280, rows, sizeof(rows));
    }
    void qform(float b, float c, float d, float x, float y, float z) {
        set<std::int16_t>(252, 1);
        const float values[6] = {b, c, d, x, y, z};
        std::memcpy(bytes.data() + 256, values, sizeof(values));
    }
    std::string with(const std::string& data) const { return bytes + data; }

    std::string bytes;
};

TEST(NiftiVolume, RasMillimetresBecomeLpsMetres) {
    const TemporaryFolder folder;
    Nifti nifti;
    nifti.sform(-90.0F, -126.0F, -72.0F);
    make_file(folder / "a.nii", nifti.with(counting(24)));
    const VoxelVolume volume = read_volume(folder / "a.nii");
    EXPECT_EQ(volume.size, (std::array<int, 3>{4, 3, 2}));
    EXPECT_EQ(volume.source_type, "int16");
    EXPECT_EQ(volume.values[23], 23.0F);
    EXPECT_TRUE(volume.warnings.empty());
    const auto expected = frame_mm(Mat3(-0.5, 0, 0, 0, -1, 0, 0, 0, 2), {90, 126, -72});
    EXPECT_LT(distance(volume.index_to_scene, expected), 1e-15);
}

TEST(NiftiVolume, SformWinsOverADifferentQformAndSaysByHowMuch) {
    // As in HarvardOxford of mricron-data: qoffset (90,0,0), srow offset (90,-126,-72); a reader
    // that goes by the qform puts it sqrt(126^2 + 72^2) = 145.12 mm off.
    const TemporaryFolder folder;
    Nifti nifti;
    nifti.sform(90.0F, -126.0F, -72.0F);
    nifti.qform(0.0F, 0.0F, 0.0F, 90.0F, 0.0F, 0.0F);
    make_file(folder / "a.nii", nifti.with(counting(24)));
    const VoxelVolume volume = read_volume(folder / "a.nii");
    const auto expected = frame_mm(Mat3(-0.5, 0, 0, 0, -1, 0, 0, 0, 2), {-90, 126, -72});
    EXPECT_LT(distance(volume.index_to_scene, expected), 1e-15);
    ASSERT_EQ(volume.warnings.size(), 1U);
    EXPECT_NE(volume.warnings[0].find("145.12 mm"), std::string::npos) << volume.warnings[0];
    nifti.qform(0.0F, 0.0F, 0.0F, 90.0F, -126.0F, -72.01F); // a hundredth of a millimetre
    make_file(folder / "a.nii", nifti.with(counting(24)));
    EXPECT_TRUE(read_volume(folder / "a.nii").warnings.empty());
}

TEST(NiftiVolume, SformIsNotTakenWhenItsCodeIsZero) {
    const TemporaryFolder folder;
    Nifti nifti;
    nifti.sform(90.0F, -126.0F, -72.0F);
    nifti.set<std::int16_t>(254, 0);
    // Half a turn about z: x and y run backwards. 0.5 turn = quaternion (0, 0, 0, 1).
    nifti.qform(0.0F, 0.0F, 1.0F, 1.0F, 2.0F, 3.0F);
    make_file(folder / "a.nii", nifti.with(counting(24)));
    const VoxelVolume volume = read_volume(folder / "a.nii");
    const auto expected = frame_mm(Mat3(0.5, 0, 0, 0, 1, 0, 0, 0, 2), {-1, -2, 3});
    EXPECT_LT(distance(volume.index_to_scene, expected), 1e-15);
    EXPECT_TRUE(volume.warnings.empty());
}

TEST(NiftiVolume, QuaternionTurnsAndQfacMirrors) {
    // A turn by 60 degrees about z in RAS: quaternion (cos 30, 0, 0, sin 30).
    const TemporaryFolder folder;
    Nifti nifti;
    nifti.qform(0.0F, 0.0F, 0.5F, 0.0F, 0.0F, 0.0F);
    nifti.set<float>(76, -1.0F);
    make_file(folder / "a.nii", nifti.with(counting(24)));
    const double c = 0.5, s = std::sqrt(0.75);
    const auto expected =
        frame_mm(Mat3(-0.5 * c, -0.5 * s, 0, 1.0 * s, -1.0 * c, 0, 0, 0, -2.0), Vec3(0.0));
    // 0.5 is exact in float; the rest is double.
    EXPECT_LT(distance(read_volume(folder / "a.nii").index_to_scene, expected), 1e-15);
}

TEST(NiftiVolume, WithoutAnyFormTheVoxelSizeAloneIsTakenAndSaid) {
    const TemporaryFolder folder;
    make_file(folder / "a.nii", Nifti().with(counting(24)));
    const VoxelVolume volume = read_volume(folder / "a.nii");
    EXPECT_LT(glm::length(volume.spacing_m() - Vec3(0.5, 1, 2) * kMm), 1e-15);
    ASSERT_EQ(volume.warnings.size(), 1U);
    EXPECT_NE(volume.warnings[0].find("no orientation"), std::string::npos);
}

TEST(NiftiVolume, UnitsOtherThanMillimetresAreHeeded) {
    const TemporaryFolder folder;
    for (const auto& [code, metres] : {std::pair{1, 1.0}, {2, 1e-3}, {3, 1e-6}, {0, 1e-3}}) {
        Nifti nifti;
        nifti.sform(0.0F, 0.0F, 0.0F);
        nifti.set<char>(123, static_cast<char>(code + 8)); // seconds beside it
        make_file(folder / "a.nii", nifti.with(counting(24)));
        const Vec3 spacing = read_volume(folder / "a.nii").spacing_m();
        EXPECT_LT(glm::length(spacing - Vec3(0.5, 1, 2) * metres), 1e-15 * metres) << code;
    }
}

TEST(NiftiVolume, SlopeAndInterceptAreAppliedAndTheFilesTypeIsKept) {
    const TemporaryFolder folder;
    Nifti nifti;
    nifti.sform(0.0F, 0.0F, 0.0F);
    nifti.set<float>(112, 2.0F);
    nifti.set<float>(116, -1024.0F);
    make_file(folder / "a.nii", nifti.with(counting(24)));
    const VoxelVolume volume = read_volume(folder / "a.nii");
    EXPECT_EQ(volume.values[23], 2.0F * 23.0F - 1024.0F);
    EXPECT_EQ(volume.source_type, "int16");
}

TEST(NiftiVolume, ReadsTheOtherByteOrderAndTrailingDimensionsOfOne) {
    const TemporaryFolder folder;
    Nifti nifti;
    nifti.sform(-90.0F, -126.0F, -72.0F);
    nifti.set<std::int16_t>(40, 5);
    const std::string plain = nifti.with(counting(24));
    make_file(folder / "a.nii", plain);
    const VoxelVolume volume = read_volume(folder / "a.nii");
    EXPECT_EQ(volume.size, (std::array<int, 3>{4, 3, 2}));

    std::string swapped = plain;
    const auto swap = [&](std::size_t offset, std::size_t bytes) {
        std::reverse(swapped.begin() + static_cast<std::ptrdiff_t>(offset),
                     swapped.begin() + static_cast<std::ptrdiff_t>(offset + bytes));
    };
    swap(0, 4);
    for (std::size_t field = 40; field < 76; field += 2)
        if (field < 56 || field >= 68) // intent_p1..3 between are floats
            swap(field, 2);
    for (std::size_t field = 76; field < 120; field += 4)
        swap(field, 4);
    swap(252, 2);
    swap(254, 2);
    for (std::size_t field = 256; field < 328; field += 4)
        swap(field, 4);
    for (std::size_t voxel = 352; voxel < swapped.size(); voxel += 2)
        swap(voxel, 2);
    make_file(folder / "b.nii", swapped);
    const VoxelVolume other = read_volume(folder / "b.nii");
    EXPECT_EQ(other.values, volume.values);
    EXPECT_EQ(distance(other.index_to_scene, volume.index_to_scene), 0.0);
}

TEST(NiftiVolume, RefusesTruncatedFilesPlainAndGzipped) {
    const TemporaryFolder folder;
    Nifti nifti;
    nifti.sform(0.0F, 0.0F, 0.0F);
    const std::string plain = nifti.with(counting(24));
    for (const std::size_t cut :
         {std::size_t{1}, std::size_t{347}, std::size_t{348}, std::size_t{352}, plain.size() - 1}) {
        SCOPED_TRACE(cut);
        make_file(folder / "cut.nii", plain.substr(0, cut));
        EXPECT_REFUSED(folder / "cut.nii", "truncated");
    }
    write_volume(random_volume(oblique_frame(Vec3(kMm), Vec3(0.0))), folder / "whole.nii.gz");
    const std::string whole = content_of(folder / "whole.nii.gz");
    for (const std::size_t cut :
         {std::size_t{1}, std::size_t{20}, whole.size() / 4, whole.size() / 2, whole.size() - 60}) {
        SCOPED_TRACE(cut);
        make_file(folder / "cut.nii.gz", whole.substr(0, cut));
        refusal(folder / "cut.nii.gz");
    }
}

TEST(NiftiVolume, RefusesAnAbsurdSizeBeforeMemoryIsAskedFor) {
    const TemporaryFolder folder;
    Nifti nifti;
    nifti.sform(0.0F, 0.0F, 0.0F);
    for (const std::size_t field : {42U, 44U, 46U})
        nifti.set<std::int16_t>(field, 9000); // 1.4 TB
    make_file(folder / "a.nii", nifti.with(counting(24)));
    EXPECT_REFUSED(folder / "a.nii", "truncated");
    make_file(folder / "a.nii.gz", nifti.with(counting(24)));
    EXPECT_REFUSED(folder / "a.nii.gz", "truncated");
}

TEST(NiftiVolume, RefusesWhatIsNotAScalarVolume) {
    const TemporaryFolder folder;
    const auto refused = [&](const char* words, const auto& change) {
        SCOPED_TRACE(words);
        Nifti nifti;
        nifti.sform(0.0F, 0.0F, 0.0F);
        change(nifti);
        make_file(folder / "a.nii", nifti.with(counting(240)));
        EXPECT_REFUSED(folder / "a.nii", words);
    };
    refused("2 dimensions", [](Nifti& n) { n.set<std::int16_t>(40, 2); });
    refused("4 dimensions", [](Nifti& n) {
        n.set<std::int16_t>(40, 4);
        n.set<std::int16_t>(48, 2);
    });
    refused("impossible size", [](Nifti& n) { n.set<std::int16_t>(44, 0); });
    refused("impossible size", [](Nifti& n) { n.set<std::int16_t>(44, -3); });
    refused("9 dimensions", [](Nifti& n) { n.set<std::int16_t>(40, 9); });
    refused("type 128", [](Nifti& n) { n.type(128, 24); }); // RGB
    refused("type 32", [](Nifti& n) { n.type(32, 64); });   // complex
    refused("vox_offset", [](Nifti& n) { n.set<float>(108, std::nanf("")); });
    refused("NIfTI-2", [](Nifti& n) { n.set<std::int32_t>(0, 540); });
    refused("not a single-file NIfTI-1", [](Nifti& n) { n.set<char>(345, 'i'); });
    refused("singular", [](Nifti& n) { n.set<float>(280, 0.0F); });
    refused("not finite", [](Nifti& n) { n.set<float>(284, std::nanf("")); });
}

} // namespace
} // namespace palpate
