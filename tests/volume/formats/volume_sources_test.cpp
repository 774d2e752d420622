// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/volume_sources.h>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

using Files = std::vector<std::filesystem::path>;

TEST(SourceFiles, OfAPlainFileAreItself) {
    const test::TemporaryFolder folder;
    test::make_file(folder / "a.nrrd", "NRRD0004\nencoding: raw\n\ndata file: voxels\n");
    EXPECT_EQ(source_files(folder / "a.nrrd"), Files{folder / "a.nrrd"});
    test::make_file(folder / "a.mha", "NDims = 3\nElementDataFile = LOCAL\nElementDataFile = v");
    EXPECT_EQ(source_files(folder / "a.mha"), Files{folder / "a.mha"});
    EXPECT_EQ(source_files(folder / "missing.nii"), Files{folder / "missing.nii"});
}

TEST(SourceFiles, OfADetachedHeaderIncludeItsData) {
    const test::TemporaryFolder folder;
    test::make_file(folder / "a.nhdr", "NRRD0004\r\nencoding: raw\r\nData File: b.raw\r\n");
    EXPECT_EQ(source_files(folder / "a.nhdr"), (Files{folder / "a.nhdr", folder / "b.raw"}));
    test::make_file(folder / "a.mhd", "NDims = 3\nElementDataFile = c.zraw\n");
    EXPECT_EQ(source_files(folder / "a.mhd"), (Files{folder / "a.mhd", folder / "c.zraw"}));
    test::make_file(folder / "l.nhdr", "NRRD0004\ndatafile: LIST 2\nz.raw\ny.raw\n");
    EXPECT_EQ(source_files(folder / "l.nhdr"),
              (Files{folder / "l.nhdr", folder / "y.raw", folder / "z.raw"}));
}

// The readers go by what a header says, not by its name: .nrrd with voxels elsewhere was taken for
// a plain file, so that the cache and a replay did not see that they were others.
TEST(SourceFiles, OfADetachedHeaderWithAnAttachedOnesNameIncludeItsData) {
    const test::TemporaryFolder folder;
    test::make_file(folder / "a.nrrd", "NRRD0004\nencoding: raw\ndata file: b.raw\n\n");
    EXPECT_EQ(source_files(folder / "a.nrrd"), (Files{folder / "a.nrrd", folder / "b.raw"}));
    test::make_file(folder / "a.mha", "NDims = 3\nElementDataFile = c.zraw\n");
    EXPECT_EQ(source_files(folder / "a.mha"), (Files{folder / "a.mha", folder / "c.zraw"}));
}

// What lies beside slices and is none is not read: it may be written, and it changes nothing.
TEST(SourceFiles, OfAFolderAreItsSlicesByName) {
    const test::TemporaryFolder folder;
    test::make_file(folder / "2", std::string(128, '\0') + "DICM");
    test::make_file(folder / "1.dcm", "x");
    std::filesystem::create_directory(folder / "deeper");
    test::make_file(folder / "notes.txt", "x");
    test::make_file(folder / "scene.toml", "[volume.scan]\n");
    test::make_file(folder / "bone.ply", "ply\n");
    EXPECT_EQ(source_files(folder.path()), (Files{folder / "1.dcm", folder / "2"}));
}

TEST(SourceFiles, OfAPatternAreAllThatLieBesideTheHeader) {
    const test::TemporaryFolder folder;
    test::make_file(folder / "p.nhdr", "NRRD0004\ndata file: s%02d.raw 1 2 1\n");
    for (const char* name : {"s01.raw", "s02.raw"})
        test::make_file(folder / name, "x");
    EXPECT_EQ(source_files(folder / "p.nhdr"),
              (Files{folder / "p.nhdr", folder / "s01.raw", folder / "s02.raw"}));
}

TEST(SourceFiles, OfAPatternInAnotherFolderAreAllThatLieThere) {
    const test::TemporaryFolder folder;
    std::filesystem::create_directory(folder / "slices");
    for (const char* name : {"slices/s000.raw", "slices/s001.raw", "beside.raw"})
        test::make_file(folder / name, "x");
    test::make_file(folder / "p.nhdr", "NRRD0004\ndata file: slices/s%03d.raw 0 1 1\n");
    EXPECT_EQ(source_files(folder / "p.nhdr"),
              (Files{folder / "p.nhdr", folder / "slices/s000.raw", folder / "slices/s001.raw"}));
}

// The number may be a folder's: then the files lie at any depth.
TEST(SourceFiles, OfAPatternOfFoldersAreAllThatLieBelow) {
    const test::TemporaryFolder folder;
    for (const char* name : {"s0", "s1"}) {
        std::filesystem::create_directory(folder / name);
        test::make_file(folder / name / "voxels.raw", "x");
    }
    test::make_file(folder / "p.nhdr", "NRRD0004\ndata file: s%d/voxels.raw 0 1 1\n");
    EXPECT_EQ(source_files(folder / "p.nhdr"),
              (Files{folder / "p.nhdr", folder / "s0/voxels.raw", folder / "s1/voxels.raw"}));
}

// A list is the word alone, as its reader has it: a name may begin with it.
TEST(SourceFiles, OfANameThatBeginsWithListIsTheFileOfThatName) {
    const test::TemporaryFolder folder;
    test::make_file(folder / "a.nhdr", "NRRD0004\ndata file: list_ct.raw\n");
    EXPECT_EQ(source_files(folder / "a.nhdr"), (Files{folder / "a.nhdr", folder / "list_ct.raw"}));
    test::make_file(folder / "a.mhd", "NDims = 3\nElementDataFile = list_ct.raw\n");
    EXPECT_EQ(source_files(folder / "a.mhd"), (Files{folder / "a.mhd", folder / "list_ct.raw"}));
}

// Only a line with nothing in it ends an NRRD header, as its reader has it.
TEST(SourceFiles, ALineOfBlanksDoesNotEndAnNrrdHeader) {
    const test::TemporaryFolder folder;
    test::make_file(folder / "a.nhdr", "NRRD0004\n  \t\ndata file: b.raw\n");
    EXPECT_EQ(source_files(folder / "a.nhdr"), (Files{folder / "a.nhdr", folder / "b.raw"}));
    test::make_file(folder / "c.nrrd", "NRRD0004\n \n\ndata file: voxels\n");
    EXPECT_EQ(source_files(folder / "c.nrrd"), Files{folder / "c.nrrd"});
}

} // namespace
} // namespace palpate
