// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <palpate/geometry/certified_mesh.h>

namespace palpate {

/// A place on a mesh: exactly on a face, an edge or a vertex, seen from one side. The side is a
/// label that only walking over edges changes; no rounded distance decides about it.
struct MeshSpot {
    enum class Feature : std::uint8_t { face, edge, vertex };
    Vec3 position{0.0}; ///< m, on the feature to double rounding
    std::uint32_t facet = 0;
    std::int8_t side = 1; ///< +1: on the side of the facet's normal
    Feature feature = Feature::face;
    std::uint8_t index = 0; ///< which edge, or corner, of the facet
};

/// Where a vector points from a spot: the nearest feature of the flat facets about it.
struct Heading {
    enum class Toward : std::uint8_t { face, edge, apex };
    Toward toward = Toward::apex;
    std::uint32_t facet = 0; ///< to go into, or with the edge to go along
    std::int8_t side = 1;
    std::uint8_t edge = 0;  ///< toward edge: of the facet
    double reach_m = 0.0;   ///< length of the vector's projection onto the feature
    double height_m = 0.0;  ///< > 0: the vector leads into free space; < 0: into the material
    bool on_border = false; ///< the spot is at a border: both sides can be reached
};

/// One leg of a walk.
struct WalkStep {
    enum class End : std::uint8_t {
        rests,     ///< nowhere on the surface is nearer
        arrives,   ///< at `spot`, which is nearer
        lifts,     ///< the pull leads off the surface
        uncertain, ///< the way leads onto a facet that is not certified
    };
    End end = End::rests;
    MeshSpot spot;
    Heading heading;
};

/// Sliding on a mesh: the path of steepest descent of the distance to a point, exactly, facet by
/// facet (docs/contact.md). Needs no queries. Reads the mesh only; any number of threads.
class MeshWalk {
public:
    /// The mesh must outlive this.                                                      [setup]
    explicit MeshWalk(const CertifiedMesh& mesh) noexcept;

    /// The nearest feature to `vector`, m, of the surface about the spot, as if its facets went on
    /// for ever.  [loop]
    Heading heading(const MeshSpot& spot, const Vec3& vector) const noexcept;

    /// Whether step() would rest at the spot, and that is within a facet.                [loop]
    bool rests_in_facet(const MeshSpot& spot, const Vec3& pull) const noexcept;
    /// From the spot to the end of the facet or edge that leads towards `pull`.          [loop]
    WalkStep step(const MeshSpot& spot, const Vec3& pull) const noexcept;

    /// The spot of a point on (to rounding) a facet: on an edge or vertex when within the
    /// tolerance.  [loop]
    MeshSpot spot_at(std::uint32_t facet, std::int8_t side, const Vec3& point) const noexcept;

    /// The side from which the spot is seen from `seen_from`, with nothing in between; the spot's
    /// own side plays no part.  [loop]
    std::int8_t side_seen_from(const MeshSpot& spot, const Vec3& seen_from) const noexcept;

    /// The facets that contain the spot.                                                [loop]
    void facets_at(const MeshSpot& spot, Fan& facets) const noexcept;

    /// Unit normal of a facet, towards the side from which it is felt.                   [any]
    Vec3 outward(std::uint32_t facet, std::int8_t side) const noexcept {
        return static_cast<double>(side) * mesh_.topology().facet(facet).normal;
    }

private:
    Heading heading_of_face(const MeshSpot& spot, const Vec3& vector) const noexcept;
    Heading heading_of_edge(const MeshSpot& spot, const Vec3& vector) const noexcept;
    Heading heading_of_vertex(const MeshSpot& spot, const Vec3& vector) const noexcept;
    Vec3 mean_outward(const Fan& around, const Vec3& vertex) const noexcept;
    MeshSpot across_face(const MeshSpot& spot, const Heading& heading,
                         const Vec3& pull) const noexcept;
    MeshSpot along_edge(const Heading& heading, const Vec3& pull) const noexcept;
    MeshSpot on_edge(std::uint32_t facet, std::int8_t side, std::uint8_t edge,
                     double share) const noexcept;
    MeshSpot at_corner(std::uint32_t facet, std::int8_t side, std::uint8_t corner) const noexcept;

    const CertifiedMesh& mesh_;
    const MeshTopology& topology_;
    double tolerance_m_;
    double snap_m_;
};

} // namespace palpate
