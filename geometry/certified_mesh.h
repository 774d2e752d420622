// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <future>
#include <memory>
#include <vector>

#include <palpate/geometry/mesh_topology.h>
#include <palpate/geometry/surface_scene.h>

namespace palpate {

/// A triangle mesh with what is needed to walk on it: queries, neighbours, and for each facet
/// whether its surroundings are certified.
///
/// Certified means: what comes closer to the facet than clearance_m() is joined to it by a vertex,
/// in one fan about it, and does not pierce it or lie folded onto it. A point that slides on such a
/// facet can only be stopped by facets of these fans, so no query is needed while it does.
/// Immutable, for any number of threads.
class CertifiedMesh {
public:
    /// Where certificates come from.
    enum class Certificates {
        computed, ///< each facet's surroundings are looked at, as above
        assumed,  ///< every facet is called certified: shows in tests what certificates are for
    };

    /// Throws as SurfaceScene does. On all processors.                                  [setup]
    explicit CertifiedMesh(std::shared_ptr<const TriangleMesh> mesh,
                           Certificates certificates = Certificates::computed);

    /// For rays and closest points.                                                     [any]
    const SurfaceScene& scene() const noexcept { return scene_; }
    /// For neighbours and fans.                                                         [any]
    const MeshTopology& topology() const noexcept { return topology_; }

    /// Whether a facet's surroundings are certified; facet < facet_count() of topology().   [any]
    bool certified(std::uint32_t facet) const noexcept { return uncertain_[facet] == 0; }
    /// Per facet: 0 where certified.
    const std::vector<std::uint8_t>& uncertain() const noexcept { return uncertain_; }
    std::size_t uncertain_count() const noexcept { return uncertain_count_; } ///< facets  [any]
    /// Whether there is an edge of one facet: then the mesh has no inside.
    bool has_border() const noexcept { return has_border_; }
    /// The same of the connected part that a facet is of.                               [any]
    bool has_border(std::uint32_t facet) const noexcept {
        return has_border_ && open_parts_[topology_.facet(facet).part];
    }

    /// How far a point is kept from facets that are not certified, m: twice what closes cracks
    /// between them (60 nm for meshes of 31-62 mm half extent).
    double skin_m() const noexcept { return skin_m_; }
    /// Four skins, m.
    double clearance_m() const noexcept { return scene_.near_m(); }
    /// Below this a distance is nothing, m: 2e-11 of the half extent, and at least a thousand
    /// roundings (1e-12 m for 50 mm).
    double tolerance_m() const noexcept { return tolerance_m_; }

private:
    CertifiedMesh(std::shared_ptr<const TriangleMesh> mesh, std::future<MeshTopology> topology,
                  Certificates certificates);
    void certify();
    void spread_false_borders();
    bool clear_of_each_other(std::uint32_t facet, std::uint32_t other) const;

    SurfaceScene scene_;
    MeshTopology topology_;
    double skin_m_;
    double tolerance_m_;
    std::vector<std::uint8_t> uncertain_;
    std::size_t uncertain_count_ = 0;
    bool has_border_ = false;
    std::vector<bool> open_parts_; // by the number of the part; empty: none is
};

} // namespace palpate
