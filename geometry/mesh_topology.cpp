// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/mesh_topology.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace palpate {
namespace {

/// One side of a facet, keyed by its vertices in ascending order.
struct HalfEdge {
    std::uint32_t low, high;
    std::uint32_t facet;
    std::uint8_t edge;
    bool ascending; // runs from low to high
    bool dropped;   // the facet has no area
};

bool same_edge(const HalfEdge& a, const HalfEdge& b) noexcept {
    return a.low == b.low && a.high == b.high;
}

bool before(const HalfEdge& a, const HalfEdge& b) noexcept {
    if (a.low != b.low) return a.low < b.low;
    if (a.high != b.high) return a.high < b.high;
    if (a.dropped != b.dropped) return b.dropped;
    return a.facet < b.facet;
}

bool lexicographic(const Vec3& a, const Vec3& b) noexcept {
    if (a.x != b.x) return a.x < b.x;
    if (a.y != b.y) return a.y < b.y;
    return a.z < b.z;
}

} // namespace

MeshTopology::MeshTopology(const TriangleMesh& mesh) {
    if (mesh.triangles.size() > std::numeric_limits<std::int32_t>::max())
        throw std::invalid_argument("mesh has more than 2^31 triangles; use a coarser one");
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (const std::uint32_t v : mesh.triangles[t])
            if (v >= mesh.vertices.size())
                throw std::invalid_argument("triangle " + std::to_string(t) + " names vertex " +
                                            std::to_string(v) + " of " +
                                            std::to_string(mesh.vertices.size()) +
                                            "; make every index smaller than the vertex count");
    facets_.resize(mesh.triangles.size());
    weld(mesh);
    link_edges();
    tell_faces();
    match_doubled();
    mark_vertices();
}

/// Vertices at bit-equal positions become one: files without shared vertices (STL) have neighbours,
/// too.
void MeshTopology::weld(const TriangleMesh& mesh) {
    std::vector<std::uint32_t> order(mesh.vertices.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        const Vec3 &p = mesh.vertices[a], &q = mesh.vertices[b];
        return p == q ? a < b : lexicographic(p, q);
    });
    std::vector<std::uint32_t> name(mesh.vertices.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        const bool again = i > 0 && mesh.vertices[order[i]] == mesh.vertices[order[i - 1]];
        name[order[i]] = again ? name[order[i - 1]] : order[i];
    }
    positions_ = mesh.vertices;
    for (std::size_t t = 0; t < facets_.size(); ++t) {
        Facet& facet = facets_[t];
        for (int k = 0; k < 3; ++k)
            facet.vertex[k] = name[mesh.triangles[t][k]];
        facet.neighbour.fill(static_cast<std::uint32_t>(t));
        facet.turn.fill(-1);
        facet.shared_edge = {0, 1, 2};
        facet.normal = triangle_normal(positions_[facet.vertex[0]], positions_[facet.vertex[1]],
                                       positions_[facet.vertex[2]]);
    }
}

void MeshTopology::link_edges() {
    std::vector<HalfEdge> edges;
    edges.reserve(3 * facets_.size());
    for (std::uint32_t t = 0; t < facets_.size(); ++t)
        for (std::uint8_t k = 0; k < 3; ++k) {
            const std::uint32_t from = facets_[t].vertex[k], to = facets_[t].vertex[(k + 1) % 3];
            edges.push_back(
                {std::min(from, to), std::max(from, to), t, k, from < to, facets_[t].dropped()});
        }
    std::sort(edges.begin(), edges.end(), before);

    for (std::size_t first = 0; first < edges.size();) {
        std::size_t last = first, usable = 0;
        for (; last < edges.size() && same_edge(edges[first], edges[last]); ++last)
            if (!edges[last].dropped) ++usable;
        const std::size_t dropped = last - first - usable;
        if (usable == 2) {
            const HalfEdge &a = edges[first], &b = edges[first + 1];
            const std::int8_t turn = a.ascending == b.ascending ? -1 : 1;
            facets_[a.facet].neighbour[a.edge] = b.facet;
            facets_[b.facet].neighbour[b.edge] = a.facet;
            facets_[a.facet].shared_edge[a.edge] = b.edge;
            facets_[b.facet].shared_edge[b.edge] = a.edge;
            facets_[a.facet].turn[a.edge] = facets_[b.facet].turn[b.edge] = turn;
        } else if (usable > 2 || (usable == 1 && dropped > 0)) {
            // Not a border: beyond a facet without area the surface goes on.
            for (std::size_t e = first; e < first + usable; ++e)
                facets_[edges[e].facet].singular = true;
        }
        first = last;
    }
}

