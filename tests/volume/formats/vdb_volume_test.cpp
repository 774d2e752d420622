// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/volume_file.h>

#include <cstdint>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::content_of;
using test::make_file;
using test::refusal;
using test::TemporaryFolder;

constexpr double kMm = 1e-3;

/// An empty grid of background 0 from OpenVDB's list of types: Grid::create() compiles all of a
/// type once more, for seconds.
template <class Grid>
typename Grid::Ptr empty_grid() {
    return openvdb::gridPtrCast<Grid>(openvdb::GridBase::createGrid(Grid::gridType()));
}

/// One whose background is far from all that is in it.
openvdb::FloatGrid::Ptr sparse_grid() {
    const auto result = empty_grid<openvdb::FloatGrid>();
    result->tree().root().setBackground(-1000.0F, /*updateChildNodes=*/false);
    return result;
}

class VdbVolume : public testing::Test {
protected:
    void SetUp() override { openvdb::initialize(); }

    static void write(const std::filesystem::path& file, const openvdb::GridPtrVec& grids) {
        openvdb::io::File output(file.string());
        output.write(grids);
        output.close();
    }
    static openvdb::FloatGrid::Ptr grid(const std::string& name, float value) {
        auto result = sparse_grid();
        result->setName(name);
        result->tree().setValue(openvdb::Coord(-3, 4, 5), value);
        result->tree().setValue(openvdb::Coord(10, 6, 5), 2.0F * value);
        return result;
    }
    /// 5000 whole numbers below 1000 in a cube of 60.
    static openvdb::FloatGrid::Ptr dense_grid() {
        auto result = grid("density", 1.0F);
        std::mt19937 random(8);
        for (int n = 0; n < 5000; ++n) {
            const openvdb::Coord at(static_cast<int>(random() % 60),
                                    static_cast<int>(random() % 60),
                                    static_cast<int>(random() % 60));
            result->tree().setValue(at, static_cast<float>(random() % 1000));
        }
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

std::string message_of(const std::filesystem::path& file, const VolumeSelection& selection) {
    try {
        read_volume(file, selection);
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return {};
}

VolumeSelection grid_named(const std::string& name) { return {{}, name, {}, {}}; }

TEST_F(VdbVolume, TheGridNamedDensityIsTakenAmongSeveralOrTheOneAskedFor) {
    const TemporaryFolder folder;
    write(folder / "a.vdb", {grid("other", 1.0F), grid("density", 5.0F), grid("more", 2.0F)});
    EXPECT_EQ(read_volume(folder / "a.vdb").at(0, 0, 0), 5.0F);
    EXPECT_EQ(read_volume(folder / "a.vdb", grid_named("other")).at(0, 0, 0), 1.0F);
    EXPECT_EQ(read_volume(folder / "a.vdb", grid_named("more")).at(0, 0, 0), 2.0F);
    EXPECT_NE(message_of(folder / "a.vdb", grid_named("none")).find("has no grid \"none\", only: "),
              std::string::npos);
    write(folder / "b.vdb", {grid("one", 1.0F), grid("two", 2.0F)});
    EXPECT_REFUSED(folder / "b.vdb", "one (float), two (float)");
    EXPECT_REFUSED(folder / "b.vdb", "--grid");
    write(folder / "c.vdb", {grid("one", 1.0F), grid("one", 2.0F)});
    EXPECT_NE(message_of(folder / "c.vdb", grid_named("one")).find("several grids named"),
              std::string::npos);
}

template <class Grid>
typename Grid::Ptr single(const std::string& name, const typename Grid::ValueType& value) {
    auto result = empty_grid<Grid>();
    result->setName(name);
    result->tree().setValue(openvdb::Coord(1, 2, 3), value);
    return result;
}

TEST_F(VdbVolume, DoubleAndIntegerGridsAreReadAndOthersListed) {
    const TemporaryFolder folder;
    write(folder / "a.vdb",
          {single<openvdb::DoubleGrid>("d", 0.5), single<openvdb::Int32Grid>("i", -7),
           single<openvdb::Vec3SGrid>("v", openvdb::Vec3s(1, 2, 3)),
           single<openvdb::BoolGrid>("b", true), grid("f", 3.0F)});
    EXPECT_EQ(read_volume(folder / "a.vdb", grid_named("d")).values, std::vector<float>{0.5F});
    EXPECT_EQ(read_volume(folder / "a.vdb", grid_named("d")).source_type, "float64");
    EXPECT_EQ(read_volume(folder / "a.vdb", grid_named("i")).values, std::vector<float>{-7.0F});
    EXPECT_EQ(read_volume(folder / "a.vdb", grid_named("i")).source_type, "int32");
    EXPECT_EQ(read_volume(folder / "a.vdb", grid_named("f")).at(0, 0, 0), 3.0F);
    EXPECT_NE(message_of(folder / "a.vdb", grid_named("v")).find("no scalar volume"),
              std::string::npos);
    const auto entries = list_volumes(folder / "a.vdb");
    ASSERT_EQ(entries.size(), 5U);
    std::string list;
    for (const VolumeEntry& entry : entries)
        list += entry.selector + ": " + entry.text + (entry.readable ? " +" : "") + "\n";
    EXPECT_NE(list.find("d: double +\n"), std::string::npos) << list;
    EXPECT_NE(list.find("v: vec3s, not scalar\n"), std::string::npos) << list;
    EXPECT_NE(list.find("b: bool, not scalar\n"), std::string::npos) << list;
    write(folder / "only.vdb", {single<openvdb::Vec3SGrid>("v", openvdb::Vec3s(1, 2, 3)),
                                single<openvdb::Int32Grid>("i", -7)});
    EXPECT_EQ(read_volume(folder / "only.vdb").values, std::vector<float>{-7.0F});
    write(folder / "none.vdb", {single<openvdb::Vec3SGrid>("v", openvdb::Vec3s(1, 2, 3))});
    EXPECT_REFUSED(folder / "none.vdb", "v (vec3s)");
}

TEST_F(VdbVolume, EveryWayOfStoringIsRead) {
    const TemporaryFolder folder;
    const auto density = dense_grid();
    write(folder / "plain.vdb", {density});
    const VoxelVolume expected = read_volume(folder / "plain.vdb");
    const auto expect_same = [&](const std::filesystem::path& file) {
        const VoxelVolume read = read_volume(file);
        EXPECT_EQ(read.size, expected.size);
        EXPECT_EQ(read.values, expected.values);
    };
    for (const std::uint32_t compression : {0U, 1U, 2U, 3U, 4U, 6U}) {
        SCOPED_TRACE("compression " + std::to_string(compression));
        openvdb::io::File file((folder / "c.vdb").string());
        file.setCompression(compression);
        file.write(openvdb::GridPtrVec{density});
        file.close();
        expect_same(folder / "c.vdb");
    }
    density->setSaveFloatAsHalf(true); // whole numbers below 1000: exact in half floats
    write(folder / "half.vdb", {density});
    expect_same(folder / "half.vdb");
    density->setSaveFloatAsHalf(false);
    {
        std::ofstream stream(folder / "stream.vdb", std::ios::binary);
        openvdb::io::Stream(stream).write(openvdb::GridPtrVec{density, grid("other", 1.0F)});
    }
    expect_same(folder / "stream.vdb");
    // Two grids of one tree: the second refers to the first.
    const auto sharing = density->copy();
    sharing->setName("again");
    write(folder / "shared.vdb", {density, sharing});
    EXPECT_EQ(read_volume(folder / "shared.vdb", grid_named("again")).values, expected.values);
    EXPECT_EQ(read_volume(folder / "shared.vdb", grid_named("density")).values, expected.values);
}

TEST_F(VdbVolume, RefusesWhatHasNoDenseAffineVolume) {
    const TemporaryFolder folder;
    write(folder / "empty.vdb", {empty_grid<openvdb::FloatGrid>()});
    EXPECT_REFUSED(folder / "empty.vdb", "no active voxel");
    const auto huge = grid("huge", 1.0F);
    huge->tree().setValue(openvdb::Coord(1000000, 1000000, 1000000), 1.0F);
    write(folder / "huge.vdb", {huge});
    EXPECT_REFUSED(folder / "huge.vdb", "too large");
    const auto sparse = grid("sparse", 1.0F);
    sparse->tree().setValue(openvdb::Coord(1000, 500, 400), 1.0F); // one astray
    write(folder / "sparse.vdb", {sparse});
    EXPECT_REFUSED(folder / "sparse.vdb",
                   "over a box of 1004x497x396, most of which would be empty");
    const auto frustum = grid("frustum", 1.0F);
    frustum->setTransform(openvdb::math::Transform::createFrustumTransform(
        openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(10)), 0.5, 10.0));
    write(folder / "frustum.vdb", {frustum});
    EXPECT_REFUSED(folder / "frustum.vdb", "not affine");
}

TEST_F(VdbVolume, RefusesTruncatedFilesWhereverTheyAreCut) {
    const TemporaryFolder folder;
    write(folder / "whole.vdb", {dense_grid()});
    const std::string whole = content_of(folder / "whole.vdb");
    EXPECT_GT(read_volume(folder / "whole.vdb").voxels(), 0U);
    for (int share = 1; share < 100; ++share) {
        const std::size_t cut = whole.size() * static_cast<std::size_t>(share) / 100;
        SCOPED_TRACE(cut);
        make_file(folder / "cut.vdb", whole.substr(0, cut));
        refusal(folder / "cut.vdb");
    }
    make_file(folder / "cut.vdb", whole.substr(0, whole.size() - 1));
    refusal(folder / "cut.vdb");
}

// A negative length of a node's values made OpenVDB 10.0 write behind its buffer.
TEST_F(VdbVolume, WrongBytesAreReadOrRefused) {
    const TemporaryFolder folder;
    const auto few = sparse_grid();
    few->setName("density");
    std::mt19937 random(9);
    for (int n = 0; n < 40; ++n)
        few->tree().setValue(openvdb::Coord(static_cast<int>(random() % 20),
                                            static_cast<int>(random() % 20),
                                            static_cast<int>(random() % 20)),
                             static_cast<float>(random() % 1000));
    SCOPED_TRACE("seed 9");
    for (const std::uint32_t compression : {1U, 6U}) { // zip; blosc of active values
        openvdb::io::File file((folder / "whole.vdb").string());
        file.setCompression(compression);
        file.write(openvdb::GridPtrVec{few, single<openvdb::Int32Grid>("labels", 3)});
        file.close();
        const std::string whole = content_of(folder / "whole.vdb");
        int read = 0;
        testing::internal::CaptureStderr();
        for (int n = 0; n < 300; ++n) {
            std::string damaged = whole;
            const std::size_t reach = n % 2 == 0 ? 600 : whole.size();
            const std::size_t at = random() % reach;
            damaged[at] = static_cast<char>(random());
            SCOPED_TRACE("byte " + std::to_string(at));
            make_file(folder / "damaged.vdb", damaged);
            try {
                const VoxelVolume volume = read_volume(folder / "damaged.vdb");
                EXPECT_EQ(volume.values.size(), volume.voxels());
                ++read;
            } catch (const std::runtime_error& error) {
                const std::string message = error.what();
                EXPECT_EQ(message.find((folder / "damaged.vdb").string()), 0U) << message;
                EXPECT_EQ(message.find('\n'), std::string::npos) << message;
                EXPECT_NE(message.find("; "), std::string::npos) << "no remedy: " << message;
            } // anything else ends the test
        }
        EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
        EXPECT_GT(read, 0);
        EXPECT_LT(read, 300);
    }
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
