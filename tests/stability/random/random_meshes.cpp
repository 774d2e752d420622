// SPDX-License-Identifier: Apache-2.0
#include "tests/stability/random/random_meshes.h"

#include <array>
#include <functional>
#include <numbers>

#include "tests/support/odd_meshes.h"

namespace palpate::stability {
namespace {

using test::between;
using test::of_any_size;
using test::pick;
using test::Random;

/// A strip with half a twist: one side, one border.
TriangleMesh moebius(std::uint32_t pieces) {
    TriangleMesh mesh;
    for (std::uint32_t i = 0; i < pieces; ++i) {
        const double turn = 2.0 * std::numbers::pi * i / pieces;
        const Vec3 out{std::cos(turn), std::sin(turn), 0.0};
        const Vec3 across = std::cos(0.5 * turn) * out + Vec3{0.0, 0.0, std::sin(0.5 * turn)};
        mesh.vertices.push_back(0.7 * out - 0.3 * across);
        mesh.vertices.push_back(0.7 * out + 0.3 * across);
    }
    for (std::uint32_t i = 0; i < pieces; ++i) {
        const std::uint32_t a = 2 * i, b = a + 1;
        const bool last = i + 1 == pieces; // there the sides are exchanged
        const std::uint32_t c = last ? 1 : a + 2, d = last ? 0 : a + 3;
        mesh.triangles.push_back({a, c, b});
        mesh.triangles.push_back({b, c, d});
    }
    return mesh;
}

TriangleMesh flat(TriangleMesh mesh, double share) {
    for (Vec3& p : mesh.vertices)
        p.z *= share;
    return mesh;
}

TriangleMesh nested(double ratio) {
    TriangleMesh mesh = test::icosphere(1.0, 2);
    test::append(mesh, test::icosphere(ratio, 2));
    return mesh;
}

TriangleMesh overlapping(const Vec3& by) {
    TriangleMesh mesh = test::icosphere(0.7, 2);
    test::append(mesh, test::moved(test::icosphere(0.7, 2), by));
    return mesh;
}

/// Two boxes with a gap between them that is much narrower than anything else.
TriangleMesh cracked(double gap) {
    TriangleMesh mesh = test::box_mesh({-0.8, -0.6, -0.4}, {-0.5 * gap, 0.6, 0.4});
    test::append(mesh, test::box_mesh({0.5 * gap, -0.6, -0.4}, {0.8, 0.6, 0.4}));
    return mesh;
}

TriangleMesh doubled(const TriangleMesh& once) {
    TriangleMesh mesh = once;
    test::append(mesh, once);
    return mesh;
}

} // namespace

TriangleMesh prism(double angle_deg, double size_m) {
    const double half = 0.5 * angle_deg * std::numbers::pi / 180.0;
    const double x = size_m * std::sin(half), z = size_m * std::cos(half);
    TriangleMesh mesh;
    for (const double y : {-size_m, size_m}) {
        mesh.vertices.push_back({0, y, 0});
        mesh.vertices.push_back({x, y, -z});
        mesh.vertices.push_back({-x, y, -z});
    }
    mesh.triangles = {{0, 2, 1}, {3, 4, 5}, {0, 4, 3}, {0, 1, 4},
                      {1, 5, 4}, {1, 2, 5}, {2, 3, 5}, {2, 0, 3}};
    return mesh;
}

RandomMesh random_mesh(Random& random, double size_m) {
    const unsigned seed = static_cast<unsigned>(random());
    const int levels = 1 + pick(random, 3);
    const TriangleMesh ball = test::icosphere(1.0, levels);
    const double x = between(random, 0.02, 0.9), angle = between(random, 1.0, 175.0);
    const double tiny = of_any_size(random, 1e-9, 1e-2);
    const std::array<std::pair<const char*, std::function<TriangleMesh()>>, 21> kinds{{
        {"ball", [&] { return ball; }},
        {"bumps", [&] { return test::bumpy_sphere(1.0, levels, 0.3 * x); }},
        {"spikes", [&] { return test::spiky_ball(1.0, 2, 0.6 * x, seed); }},
        {"slivers", [&] { return flat(ball, tiny + 1e-3); }},
        {"doubled", [&] { return doubled(ball); }},
        {"doubled sheet", [&] { return doubled(test::sheet(2.0, 3)); }},
        {"inverted", [&] { return test::reversed(ball); }},
        {"nested", [&] { return nested(x); }},
        {"nearly doubled", [&] { return nested(1.0 - tiny); }},
        {"moebius", [&] { return moebius(12 + 6 * static_cast<std::uint32_t>(levels)); }},
        {"soup", [&] { return test::soup(ball, 1e-6 * tiny); }},
        {"prism", [&] { return prism(angle, 1.0); }},
        {"T-junctions", [&] { return test::with_t_junctions(ball, 10); }},
        {"partly reversed", [&] { return test::partly_reversed(ball); }},
        {"knife", [&] { return test::knife(1.0, tiny + 1e-4, 7); }},
        {"wedges on one edge", [&] { return test::wedges_on_one_edge(1.0); }},
        {"overlapping",
         [&] {
             return overlapping({x, 0.1 * x, 0.02});
         }},
        {"crack", [&] { return cracked(tiny); }},
        {"sheet", [&] { return test::sheet(2.0, 4); }},
        {"plate",
         [&] {
             return test::box_mesh({-1, -1, -0.5 * tiny}, {1, 1, 0.5 * tiny});
         }},
        {"reversed prism", [&] { return test::reversed(prism(angle, 1.0)); }},
    }};
    const auto& [kind, make] = kinds[static_cast<std::size_t>(pick(random, kinds.size()))];
    RandomMesh made{kind, make()};
    if (test::chance(random, 0.5)) made.mesh = test::turned(std::move(made.mesh));
    for (Vec3& p : made.mesh.vertices)
        p *= size_m;
    return made;
}

} // namespace palpate::stability
