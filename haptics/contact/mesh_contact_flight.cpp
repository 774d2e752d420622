// SPDX-License-Identifier: Apache-2.0
// How a MeshContact flies: along a ray to the first facet, exactly onto it when that is certified,
// to a skin's distance when not.
#include <palpate/haptics/contact/mesh_contact.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace palpate {
namespace {

// A point this near to the skin's height is as good as there.
constexpr double kNearlySkin = 0.99;
// Looks at what else is near before a flight ends where it began.
constexpr int kPullBacks = 4;
// A flight along an uncertain facet stops this many skins before meeting it.
constexpr double kGrazingSkins = 2.0;
// Off a certified facet by this many tolerances, rounding does not reach it.
constexpr double kTellsSides = 4.0;
// A height above a facet's plane below this share of the tolerance does not tell the side.
constexpr double kSideShare = 0.1;

} // namespace

std::optional<SurfaceHit> MeshContact::first_hit(const Vec3& from, const Vec3& to) noexcept {
    std::array<std::uint32_t, Fan::kCapacity> except;
    for (std::size_t i = 0; i < now_.leaving.size(); ++i)
        except[i] = now_.leaving[i].facet;
    SegmentOptions options;
    options.except = {except.data(), now_.leaving.size()};
    if (mesh_->uncertain_count() > 0) options.widened = mesh_->uncertain();
    ++queries_;
    return mesh_->scene().first_hit(from, to, options);
}

std::optional<SurfaceHit> MeshContact::closest_point(const Vec3& point, double radius_m) noexcept {
    ++queries_;
    return mesh_->scene().closest_point(point, radius_m);
}

/// Sets now_.leg to the part of the chord that is free, and returns which share that is.
double MeshContact::fly(const Vec3& from, const Vec3& to) noexcept {
    now_.leg = {Leg::Kind::flight, from, to, false, {}, -1.0};
    if (!SurfaceScene::answers_at(from) || !SurfaceScene::answers_at(to)) {
        if (mesh_->scene().is_away(from, to)) return 1.0;
        now_.leg.to = from; // what is between, nobody can say
        return 0.0;
    }
    const bool uncertain = mesh_->uncertain_count() > 0;
    const double margin = uncertain ? skin_m_ : tolerance_m_;
    if (now_.mode == Mode::airborne && now_.guards.size() == 0 &&
        glm::length(to - now_.ball_center) < now_.ball_radius_m - margin)
        return 1.0;

    if (const std::optional<SurfaceHit> hit = first_hit(from, to)) {
        if (!mesh_->certified(hit->triangle)) return stop_above(from, to, *hit);
        land(from, *hit);
        const double share = std::min(1.0, hit->distance_m / glm::length(to - from));
        // Where a facet is as thin as a hair, the point of it that was met is known less well along
        // it than across. What arrives there has arrived.
        const Vec3 reached = from + share * (to - from);
        if (glm::length(reached - now_.leg.to) > tolerance_m_) now_.leg.to = reached;
        return share;
    }
    const std::optional<SurfaceHit> near = closest_point(to, kBallRadius);
    now_.leg.clear_m = near ? near->distance_m : kBallRadius;
    if (!near) return 1.0;
    if (!mesh_->certified(near->triangle)) return stop_clear(from, to, 1.0);
    if (near->distance_m < tolerance_m_) {
        land(from, *near);
        now_.leg.to = to; // it touches: to the spot it is less than nothing
    }
    return 1.0;
}

/// The flight ends on a certified facet.
void MeshContact::land(const Vec3& from, const SurfaceHit& hit) noexcept {
    now_.leg.lands = true;
    now_.leg.spot = walk_.spot_at(hit.triangle, 1, hit.position);
    now_.leg.spot.side = side_of_hit(now_.leg.spot, from);
    now_.leg.to = now_.leg.spot.position;
}

