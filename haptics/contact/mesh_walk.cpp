// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/contact/mesh_walk.h>

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// Points this share of the tolerance from an edge or vertex are on it: less than what counts as a
// movement, so that a proxy put onto an edge stays there.
constexpr double kSnapShare = 0.25;

using Feature = MeshSpot::Feature;
using Toward = Heading::Toward;

/// Takes over a heading that leads farther along the surface; of equals, one into free space.
void prefer(Heading& best, const Heading& other) noexcept {
    if (other.reach_m > best.reach_m ||
        (other.reach_m == best.reach_m && other.height_m > best.height_m))
        best = other;
}

double angle_between(const Vec3& u, const Vec3& v) noexcept {
    return std::atan2(glm::length(glm::cross(u, v)), glm::dot(u, v));
}

} // namespace

MeshWalk::MeshWalk(const CertifiedMesh& mesh) noexcept
    : mesh_(mesh), topology_(mesh.topology()), tolerance_m_(mesh.tolerance_m()),
      snap_m_(kSnapShare * mesh.tolerance_m()) {}

Heading MeshWalk::heading(const MeshSpot& spot, const Vec3& vector) const noexcept {
    switch (spot.feature) {
    case Feature::face:
        return heading_of_face(spot, vector);
    case Feature::edge:
        return heading_of_edge(spot, vector);
    default:
        return heading_of_vertex(spot, vector);
    }
}

Heading MeshWalk::heading_of_face(const MeshSpot& spot, const Vec3& vector) const noexcept {
    const Vec3& n = topology_.facet(spot.facet).normal;
    const double height = glm::dot(n, vector);
    Heading heading;
    heading.toward = Toward::face;
    heading.facet = spot.facet;
    heading.side = spot.side;
    heading.reach_m = glm::length(vector - height * n);
    heading.height_m = spot.side * height;
    return heading;
}

Heading MeshWalk::heading_of_edge(const MeshSpot& spot, const Vec3& vector) const noexcept {
    const Facet& here = topology_.facet(spot.facet);
    const Vec3 from = topology_.corner(spot.facet, spot.index);
    const Vec3 along = glm::normalize(topology_.corner(spot.facet, (spot.index + 1) % 3) - from);

    Heading best;
    best.toward = Toward::edge;
    best.facet = spot.facet;
    best.side = spot.side;
    best.edge = spot.index;
    best.reach_m = std::abs(glm::dot(vector, along));

    const std::uint32_t other = here.neighbour[spot.index];
    const auto other_side = static_cast<std::int8_t>(spot.side * here.turn[spot.index]);
    const Vec3 outward_here = outward(spot.facet, spot.side);
    const Vec3 outward_there = outward(other, other_side);
    const bool border = other == spot.facet;
    // Beyond a border there is nothing: all of it is free space.
    const Vec3 beside = vector - glm::dot(vector, along) * along;
    best.height_m = border ? glm::length(beside) : glm::dot(outward_here + outward_there, vector);

    // Into the facet from its edge: the direction in its plane, away from the edge.
    const auto consider = [&](std::uint32_t facet, std::int8_t side, const Vec3& edge_direction) {
        const Vec3& n = topology_.facet(facet).normal;
        const double height = glm::dot(n, vector);
        const Vec3 flat = vector - height * n;
        if (!(glm::dot(glm::cross(n, edge_direction), flat) > 0.0)) return;
        Heading into;
        into.toward = Toward::face;
        into.facet = facet;
        into.side = side;
        into.reach_m = glm::length(flat);
        into.height_m = side * height;
        prefer(best, into);
    };
    consider(spot.facet, spot.side, along);
    // The neighbour's own edge runs the other way, unless it is oriented the other way round.
    const bool reversed = !border && here.turn[spot.index] < 0;
    consider(other, other_side, border || reversed ? along : -along);
    best.on_border = border;
    return best;
}

