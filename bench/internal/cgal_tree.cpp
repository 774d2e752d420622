// SPDX-License-Identifier: Apache-2.0
#include "bench/internal/cgal_tree.h"

#include <cmath>
#include <vector>

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

namespace palpate::bench {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using AabbTree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

Kernel::Point_3 point_of(const Vec3& p) { return {p.x, p.y, p.z}; }

} // namespace

struct CgalTree::Tree {
    Triangles triangles;
    AabbTree tree;
};

CgalTree::CgalTree(const TriangleMesh& mesh) : tree_(std::make_unique<Tree>()) {
    for (const auto& t : mesh.triangles)
        tree_->triangles.emplace_back(point_of(mesh.vertices[t[0]]), point_of(mesh.vertices[t[1]]),
                                      point_of(mesh.vertices[t[2]]));
    tree_->tree.insert(tree_->triangles.begin(), tree_->triangles.end());
    tree_->tree.build();
    tree_->tree.accelerate_distance_queries();
}

CgalTree::~CgalTree() = default;

std::optional<double> CgalTree::first_hit(const Vec3& from, const Vec3& to) const {
    const Kernel::Ray_3 ray(point_of(from), point_of(to));
    const auto hit = tree_->tree.first_intersection(ray);
    if (!hit) return std::nullopt;
    const auto* point = boost::get<Kernel::Point_3>(&hit->first);
    if (!point) return std::nullopt; // along a triangle
    const double distance = std::sqrt(CGAL::squared_distance(point_of(from), *point));
    return distance <= glm::length(to - from) ? std::optional(distance) : std::nullopt;
}

double CgalTree::closest_point(const Vec3& point) const {
    return std::sqrt(tree_->tree.squared_distance(point_of(point)));
}

} // namespace palpate::bench
