// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/formats/mesh_file.h>

#include "tests/support/mesh_text.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

using ObjFile = test::MeshText;

TEST_F(ObjFile, ComesBackAsItWasWritten) {
    const TriangleMesh mesh = test::bumpy_sphere(50.0, 3);
    const MeshFile file = read("a.obj", test::obj(mesh));
    EXPECT_EQ(file.mesh.triangles, mesh.triangles);
    ASSERT_EQ(file.mesh.vertices.size(), mesh.vertices.size());
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        ASSERT_EQ(file.mesh.vertices[v], mesh.vertices[v] / 1000.0); // 17 digits are exact
}

TEST_F(ObjFile, TexturesNormalsColoursAndGroupsArePassedOver) {
    const MeshFile file = read("a.OBJ", "mtllib a.mtl\no skull\ng upper lower\ns off\n"
                                        "v 0 0 0 1.0\nv 10 0 0 0.5 0.5 0.5\nv 0 10 0\nv 0 0 10\n"
                                        "vt 0 0\nvn 0 0 1\nusemtl bone\nl 1 2\n"
                                        "f 1/1/1 2/1/1 3/1/1\nf 1//1 3//1 4//1\nf 1/1 4/1 2/1\n");
    ASSERT_EQ(file.mesh.triangles.size(), 3u);
    EXPECT_EQ(file.mesh.triangles[1], (std::array<std::uint32_t, 3>{0, 2, 3}));
    EXPECT_EQ(file.mesh.triangles[2], (std::array<std::uint32_t, 3>{0, 3, 1}));
    EXPECT_EQ(file.mesh.vertices[1], Vec3(0.01, 0.0, 0.0));
}

TEST_F(ObjFile, NegativeIndicesCountBackFromTheLastVertexSoFar) {
    const MeshFile file =
        read("a.obj", "v 0 0 0\nv 10 0 0\nv 0 10 0\nf -3 -2 -1\nv 0 0 10\nf -4 -2 -1\n");
    EXPECT_EQ(file.mesh.triangles[0], (std::array<std::uint32_t, 3>{0, 1, 2}));
    EXPECT_EQ(file.mesh.triangles[1], (std::array<std::uint32_t, 3>{0, 2, 3}));
}

TEST_F(ObjFile, PositiveIndicesMayNameVerticesThatComeLater) {
    const MeshFile file = read("a.obj", "f 1 2 3\nv 0 0 0\nv 10 0 0\nv 0 10 0\n");
    EXPECT_EQ(file.mesh.triangles.size(), 1u);
}

TEST_F(ObjFile, PolygonsAreCutIntoFansAndLinesMayBeContinued) {
    const MeshFile file = read("a.obj", "v 0 0 0\r\nv 10 0 0\r\nv 10 10 \\\r\n0\r\nv 0 10 0\r\n"
                                        "f 1 2 \\\r\n 3 4\r\n");
    ASSERT_EQ(file.mesh.triangles.size(), 2u);
    EXPECT_EQ(file.mesh.triangles[1], (std::array<std::uint32_t, 3>{0, 2, 3}));
    EXPECT_EQ(file.mesh.vertices[2], Vec3(0.01, 0.01, 0.0));
}

TEST_F(ObjFile, ACommentIsNotContinued) {
    const MeshFile file = read("a.obj", "# C:\\scans\\\nv 0 0 0\nv 10 0 0 # one \\\nv 0 10 0\n"
                                        "f 1 2 3\n");
    EXPECT_EQ(file.mesh.vertices.size(), 3u);
    EXPECT_EQ(file.mesh.triangles.size(), 1u);
}

TEST_F(ObjFile, ACommentMayFollowALine) {
    const MeshFile file =
        read("a.obj", "  # one\\\nv 0 0 0 # first\nv 10 0 \\\n0 # second\nv 0 10 0\n"
                      "g #1 upper\nf 1 2 3 # all\n");
    EXPECT_EQ(file.mesh.vertices.size(), 3u);
    EXPECT_EQ(file.mesh.triangles.size(), 1u);
}

TEST_F(ObjFile, ErrorsSayWhereAndWhat) {
    const std::string start = "# a comment\nv 0 0 0\nv 10 0 0\nv 0 10 0\n";
    EXPECT_EQ(complaint("a.obj", start + "f 1 2 4\n"),
              "a.obj:5: face names vertex 4 of 3; copy or export it again");
    EXPECT_EQ(complaint("a.obj", start + "f 1 2 -4\n"),
              "a.obj:5: face '-4' names no vertex (the first is 1, the last so far -1); repair the "
              "file");
    EXPECT_EQ(
        complaint("a.obj", start + "f 1 2 0/1\n"),
        "a.obj:5: face '0/1' names no vertex (the first is 1, the last so far -1); repair the "
        "file");
    EXPECT_EQ(complaint("a.obj", start + "f 1 2 /3\n"),
              "a.obj:5: face '/3' names no vertex; repair the file");
    EXPECT_EQ(complaint("a.obj", start + "f 1 2 99999999999999999999\n"),
              "a.obj:5: face '99999999999999999999' names no vertex; repair the file");
    EXPECT_EQ(complaint("a.obj", start + "f 1 2\n"),
              "a.obj:5: face has fewer than 3 vertices; remove it");
    EXPECT_EQ(complaint("a.obj", start + "v 1 2\n"),
              "a.obj:5: vertex 4: has fewer than 3 coordinates; repair the file");
    EXPECT_EQ(complaint("a.obj", start + "v 1 2 3,5\n"),
              "a.obj:5: vertex 4: '3,5' is not a number; repair the file");
    EXPECT_EQ(complaint("a.obj", start + "v 1 2 nan\n"),
              "a.obj:5: vertex 4: its position is not finite; repair the file");
    EXPECT_EQ(complaint("a.obj", start + "w 1 2 3\n"),
              "a.obj:5: 'w' is no keyword of an OBJ file; repair the file");
    EXPECT_EQ(complaint("a.obj", start), "a.obj: has no triangle; export a surface");
    EXPECT_EQ(complaint("a.obj", ""), "a.obj: has no triangle; export a surface");
}

TEST_F(ObjFile, WithoutALineBreakAtItsEndIsDoubted) {
    const std::string whole = test::obj(test::sheet(60.0, 1));
    const MeshFile file = read("a.obj", whole.substr(0, whole.size() - 1));
    EXPECT_EQ(file.warnings.at(0), "does not end with a line break: see that it is not cut off");
    EXPECT_NE(read("a.obj", whole).warnings.at(0), file.warnings[0]);
}

} // namespace
} // namespace palpate
