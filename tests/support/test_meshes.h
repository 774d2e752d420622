// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include <palpate/geometry/triangle_mesh.h>

/// Meshes whose geometry is known, for tests. Metres; counter-clockwise seen from outside.
namespace palpate::test {

/// Every triangle into four; `place` puts the edges' midpoints where they belong.
template <typename Place>
TriangleMesh subdivided(const TriangleMesh& coarse, const Place& place) {
    TriangleMesh fine{coarse.vertices, {}};
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middle_of;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
        const auto [found, is_new] =
            middle_of.try_emplace(std::pair{std::min(a, b), std::max(a, b)},
                                  static_cast<std::uint32_t>(fine.vertices.size()));
        if (is_new) fine.vertices.push_back(place(0.5 * (coarse.vertices[a] + coarse.vertices[b])));
        return found->second;
    };
    for (const auto& t : coarse.triangles) {
        const std::uint32_t ab = middle(t[0], t[1]), bc = middle(t[1], t[2]),
                            ca = middle(t[2], t[0]);
        fine.triangles.push_back({t[0], ab, ca});
        fine.triangles.push_back({ab, t[1], bc});
        fine.triangles.push_back({ca, bc, t[2]});
        fine.triangles.push_back({ab, bc, ca});
    }
    return fine;
}

/// An icosahedron subdivided `levels` times onto the sphere: 20 * 4^levels triangles.
inline TriangleMesh icosphere(double radius, int levels, const Vec3& center = Vec3{0.0}) {
    const double g = 0.5 * (1.0 + std::sqrt(5.0)); // golden ratio
    TriangleMesh mesh;
    mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                     {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
    mesh.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                      {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                      {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                      {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    const auto onto_unit_sphere = [](const Vec3& p) { return glm::normalize(p); };
    for (Vec3& p : mesh.vertices)
        p = onto_unit_sphere(p);
    for (int level = 0; level < levels; ++level)
        mesh = subdivided(mesh, onto_unit_sphere);
    for (Vec3& p : mesh.vertices)
        p = center + radius * p;
    return mesh;
}

/// A sphere with smooth bumps of `height` relative to its radius, about `waves` around the equator.
inline TriangleMesh bumpy_sphere(double radius, int levels, double height = 0.1, double waves = 7.0,
                                 const Vec3& center = Vec3{0.0}) {
    TriangleMesh mesh = icosphere(1.0, levels);
    for (Vec3& p : mesh.vertices) {
        const double bump =
            std::sin(waves * p.x + 0.3) * std::sin(waves * p.y + 1.1) * std::sin(waves * p.z + 2.3);
        p = center + radius * (1.0 + height * bump) * p;
    }
    return mesh;
}

/// A closed box of 12 triangles.
inline TriangleMesh box_mesh(const Vec3& lower, const Vec3& upper) {
    TriangleMesh mesh;
    for (int corner = 0; corner < 8; ++corner)
        mesh.vertices.push_back({corner & 1 ? upper.x : lower.x, corner & 2 ? upper.y : lower.y,
                                 corner & 4 ? upper.z : lower.z});
    mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return mesh;
}

/// The thin plate that a probe must not fall through: 60 x 60 x 1 mm, its middle at the origin.
inline TriangleMesh plate() { return box_mesh({-0.03, -0.03, -0.0005}, {0.03, 0.03, 0.0005}); }

/// An open square sheet in z = 0 of cells x cells squares, normals towards +z.
inline TriangleMesh sheet(double side, std::uint32_t cells) {
    TriangleMesh mesh;
    for (std::uint32_t y = 0; y <= cells; ++y)
        for (std::uint32_t x = 0; x <= cells; ++x)
            mesh.vertices.push_back(
                {side * (x / double(cells) - 0.5), side * (y / double(cells) - 0.5), 0.0});
    for (std::uint32_t y = 0; y < cells; ++y)
        for (std::uint32_t x = 0; x < cells; ++x) {
            const std::uint32_t a = y * (cells + 1) + x, b = a + 1, c = a + cells + 1, d = c + 1;
            mesh.triangles.push_back({a, b, d});
            mesh.triangles.push_back({a, d, c});
        }
    return mesh;
}

/// All of `part` behind all of `mesh`.
inline void append(TriangleMesh& mesh, const TriangleMesh& part) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), part.vertices.begin(), part.vertices.end());
    for (const auto& t : part.triangles)
        mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
}

/// The same surface with its inside and outside exchanged.
inline TriangleMesh reversed(TriangleMesh mesh) {
    for (auto& t : mesh.triangles)
        std::swap(t[1], t[2]);
    return mesh;
}

/// The same mesh elsewhere.
inline TriangleMesh moved(TriangleMesh mesh, const Vec3& by) {
    for (Vec3& p : mesh.vertices)
        p += by;
    return mesh;
}

} // namespace palpate::test
