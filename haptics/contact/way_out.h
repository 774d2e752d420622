// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <palpate/geometry/surface_scene.h>

namespace palpate {

/// One ray out of a mesh: it tells whether a place is behind its facets.
class WayOut {
public:
    /// Of a mesh, m; it must outlive this.                                              [setup]
    explicit WayOut(const SurfaceScene& surface) : surface_(&surface) {
        Box bounds;
        for (const Vec3& vertex : surface.mesh().vertices)
            bounds.add(vertex);
        // Parallel to nothing that meshes have many facets along, and longer than the mesh.
        way_ = glm::length(bounds.extent()) * glm::normalize(Vec3{0.362, 0.541, -0.759});
    }

    /// Whether the first facet on the way out shows the place `p`, m, scene frame, its back: then
    /// it is inside a closed mesh.                                                      [loop]
    bool meets_a_back(const Vec3& p) const noexcept {
        const std::optional<SurfaceHit> hit = surface_->first_hit(p, p + way_);
        return hit && glm::dot(hit->normal, way_) > 0.0;
    }

private:
    const SurfaceScene* surface_;
    Vec3 way_{0.0}; // m
};

} // namespace palpate
