// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/volume_import.h>
#include <palpate/volume/formats/volume_file.h>

#include <csignal>
#include <iterator>
#include <random>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::distance;
using test::make_file;
using test::oblique_frame;
using test::random_volume;
using test::refusal;
using test::sheared_frame;
using test::TemporaryFolder;

constexpr double kMm = 1e-3;

// --- round trips ---------------------------------------------------------------------------------

TEST(VolumeFile, RoundTripKeepsValuesBitForBitAndPlaces) {
    const TemporaryFolder folder;
    const auto frame = oblique_frame(Vec3(0.3, 0.9, 1.7) * kMm, Vec3(-0.12, 0.034, 0.21));
    const VoxelVolume volume = random_volume(frame);
    for (const char* name : {"a.nrrd", "a.nii", "a.nii.gz"}) {
        SCOPED_TRACE(name);
        write_volume(volume, folder / name);
        const VoxelVolume back = read_volume(folder / name);
        EXPECT_EQ(back.size, volume.size);
        EXPECT_EQ(back.values, volume.values);
        EXPECT_EQ(back.source_type, "float32");
        EXPECT_TRUE(back.warnings.empty()) << back.warnings.front();
        // NRRD: 17 digits; NIfTI: float millimetres, 6e-8 of 210 mm in each of three coordinates
        // and as much again in ten voxels' directions.
        const double tolerance = std::string(name) == "a.nrrd" ? 1e-15 : 50e-9;
        EXPECT_LT(distance(back.index_to_scene, volume.index_to_scene), tolerance);
    }
    EXPECT_LT(std::filesystem::file_size(folder / "a.nii.gz"),
              std::filesystem::file_size(folder / "a.nii"));
}

TEST(VolumeFile, ShearedAxesSurviveInNrrdAndAreRefusedByNifti) {
    const TemporaryFolder folder;
    const VoxelVolume volume = random_volume(sheared_frame(0.7 * kMm));
    write_volume(volume, folder / "a.nrrd");
    const VoxelVolume back = read_volume(folder / "a.nrrd");
    EXPECT_LT(distance(back.index_to_scene, volume.index_to_scene), 1e-15);
    EXPECT_THROW(write_volume(volume, folder / "a.nii.gz"), std::runtime_error);
    EXPECT_FALSE(std::filesystem::exists(folder / "a.nii.gz"));
}

