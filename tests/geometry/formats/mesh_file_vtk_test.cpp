// SPDX-License-Identifier: Apache-2.0
// VTK's two formats of polygonal data, in every way that their numbers are stored.
#include <palpate/geometry/formats/mesh_file.h>

#include <gmock/gmock.h>

#include "tests/support/test_meshes.h"
#include "tests/support/vtk_text.h"

namespace palpate {
namespace {

using test::legacy_vtk;
using test::VtpForm;
using test::VtpWriter;
using Format = VtpForm::Format;

/// Positions that floats hold, so that every type gives them back.
TriangleMesh ball() {
    TriangleMesh mesh = test::icosphere(50.0, 1);
    for (Vec3& p : mesh.vertices)
        p = Vec3(static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z));
    return mesh;
}

std::vector<Vec3> in_metres(const TriangleMesh& mesh) {
    std::vector<Vec3> points;
    for (const Vec3& p : mesh.vertices)
        points.push_back(p / 1000.0);
    return points;
}

class VtkMesh : public test::MeshText {
protected:
    void expect_same(const std::string& name, const std::string& bytes) const {
        const MeshFile file = read(name, bytes);
        EXPECT_EQ(file.mesh.triangles, ball().triangles);
        EXPECT_EQ(file.mesh.vertices, in_metres(ball()));
        EXPECT_FALSE(file.frame_stated);
        EXPECT_FALSE(file.unit_stated);
    }
};

TEST_F(VtkMesh, XmlComesBackHoweverItsNumbersAreStored) {
    for (const Format format : {Format::ascii, Format::binary, Format::raw, Format::base64})
        for (unsigned bits = 0; bits < 32; ++bits) {
            VtpForm form{format, {}, {}, {}, {}, {}, {}};
            form.is_deflated = (bits & 1U) != 0;
            form.big_endian = (bits & 2U) != 0;
            form.wide_header = (bits & 4U) != 0;
            form.doubles = (bits & 8U) != 0;
            form.wide_index = (bits & 16U) != 0;
            SCOPED_TRACE(testing::Message()
                         << "format " << static_cast<int>(format) << " bits " << bits);
            expect_same("a.vtp", VtpWriter(form).file(ball()));
            expect_same("a.vtp", VtpWriter(form).file(ball(), true));
        }
}

TEST_F(VtkMesh, LegacyComesBackHoweverItsNumbersAreStored) {
    for (const bool is_binary : {false, true})
        for (const bool is_new : {false, true}) {
            SCOPED_TRACE(testing::Message() << is_binary << is_new);
            expect_same("a.vtk", legacy_vtk(ball(), is_binary, is_new));
        }
}

TEST_F(VtkMesh, StripsAndPolygonsAreCutIntoTrianglesThatFaceAlike) {
    const std::string head = "# vtk DataFile Version 3.0\na\nASCII\nDATASET POLYDATA\n"
                             "POINTS 6 float\n0 0 0 1 0 0 0 1 0 1 1 0 0 2 0 1 2 0\n";
    const MeshFile strip = read("a.vtk", head + "TRIANGLE_STRIPS 1 7\n6 0 1 2 3 4 5\n");
    ASSERT_EQ(strip.mesh.triangles.size(), 4U);
    const MeshFile polygons =
        read("a.vtk", head + "VERTICES 1 2\n1 0\nLINES 1 3\n2 0 1\nPOLYGONS 2 10\n4 0 1 3 2\n"
                             "4 2 3 5 4\n");
    ASSERT_EQ(polygons.mesh.triangles.size(), 4U);
    for (const MeshFile* file : {&strip, &polygons})
        for (const auto& t : file->mesh.triangles) {
            const auto& v = file->mesh.vertices;
            EXPECT_EQ(triangle_normal(v[t[0]], v[t[1]], v[t[2]]), Vec3(0, 0, 1));
        }
}

TEST_F(VtkMesh, PiecesBecomeOneMesh) {
    const std::string one = VtpWriter({}).file(ball());
    const std::size_t begin = one.find("<Piece"), end = one.find("</PolyData>");
    const std::string two = one.substr(0, end) + one.substr(begin, end - begin) + one.substr(end);
    const MeshFile file = read("a.vtp", two);
    EXPECT_EQ(file.mesh.vertices.size(), 2 * ball().vertices.size());
    EXPECT_EQ(file.mesh.triangles.size(), 2 * ball().triangles.size());
    EXPECT_EQ(file.mesh.triangles.back()[0], ball().triangles.back()[0] + ball().vertices.size());
}

TEST_F(VtkMesh, FrameIsReadWhereSlicerStatesIt) {
    const MeshFile legacy =
        read("a.vtk", legacy_vtk(ball(), true, false, "3D Slicer output. SPACE=RAS"));
    EXPECT_TRUE(legacy.frame_stated);
    EXPECT_EQ(legacy.frame, MeshFrame::ras);
    EXPECT_DOUBLE_EQ(legacy.mesh.vertices[0].x, -1e-3 * ball().vertices[0].x);

    VtpForm form; // the letters of a text are numbers
    form.head = "<FieldData><Array type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" "
                "format=\"ascii\">82 65 83 0</Array></FieldData>\n";
    const MeshFile xml = read("a.vtp", VtpWriter(form).file(ball()));
    EXPECT_TRUE(xml.frame_stated);
    EXPECT_EQ(xml.frame, MeshFrame::ras);
    form.head = "<!-- SPACE=LPS UNIT=m -->\n";
    const MeshFile comment = read("a.vtp", VtpWriter(form).file(ball()));
    EXPECT_TRUE(comment.frame_stated && comment.unit_stated);
    EXPECT_EQ(comment.unit, MeshUnit::metre);
    EXPECT_EQ(read("a.vtp", VtpWriter({}).file(ball())).warnings,
              (std::vector<std::string>{"states no frame: LPS is assumed",
                                        "states no unit: millimetres are assumed"}));
}

TEST_F(VtkMesh, WhatIsNotReadSaysWhy) {
    const std::string xml = VtpWriter({}).file(ball()), text = legacy_vtk(ball(), false, false);
    const auto changed = [](std::string bytes, const std::string& from, const std::string& to) {
        return bytes.replace(bytes.find(from), from.size(), to);
    };
    EXPECT_EQ(complaint("a.vtp", changed(xml, "\"PolyData\"", "\"UnstructuredGrid\"")),
              "a.vtp:2: holds UnstructuredGrid, not PolyData; save the surface of it as .vtp");
    EXPECT_EQ(complaint("a.vtp", changed(xml, " header_type",
                                         " compressor=\"vtkLZ4DataCompressor\""
                                         " header_type")),
              "a.vtp:2: is compressed by vtkLZ4DataCompressor, which is not read; write it with "
              "zlib or uncompressed");
    EXPECT_EQ(complaint("a.vtp", "<html></html>"),
              "a.vtp:1: is XML, but no VTK file; give a .vtp of polygonal data");
    EXPECT_EQ(complaint("a.vtk", changed(text, "POLYDATA", "UNSTRUCTURED_GRID")),
              "a.vtk:4: holds UNSTRUCTURED_GRID, not POLYDATA; save the surface of it as polygonal "
              "data");
    EXPECT_EQ(complaint("a.vtk", changed(text, "\n3 ", "\n9999 ")),
              "a.vtk: a cell has more corners than there are; copy or export it again");
}

// A file of 1.4 MB that inflates to 1 GiB was inflated whole before it was compared with the piece.
TEST_F(VtkMesh, AMessageIsOneLineWhateverTheFileSays) {
    for (const std::string text :
         {"<VTKFile type=\"Poly\nData\"></VTKFile>",
          "<VTKFile type=\"PolyData\" compressor=\"vtk\x1B[2JData\n\"></VTKFile>"})
        try {
            read("a.vtp", "<?xml version=\"1.0\"?>\n" + text);
            ADD_FAILURE() << "read: " << text;
        } catch (const std::runtime_error& error) {
            const std::string words = error.what();
            EXPECT_TRUE(std::none_of(words.begin(), words.end(), [](unsigned char c) {
                return c < 0x20;
            })) << words;
            EXPECT_THAT(words, testing::HasSubstr("a.vtp:2: "));
        }
}

TEST_F(VtkMesh, DeflatedBeyondWhatItsPieceStatesIsNotInflated) {
    VtpForm form{Format::raw, {}, {}, {}, {}, {}, {}};
    form.is_deflated = true;
    std::string bytes = VtpWriter(form).file(ball());
    const std::string stated = "NumberOfPoints=\"";
    const std::size_t at = bytes.find(stated) + stated.size();
    bytes.replace(at, bytes.find('"', at) - at, "4");
    EXPECT_THAT(complaint("a.vtp", bytes),
                testing::HasSubstr("inflates to more than the piece states"));
}

// The corners of cells were inflated whole, up to 96 GiB, before they were compared with the cells.
TEST_F(VtkMesh, CornersBeyondTheLastCellAreNotInflated) {
    for (const bool as_strips : {false, true}) {
        VtpForm form{Format::raw, {}, {}, {}, {}, {}, {}};
        form.is_deflated = true;
        const std::string whole = VtpWriter(form).file(ball(), as_strips);
        EXPECT_EQ(complaint("a.vtp", whole), "");
        // The array of another mesh, of whose cells there are more.
        VtpForm twice = form;
        twice.twice_the_corners = true;
        EXPECT_THAT(complaint("a.vtp", VtpWriter(twice).file(ball(), as_strips)),
                    testing::HasSubstr("inflates to more than the piece states"));
    }
}

} // namespace
} // namespace palpate
