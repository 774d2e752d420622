// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/formats/mesh_file.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/mesh_text.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

class PlyFile : public testing::Test {
protected:
    std::filesystem::path write(const std::string& text) const {
        std::ofstream(folder / "mesh.ply", std::ios::binary) << text;
        return folder / "mesh.ply";
    }
    /// What reading this text complains about, without the folder.
    std::string complaint(const std::string& text) const {
        try {
            read_ply(write(text));
        } catch (const std::runtime_error& error) {
            const std::string what = error.what();
            const std::string prefix = folder.path().string() + "/";
            EXPECT_TRUE(what.starts_with(prefix)) << what;
            EXPECT_EQ(what.find('\n'), std::string::npos) << what;
            return what.substr(prefix.size());
        }
        return "nothing";
    }

    test::TemporaryFolder folder;
};

std::string header(const std::string& format, int vertices, int faces,
                   const std::string& comment = "") {
    return "ply\nformat " + format + " 1.0\n" + comment + "element vertex " +
           std::to_string(vertices) +
           "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
           std::to_string(faces) + "\nproperty list uchar int vertex_indices\nend_header\n";
}

std::string text_of(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

TEST_F(PlyFile, ComesBackAsItWasWritten) {
    const TriangleMesh mesh = test::bumpy_sphere(0.05, 3);
    write_ply(mesh, folder / "a.ply", {"made by a test", "level 226 HU"});
    const TriangleMesh back = read_ply(folder / "a.ply");
    EXPECT_EQ(back.triangles, mesh.triangles);
    ASSERT_EQ(back.vertices.size(), mesh.vertices.size());
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        // Times 1000 and divided by 1000: two roundings of half an ulp, 7e-18 m each at 0.05 m.
        ASSERT_LE(glm::length(back.vertices[v] - mesh.vertices[v]), 3e-17);
}

TEST_F(PlyFile, SaysFrameUnitAndComments) {
    write_ply(test::sheet(0.06, 1), folder / "a.ply", {"made by a test", "level 226 HU"});
    const std::string text = text_of(folder / "a.ply");
    EXPECT_TRUE(
        text.starts_with("ply\nformat binary_little_endian 1.0\ncomment SPACE=LPS\n"
                         "comment UNIT=mm\ncomment made by a test\ncomment level 226 HU\n"));
    EXPECT_EQ(text.size(), text.find("end_header\n") + 11 + 4 * 24 + 2 * 13);
}

TEST_F(PlyFile, WritingLeavesNoOtherFile) {
    write_ply(test::sheet(0.06, 1), folder / "a.ply");
    write_ply(test::sheet(0.06, 2), folder / "a.ply");
    EXPECT_EQ(read_ply(folder / "a.ply").triangles.size(), 8u);
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST_F(PlyFile, EmptyMeshComesBackEmpty) {
    write_ply({}, folder / "a.ply");
    EXPECT_TRUE(read_ply(folder / "a.ply").vertices.empty());
}

TEST_F(PlyFile, ThatCannotBeWrittenIsNamed) {
    const auto file = folder / "no such folder/a.ply";
    try {
        write_ply({}, file);
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_TRUE(std::string(error.what()).starts_with(file.string() + ": ")) << error.what();
    }
    EXPECT_THROW(write_ply({}, folder / "a.ply", {"two\nlines"}), std::invalid_argument);
}

TEST_F(PlyFile, AsciiQuadBecomesTwoTriangles) {
    const TriangleMesh mesh = read_ply(
        write(header("ascii", 4, 1) + "0 0 0\n1 0 0\r\n  1 1.5e0 0\n0 1 +2\n\n4 0 1 2 3\n"));
    ASSERT_EQ(mesh.triangles.size(), 2u);
    EXPECT_EQ(mesh.triangles[1], (std::array<std::uint32_t, 3>{0, 2, 3}));
    EXPECT_EQ(mesh.vertices[2], Vec3(0.001, 0.0015, 0.0));
    EXPECT_EQ(mesh.vertices[3], Vec3(0.0, 0.001, 0.002));
}

TEST_F(PlyFile, CommentsTurnRasAndScaleMetres) {
    const std::string body = "1 2 3\n2 2 3\n1 4 3\n3 0 1 2\n";
    const TriangleMesh ras = read_ply(write(header("ascii", 3, 1, "comment SPACE=RAS\n") + body));
    EXPECT_EQ(ras.vertices[0], Vec3(-0.001, -0.002, 0.003));
    const TriangleMesh metres = read_ply(write(header("ascii", 3, 1, "comment UNIT=m\n") + body));
    EXPECT_EQ(metres.vertices[0], Vec3(1.0, 2.0, 3.0));
    EXPECT_EQ(complaint(header("ascii", 3, 1, "comment UNIT=inch\n") + body),
              "mesh.ply:3: unknown UNIT=inch; use UNIT=mm or UNIT=m");
}

TEST_F(PlyFile, BinaryFloatWithOtherPropertiesAndElementsIsRead) {
    std::string text =
        "ply\r\nformat binary_little_endian 1.0\r\nobj_info scanner\r\nelement vertex 3\r\n"
        "property float x\r\nproperty uchar red\r\nproperty float y\r\nproperty float z\r\n"
        "element camera 2\r\nproperty list ushort short view\r\n"
        "element face 1\r\nproperty uchar flag\r\n"
        "property list uchar uint vertex_index\r\nend_header\r\n";
    const auto put = [&](auto value) {
        char bytes[sizeof value];
        std::memcpy(bytes, &value, sizeof value);
        text.append(bytes, sizeof value);
    };
    for (int v = 0; v < 3; ++v) {
        put(float(v)), put(std::uint8_t(200)), put(float(v * v)), put(7.0f);
    }
    put(std::uint16_t(2)), put(std::int16_t(-1)), put(std::int16_t(5)), put(std::uint16_t(0));
    put(std::uint8_t(1)), put(std::uint8_t(3)), put(0u), put(2u), put(1u);
    const TriangleMesh mesh = read_ply(write(text));
    EXPECT_EQ(mesh.vertices[2], Vec3(0.002, 0.004, 0.007));
    EXPECT_EQ(mesh.triangles.at(0), (std::array<std::uint32_t, 3>{0, 2, 1}));
}

TEST_F(PlyFile, BigEndianIsReadAsLittleEndianIs) {
    std::string text = "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty double x\n"
                       "property float y\nproperty short z\nelement face 1\n"
                       "property list ushort uint vertex_indices\nend_header\n";
    for (int v = 0; v < 3; ++v) {
        test::put_big_endian(text, 1.5 * v);
        test::put_big_endian(text, 0.25f * static_cast<float>(v * v));
        test::put_big_endian(text, static_cast<std::int16_t>(-7));
    }
    test::put_big_endian(text, std::uint16_t{3});
    for (const std::uint32_t vertex : {0u, 2u, 1u})
        test::put_big_endian(text, vertex);
    const TriangleMesh mesh = read_ply(write(text));
    EXPECT_EQ(mesh.vertices[2], Vec3(0.003, 0.001, -0.007));
    EXPECT_EQ(mesh.triangles.at(0), (std::array<std::uint32_t, 3>{0, 2, 1}));
}

TEST_F(PlyFile, RowsThatTheHeaderDoesNotCountAreSaid) {
    const TriangleMesh sheet = test::sheet(60.0, 1);
    test::make_file(folder / "a.ply", test::ascii_ply(sheet) + "3 0 1 2\n");
    EXPECT_EQ(read_mesh(folder / "a.ply").warnings.at(0), "has more rows than its header says");
    write_ply(sheet, folder / "b.ply");
    test::make_file(folder / "b.ply", test::content_of(folder / "b.ply") + "1234567890123");
    EXPECT_EQ(read_mesh(folder / "b.ply").warnings.at(0),
              "13 bytes behind the last row are passed over");
}

TEST_F(PlyFile, OwnFilesAreReadWithoutAWarning) {
    write_ply(test::sheet(0.06, 1), folder / "a.ply", {"level 226 HU"});
    const MeshFile file = read_mesh(folder / "a.ply");
    EXPECT_TRUE(file.warnings.empty());
    EXPECT_TRUE(file.frame_stated && file.unit_stated);
}

TEST_F(PlyFile, ErrorsSayWhereAndWhat) {
    const std::string triangle = "0 0 0\n1 0 0\n0 1 0\n"; // lines 10 to 12, behind the header
    EXPECT_EQ(complaint(header("ascii", 3, 1) + "0 0 0\n1 zero 0\n0 1 0\n3 0 1 2\n"),
              "mesh.ply:11: vertex 1: 'zero' is not a number; repair the file");
    EXPECT_EQ(complaint(header("ascii", 3, 1) + triangle + "3 0 1 3\n"),
              "mesh.ply:13: face 0: names a vertex that is not one of the 3; repair the file");
    EXPECT_EQ(complaint(header("ascii", 3, 1) + triangle + "3 0 1 -1\n"),
              "mesh.ply:13: face 0: names a vertex that is not one of the 3; repair the file");
    EXPECT_EQ(complaint(header("ascii", 3, 1) + triangle + "2 0 1\n"),
              "mesh.ply:13: face 0: has fewer than 3 vertices; remove it");
    EXPECT_EQ(complaint(header("ascii", 3, 1) + "0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n"),
              "mesh.ply:11: vertex 1: its position is not finite; repair the file");
    EXPECT_EQ(complaint(header("ascii", 3, 1) + "0 0 0\n1 0 0\n0 1"),
              "mesh.ply:12: vertex 2: the file ends in it, of 3; copy or export it again");
    EXPECT_EQ(complaint(header("binary_middle_endian", 3, 1)),
              "mesh.ply:2: unknown format 'binary_middle_endian'; use ascii, "
              "binary_little_endian or binary_big_endian");
    EXPECT_EQ(complaint("solid cube\n"),
              "mesh.ply: not a PLY file (its first line is not 'ply'); export the mesh as PLY");
    EXPECT_EQ(complaint(""),
              "mesh.ply: not a PLY file (its first line is not 'ply'); export the mesh as PLY");
    EXPECT_EQ(complaint("ply\nformat ascii 1.0\nelement vertex many\n"),
              "mesh.ply:3: 'many' is not a count; repair the header");
    EXPECT_EQ(complaint("ply\nformat ascii 1.0\n"),
              "mesh.ply: the header has no end_header; the file is cut off: copy it again");
    EXPECT_EQ(complaint(header("ascii", 2000000000, 1) + triangle)
                  .find("mesh.ply: has 2000000000 of 'vertex'"),
              0u);
    EXPECT_EQ(
        complaint("ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
                  "property float z\nend_header\n"),
        "mesh.ply: has no element 'face'; export a surface, not a cloud of points");
}

TEST_F(PlyFile, MissingFileIsNamed) {
    try {
        read_ply(folder / "absent.ply");
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("absent.ply: cannot be opened"),
                  std::string::npos);
    }
}

TEST_F(PlyFile, CutOffAnywhereIsAnErrorNotAMesh) {
    write_ply(test::icosphere(0.05, 1), folder / "whole.ply");
    const std::string whole = text_of(folder / "whole.ply");
    for (std::size_t size = 0; size < whole.size(); size += 7)
        EXPECT_NE(complaint(whole.substr(0, size)), "nothing") << size;
}

} // namespace
} // namespace palpate