TEST(VolumeFile, WritingLeavesOneCompleteFileOrNothing) {
    const TemporaryFolder folder;
    const VoxelVolume volume = random_volume(oblique_frame(Vec3(kMm), Vec3(0.0)));
    testing::internal::CaptureStderr();
    for (const char* ending : {".nrrd", ".nii", ".nii.gz"}) {
        const auto target = folder / (std::string("taken") + ending);
        std::filesystem::create_directory(target);
        make_file(target / "x", "a folder with something in it cannot be replaced");
        EXPECT_THROW(write_volume(volume, target), std::runtime_error);
        std::filesystem::remove_all(target);
        EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << ending;
        EXPECT_THROW(write_volume(volume, folder / "missing" / (std::string("a") + ending)),
                     std::runtime_error);
        make_file(target, "an older file");
        write_volume(volume, target);
        EXPECT_EQ(read_volume(target).values, volume.values);
        std::filesystem::remove(target);
        EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << ending;
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

/// A disk that is full: files of this process end after some bytes, as long as this is there.
class FullDisk {
public:
    explicit FullDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
        getrlimit(RLIMIT_FSIZE, &before_);
        const rlimit limit{bytes, before_.rlim_max};
        setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~FullDisk() {
        setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, handler_);
    }
    FullDisk(const FullDisk&) = delete;
    FullDisk& operator=(const FullDisk&) = delete;

private:
    void (*handler_)(int);
    rlimit before_{};
};

TEST(VolumeFile, OnAFullDiskAnOlderFileStaysAndNothingIsLeft) {
    const VoxelVolume volume = random_volume(oblique_frame(Vec3(kMm), Vec3(0.0)));
    ASSERT_GT(volume.values.size() * sizeof(float), 1000U);
    for (const char* ending : {".nrrd", ".nii", ".nii.gz"}) {
        const TemporaryFolder folder;
        const auto target = folder / (std::string("taken") + ending);
        make_file(target, "an older file");
        testing::internal::CaptureStderr(); // the NIfTI library says there what it saw
        std::string said;
        try {
            const FullDisk disk(1000);
            write_volume(volume, target);
        } catch (const std::runtime_error& error) {
            said = error.what();
        }
        testing::internal::GetCapturedStderr();
        EXPECT_TRUE(said.starts_with(target.string() + ": cannot be written (")) << said;
        EXPECT_TRUE(said.ends_with("check the folder and the space on the disk")) << said;
        EXPECT_EQ(std::filesystem::file_size(target), std::string("an older file").size());
        EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
    }
}

TEST(VolumeFile, WritingRefusesWhatIsNoVolumeAndNamesItCannotWrite) {
    const TemporaryFolder folder;
    VoxelVolume volume = random_volume(AffineTransform{});
    for (const char* name : {"a.vdb", "a.png", "a", "a.nhdr"})
        EXPECT_THROW(write_volume(volume, folder / name), std::runtime_error) << name;
    volume.values.pop_back();
    EXPECT_THROW(write_volume(volume, folder / "a.nrrd"), std::invalid_argument);
    EXPECT_THROW(write_volume(VoxelVolume{}, folder / "a.nrrd"), std::invalid_argument);
    VoxelVolume flat = random_volume(AffineTransform{});
    flat.index_to_scene.linear[2] = flat.index_to_scene.linear[1];
    EXPECT_THROW(write_volume(flat, folder / "a.nrrd"), std::runtime_error);
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

// --- what is no volume at all --------------------------------------------------------------------

TEST(VolumeFile, RefusesWhatCannotBeAVolumeWithOneLine) {
    const TemporaryFolder folder;
    for (const char* ending :
         {".nrrd", ".nhdr", ".nii", ".nii.gz", ".mha", ".mhd", ".vdb", ".dcm"}) {
        SCOPED_TRACE(ending);
        EXPECT_REFUSED(folder / (std::string("missing") + ending), "does not exist");
        std::filesystem::create_directory(folder / (std::string("folder") + ending));
        EXPECT_REFUSED(folder / (std::string("folder") + ending), "is a folder");
        make_file(folder / (std::string("empty") + ending), "");
        EXPECT_REFUSED(folder / (std::string("empty") + ending), "is empty");
        make_file(folder / (std::string("text") + ending),
                  std::string(1000, 'x') + "\nnot a volume\n");
        refusal(folder / (std::string("text") + ending));
        SCOPED_TRACE("seed 3");
        std::mt19937 random(3);
        std::string noise(5000, '\0');
        for (char& c : noise)
            c = static_cast<char>(random());
        make_file(folder / (std::string("noise") + ending), noise);
        refusal(folder / (std::string("noise") + ending));
    }
    make_file(folder / "a.png", "x");
    EXPECT_REFUSED(folder / "a.png", ".mha, .mhd, .vdb and folders of DICOM slices are read");
    make_file(folder / ".nrrd", "x");
    EXPECT_REFUSED(folder / ".nrrd", "not a volume by its name");
}

// As those with an ending: what is wrong with it is not its name's form.
TEST(VolumeFile, ANameThatIsNotThereDoesNotExistWhateverItsEnding) {
    const TemporaryFolder folder;
    for (const char* name : {"missing", ".nrrd", "missing.png", "no_folder/missing"})
        EXPECT_REFUSED(folder / name, "does not exist");
}

TEST(ImportError, KeepsThePathsBlanksAndHasNoControlCharacters) {
    EXPECT_STREQ(internal::import_error("two  blanks\n\x01.nrrd", "is  gone\n;\x02 get it ").what(),
                 "two  blanks??.nrrd: is gone ;? get it");
}

} // namespace
} // namespace palpate
