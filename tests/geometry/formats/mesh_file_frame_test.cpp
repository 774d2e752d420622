// SPDX-License-Identifier: Apache-2.0
// What a mesh file says of its frame and unit, what the caller says, and what is taken for granted.
#include <palpate/geometry/formats/mesh_file.h>

#include <functional>
#include <vector>

#include <palpate/geometry/mesh_report.h>

#include "tests/support/mesh_text.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

using MeshFrames = test::MeshText;

const std::string kNoFrame = "states no frame: LPS is assumed";
const std::string kNoUnit = "states no unit: millimetres are assumed";

/// One mesh in every format, with a text where the format has room for one.
struct Format {
    std::string name;
    std::function<std::string(const TriangleMesh&, const std::string&)> bytes;
};

const std::vector<Format>& formats() {
    static const std::vector<Format> all{
        {"a.ply",
         [](const TriangleMesh& m, const std::string& t) { return test::ascii_ply(m, t); }},
        {"a.stl",
         [](const TriangleMesh& m, const std::string& t) {
             return test::binary_stl(m, t.empty() ? "made by a test" : t);
         }},
        {"b.stl",
         [](const TriangleMesh& m, const std::string& t) { return test::ascii_stl(m, t); }},
        {"a.obj", [](const TriangleMesh& m, const std::string& t) { return test::obj(m, t); }}};
    return all;
}

TriangleMesh ball() { return test::icosphere(50.0, 1, Vec3(1.0, 2.0, 3.0)); } // mm

TEST_F(MeshFrames, WithoutAWordAreLpsAndMillimetresAndSaidToBe) {
    for (const Format& format : formats()) {
        SCOPED_TRACE(format.name);
        const MeshFile file = read(format.name, format.bytes(ball(), ""));
        EXPECT_EQ(file.frame, MeshFrame::lps);
        EXPECT_EQ(file.unit, MeshUnit::millimetre);
        EXPECT_FALSE(file.frame_stated || file.unit_stated);
        EXPECT_EQ(file.warnings, (std::vector<std::string>{kNoFrame, kNoUnit}));
    }
}

TEST_F(MeshFrames, SlicersTextIsUnderstoodInEveryFormat) {
    for (const Format& format : formats()) {
        SCOPED_TRACE(format.name);
        const TriangleMesh plain = read(format.name, format.bytes(ball(), "")).mesh;
        const MeshFile lps = read(format.name, format.bytes(ball(), "3D Slicer output. SPACE=LPS"));
        EXPECT_EQ(lps.mesh.vertices, plain.vertices);
        EXPECT_TRUE(lps.frame_stated);
        EXPECT_EQ(lps.warnings, (std::vector<std::string>{kNoUnit}));

        const MeshFile ras = read(format.name, format.bytes(ball(), "3D Slicer output. SPACE=RAS"));
        EXPECT_EQ(ras.frame, MeshFrame::ras);
        EXPECT_EQ(ras.mesh.triangles, plain.triangles);
        ASSERT_EQ(ras.mesh.vertices.size(), plain.vertices.size());
        for (std::size_t v = 0; v < plain.vertices.size(); ++v)
            ASSERT_EQ(ras.mesh.vertices[v], plain.vertices[v] * Vec3(-1.0, -1.0, 1.0));
        // Half a turn, no mirror: what faced outwards still does.
        EXPECT_GT(inspect(ras.mesh).volume_m3, 0.0);
    }
}

TEST_F(MeshFrames, AStatementMayFollowTheCommentsSignAtOnce) {
    const MeshFile file = read("a.obj", "#SPACE=RAS\n#UNIT=m\n" + test::obj(ball()));
    EXPECT_EQ(file.frame, MeshFrame::ras);
    EXPECT_TRUE(file.frame_stated);
    EXPECT_TRUE(file.unit_stated);
}

TEST_F(MeshFrames, MetresAreUnderstoodInEveryFormat) {
    TriangleMesh mesh = ball();
    for (Vec3& p : mesh.vertices)
        p = p / 1024.0; // about metres
    for (const Format& format : formats()) {
        SCOPED_TRACE(format.name);
        const MeshFile file = read(format.name, format.bytes(mesh, "SPACE=LPS, UNIT=m."));
        EXPECT_EQ(file.unit, MeshUnit::metre);
        EXPECT_TRUE(file.warnings.empty());
        // float32 in binary STL: half an ulp of 0.05 is 1.9e-9.
        EXPECT_NEAR(inspect(file.mesh).bounds.upper.x, 51.0 / 1024.0, 2e-9 + 0.003);
    }
}