Heading MeshWalk::heading_of_vertex(const MeshSpot& spot, const Vec3& vector) const noexcept {
    Fan around;
    topology_.fan(spot.facet, spot.side, spot.index, around);
    Heading best;
    best.facet = spot.facet;
    best.side = spot.side;
    for (std::size_t i = 0; i < around.size(); ++i) {
        const FanFacet& one = around[i];
        const Vec3& n = topology_.facet(one.facet).normal;
        const Vec3 next = topology_.corner(one.facet, (one.corner + 1) % 3) - spot.position;
        const Vec3 previous = topology_.corner(one.facet, (one.corner + 2) % 3) - spot.position;
        const bool border = topology_.is_border(one.facet, one.exit_edge);
        if (border) best.on_border = true;

        const double height = glm::dot(n, vector);
        const Vec3 flat = vector - height * n;
        Heading into;
        into.facet = one.facet;
        into.side = one.side;
        into.on_border = best.on_border;
        if (glm::dot(glm::cross(n, next), flat) > 0.0 &&
            glm::dot(glm::cross(previous, n), flat) > 0.0) {
            into.toward = Toward::face;
            into.reach_m = glm::length(flat);
            into.height_m = one.side * height;
            prefer(best, into);
            continue;
        }
        // The edge that this facet shares with the next one.
        const Vec3& edge = one.exit_edge == one.corner ? next : previous;
        const double product = glm::dot(vector, edge);
        if (!(product > 0.0)) continue;
        const double along = product / glm::length(edge);
        const FanFacet& after = around[(i + 1) % around.size()];
        into.toward = Toward::edge;
        into.edge = one.exit_edge;
        into.reach_m = along;
        into.height_m =
            border
                ? glm::length(vector - along * glm::normalize(edge))
                : glm::dot(outward(one.facet, one.side) + outward(after.facet, after.side), vector);
        prefer(best, into);
    }
    if (best.toward == Toward::apex)
        best.height_m = best.on_border ? glm::length(vector)
                                       : glm::dot(mean_outward(around, spot.position), vector);
    return best;
}

/// The sum of a fan's normals, each times its angle: tells in front from behind at a vertex.
Vec3 MeshWalk::mean_outward(const Fan& around, const Vec3& vertex) const noexcept {
    Vec3 mean{0.0};
    for (std::size_t i = 0; i < around.size(); ++i) {
        const FanFacet& one = around[i];
        const Vec3 next = topology_.corner(one.facet, (one.corner + 1) % 3) - vertex;
        const Vec3 previous = topology_.corner(one.facet, (one.corner + 2) % 3) - vertex;
        mean += angle_between(next, previous) * outward(one.facet, one.side);
    }
    return mean;
}

bool MeshWalk::rests_in_facet(const MeshSpot& spot, const Vec3& pull) const noexcept {
    if (spot.feature != Feature::face) return false;
    const Heading to = heading_of_face(spot, pull - spot.position);
    return !(to.height_m > tolerance_m_) && !(to.reach_m > tolerance_m_);
}

WalkStep MeshWalk::step(const MeshSpot& spot, const Vec3& pull) const noexcept {
    WalkStep step;
    step.spot = spot;
    step.heading = heading(spot, pull - spot.position);
    const Heading& to = step.heading;
    if (to.height_m > tolerance_m_) {
        step.end = WalkStep::End::lifts;
        return step;
    }
    if (to.toward == Toward::apex || !(to.reach_m > tolerance_m_)) return step;
    const bool certain = mesh_.certified(to.facet) ||
                         (to.toward == Toward::edge &&
                          mesh_.certified(topology_.facet(to.facet).neighbour[to.edge]));
    if (!certain) {
        step.end = WalkStep::End::uncertain;
        return step;
    }
    step.end = WalkStep::End::arrives;
    step.spot = to.toward == Toward::face ? across_face(spot, to, pull) : along_edge(to, pull);
    return step;
}

/// Towards the foot of `pull` on the facet's plane, as far as the facet goes.
MeshSpot MeshWalk::across_face(const MeshSpot& spot, const Heading& heading,
                               const Vec3& pull) const noexcept {
    const Facet& facet = topology_.facet(heading.facet);
    const Vec3 corner[3] = {topology_.corner(heading.facet, 0), topology_.corner(heading.facet, 1),
                            topology_.corner(heading.facet, 2)};
    // From the pull alone, so that a held probe means the same bits.
    const Vec3 foot = pull - glm::dot(facet.normal, pull - corner[0]) * facet.normal;

    // The edges that the spot is on cannot be the way out of a facet that the heading leads into.
    const auto contains_spot = [&](int edge) {
        if (spot.feature == Feature::face) return false;
        const Facet& of = topology_.facet(spot.facet);
        const std::uint32_t a = facet.vertex[edge], b = facet.vertex[(edge + 1) % 3];
        if (spot.feature == Feature::vertex) {
            const std::uint32_t at = of.vertex[spot.index];
            return a == at || b == at;
        }
        const std::uint32_t p = of.vertex[spot.index], q = of.vertex[(spot.index + 1) % 3];
        return (a == p && b == q) || (a == q && b == p);
    };
    double leaves_at = 1.0;
    int exit = -1, nearest = -1;
    double nearest_squared = snap_m_ * snap_m_;
    for (int k = 0; k < 3; ++k) {
        const Vec3 edge = corner[(k + 1) % 3] - corner[k];
        const Vec3 inward = glm::cross(facet.normal, edge);
        const double end = glm::dot(inward, foot - corner[k]);
        const bool stays = end >= 0.0 || contains_spot(k);
        if (stays && end * end < nearest_squared * squared_length(edge)) {
            nearest_squared = end * end / squared_length(edge);
            nearest = k;
        }
        if (stays) continue;
        const double start = std::max(0.0, glm::dot(inward, spot.position - corner[k]));
        const double share = start / (start - end);
        if (share < leaves_at) {
            leaves_at = share;
            exit = k;
        }
    }
    const int edge = exit >= 0 ? exit : nearest;
    if (edge < 0) return {foot, heading.facet, heading.side, Feature::face, 0};
    const Vec3 reached = exit >= 0 ? spot.position + leaves_at * (foot - spot.position) : foot;
    const Vec3 along = corner[(edge + 1) % 3] - corner[edge];
    return on_edge(heading.facet, heading.side, static_cast<std::uint8_t>(edge),
                   glm::dot(reached - corner[edge], along) / squared_length(along));
}

