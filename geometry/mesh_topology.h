// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <palpate/geometry/triangle_mesh.h>

namespace palpate {

/// A triangle with its neighbours. Edge k runs from vertex k to vertex k + 1 (mod 3); corner k is
/// at vertex k.
struct Facet {
    Vec3 normal{0.0};                         ///< unit, right-hand rule; zero: dropped
    std::array<std::uint32_t, 3> vertex{};    ///< equal positions have one name, see position()
    std::array<std::uint32_t, 3> neighbour{}; ///< over edge k; at a border the facet itself
    /// What a side (+1 where the normal points, -1 behind) becomes over edge k: -1 where the
    /// neighbour is oriented the other way round, and at a border, where a sheet's other side
    /// begins.
    std::array<std::int8_t, 3> turn{};
    std::array<std::uint8_t, 3> shared_edge{}; ///< which edge of the neighbour edge k is
    /// Not dropped, but has an edge of more than two facets, a vertex with several fans, or lies
    /// beside a dropped facet: its surroundings are not a surface.
    bool singular = false;
    std::int8_t face = 1;   ///< MeshTopology::face() of its side +1
    std::uint32_t part = 0; ///< which connected part it is of: a number, as others of it have

    bool dropped() const noexcept { return normal == Vec3{0.0}; } ///< it has no area  [any]
};

/// A facet about a vertex, seen from one side.
struct FanFacet {
    std::uint32_t facet = 0;    ///< index of the triangle
    std::int8_t side = 1;       ///< from which it is seen: 1 where its normal points, -1 behind
    std::uint8_t corner = 0;    ///< where the vertex is
    std::uint8_t exit_edge = 0; ///< towards the fan's next facet
};

/// The facets about a vertex in their order, each with the side from which it is seen when one
/// walks round without passing through the surface. At a border the walk goes on over it: facets
/// come twice, once from each side.
class Fan {
public:
    static constexpr std::size_t kCapacity = 96; ///< facets at most
    void clear() noexcept { count_ = 0; }        ///< [loop]
    /// False: it is full, and the facet was left out.                                       [loop]
    bool add(const FanFacet& facet) noexcept {
        if (count_ == kCapacity) return false;
        facets_[count_++] = facet;
        return true;
    }
    std::size_t size() const noexcept { return count_; } ///< facets in it  [loop]
    /// The i-th in walking order, i < size().                                               [loop]
    const FanFacet& operator[](std::size_t i) const noexcept { return facets_[i]; }

private:
    std::array<FanFacet, kCapacity> facets_;
    std::size_t count_ = 0;
};

/// What the triangles of a mesh are to one another. Immutable; facet i is triangle i. Where a mesh
/// is no surface (edges of three facets, vertices where several fans meet, beside triangles without
/// area), facets are marked singular and not linked there, rather than refused.
class MeshTopology {
public:
    /// Throws std::invalid_argument when a triangle names a vertex that does not exist or there are
    /// more than 2^31 triangles.   [setup]
    explicit MeshTopology(const TriangleMesh& mesh);

    std::size_t facet_count() const noexcept { return facets_.size(); } ///< dropped ones too  [any]
    /// `index` < facet_count().                                                             [any]
    const Facet& facet(std::uint32_t index) const noexcept { return facets_[index]; }
    /// Where a facet's vertex is, m.
    const Vec3& position(std::uint32_t vertex) const noexcept { return positions_[vertex]; }
    /// Where corner k of a facet is, m; k in [0, 2].                                        [any]
    Vec3 corner(std::uint32_t facet, int k) const noexcept {
        return positions_[facets_[facet].vertex[k]];
    }
    /// The face of its connected part that a side of a facet (+1 or -1) belongs to, +1 or -1: the
    /// same for sides between which one can walk without going round a border, and for those of a
    /// facet that is there twice which lie on one side of it. Of most of the
    /// part's area it is the side itself; of all, where all facets are oriented alike. The other
    /// way round, it gives the side that belongs to a face. A strip that twists has one face in
    /// truth; there it depends on the way. [any]
    std::int8_t face(std::uint32_t facet, std::int8_t side) const noexcept {
        return static_cast<std::int8_t>(facets_[facet].face * side);
    }
    /// Whether no other facet is linked over an edge in [0, 2].                             [any]
    bool is_border(std::uint32_t facet, int edge) const noexcept {
        return facets_[facet].neighbour[edge] == facet;
    }

    /// The fan about a corner of a facet that is seen from `side`, that facet first. False when it
    /// has more than Fan::kCapacity facets, then it is cut off; no such vertex is left to facets
    /// that are not singular. [any]
    bool fan(std::uint32_t facet, std::int8_t side, std::uint8_t corner,
             Fan& around) const noexcept;

private:
    void weld(const TriangleMesh& mesh);
    void link_edges();
    void tell_faces();
    void match_doubled();
    void mark_vertices();

    std::vector<Facet> facets_;
    std::vector<Vec3> positions_;
};

} // namespace palpate
