// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/mesh_check.h>

#include <algorithm>
#include <stdexcept>
#include <string>

#include <palpate/geometry/patient_size.h>

namespace palpate {

void require_mesh(std::string_view what, const TriangleMesh& mesh) {
    const auto fail = [what](const std::string& why) {
        throw std::invalid_argument(std::string(what) + why);
    };
    if (mesh.triangles.empty()) fail(".triangles is empty; give at least one");
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto& t = mesh.triangles[i];
        const std::uint32_t largest = std::max({t[0], t[1], t[2]});
        if (largest >= mesh.vertices.size())
            fail(".triangles[" + std::to_string(i) + "] names vertex " + std::to_string(largest) +
                 ", and there are " + std::to_string(mesh.vertices.size()) +
                 "; count vertices from 0");
    }
    Box bounds;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        if (!is_finite(mesh.vertices[i]))
            fail(".vertices[" + std::to_string(i) + "] is not finite; give numbers in m");
        bounds.add(mesh.vertices[i]);
    }
    if (const auto implausible = implausible_bounds(bounds)) fail(" " + implausible->what);
}

} // namespace palpate
