// SPDX-License-Identifier: Apache-2.0
// Files that were cut off or damaged on their way: an error that names the file, or a mesh that is
// safe to use. Sanitizers watch over the rest.
#include <palpate/geometry/formats/mesh_file.h>

#include <functional>
#include <map>
#include <random>

#include <palpate/geometry/mesh_report.h>

#include "tests/support/mesh_text.h"
#include "tests/support/test_meshes.h"
#include "tests/support/vtk_text.h"

namespace palpate {
namespace {

class DamagedMesh : public test::MeshText {
protected:
    /// Reads, and checks what every mesh that is handed out must keep. True when there was one.
    bool is_read(const std::string& name, const std::string& bytes) {
        try {
            const TriangleMesh mesh = read(name, bytes).mesh;
            EXPECT_FALSE(mesh.triangles.empty());
            for (const Vec3& p : mesh.vertices)
                EXPECT_TRUE(is_finite(p));
            EXPECT_NO_THROW(inspect(mesh)); // every index names a vertex
            return true;
        } catch (const std::runtime_error& error) {
            EXPECT_TRUE(std::string(error.what()).starts_with((folder / name).string() + ":"));
            return false;
        }
    }
};

test::VtpForm deflated(test::VtpForm::Format format) {
    test::VtpForm form;
    form.format = format;
    form.is_deflated = true;
    return form;
}

const std::map<std::string, std::string>& whole_files() {
    static const std::map<std::string, std::string> files = [] {
        const TriangleMesh mesh = test::icosphere(50.0, 1);
        test::TemporaryFolder folder;
        write_ply(mesh, folder / "a.ply");
        return std::map<std::string, std::string>{
            {"binary.ply", test::content_of(folder / "a.ply")},
            {"text.ply", test::ascii_ply(mesh, "SPACE=LPS")},
            {"binary.stl", test::binary_stl(mesh)},
            {"solid.stl", test::binary_stl(mesh, "solid SPACE=LPS")},
            {"text.stl", test::ascii_stl(mesh, "a SPACE=LPS")},
            {"text.obj", test::obj(mesh, "SPACE=LPS")},
            {"text.vtk", test::legacy_vtk(mesh, false, false)},
            {"binary.vtk", test::legacy_vtk(mesh, true, true)},
            {"text.vtp", test::VtpWriter({}).file(mesh)},
            {"deflated.vtp", test::VtpWriter(deflated(test::VtpForm::Format::binary)).file(mesh)},
            {"raw.vtp", test::VtpWriter(deflated(test::VtpForm::Format::raw)).file(mesh)}};
    }();
    return files;
}

TEST_F(DamagedMesh, CutOffAnywhereIsAnErrorWhereItCanBeKnown) {
    for (const auto& [name, whole] : whole_files()) {
        SCOPED_TRACE(name);
        // Of text, a number's last digits may be missing, or the last solid's name; of an OBJ,
        // whole faces.
        const bool is_obj = name == "text.obj";
        const std::size_t certain = name == "text.stl"       ? whole.find("endsolid") + 8
                                    : name == "text.ply"     ? whole.size() - 3
                                    : is_obj                 ? whole.find("\nf")
                                    : name.ends_with(".vtk") ? whole.find("\n\nCELL_DATA") - 2
                                    : name.ends_with(".vtp") ? whole.size() - 1
                                                             : whole.size();
        for (std::size_t size = 0; size < whole.size(); size += size < 600 ? 1 : 7)
            if (is_read(name, whole.substr(0, size))) {
                ASSERT_GE(size, certain) << "was read";
            }
        EXPECT_TRUE(is_read(name, whole));
    }
}

TEST_F(DamagedMesh, ObjCutOffBetweenLinesKeepsTheFacesBefore) {
    const std::string& whole = whole_files().at("text.obj");
    const TriangleMesh mesh = read("a.obj", whole).mesh;
    for (std::size_t end = whole.find("\nf") + 1; end < whole.size();
         end = whole.find('\n', end) + 1) {
        const std::string cut = whole.substr(0, end);
        if (cut.find("\nf") == std::string::npos) continue;
        const TriangleMesh some = read("a.obj", cut).mesh;
        ASSERT_TRUE(
            std::equal(some.triangles.begin(), some.triangles.end(), mesh.triangles.begin()));
    }
}

TEST_F(DamagedMesh, AnyBytesChangedGiveAnErrorOrASafeMesh) {
    std::size_t read = 0, refused = 0;
    for (const auto& [name, whole] : whole_files()) {
        for (std::uint64_t seed = 1; seed <= 250; ++seed) {
            SCOPED_TRACE(testing::Message() << name << " seed " << seed);
            std::mt19937_64 random(seed);
            std::string bytes = whole;
            // Half of the damage where it hurts most, in the header.
            const std::size_t room =
                seed % 2 == 0 ? bytes.size() : std::min<std::size_t>(bytes.size(), 300);
            for (std::uint64_t k = 0; k < 1 + seed % 5; ++k)
                bytes[random() % room] = static_cast<char>(random());
            (is_read(name, bytes) ? read : refused) += 1;
        }
    }
    EXPECT_GT(read, 100u); // coordinates of a little more or less
    EXPECT_GT(refused, 100u);
}

TEST_F(DamagedMesh, BytesOfNothingAreRefused) {
    for (const std::string name : {"a.ply", "a.stl", "a.obj", "a.vtp", "a.vtk"})
        for (std::uint64_t seed = 1; seed <= 60; ++seed) {
            std::mt19937_64 random(seed);
            std::string bytes(random() % 2000, '\0');
            for (char& byte : bytes)
                byte = static_cast<char>(random());
            EXPECT_FALSE(is_read(name, bytes)) << name << " seed " << seed;
            EXPECT_FALSE(is_read(name, std::string(static_cast<std::size_t>(seed), '\0')));
        }
}

} // namespace
} // namespace palpate
