// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/volume_file.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "tests/support/nifti_writer.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::content_of;
using test::counting;
using test::distance;
using test::frame_mm;
using test::make_file;
using test::Nifti;
using test::oblique_frame;
using test::random_volume;
using test::refusal;
using test::TemporaryFolder;

constexpr double kMm = 1e-3;

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
    EXPECT_NE(volume.warnings[0].find("145.12 mm and 0.0 degrees: the sform is taken"),
              std::string::npos)
        << volume.warnings[0];
    nifti.qform(0.0F, 0.0F, 0.0F, 90.0F, -126.0F, -72.01F); // a hundredth of a millimetre
    make_file(folder / "a.nii", nifti.with(counting(24)));
    EXPECT_TRUE(read_volume(folder / "a.nii").warnings.empty());
}

TEST(NiftiVolume, TheFormThatIsAskedForIsTakenAndAMissingOneIsAnError) {
    const TemporaryFolder folder;
    const auto file = folder / "a.nii";
    const auto read = [&](VolumeSelection::NiftiTransform transform) {
        VolumeSelection selection;
        selection.nifti_transform = transform;
        return read_volume(file, selection);
    };
    Nifti nifti;
    nifti.sform(90.0F, -126.0F, -72.0F);
    // Half a turn about z: x and y run backwards, 180 degrees from the sform.
    nifti.qform(0.0F, 0.0F, 1.0F, 1.0F, 2.0F, 3.0F);
    make_file(file, nifti.with(counting(24)));
    const auto by_sform = frame_mm(Mat3(-0.5, 0, 0, 0, -1, 0, 0, 0, 2), {-90, 126, -72});
    const auto by_qform = frame_mm(Mat3(0.5, 0, 0, 0, 1, 0, 0, 0, 2), {-1, -2, 3});
    const VoxelVolume automatic = read(VolumeSelection::NiftiTransform::automatic);
    const VoxelVolume sform = read(VolumeSelection::NiftiTransform::sform);
    const VoxelVolume qform = read(VolumeSelection::NiftiTransform::qform);
    EXPECT_LT(distance(automatic.index_to_scene, by_sform), 1e-15);
    EXPECT_LT(distance(sform.index_to_scene, by_sform), 1e-15);
    EXPECT_LT(distance(qform.index_to_scene, by_qform), 1e-15);
    ASSERT_EQ(qform.warnings.size(), 1U);
    EXPECT_NE(qform.warnings[0].find("180.0 degrees: the qform is taken"), std::string::npos)
        << qform.warnings[0];

    const auto refused = [&](VolumeSelection::NiftiTransform transform, const char* words) {
        try {
            read(transform);
            ADD_FAILURE() << "was read";
        } catch (const std::runtime_error& error) {
            EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
        }
    };
    nifti.set<std::int16_t>(252, 0);
    make_file(file, nifti.with(counting(24)));
    refused(VolumeSelection::NiftiTransform::qform, "no qform (its code is 0); choose its sform");
    nifti.set<std::int16_t>(252, 1);
    nifti.set<std::int16_t>(254, 0);
    make_file(file, nifti.with(counting(24)));
    refused(VolumeSelection::NiftiTransform::sform, "no sform (its code is 0); choose its qform");
}

TEST(NiftiVolume, WarnsOfASformWhoseVoxelsAreNotThoseOfThePixdim) {
    // Seen in the wild: a sform of unit columns beside voxels of another size.
    const TemporaryFolder folder;
    Nifti nifti;
    nifti.sform({Mat3(1.0), Vec3(0.0)});
    make_file(folder / "a.nii", nifti.with(counting(24)));
    const VoxelVolume volume = read_volume(folder / "a.nii");
    ASSERT_EQ(volume.warnings.size(), 1U);
    EXPECT_NE(volume.warnings[0].find("1 x 1 x 1, its pixdim says 0.5 x 1 x 2"), std::string::npos)
        << volume.warnings[0];
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

TEST(NiftiVolume, NegativeSizesOfVoxelsMirrorNothingAndAreWarnedOf) {
    const TemporaryFolder folder;
    const auto read = [&](float i, float j, bool has_qform) {
        Nifti nifti;
        if (has_qform) nifti.qform(0.0F, 0.0F, 0.5F, 1.0F, 2.0F, 3.0F);
        nifti.spacing(i, j, 2.0F);
        make_file(folder / "a.nii", nifti.with(counting(24)));
        return read_volume(folder / "a.nii");
    };
    for (const bool has_qform : {true, false}) {
        const VoxelVolume plain = read(0.5F, 1.0F, has_qform);
        for (const auto& [i, j] : {std::pair{-0.5F, 1.0F}, {0.5F, -1.0F}, {-0.5F, -1.0F}}) {
            const VoxelVolume volume = read(i, j, has_qform);
            EXPECT_EQ(distance(volume.index_to_scene, plain.index_to_scene), 0.0) << i << ' ' << j;
            ASSERT_EQ(volume.warnings.size(), plain.warnings.size() + 1) << i << ' ' << j;
            EXPECT_EQ(std::count_if(volume.warnings.begin(), volume.warnings.end(),
                                    [](const std::string& words) {
                                        return words.find("negative size") != std::string::npos;
                                    }),
                      1);
        }
    }
}

TEST(NiftiVolume, UnitsOtherThanMillimetresAreHeeded) {
    const TemporaryFolder folder;
    for (const auto& [code, metres] : {std::pair{1, 1.0}, {2, 1e-3}, {3, 1e-6}, {0, 1e-3}}) {
        Nifti nifti;
        nifti.sform({Mat3(0.25, 0, 0, 0, 0.5, 0, 0, 0, 1), Vec3(0.0)}); // a metre at most
        nifti.set<char>(123, static_cast<char>(code + 8));              // seconds beside it
        make_file(folder / "a.nii", nifti.with(counting(24)));
        const Vec3 spacing = read_volume(folder / "a.nii").spacing_m();
        EXPECT_LT(glm::length(spacing - Vec3(0.25, 0.5, 1) * metres), 1e-15 * metres) << code;
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
         {std::size_t{1}, std::size_t{20}, whole.size() / 4, whole.size() / 2, whole.size() - 60,
          whole.size() - 8, whole.size() - 1}) { // the last eight bytes are sum and length
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
    refused("3 numbers per voxel", [](Nifti& n) { n.sizes({4, 3, 2, 3}); });
    refused("3 numbers per voxel (vector)", [](Nifti& n) {
        n.sizes({4, 3, 2, 1, 3});
        n.intent(1007);
    });
    refused("9 volumes, as of a time series", [](Nifti& n) {
        n.sizes({4, 3, 2, 9});
        n.intent(3); // t statistics: not components of a thing
    });
    refused("5 dimensions", [](Nifti& n) { n.sizes({4, 3, 2, 2, 2}); });
    refused("impossible size", [](Nifti& n) { n.sizes({4, 3, 2, -2}); });
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