/// From which side a flight that came from `from` meets a spot.
std::int8_t MeshContact::side_of_hit(const MeshSpot& spot, const Vec3& from) const noexcept {
    const MeshTopology& topology = mesh_->topology();
    const Facet& facet = topology.facet(spot.facet);
    const double height = glm::dot(facet.normal, from - topology.corner(spot.facet, 0));
    if (std::abs(height) > kSideShare * tolerance_m_) {
        if (spot.feature == MeshSpot::Feature::face) return height < 0.0 ? -1 : 1;
        // Of a sharp wedge that is met exactly on its edge, one facet is seen from behind though
        // the start is in front: the nearest feature tells, where it is not too near to tell.
        MeshSpot front = spot;
        front.side = 1;
        const Heading to = walk_.heading(front, from - spot.position);
        const bool tells = !to.on_border && std::abs(to.height_m) > kSideShare * tolerance_m_;
        return (tells ? to.height_m : height) < 0.0 ? -1 : 1;
    }
    // So near to its plane that rounding would tell: the label of the facet itself is still there,
    // where another surface cut the flight off; from a neighbour, it goes over the edge.
    for (std::size_t i = 0; i < now_.leaving.size(); ++i) {
        if (now_.leaving[i].facet == spot.facet) return now_.leaving[i].side;
        const Facet& left = topology.facet(now_.leaving[i].facet);
        for (int k = 0; k < 3; ++k)
            if (left.neighbour[k] == spot.facet)
                return static_cast<std::int8_t>(now_.leaving[i].side * left.turn[k]);
    }
    return walk_.side_seen_from(spot, from);
}

/// Stops where the chord is a skin above an uncertain facet's plane, and remembers that plane.
double MeshContact::stop_above(const Vec3& from, const Vec3& to, const SurfaceHit& hit) noexcept {
    const MeshTopology& topology = mesh_->topology();
    const MeshSpot spot = walk_.spot_at(hit.triangle, 1, hit.position);
    const Vec3 normal = walk_.outward(hit.triangle, side_of_hit(spot, from));
    const Vec3 corner = topology.corner(hit.triangle, 0);
    const double height_from = glm::dot(normal, from - corner);
    const double height_to = glm::dot(normal, to - corner);
    const double length = glm::length(to - from);
    double share = std::max(0.0, (hit.distance_m - kGrazingSkins * skin_m_) / length);
    if (height_from - height_to > tolerance_m_)
        share = std::clamp((height_from - skin_m_) / (height_from - height_to), 0.0,
                           std::min(1.0, hit.distance_m / length));
    share = stop_clear(from, to, share);
    const double height = std::min(skin_m_, glm::dot(normal, now_.leg.to - corner));
    guard(corner + height * normal, normal, hit.triangle, now_.leg.to);
    return share;
}

/// Back along the chord to where nothing uncertain is nearer than the skin.
double MeshContact::stop_clear(const Vec3& from, const Vec3& to, double share) noexcept {
    now_.leg.lands = false;
    now_.leg.clear_m = 0.0;
    for (int i = 0; i <= kPullBacks; ++i) {
        now_.leg.to = from + share * (to - from);
        if (share == 0.0) break;
        const std::optional<SurfaceHit> near = closest_point(now_.leg.to, kNearlySkin * skin_m_);
        if (!near) return share;
        // Nearer to a certified facet than that, a later flight could not tell its sides.
        if (mesh_->certified(near->triangle)) {
            if (near->distance_m > kTellsSides * tolerance_m_) return share;
            break;
        }
        if (i == kPullBacks) break;

        const Vec3 away = now_.leg.to - near->position;
        const MeshSpot spot = walk_.spot_at(near->triangle, 1, near->position);
        const bool on_face = spot.feature == MeshSpot::Feature::face;
        const Vec3 normal = on_face || near->distance_m < tolerance_m_
                                ? walk_.outward(near->triangle, side_of_hit(spot, from))
                                : away / near->distance_m;
        const double height_from = glm::dot(normal, from - near->position);
        const double height_to = glm::dot(normal, away);
        share = height_from > skin_m_ && height_from > height_to
                    ? share * (height_from - skin_m_) / (height_from - height_to)
                    : 0.0;
        const Vec3 back = from + share * (to - from);
        const double height = std::min(skin_m_, glm::dot(normal, back - near->position));
        guard(near->position + height * normal, normal,
              on_face ? near->triangle : GuardPlanes::kNoFacet, back);
    }
    now_.leg.to = from;
    return 0.0;
}

} // namespace palpate
