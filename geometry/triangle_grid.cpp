// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/triangle_grid.h>

#include <algorithm>

namespace palpate {
namespace {

template <typename Visit>
bool any_cube(const Vec3& lower, const Vec3& upper, double side, const Visit& visit) {
    const internal::Cube low = internal::cube_of(lower, side),
                         high = internal::cube_of(upper, side);
    for (std::int64_t x = low.x; x <= high.x; ++x)
        for (std::int64_t y = low.y; y <= high.y; ++y)
            for (std::int64_t z = low.z; z <= high.z; ++z)
                if (visit(internal::Cube{x, y, z})) return true;
    return false;
}

constexpr double kMostCubes = 4096.0; // of one triangle

bool is_large(const Box& box, double side) {
    const Vec3 cubes = box.extent() / side + 1.0;
    return cubes.x * cubes.y * cubes.z > kMostCubes;
}

} // namespace

TriangleGrid::TriangleGrid(const TriangleMesh& mesh, double side) : mesh_(mesh), side_(side) {
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        Box box;
        for (const std::uint32_t vertex : mesh.triangles[t])
            box.add(mesh.vertices[vertex]);
        if (is_large(box, side)) {
            large_.push_back(t);
            continue;
        }
        any_cube(box.lower, box.upper, side, [&](const internal::Cube& cube) {
            triangles_in_[cube].push_back(t);
            return false;
        });
    }
}

bool TriangleGrid::has_facing(const Vec3& p, const Vec3& direction, double radius) const {
    const bool is_of_cubes =
        any_cube(p - radius, p + radius, side_, [&](const internal::Cube& cube) {
            const auto found = triangles_in_.find(cube);
            return found != triangles_in_.end() &&
                   has_facing_among(found->second, p, direction, radius);
        });
    return is_of_cubes || has_facing_among(large_, p, direction, radius);
}

bool TriangleGrid::has_facing_among(const std::vector<std::uint32_t>& triangles, const Vec3& p,
                                    const Vec3& direction, double radius) const {
    return std::any_of(triangles.begin(), triangles.end(), [&](std::uint32_t t) {
        const Vec3& a = mesh_.vertices[mesh_.triangles[t][0]];
        const Vec3& b = mesh_.vertices[mesh_.triangles[t][1]];
        const Vec3& c = mesh_.vertices[mesh_.triangles[t][2]];
        return glm::dot(glm::cross(b - a, c - a), direction) > 0.0 &&
               squared_length(closest_point_on_triangle(p, a, b, c) - p) <= radius * radius;
    });
}

} // namespace palpate