TEST_F(MeshFrames, SettingsWinAndContradictionsAreSaid) {
    const std::string bytes = test::obj(ball(), "SPACE=LPS UNIT=mm");
    const TriangleMesh plain = read("a.obj", bytes).mesh;
    const MeshFile other = read("a.obj", bytes, {MeshFrame::ras, MeshUnit::metre});
    EXPECT_EQ(other.frame, MeshFrame::ras);
    EXPECT_EQ(other.unit, MeshUnit::metre);
    EXPECT_TRUE(other.frame_stated && other.unit_stated);
    EXPECT_EQ(other.warnings.at(0), "states SPACE=LPS, but is read as RAS as asked");
    EXPECT_EQ(other.warnings.at(1), "states UNIT=mm, but is read in metres as asked");
    for (std::size_t v = 0; v < plain.vertices.size(); ++v)
        ASSERT_EQ(other.mesh.vertices[v] / 1000.0, plain.vertices[v] * Vec3(-1.0, -1.0, 1.0));

    const MeshFile same = read("a.obj", bytes, {MeshFrame::lps, MeshUnit::millimetre});
    EXPECT_TRUE(same.warnings.empty());
    EXPECT_EQ(same.mesh.vertices, plain.vertices);
    const MeshFile silent =
        read("a.obj", test::obj(ball()), {MeshFrame::ras, MeshUnit::millimetre});
    EXPECT_TRUE(silent.warnings.empty()) << "what is asked for is not assumed";
    EXPECT_EQ(silent.frame, MeshFrame::ras);
}

TEST_F(MeshFrames, UnknownOrContradictingStatementsAreErrorsUnlessSettingsSettleThem) {
    const std::string unknown = test::obj(ball(), "SPACE=LAS");
    EXPECT_EQ(complaint("a.obj", unknown),
              "a.obj:1: unknown SPACE=LAS; use SPACE=LPS or SPACE=RAS");
    EXPECT_EQ(read("a.obj", unknown, {MeshFrame::lps, MeshUnit::as_stated}).warnings.at(0),
              "unknown SPACE=LAS; use SPACE=LPS or SPACE=RAS");
    const std::string both = "# SPACE=LPS\n# SPACE=RAS\n" + test::obj(ball());
    EXPECT_EQ(complaint("a.obj", both),
              "a.obj:2: states both SPACE=LPS and SPACE=RAS; keep the right one");
    EXPECT_EQ(complaint("a.stl", test::binary_stl(ball(), "UNIT=inch")),
              "a.stl: unknown UNIT=inch; use UNIT=mm or UNIT=m");
    const MeshFile settled = read("a.obj", both, {MeshFrame::ras, MeshUnit::as_stated});
    EXPECT_EQ(settled.frame, MeshFrame::ras);
}

TEST_F(MeshFrames, AnatomyOfAbsurdSizeIsDoubted) {
    const auto doubts = [&](double factor, const MeshFileSettings& settings) {
        TriangleMesh mesh = ball();
        for (Vec3& p : mesh.vertices)
            p = factor * p;
        const MeshFile file = read("a.obj", test::obj(mesh, "SPACE=LPS UNIT=mm"), settings);
        return file.warnings.empty() ? std::string() : file.warnings.back();
    };
    EXPECT_EQ(doubts(1.0, {}), "");
    EXPECT_EQ(doubts(1e-3, {}),
              "is 0.0001 m across when read in millimetres; if it is in metres, ask for that");
    EXPECT_EQ(doubts(1.0, {MeshFrame::as_stated, MeshUnit::metre}),
              "is 100 m across when read in metres; if it is in millimetres, ask for that");
}

TEST_F(MeshFrames, EndingsThatNobodyReadsAreRefused) {
    EXPECT_EQ(complaint("a.vtu", ""),
              "a.vtu: unknown ending '.vtu'; give a mesh as .ply, .stl, .obj, .vtp or .vtk");
    EXPECT_EQ(complaint("mesh", ""),
              "mesh: unknown ending ''; give a mesh as .ply, .stl, .obj, .vtp or .vtk");
    std::filesystem::create_directory(folder / "folder.stl");
    try {
        read_mesh(folder / "folder.stl");
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("folder.stl: is a folder"), std::string::npos);
    }
}

} // namespace
} // namespace palpate
