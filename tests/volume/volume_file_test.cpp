// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/volume_file.h>

#include <random>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::content_of;
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

// --- what is no volume at all
// ----------------------------------------------------------------------

TEST(VolumeFile, RefusesWhatCannotBeAVolumeWithOneLine) {
    const TemporaryFolder folder;
    for (const char* ending : {".nrrd", ".nhdr", ".nii", ".nii.gz", ".vdb"}) {
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
    EXPECT_REFUSED(folder / "a.png", ".nrrd, .nhdr, .nii, .nii.gz and .vdb are read");
    EXPECT_REFUSED(folder / ".nrrd", "not a volume by its name");
}

// --- OpenVDB -------------------------------------------------------------------------------------

class VdbVolume : public testing::Test {
protected:
    void SetUp() override { openvdb::initialize(); }

    static void write(const std::filesystem::path& file, const openvdb::GridPtrVec& grids) {
        openvdb::io::File output(file.string());
        output.write(grids);
        output.close();
    }
    static openvdb::FloatGrid::Ptr grid(const std::string& name, float value) {
        auto result = openvdb::FloatGrid::create(-1000.0F);
        result->setName(name);
        result->tree().setValue(openvdb::Coord(-3, 4, 5), value);
        result->tree().setValue(openvdb::Coord(10, 6, 5), 2.0F * value);
        return result;
    }
};

TEST_F(VdbVolume, IsCopiedOverItsActiveBoxWithBackgroundBetween) {
    const TemporaryFolder folder;
    const auto density = grid("anything", 7.0F);
    // Sheared and shifted, mm.
    density->setTransform(openvdb::math::Transform::createLinearTransform(
        openvdb::Mat4R(openvdb::Vec4d(0.5, 0.1, 0, 0), openvdb::Vec4d(0, -1, 0.2, 0),
                       openvdb::Vec4d(0, 0, 2, 0), openvdb::Vec4d(100, 200, 300, 1), true)));
    write(folder / "a.vdb", {density});
    const VoxelVolume volume = read_volume(folder / "a.vdb");
    EXPECT_EQ(volume.size, (std::array<int, 3>{14, 3, 1}));
    for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 14; ++i)
            EXPECT_EQ(volume.at(i, j, 0),
                      i == 0 && j == 0 ? 7.0F : (i == 13 && j == 2 ? 14.0F : -1000.0F));
    const openvdb::Vec3d world = density->indexToWorld(openvdb::Coord(-3 + 13, 4 + 2, 5));
    const Vec3 expected = kMm * Vec3(world.x(), world.y(), world.z());
    EXPECT_LT(glm::length(volume.index_to_scene.point({13, 2, 0}) - expected), 1e-15);
    EXPECT_EQ(volume.source_type, "float32");
    EXPECT_TRUE(volume.warnings.empty());
}

TEST_F(VdbVolume, TheGridNamedDensityIsTakenAmongSeveral) {
    const TemporaryFolder folder;
    write(folder / "a.vdb", {grid("other", 1.0F), grid("density", 5.0F), grid("more", 2.0F)});
    EXPECT_EQ(read_volume(folder / "a.vdb").at(0, 0, 0), 5.0F);
    write(folder / "b.vdb", {grid("one", 1.0F), grid("two", 2.0F)});
    EXPECT_REFUSED(folder / "b.vdb", "one (float), two (float)");
    const auto labels = openvdb::Int32Grid::create(0);
    labels->setName("labels");
    labels->tree().setValue(openvdb::Coord(0), 3);
    write(folder / "c.vdb", {labels, grid("only", 3.0F)});
    EXPECT_EQ(read_volume(folder / "c.vdb").at(0, 0, 0), 3.0F);
    write(folder / "d.vdb", {labels});
    EXPECT_REFUSED(folder / "d.vdb", "labels (int32)");
}

TEST_F(VdbVolume, RefusesWhatHasNoDenseAffineVolume) {
    const TemporaryFolder folder;
    write(folder / "empty.vdb", {openvdb::FloatGrid::create()});
    EXPECT_REFUSED(folder / "empty.vdb", "no active voxel");
    const auto huge = grid("huge", 1.0F);
    huge->tree().setValue(openvdb::Coord(1000000, 1000000, 1000000), 1.0F);
    write(folder / "huge.vdb", {huge});
    EXPECT_REFUSED(folder / "huge.vdb", "too large");
    const auto frustum = grid("frustum", 1.0F);
    frustum->setTransform(openvdb::math::Transform::createFrustumTransform(
        openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(10)), 0.5, 10.0));
    write(folder / "frustum.vdb", {frustum});
    EXPECT_REFUSED(folder / "frustum.vdb", "not affine");
}

TEST_F(VdbVolume, RefusesTruncatedFilesWhereverTheyAreCut) {
    const TemporaryFolder folder;
    const auto density = grid("density", 1.0F);
    SCOPED_TRACE("seed 8");
    std::mt19937 random(8);
    for (int n = 0; n < 5000; ++n) {
        const openvdb::Coord at(static_cast<int>(random() % 60), static_cast<int>(random() % 60),
                                static_cast<int>(random() % 60));
        density->tree().setValue(at, static_cast<float>(random() % 1000));
    }
    write(folder / "whole.vdb", {density});
    const std::string whole = content_of(folder / "whole.vdb");
    EXPECT_GT(read_volume(folder / "whole.vdb").voxels(), 0U);
    for (int share = 1; share < 40; ++share) {
        const std::size_t cut = whole.size() * static_cast<std::size_t>(share) / 40;
        SCOPED_TRACE(cut);
        make_file(folder / "cut.vdb", whole.substr(0, cut));
        refusal(folder / "cut.vdb");
    }
    make_file(folder / "cut.vdb", whole.substr(0, whole.size() - 1));
    refusal(folder / "cut.vdb");
}

TEST_F(VdbVolume, RefusesANewerFileVersionWithoutAWord) {
    const TemporaryFolder folder;
    write(folder / "a.vdb", {grid("density", 1.0F)});
    std::string bytes = content_of(folder / "a.vdb");
    bytes[9] = 127; // second byte of the version, after the eight of the magic number
    make_file(folder / "a.vdb", bytes);
    EXPECT_REFUSED(folder / "a.vdb", "newer than");
}

TEST_F(VdbVolume, WarnsThatALevelSetIsNegativeInside) {
    const TemporaryFolder folder;
    const auto set = grid("density", 1.0F);
    set->setGridClass(openvdb::GRID_LEVEL_SET);
    write(folder / "a.vdb", {set});
    const VoxelVolume volume = read_volume(folder / "a.vdb");
    ASSERT_EQ(volume.warnings.size(), 1U);
    EXPECT_NE(volume.warnings[0].find("level set"), std::string::npos);
}

} // namespace
} // namespace palpate
