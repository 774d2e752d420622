// SPDX-License-Identifier: Apache-2.0
// This source is Apache-2.0; the CGAL package it uses (Intersecting Sequences of dD Iso-oriented
// Boxes) is GPL-3.0-or-later, or commercial. It is therefore built into palpate::extraction, which
// as a whole is under CGAL's terms.
#include <palpate/geometry/mesh_intersections.h>

#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/box_intersection_d.h>
#include <CGAL/intersections.h>

#include <palpate/geometry/internal/vertex_welder.h>

namespace palpate {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Triangle = Kernel::Triangle_3;
using Segment = Kernel::Segment_3;
using Box3 = CGAL::Box_intersection_d::Box_with_info_d<double, 3, std::uint32_t>;
using Corners = std::array<std::uint32_t, 3>;

/// The mesh with one vertex at each position.
struct Welded {
    std::vector<Point> points;
    std::vector<Corners> triangles; // degenerate ones left out
};

Welded welded(const TriangleMesh& mesh) {
    Welded result;
    internal::VertexWelder welder;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        Corners corners{};
        std::array<Vec3, 3> p{};
        for (int k = 0; k < 3; ++k) {
            const std::uint32_t vertex = mesh.triangles[t][k];
            if (vertex >= mesh.vertices.size() || !is_finite(mesh.vertices[vertex]))
                throw std::invalid_argument("triangle " + std::to_string(t) + " names vertex " +
                                            std::to_string(vertex) +
                                            ", which does not exist or is not finite; repair it");
            p[k] = mesh.vertices[vertex];
            const auto [number, is_new] = welder.weld(p[k]);
            corners[k] = number;
            if (is_new) result.points.emplace_back(p[k].x, p[k].y, p[k].z);
        }
        if (!is_degenerate(p[0], p[1], p[2])) result.triangles.push_back(corners);
    }
    return result;
}

/// The second triangle turned so that the vertices that both have come first in both.
struct Pair {
    Corners first, second;
    int shared = 0;
};

Pair aligned(const Corners& first, const Corners& second) {
    Pair pair{first, second, 0};
    for (int i = 0; i < 3; ++i)
        for (int j = pair.shared; j < 3; ++j)
            if (pair.first[i] == pair.second[j]) {
                std::swap(pair.first[i], pair.first[pair.shared]);
                std::swap(pair.second[j], pair.second[pair.shared]);
                ++pair.shared;
                break;
            }
    return pair;
}

bool intersect(const Welded& mesh, const Corners& first, const Corners& second) {
    const Pair pair = aligned(first, second);
    const auto point = [&](std::uint32_t vertex) { return mesh.points[vertex]; };
    const auto triangle = [&](const Corners& t) {
        return Triangle(point(t[0]), point(t[1]), point(t[2]));
    };
    const auto beyond_first_corner = [&](const Corners& t) {
        return Segment(point(t[1]), point(t[2]));
    };
    switch (pair.shared) {
    case 0:
        return CGAL::do_intersect(triangle(pair.first), triangle(pair.second));
    case 1: // what they have in common beside the vertex ends on a side that is not at it
        return CGAL::do_intersect(triangle(pair.first), beyond_first_corner(pair.second)) ||
               CGAL::do_intersect(triangle(pair.second), beyond_first_corner(pair.first));
    case 2: { // only folded flat onto each other
        const Point a = point(pair.first[0]), b = point(pair.first[1]);
        const Point c = point(pair.first[2]), d = point(pair.second[2]);
        return CGAL::coplanar(a, b, c, d) &&
               CGAL::coplanar_orientation(a, b, c, d) == CGAL::POSITIVE;
    }
    default:
        return true;
    }
}

} // namespace

std::size_t count_self_intersections(const TriangleMesh& mesh) {
    const Welded soup = welded(mesh);
    std::vector<Box3> boxes;
    boxes.reserve(soup.triangles.size());
    for (std::uint32_t t = 0; t < soup.triangles.size(); ++t) {
        const Corners& corners = soup.triangles[t];
        boxes.emplace_back(soup.points[corners[0]].bbox() + soup.points[corners[1]].bbox() +
                               soup.points[corners[2]].bbox(),
                           t);
    }
    std::vector<const Box3*> in_order;
    in_order.reserve(boxes.size());
    for (const Box3& box : boxes)
        in_order.push_back(&box);

    std::size_t count = 0;
    CGAL::box_self_intersection_d(in_order.begin(), in_order.end(),
                                  [&](const Box3* x, const Box3* y) {
                                      const Corners& first = soup.triangles[x->info()];
                                      const Corners& second = soup.triangles[y->info()];
                                      if (intersect(soup, first, second)) ++count;
                                  });
    return count;
}

} // namespace palpate
