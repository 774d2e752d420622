// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/surface_seeds.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>
#include <unordered_map>

#include <palpate/geometry/internal/mesh_components.h>
#include <palpate/geometry/triangle_grid.h>

namespace palpate {
namespace {

// A sphere meshed from fewer points than these can collapse or vanish under Delaunay refinement
// (measured on skull CT).
constexpr std::size_t kFewestSeeds = 40;
constexpr double kCubePerFacet =
    1.1; // seeds a little sparser than the facets asked for do not set their size
constexpr double kFewestCovered = 0.5;
constexpr double kTolerancePerExtent =
    0.25; // of a small part: its far side must not stand in for its near side

void require_length(double value, const char* name) {
    if (!(value > 0.0) || !std::isfinite(value))
        throw std::invalid_argument(std::string(name) + " is " + std::to_string(value) +
                                    "; give a finite length > 0 in metres");
}

void require_indices(const TriangleMesh& mesh) {
    for (const auto& triangle : mesh.triangles)
        for (const std::uint32_t vertex : triangle)
            if (vertex >= mesh.vertices.size())
                throw std::invalid_argument("a triangle names vertex " + std::to_string(vertex) +
                                            " of " + std::to_string(mesh.vertices.size()) +
                                            "; make every index smaller than the vertex count");
}

/// Directions of the vertices' normals, weighted by area, not of unit length.
std::vector<Vec3> vertex_directions(const TriangleMesh& mesh) {
    std::vector<Vec3> directions(mesh.vertices.size(), Vec3{0.0});
    for (const auto& t : mesh.triangles) {
        const Vec3& a = mesh.vertices[t[0]];
        const Vec3 doubled_area = glm::cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a);
        for (const std::uint32_t vertex : t)
            directions[vertex] += doubled_area;
    }
    return directions;
}

struct Component {
    std::size_t triangles = 0;
    std::vector<std::uint32_t> vertices;
};

std::vector<Component> components_of(const TriangleMesh& mesh) {
    const internal::ComponentLabels labels = internal::label_components(mesh);
    std::vector<Component> components(labels.count);
    for (const std::uint32_t label : labels.of_triangle)
        ++components[label].triangles;
    for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v)
        if (labels.of_vertex[v] != internal::ComponentLabels::kNone)
            components[labels.of_vertex[v]].vertices.push_back(v);
    return components;
}

/// The first vertex of every cube, and every further one that faces away from all kept there.
std::vector<std::uint32_t> thin(const TriangleMesh& mesh, const std::vector<Vec3>& directions,
                                const std::vector<std::uint32_t>& vertices, double side) {
    std::vector<std::uint32_t> kept;
    std::unordered_map<internal::Cube, std::vector<std::uint32_t>, internal::CubeHash> kept_in;
    for (const std::uint32_t vertex : vertices) {
        auto& neighbours = kept_in[internal::cube_of(mesh.vertices[vertex], side)];
        const bool taken =
            std::any_of(neighbours.begin(), neighbours.end(), [&](std::uint32_t other) {
                return glm::dot(directions[vertex], directions[other]) >= 0.0;
            });
        if (taken) continue;
        neighbours.push_back(vertex);
        kept.push_back(vertex);
    }
    return kept;
}

double share_covered(const TriangleMesh& preview, const std::vector<Vec3>& directions,
                     const Component& component, const TriangleGrid& grid, double tolerance) {
    Box box;
    for (const std::uint32_t vertex : component.vertices)
        box.add(preview.vertices[vertex]);
    const Vec3 extent = box.extent();
    const double smallest_extent = std::min({extent.x, extent.y, extent.z});
    // A flat part (a preview of one plane) has no extent to go by.
    const double radius = smallest_extent > 0.0
                              ? std::min(tolerance, kTolerancePerExtent * smallest_extent)
                              : tolerance;
    const auto covered =
        std::count_if(component.vertices.begin(), component.vertices.end(), [&](std::uint32_t v) {
            return grid.has_facing(preview.vertices[v], directions[v], radius);
        });
    return static_cast<double>(covered) / static_cast<double>(component.vertices.size());
}

/// That component of the report which has this one's first vertex as its sample.
MeshComponent measured(const TriangleMesh& preview, const internal::ComponentLabels& labels,
                       std::uint32_t label) {
    TriangleMesh part{preview.vertices, {}};
    for (std::size_t t = 0; t < preview.triangles.size(); ++t)
        if (labels.of_triangle[t] == label) part.triangles.push_back(preview.triangles[t]);
    return inspect(part).components.front();
}

} // namespace

std::vector<Vec3> choose_seeds(const TriangleMesh& preview, double facet_size_m,
                               std::size_t smallest_component_triangles) {
    require_length(facet_size_m, "facet_size_m");
    require_indices(preview);
    const std::vector<Vec3> directions = vertex_directions(preview);
    std::vector<Vec3> seeds;
    for (const Component& component : components_of(preview)) {
        if (component.triangles < smallest_component_triangles) continue;
        const std::size_t wanted = std::min(kFewestSeeds, component.vertices.size());
        double side = kCubePerFacet * facet_size_m;
        auto kept = thin(preview, directions, component.vertices, side);
        // Cubes shrink until there are enough; by 2^-20 of a facet they hold one vertex each, or
        // equal ones.
        for (int halvings = 0; kept.size() < wanted && halvings < 20; ++halvings) {
            side *= 0.5;
            kept = thin(preview, directions, component.vertices, side);
        }
        for (const std::uint32_t vertex : kept)
            seeds.push_back(preview.vertices[vertex]);
    }
    return seeds;
}

std::vector<ComponentMatch> missing_components(const TriangleMesh& preview,
                                               const TriangleMesh& mesh,
                                               std::size_t smallest_component_triangles,
                                               double tolerance_m) {
    require_length(tolerance_m, "tolerance_m");
    require_indices(preview);
    require_indices(mesh);
    const std::vector<Vec3> directions = vertex_directions(preview);
    const TriangleGrid grid(mesh, tolerance_m);
    const internal::ComponentLabels labels = internal::label_components(preview);
    const std::vector<Component> components = components_of(preview);

    std::vector<ComponentMatch> missing;
    for (std::uint32_t label = 0; label < components.size(); ++label) {
        const Component& component = components[label];
        if (component.triangles < smallest_component_triangles) continue;
        const double covered = share_covered(preview, directions, component, grid, tolerance_m);
        if (covered < kFewestCovered)
            missing.push_back({measured(preview, labels, label), covered});
    }
    std::stable_sort(missing.begin(), missing.end(), [](const auto& x, const auto& y) {
        return x.component.area_m2 > y.component.area_m2;
    });
    return missing;
}

} // namespace palpate
