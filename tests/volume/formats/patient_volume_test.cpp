// SPDX-License-Identifier: Apache-2.0
// Volumes that no patient has, of every reader, and files and choices that are for something else.
#include <palpate/volume/formats/volume_file.h>

#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include <palpate/volume/fields/grid_field.h>
#include <palpate/volume/formats/label_file.h>
#include <palpate/volume/formats/vector_file.h>
#include <palpate/volume/label_volume.h>
#include <palpate/volume/vector_volume.h>

#include "tests/support/nifti_writer.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::counting;
using test::make_file;
using test::TemporaryFolder;

template <class Read>
std::string complaint(const Read& read) {
    try {
        read();
    } catch (const std::runtime_error& error) {
        return error.what();
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return {};
}

std::string nrrd(const std::string& spacings, const std::string& origin = "(0,0,0)") {
    return "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 4 3 2\n"
           "spacings: " +
           spacings + "\nspace origin: " + origin + "\nendian: little\nencoding: raw\n\n" +
           counting(24);
}

std::string meta(const std::string& spacing, const std::string& offset) {
    return "ObjectType = Image\nNDims = 3\nBinaryData = True\nDimSize = 4 3 2\nElementSpacing = " +
           spacing + "\nOffset = " + offset +
           "\nElementType = MET_SHORT\nElementDataFile = LOCAL\n" + counting(24);
}

// 1e-30 mm ended as an internal error, 1e-9 x 1 x 1e9 mm took all memory there was.
TEST(PatientVolume, SpacingsAndOriginsThatNoPatientHasAreRefusedWithTheirLine) {
    const TemporaryFolder folder;
    const auto said = [&](const std::string& name, const std::string& bytes) {
        make_file(folder / name, bytes);
        return complaint([&] { read_volume(folder / name); });
    };
    for (const char* spacings : {"1e-30 1e-30 1e-30", "1e-30 1 1", "1e-9 1 1e9", "1e30 1e30 1e30",
                                 "1e-3 1 100", "2000 2000 2000"}) {
        const std::string words = said("a.nrrd", nrrd(spacings));
        EXPECT_NE(words.find("a.nrrd:6: has voxels of "), std::string::npos) << words;
        EXPECT_NE(words.find("correct their spacing"), std::string::npos) << words;
        EXPECT_NE(said("a.mha", meta(spacings, "0 0 0")).find("a.mha:5: has voxels of "),
                  std::string::npos)
            << spacings;
    }
    const std::string far = said("b.nrrd", nrrd("1 1 1", "(1e18,0,0)"));
    EXPECT_NE(far.find("b.nrrd:7: lies up to "), std::string::npos) << far;
    EXPECT_NE(said("b.mha", meta("1 1 1", "0 -1e18 0")).find("b.mha:6: lies up to "),
              std::string::npos);
    EXPECT_EQ(said("c.nrrd", nrrd("0.4 0.4 1.5", "(-100,-200,-1500)")), "");
    EXPECT_EQ(said("c.mha", meta("0.4 0.4 1.5", "-100 -200 -1500")), "");
}

TEST(PatientVolume, EveryReaderAndTheGridItselfAsk) {
    const TemporaryFolder folder;
    test::Nifti nifti;
    nifti.sform({Mat3(1e-20, 0, 0, 0, 1, 0, 0, 0, 1), Vec3(0.0)});
    make_file(folder / "a.nii", nifti.bytes + counting(24));
    EXPECT_NE(complaint([&] { read_volume(folder / "a.nii"); }).find("a.nii: has voxels of "),
              std::string::npos);
    make_file(folder / "a.nrrd", nrrd("1e-9 1 1e9"));
    for (const std::string& words : {complaint([&] { read_label_volume(folder / "a.nrrd"); }),
                                     complaint([&] { read_vector_volume(folder / "a.nrrd"); }),
                                     complaint([&] { list_volumes(folder / "a.nrrd"); })})
        EXPECT_NE(words.find("a.nrrd:6: has voxels of "), std::string::npos) << words;

    VoxelVolume volume =
        test::sampled({4, 4, 4}, {Mat3(1e-3), Vec3(0.0)}, [](const Vec3& p) { return p.x; });
    volume.index_to_scene.linear[1] *= 1e9;
    EXPECT_NE(complaint([&] { GridField(volume, 0.0F); }).find("volume: it has voxels of "),
              std::string::npos);
    EXPECT_NE(complaint([&] { write_volume(volume, folder / "b.nrrd"); }).find("has voxels of "),
              std::string::npos);
}

TEST(PatientVolume, MoreThanTheMachineHasIsRefusedBeforeItIsAskedFor) {
    const TemporaryFolder folder;
    // 100 000 x 1000 x 1000 floats: 4e11 bytes. A hole in a file takes no room.
    make_file(folder / "a.nhdr", "NRRD0004\ntype: uchar\ndimension: 3\nspace: LPS\nsizes: 100000 "
                                 "1000 1000\nspacings: 0.1 0.1 0.1\nencoding: raw\n"
                                 "data file: a.raw\n");
    make_file(folder / "a.raw", "");
    std::filesystem::resize_file(folder / "a.raw", 100000000000);
    EXPECT_NE(complaint([&] { read_volume(folder / "a.nhdr"); }).find("GB of memory"),
              std::string::npos);
}

TEST(PatientVolume, AMeshIsNamedAsWhatItIs) {
    const TemporaryFolder folder;
    for (const char* name : {"bone.ply", "bone.stl", "bone.obj"}) {
        make_file(folder / name, "ply\n");
        for (const std::string& words : {complaint([&] { read_volume(folder / name); }),
                                         complaint([&] { read_label_volume(folder / name); })})
            EXPECT_NE(words.find(": is a mesh, where a volume is wanted"), std::string::npos)
                << words;
    }
}

TEST(PatientVolume, ChoicesThatTheFileDoesNotOfferAreRefused) {
    const TemporaryFolder folder;
    make_file(folder / "a.nrrd", nrrd("1 1 1"));
    VolumeSelection repair, qform, series;
    repair.slices = VolumeSelection::Slices::repair;
    qform.nifti_transform = VolumeSelection::NiftiTransform::qform;
    series.series = "3";
    for (const auto& [selection, words] :
         {std::pair{repair, "leave slices out"}, std::pair{qform, "leave nifti_transform out"},
          std::pair{series, "leave series out"}}) {
        EXPECT_NE(complaint([&, s = selection] { read_volume(folder / "a.nrrd", s); }).find(words),
                  std::string::npos);
        EXPECT_NE(complaint([&, s = selection] {
                      read_label_volume(folder / "a.nrrd", {}, s);
                  }).find(words),
                  std::string::npos);
    }
}

TEST(PatientVolume, WhatIsWrittenIsKnownAgain) {
    const TemporaryFolder folder;
    const VoxelVolume volume =
        test::sampled({4, 4, 4}, {Mat3(1e-3), Vec3(0.0)}, [](const Vec3& p) { return p.x; });
    for (const char* name : {"a.nrrd", "a.nii", "a.nii.gz"}) {
        write_volume(volume, folder / name);
        EXPECT_TRUE(is_written_volume(folder / name)) << name;
        EXPECT_EQ(read_volume(folder / name).values, volume.values) << name;
    }
    make_file(folder / "b.nrrd", nrrd("1 1 1"));
    make_file(folder / "b.nii", test::Nifti().bytes + counting(24));
    make_file(folder / "c.nii.gz", "palpate");
    for (const char* name : {"b.nrrd", "b.nii", "c.nii.gz", "none.nii", "none.nrrd"})
        EXPECT_FALSE(is_written_volume(folder / name)) << name;
}

} // namespace
} // namespace palpate
