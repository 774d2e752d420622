// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include "tests/support/test_meshes.h"

/// Meshes that are hard to touch: sharp, thin, overlapping, cracked, with junctions. Metres.
namespace palpate::test {

/// A ball whose vertices stand out by up to `share` of the radius, inwards and outwards, at random.
inline TriangleMesh spiky_ball(double radius, int levels, double share, unsigned seed) {
    TriangleMesh mesh = icosphere(radius, levels);
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> height(1.0 - share, 1.0 + share);
    for (Vec3& p : mesh.vertices)
        p *= height(random);
    return mesh;
}

/// A unit sphere made a star: smooth bumps at random on several scales.
inline TriangleMesh random_star(TriangleMesh mesh, double radius, double share, unsigned seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    struct Wave {
        Vec3 k;
        double phase, height;
    };
    std::vector<Wave> waves;
    for (const double frequency : {3.0, 6.0, 12.0, 24.0})
        for (int i = 0; i < 6; ++i) {
            const double x = normal(random), y = normal(random), z = normal(random);
            waves.push_back({frequency * glm::normalize(Vec3{x, y, z}), normal(random) * 3.0,
                             share / frequency});
        }
    for (Vec3& p : mesh.vertices) {
        double r = 1.0;
        for (const Wave& wave : waves)
            r += wave.height * std::sin(glm::dot(wave.k, p) + wave.phase);
        p *= radius * r;
    }
    return mesh;
}

/// Two flat pyramids base to base: edges as sharp as knives. Half as thick as `thickness` at the
/// middle, `sides` corners.
inline TriangleMesh knife(double radius, double thickness, std::uint32_t sides) {
    TriangleMesh mesh;
    for (std::uint32_t i = 0; i < sides; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / sides + 0.1;
        mesh.vertices.push_back(radius * Vec3{std::cos(angle), std::sin(angle), 0.0});
    }
    mesh.vertices.push_back({0.0, 0.0, 0.5 * thickness});
    mesh.vertices.push_back({0.0, 0.0, -0.5 * thickness});
    for (std::uint32_t i = 0; i < sides; ++i) {
        const std::uint32_t next = (i + 1) % sides;
        mesh.triangles.push_back({i, next, sides});
        mesh.triangles.push_back({next, i, sides + 1});
    }
    return mesh;
}

/// Every triangle by itself, shrunk so that there are cracks of `crack` m between them.
inline TriangleMesh soup(const TriangleMesh& whole, double crack) {
    TriangleMesh mesh;
    for (const auto& t : whole.triangles) {
        const Vec3 a = whole.vertices[t[0]], b = whole.vertices[t[1]], c = whole.vertices[t[2]];
        const double ab = glm::length(b - a), bc = glm::length(c - b), ca = glm::length(a - c);
        const double area = 0.5 * glm::length(glm::cross(b - a, c - a));
        const Vec3 middle = (bc * a + ca * b + ab * c) / (ab + bc + ca);
        const double inscribed = 2.0 * area / (ab + bc + ca);
        const double share = 1.0 - 0.5 * crack / inscribed;
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        for (const Vec3& p : {a, b, c})
            mesh.vertices.push_back(middle + share * (p - middle));
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    return mesh;
}

/// The first edge of `count` triangles gets a vertex in its middle that the neighbour knows nothing
/// of.
inline TriangleMesh with_t_junctions(TriangleMesh mesh, std::size_t count) {
    const std::size_t every = mesh.triangles.size() / count;
    for (std::size_t i = 0; i < count; ++i) {
        const auto t = mesh.triangles[i * every];
        const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
        mesh.vertices.push_back(0.5 * (mesh.vertices[t[0]] + mesh.vertices[t[1]]));
        mesh.triangles[i * every] = {t[0], middle, t[2]};
        mesh.triangles.push_back({middle, t[1], t[2]});
    }
    return mesh;
}

/// Every third triangle the other way round.
inline TriangleMesh partly_reversed(TriangleMesh mesh) {
    for (std::size_t i = 0; i < mesh.triangles.size(); i += 3)
        std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
    return mesh;
}

/// Two wedges that share one edge: four triangles meet there.
inline TriangleMesh wedges_on_one_edge(double size) {
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, -size},
                     {0, 0, size},
                     {size, size, 0},
                     {size, -size, 0.0},
                     {-size, size, 0.1 * size},
                     {-size, -size, 0}};
    const auto tetrahedron = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c,
                                 std::uint32_t d) {
        for (const auto& t :
             {std::array<std::uint32_t, 3>{a, b, c}, {a, c, d}, {a, d, b}, {b, d, c}})
            mesh.triangles.push_back(t);
    };
    tetrahedron(0, 1, 2, 3);
    tetrahedron(0, 1, 5, 4);
    return mesh;
}

inline TriangleMesh turned(TriangleMesh mesh) {
    // A rotation without an axis or angle of note.
    const Vec3 axis = glm::normalize(Vec3{0.3, -1.1, 0.7});
    const double angle = 1.234567;
    for (Vec3& p : mesh.vertices)
        p = std::cos(angle) * p + std::sin(angle) * glm::cross(axis, p) +
            (1.0 - std::cos(angle)) * glm::dot(axis, p) * axis;
    return mesh;
}

} // namespace palpate::test
