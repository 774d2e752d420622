// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/formats/mesh_file.h>

#include <limits>

#include <palpate/geometry/mesh_report.h>

#include "tests/support/mesh_text.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

using StlFile = test::MeshText;

TEST_F(StlFile, BinaryCornersBecomeVerticesOfAClosedMesh) {
    const TriangleMesh mesh = test::icosphere(50.0, 3); // mm
    const MeshFile file = read("a.stl", test::binary_stl(mesh));
    EXPECT_EQ(file.mesh.vertices.size(), mesh.vertices.size());
    ASSERT_EQ(file.mesh.triangles.size(), mesh.triangles.size());
    const MeshReport report = inspect(file.mesh);
    EXPECT_TRUE(report.closed() && report.manifold());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (int k = 0; k < 3; ++k)
            for (int axis = 0; axis < 3; ++axis) {
                const double mm = mesh.vertices[mesh.triangles[t][k]][axis];
                // Exactly the float32 that the file holds, divided once.
                ASSERT_EQ(file.mesh.vertices[file.mesh.triangles[t][k]][axis],
                          static_cast<double>(static_cast<float>(mm)) / 1000.0);
            }
}

TEST_F(StlFile, TextGivesTheSameMeshAsBinary) {
    TriangleMesh mesh = test::bumpy_sphere(50.0, 2);
    for (Vec3& p : mesh.vertices)
        p = glm::round(1024.0 * p) / 1024.0; // float32 holds it exactly
    const MeshFile text = read("a.stl", test::ascii_stl(mesh));
    const MeshFile binary = read("b.stl", test::binary_stl(mesh));
    EXPECT_EQ(text.mesh.vertices, binary.mesh.vertices);
    EXPECT_EQ(text.mesh.triangles, binary.mesh.triangles);
}

TEST_F(StlFile, BinaryThatBeginsWithSolidIsToldByItsLength) {
    const TriangleMesh mesh = test::icosphere(50.0, 1);
    const MeshFile file = read("a.stl", test::binary_stl(mesh, "solid of a scanner"));
    EXPECT_EQ(file.mesh.triangles.size(), 80u);
    EXPECT_EQ(complaint("a.stl", test::binary_stl(mesh, "solid of a scanner").substr(0, 3000)),
              "a.stl: ends after 58 of 80 triangles; copy or export it again");
}

TEST_F(StlFile, ZerosOfEitherSignAreOneCoordinate) {
    TriangleMesh mesh = test::sheet(60.0, 2);
    std::string bytes = test::binary_stl(mesh);
    const std::size_t z_of_first_corner = 84 + 12 + 8;
    bytes[z_of_first_corner + 3] = static_cast<char>(0x80); // -0.0f
    const MeshFile file = read("a.stl", bytes);
    EXPECT_EQ(file.mesh.vertices.size(), 9u);
    for (const Vec3& p : file.mesh.vertices)
        EXPECT_FALSE(std::signbit(p.z));
}

TEST_F(StlFile, TextMayBeInCapitalsInSeveralSolidsAndHaveNormalsThatAreNoNumbers) {
    const std::string facet = "FACET NORMAL -nan(ind) 0 0\r\n OUTER LOOP\r\n  VERTEX 0 0 0\r\n"
                              "VERTEX +1e1 0 0 VERTEX 0 10 0\r\nENDLOOP ENDFACET\r\n";
    const MeshFile file =
        read("A.STL", "SOLID\r\n" + facet + "ENDSOLID\r\n\r\nsolid two parts\r\n" + facet + facet +
                          "endsolid two parts");
    EXPECT_EQ(file.mesh.triangles.size(), 3u);
    EXPECT_EQ(file.mesh.vertices.size(), 3u);
    EXPECT_EQ(file.mesh.vertices[1], Vec3(0.01, 0.0, 0.0));
}

TEST_F(StlFile, TextMayBeginWithBlanksAndBlankLines) {
    const TriangleMesh mesh = test::sheet(60.0, 2);
    const MeshFile plain = read("a.stl", test::ascii_stl(mesh));
    for (const char* start : {"\n", "\r\n", " \t\n\n  "}) {
        const MeshFile file = read("b.stl", start + test::ascii_stl(mesh));
        EXPECT_EQ(file.mesh.vertices, plain.mesh.vertices);
        EXPECT_EQ(file.mesh.triangles, plain.mesh.triangles);
    }
}

TEST_F(StlFile, CollapsedTrianglesStayAndAreReported) {
    TriangleMesh mesh = test::sheet(60.0, 1);
    mesh.triangles.push_back({0, 1, 1});
    const MeshFile file = read("a.stl", test::binary_stl(mesh));
    EXPECT_EQ(file.mesh.triangles.size(), 3u);
    EXPECT_EQ(inspect(file.mesh).degenerate, 1u);
}

TEST_F(StlFile, ErrorsSayWhereAndWhat) {
    const std::string start = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n";
    EXPECT_EQ(complaint("a.stl", start + "vertex 1 0 zero\n"),
              "a.stl:5: triangle 0: 'zero' is not a number; repair the file");
    EXPECT_EQ(complaint("a.stl", start + "vertex 1 0 inf\n"),
              "a.stl:5: triangle 0: its position is not finite; repair the file");
    EXPECT_EQ(complaint("a.stl", start + "endloop\n"),
              "a.stl:5: triangle 0: 'endloop' where 'vertex' should be; repair or export it again");
    EXPECT_EQ(
        complaint("a.stl", start),
        "a.stl:5: triangle 0: the file ends in it or before endsolid; copy or export it again");
    EXPECT_EQ(complaint("a.stl", "solid a\nendsolid a\n"),
              "a.stl: has no triangle; export a surface");
    EXPECT_EQ(complaint("a.stl", "solid a\nendsolid a\nmore\n"),
              "a.stl:3: 'more' where 'solid' should be; repair or export it again");
    EXPECT_EQ(complaint("a.stl", ""),
              "a.stl: is too short for an STL file; copy or export it again");
    EXPECT_EQ(complaint("a.stl", test::binary_stl({})), "a.stl: has no triangle; export a surface");

    TriangleMesh mesh = test::sheet(60.0, 1);
    mesh.vertices[3].y = std::numeric_limits<double>::infinity();
    EXPECT_EQ(complaint("a.stl", test::binary_stl(mesh)),
              "a.stl: triangle 0: its position is not finite; repair the file");
    std::string absurd = test::binary_stl(test::sheet(60.0, 1));
    absurd.replace(80, 4, "\xff\xff\xff\xff");
    EXPECT_EQ(complaint("a.stl", absurd),
              "a.stl: ends after 2 of 4294967295 triangles; copy or export it again");
}

TEST_F(StlFile, BytesBehindTheLastTriangleAreSaid) {
    const MeshFile file = read("a.stl", test::binary_stl(test::sheet(60.0, 1)) + "12345");
    EXPECT_EQ(file.mesh.triangles.size(), 2u);
    EXPECT_EQ(file.warnings.at(0), "5 bytes behind the last triangle are passed over");
}

} // namespace
} // namespace palpate
