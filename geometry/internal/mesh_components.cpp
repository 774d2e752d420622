// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/internal/mesh_components.h>

namespace palpate::internal {

ComponentLabels label_components(const TriangleMesh& mesh) {
    DisjointSets sets(mesh.vertices.size());
    for (const auto& triangle : mesh.triangles) {
        sets.join(triangle[0], triangle[1]);
        sets.join(triangle[0], triangle[2]);
    }

    ComponentLabels labels;
    labels.of_vertex.assign(mesh.vertices.size(), ComponentLabels::kNone);
    labels.of_triangle.reserve(mesh.triangles.size());
    std::vector<std::uint32_t> label_of_root(mesh.vertices.size(), ComponentLabels::kNone);
    for (const auto& triangle : mesh.triangles) {
        std::uint32_t& label = label_of_root[sets.root(triangle[0])];
        if (label == ComponentLabels::kNone) label = static_cast<std::uint32_t>(labels.count++);
        labels.of_triangle.push_back(label);
        for (const std::uint32_t vertex : triangle)
            labels.of_vertex[vertex] = label;
    }
    return labels;
}

} // namespace palpate::internal
