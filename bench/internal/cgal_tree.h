// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include <palpate/geometry/triangle_mesh.h>

/// CGAL's AABB tree over a mesh, to compare Embree with. CGAL, GPL.
namespace palpate::bench {

class CgalTree {
public:
    explicit CgalTree(const TriangleMesh& mesh);
    ~CgalTree();
    CgalTree(const CgalTree&) = delete;
    CgalTree& operator=(const CgalTree&) = delete;

    /// Distance from `from` to the first triangle on the segment, m.
    std::optional<double> first_hit(const Vec3& from, const Vec3& to) const;
    /// Distance to the closest point of the mesh, m.
    double closest_point(const Vec3& point) const;

private:
    struct Tree;
    std::unique_ptr<Tree> tree_;
};

} // namespace palpate::bench