/// From the first facet of each connected part over its edges; then so that most of its area has
/// the faces of its sides.
void MeshTopology::tell_faces() {
    std::vector<bool> is_told(facets_.size(), false);
    std::vector<std::uint32_t> part;
    for (std::uint32_t first = 0; first < facets_.size(); ++first) {
        if (is_told[first]) continue;
        is_told[first] = true;
        facets_[first].part = first;
        part.assign(1, first);
        double area_m2 = 0.0; // twice that of facets as they are, less that of the others
        for (std::size_t i = 0; i < part.size(); ++i) {
            const Facet& facet = facets_[part[i]];
            const Vec3 a = corner(part[i], 0);
            area_m2 += facet.face *
                       glm::length(glm::cross(corner(part[i], 1) - a, corner(part[i], 2) - a));
            for (int edge = 0; edge < 3; ++edge) {
                const std::uint32_t next = facet.neighbour[edge];
                if (is_told[next]) continue; // at a border it is the facet itself
                is_told[next] = true;
                facets_[next].part = first;
                facets_[next].face = static_cast<std::int8_t>(facet.face * facet.turn[edge]);
                part.push_back(next);
            }
        }
        if (area_m2 >= 0.0) continue;
        for (const std::uint32_t facet : part)
            facets_[facet].face = static_cast<std::int8_t>(-facets_[facet].face);
    }
}

/// A facet that is there again, as in meshes with two sides, lies on the first one, however it is
/// wound: they have the same two faces.
void MeshTopology::match_doubled() {
    struct Corners {
        std::array<std::uint32_t, 3> vertices; // in order
        std::uint32_t facet;
        std::int8_t wound; // whether that order is the facet's: +1, -1
    };
    std::vector<Corners> all;
    for (std::uint32_t t = 0; t < facets_.size(); ++t) {
        if (!facets_[t].singular) continue; // its edges have more than two facets
        Corners one{facets_[t].vertex, t, 1};
        for (const std::size_t k : {0, 1, 0})
            if (one.vertices[k] > one.vertices[k + 1]) {
                std::swap(one.vertices[k], one.vertices[k + 1]);
                one.wound = static_cast<std::int8_t>(-one.wound);
            }
        all.push_back(one);
    }
    std::sort(all.begin(), all.end(), [](const Corners& a, const Corners& b) {
        return std::tie(a.vertices, a.facet) < std::tie(b.vertices, b.facet);
    });
    for (std::size_t i = 1; i < all.size(); ++i) {
        const Corners &before = all[i - 1], &one = all[i];
        if (one.vertices == before.vertices)
            facets_[one.facet].face =
                static_cast<std::int8_t>(facets_[before.facet].face * before.wound * one.wound);
    }
}

/// A vertex whose facets make several fans, or too many facets, is no place to walk round.
void MeshTopology::mark_vertices() {
    std::vector<std::uint32_t> facets_at(positions_.size(), 0);
    std::vector<std::uint8_t> visited(positions_.size(), 0), odd(positions_.size(), 0);
    for (const Facet& facet : facets_)
        if (!facet.dropped())
            for (const std::uint32_t v : facet.vertex)
                ++facets_at[v];

    Fan around;
    for (std::uint32_t t = 0; t < facets_.size(); ++t)
        for (std::uint8_t k = 0; k < 3; ++k) {
            const std::uint32_t v = facets_[t].vertex[k];
            if (facets_[t].dropped() || visited[v]) continue;
            visited[v] = 1;
            if (!fan(t, 1, k, around)) {
                odd[v] = 1;
                continue;
            }
            // Over a border, and round a strip that twists, every facet comes twice.
            std::size_t distinct = 0;
            for (std::size_t i = 0; i < around.size(); ++i) {
                bool again = false;
                for (std::size_t j = 0; j < i && !again; ++j)
                    again = around[j].facet == around[i].facet;
                if (!again) ++distinct;
            }
            if (distinct != facets_at[v]) odd[v] = 1;
        }
    for (Facet& facet : facets_)
        for (const std::uint32_t v : facet.vertex)
            if (odd[v]) facet.singular = true;
}

bool MeshTopology::fan(std::uint32_t facet, std::int8_t side, std::uint8_t corner,
                       Fan& around) const noexcept {
    around.clear();
    FanFacet now{facet, side, corner, corner};
    do {
        if (!around.add(now)) return false;
        const Facet& here = facets_[now.facet];
        const std::uint8_t entry = here.shared_edge[now.exit_edge];
        FanFacet next;
        next.facet = here.neighbour[now.exit_edge];
        next.side = static_cast<std::int8_t>(now.side * here.turn[now.exit_edge]);
        const Facet& there = facets_[next.facet];
        const std::uint32_t vertex = here.vertex[now.corner];
        // An edge has two ends; the corner is at ours.
        next.corner =
            there.vertex[entry] == vertex ? entry : static_cast<std::uint8_t>((entry + 1) % 3);
        const auto before_corner = static_cast<std::uint8_t>((next.corner + 2) % 3);
        next.exit_edge = entry == next.corner ? before_corner : next.corner;
        now = next;
    } while (now.facet != facet || now.side != side || now.exit_edge != corner);
    return true;
}

} // namespace palpate
