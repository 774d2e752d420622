// SPDX-License-Identifier: Apache-2.0
// A mesh under each name that it may have: PLY, STL, OBJ, VTK.
#include <palpate/geometry/formats/mesh_file.h>
#include <palpate/geometry/mesh_report.h>

#include "tests/fuzz/target.h"

using namespace palpate;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    for (const char* name : {"a.ply", "a.stl", "a.obj", "a.vtp", "a.vtk"}) {
        const auto file = test::as_file(name, test::as_text(data, size));
        test::is_taken([&] {
            const MeshFile read = read_mesh(file);
            test::must(!read.mesh.triangles.empty(), "a mesh without triangles", name);
            for (const Vec3& p : read.mesh.vertices)
                test::must(is_finite(p), "a vertex is not finite", name);
            for (const auto& triangle : read.mesh.triangles)
                for (const std::uint32_t corner : triangle)
                    test::must(corner < read.mesh.vertices.size(), "no such vertex", name);
            inspect(read.mesh);
        });
    }
    return 0;
}
