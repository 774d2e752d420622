// SPDX-License-Identifier: Apache-2.0
// Meshes that no patient has, and files that are no meshes.
#include <palpate/geometry/formats/mesh_file.h>

#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/support/mesh_text.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

std::string complaint(const std::filesystem::path& file, const MeshFileSettings& settings = {}) {
    try {
        read_mesh(file, settings);
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return {};
}

// `info` told of a mesh 1e9 m across as of any other.
TEST(MeshFileSize, AMeshThatNoPatientHasIsRefusedWhateverItsFormat) {
    const test::TemporaryFolder folder;
    const TriangleMesh huge = test::icosphere(5e11, 1, Vec3(0.0)); // mm
    test::make_file(folder / "a.ply", test::ascii_ply(huge, ""));
    test::make_file(folder / "a.stl", test::binary_stl(huge, "a test"));
    test::make_file(folder / "a.obj", test::obj(huge, ""));
    for (const char* name : {"a.ply", "a.stl", "a.obj"}) {
        const std::string said = complaint(folder / name);
        EXPECT_NE(said.find(std::string(name) + ": is "), std::string::npos) << said;
        EXPECT_NE(said.find("at most 100 m"), std::string::npos) << said;
        EXPECT_NE(said.find("its unit"), std::string::npos) << said;
    }
    test::make_file(folder / "far.ply",
                    test::ascii_ply(test::icosphere(50, 1, Vec3(1e18, 0, 0)), ""));
    EXPECT_NE(complaint(folder / "far.ply").find("1 km"), std::string::npos)
        << complaint(folder / "far.ply");
    test::make_file(folder / "skull.ply",
                    test::ascii_ply(test::icosphere(150.0, 1, Vec3(0.0)), ""));
    EXPECT_EQ(complaint(folder / "skull.ply"), "");
    EXPECT_NE(complaint(folder / "skull.ply", {MeshFrame::as_stated, MeshUnit::metre}), "");
}

TEST(MeshFileSize, AVolumeIsNamedAsWhatItIs) {
    for (const char* name : {"ct.nrrd", "ct.nhdr", "ct.nii", "ct.nii.gz", "ct.mha", "ct.vdb"})
        EXPECT_NE(complaint(name).find(": is a volume, where a mesh is wanted"), std::string::npos)
            << complaint(name);
}

TEST(MeshFileSize, AnUnknownUnitIsToldTheKnownOnes) {
    const test::TemporaryFolder folder;
    test::make_file(folder / "a.ply",
                    test::ascii_ply(test::icosphere(5.0, 1, Vec3(0.0)), "UNIT=cm"));
    EXPECT_NE(complaint(folder / "a.ply").find("use UNIT=mm or UNIT=m"), std::string::npos)
        << complaint(folder / "a.ply");
}

} // namespace
} // namespace palpate