/// Towards the point of the edge's line that is nearest to `pull`, as far as the edge goes.
MeshSpot MeshWalk::along_edge(const Heading& heading, const Vec3& pull) const noexcept {
    const Vec3 from = topology_.corner(heading.facet, heading.edge);
    const Vec3 along = topology_.corner(heading.facet, (heading.edge + 1) % 3) - from;
    return on_edge(heading.facet, heading.side, heading.edge,
                   glm::dot(pull - from, along) / squared_length(along));
}

MeshSpot MeshWalk::on_edge(std::uint32_t facet, std::int8_t side, std::uint8_t edge,
                           double share) const noexcept {
    const Vec3 from = topology_.corner(facet, edge);
    const Vec3 to = topology_.corner(facet, (edge + 1) % 3);
    const double snap = snap_m_ / glm::length(to - from);
    if (!(share > snap)) return at_corner(facet, side, edge);
    if (share > 1.0 - snap)
        return at_corner(facet, side, static_cast<std::uint8_t>((edge + 1) % 3));
    // From one end whichever facet asks, so that both get the same bits.
    const Facet& of = topology_.facet(facet);
    const bool ascending = of.vertex[edge] < of.vertex[(edge + 1) % 3];
    const Vec3 position = ascending ? from + share * (to - from) : to + (1.0 - share) * (from - to);
    return {position, facet, side, Feature::edge, edge};
}

MeshSpot MeshWalk::at_corner(std::uint32_t facet, std::int8_t side,
                             std::uint8_t corner) const noexcept {
    return {topology_.corner(facet, corner), facet, side, Feature::vertex, corner};
}

MeshSpot MeshWalk::spot_at(std::uint32_t facet, std::int8_t side,
                           const Vec3& point) const noexcept {
    int nearest = -1;
    double nearest_m = snap_m_;
    for (int k = 0; k < 3; ++k) {
        const Vec3 from = topology_.corner(facet, k);
        const Vec3 edge = topology_.corner(facet, (k + 1) % 3) - from;
        const Vec3 inward = glm::cross(topology_.facet(facet).normal, edge);
        const double distance = glm::dot(inward, point - from) / glm::length(edge);
        if (distance >= nearest_m) continue;
        nearest_m = distance;
        nearest = k;
    }
    if (nearest < 0) return {point, facet, side, Feature::face, 0};
    const Vec3 from = topology_.corner(facet, nearest);
    const Vec3 edge = topology_.corner(facet, (nearest + 1) % 3) - from;
    return on_edge(facet, side, static_cast<std::uint8_t>(nearest),
                   glm::dot(point - from, edge) / squared_length(edge));
}

std::int8_t MeshWalk::side_seen_from(const MeshSpot& spot, const Vec3& seen_from) const noexcept {
    const Vec3 back = seen_from - spot.position;
    const double height = glm::dot(topology_.facet(spot.facet).normal, back);
    if (spot.feature == Feature::face) return height < 0.0 ? -1 : 1;
    MeshSpot front = spot;
    front.side = 1;
    const Heading to = heading(front, back);
    if (to.on_border) return height < 0.0 ? -1 : 1;
    return to.height_m < 0.0 ? -1 : 1;
}

void MeshWalk::facets_at(const MeshSpot& spot, Fan& facets) const noexcept {
    if (spot.feature == Feature::vertex) {
        topology_.fan(spot.facet, spot.side, spot.index, facets);
        return;
    }
    facets.clear();
    facets.add({spot.facet, spot.side, 0, 0});
    if (spot.feature == Feature::face) return;
    const Facet& here = topology_.facet(spot.facet);
    if (here.neighbour[spot.index] == spot.facet) return;
    const auto side = static_cast<std::int8_t>(spot.side * here.turn[spot.index]);
    facets.add({here.neighbour[spot.index], side, 0, 0});
}

} // namespace palpate
