// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/certified_mesh.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include <palpate/geometry/internal/triangle_distance.h>

namespace palpate {
namespace {

// What keeps this distance from facets is farther away than cracks that are closed are wide.
constexpr double kSkinOverWidening = 2.0;
// 1e5 roundings at 50 mm, and a millionth of a haptic device's count.
constexpr double kToleranceShare = 2.0e-11;
constexpr double kToleranceRoundings = 1000.0;
// Neighbours closer than this to lying on each other, rad: the sum of their normals says nothing.
constexpr double kSmallestFold = 1.0e-6;
// Rounding of a cheap look at two facets cannot make up for so much more room.
constexpr double kSureRoom = 2.0;

internal::Corners3 corners(const MeshTopology& topology, std::uint32_t facet, int first = 0) {
    return {topology.corner(facet, first), topology.corner(facet, (first + 1) % 3),
            topology.corner(facet, (first + 2) % 3)};
}

Box box_of(const internal::Corners3& t) {
    Box box;
    for (const Vec3& p : {t.a, t.b, t.c})
        box.add(p);
    return box;
}

/// Made in another thread, while this one builds the scene.
std::future<MeshTopology> topology_beside(std::shared_ptr<const TriangleMesh> mesh) {
    if (!mesh) return {}; // which the scene refuses
    return std::async(std::launch::async, [mesh] { return MeshTopology(*mesh); });
}

bool farther_than(const Box& a, const Box& b, double distance) {
    const Vec3 gap = glm::max(glm::max(a.lower - b.upper, b.lower - a.upper), 0.0);
    return squared_length(gap) > distance * distance;
}

} // namespace

CertifiedMesh::CertifiedMesh(std::shared_ptr<const TriangleMesh> mesh, Certificates certificates)
    : CertifiedMesh(mesh, topology_beside(mesh), certificates) {}

CertifiedMesh::CertifiedMesh(std::shared_ptr<const TriangleMesh> mesh,
                             std::future<MeshTopology> topology, Certificates certificates)
    : scene_(std::move(mesh)), topology_(topology.get()),
      skin_m_(kSkinOverWidening * scene_.widening_m()), uncertain_(topology_.facet_count(), 0) {
    Box bounds;
    for (std::uint32_t f = 0; f < topology_.facet_count(); ++f)
        if (!topology_.facet(f).dropped())
            for (int k = 0; k < 3; ++k)
                bounds.add(topology_.corner(f, k));
    const Vec3 half = 0.5 * bounds.extent();
    tolerance_m_ = std::max(kToleranceShare * std::max({half.x, half.y, half.z}),
                            kToleranceRoundings * scene_.query_error_m());
    if (certificates == Certificates::computed) certify();
    uncertain_count_ = static_cast<std::size_t>(
        std::count_if(uncertain_.begin(), uncertain_.end(), [](auto mark) { return mark != 0; }));
    // Of uncertain facets an edge without a neighbour may be a crack.
    for (std::uint32_t f = 0; f < topology_.facet_count(); ++f)
        for (int k = 0; k < 3; ++k) {
            if (!certified(f) || !topology_.is_border(f, k)) continue;
            has_border_ = true;
            open_parts_.resize(topology_.facet_count());
            open_parts_[topology_.facet(f).part] = true;
        }
}

/// Marks facets that are in each other's way.
void CertifiedMesh::certify() {
    const auto mark = [&](std::uint32_t f) {
        std::atomic_ref(uncertain_[f]).store(1, std::memory_order_relaxed);
    };
    const auto marked = [&](std::uint32_t f) {
        return std::atomic_ref(uncertain_[f]).load(std::memory_order_relaxed) != 0;
    };
    for (std::uint32_t f = 0; f < topology_.facet_count(); ++f)
        if (topology_.facet(f).dropped() || topology_.facet(f).singular) mark(f);
    // Dropped facets have no area, so the scene does not have them.
    scene_.for_pairs_near([&](std::uint32_t facet, std::uint32_t other) {
        // Nothing would change. Where a surface touches itself thousands of facets may lie within
        // the clearance, and each of them is in the way of all.
        if (marked(facet) && marked(other)) return;
        if (farther_than(box_of(corners(topology_, facet)), box_of(corners(topology_, other)),
                         clearance_m()) ||
            clear_of_each_other(facet, other))
            return;
        mark(facet);
        mark(other);
    });
    spread_false_borders();
}

/// An edge without a neighbour is a border only where its facet is certified; elsewhere the surface
/// goes on beyond it, unlinked, and no facet with a vertex there can be walked round.
void CertifiedMesh::spread_false_borders() {
    std::vector<std::uint32_t> ends;
    for (std::uint32_t f = 0; f < topology_.facet_count(); ++f)
        for (int k = 0; k < 3; ++k)
            if (uncertain_[f] && !topology_.facet(f).dropped() && topology_.is_border(f, k)) {
                ends.push_back(topology_.facet(f).vertex[k]);
                ends.push_back(topology_.facet(f).vertex[(k + 1) % 3]);
            }
    std::sort(ends.begin(), ends.end());
    for (std::uint32_t f = 0; f < topology_.facet_count(); ++f)
        for (const std::uint32_t v : topology_.facet(f).vertex)
            if (!ends.empty() && std::binary_search(ends.begin(), ends.end(), v)) uncertain_[f] = 1;
}

/// Whether what two facets do not share keeps its distance.
bool CertifiedMesh::clear_of_each_other(std::uint32_t facet, std::uint32_t other) const {
    const Facet &f = topology_.facet(facet), &g = topology_.facet(other);
    const auto has = [](const Facet& of, std::uint32_t vertex) {
        return vertex == of.vertex[0] || vertex == of.vertex[1] || vertex == of.vertex[2];
    };
    const int shared = has(g, f.vertex[0]) + has(g, f.vertex[1]) + has(g, f.vertex[2]);
    // The odd corner of each: the one shared, or of two shared the one that is not.
    int own_f = 0, own_g = 0;
    for (int k = 0; k < 3; ++k) {
        if (has(g, f.vertex[k]) == (shared == 1)) own_f = k;
        if (has(f, g.vertex[k]) == (shared == 1)) own_g = k;
    }
    const internal::Corners3 s = corners(topology_, facet, own_f);
    const internal::Corners3 t = corners(topology_, other, own_g);
    const double room = clearance_m(), sure = kSureRoom * room;
    switch (shared) {
    case 0:
        return internal::told_apart(s, t, sure) || internal::triangle_distance(s, t) >= room;
    case 1: // the edge opposite to the shared corner is what may be in the way
        return internal::told_apart_at_corner(s, t, sure) ||
               (internal::segment_triangle_distance(s.b, s.c, t) >= room &&
                internal::segment_triangle_distance(t.b, t.c, s) >= room);
    case 2: {
        const Vec3 &apex_f = s.a, &apex_g = t.a, &from = s.b;
        if (internal::told_apart_at_edge(from, s.c, apex_f, apex_g, sure)) return true;
        const Vec3 on_t = closest_point_on_triangle(apex_f, t.a, t.b, t.c);
        const Vec3 on_s = closest_point_on_triangle(apex_g, s.a, s.b, s.c);
        if (glm::length(on_t - apex_f) < room || glm::length(on_s - apex_g) < room) return false;
        // Folded shut: both go the same way from the shared edge.
        const Vec3 unit = glm::normalize(s.c - from);
        const auto inward = [&](const Vec3& apex) {
            const Vec3 d = apex - from;
            return glm::normalize(d - glm::dot(d, unit) * unit);
        };
        return glm::length(inward(apex_f) - inward(apex_g)) > kSmallestFold;
    }
    default:
        return false; // the same corners: two facets on each other
    }
}

} // namespace palpate
