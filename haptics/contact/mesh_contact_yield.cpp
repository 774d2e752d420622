// SPDX-License-Identifier: Apache-2.0
// A mesh that yields: what is felt behind it, and how the proxy comes out again.
//
// Behind the surface the contact goes on in front of it, as if the mesh had held: the front follows
// the proxy over the facets, and its distance from it is the depth. Play is a level at a depth.
#include <palpate/haptics/contact/mesh_contact.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace palpate {
namespace {

// Pieces of way that the front goes for one piece of the proxy's; the rest in the next.
constexpr int kFrontLegs = 64;
// A surface that yielded may be entered deeper by this, as volumes may (m).
constexpr double kHeldSlack = 25e-6;
// Longest step for which the surface behind is as flat as its plane (m).
constexpr double kHeldTrust = 1e-3;
// Longest chord before the front comes along (m).
constexpr double kHeldStride = 4e-3;
// Tolerances in front of a facet from which its side can be seen.
constexpr double kOffTheFacet = 4.0;

} // namespace

void MeshContact::set_gain(const Gain& gain) noexcept {
    now_.strength = SurfaceStrength::of(settings_.strength_n, settings_.yielding, gain);
    if (now_.strength.off) switch_off();
}

void MeshContact::open() noexcept {
    if (!now_.passed) pass_through(now_.proxy);
    now_.state = SurfaceState::inside;
}

/// As if open; a proxy that was in front of it still is.
void MeshContact::switch_off() noexcept {
    now_.state = SurfaceState::inside;
    if (now_.passed) return;
    now_.passed = now_.in_front = true;
    now_.front_side = 0;
    now_.seen = now_.proxy;
    // On a facet no ray would tell the side: looked at from a little off it.
    if (now_.mode == Mode::on_surface)
        now_.seen += kOffTheFacet * tolerance_m_ * walk_.outward(now_.spot.facet, now_.spot.side);
    now_.leg.kind = Leg::Kind::none;
}

double MeshContact::trust_m() const noexcept {
    return now_.passed ? kHeldTrust : std::numeric_limits<double>::infinity();
}

/// The surface gives way: from here on the label of its side is that of the front.
void MeshContact::pass_through(const Vec3& proxy) noexcept {
    if (now_.mode == Mode::on_surface) {
        now_.gone_through = now_.spot.facet;
        now_.front_side = mesh_->topology().face(now_.spot.facet, now_.spot.side);
    } else if (const auto near = closest_point(now_.proxy, kBallRadius)) {
        now_.gone_through = near->triangle;
        now_.front_side = face_seen_from(*near, now_.proxy);
    }
    now_.leg.kind = Leg::Kind::none;
    now_.passed = true;
    now_.in_front = false;
    now_.held_depth_m = 0.0;
    now_.seen = now_.proxy;
    now_.behind = now_.proxy;
    front_follows(proxy);
}

/// The front goes to where the mesh would hold a proxy that is drawn to `proxy`.
void MeshContact::front_follows(const Vec3& proxy) noexcept {
    now_.behind = proxy;
    now_.pull = proxy;
    for (int i = 0; i < kFrontLegs; ++i) {
        const SlideLeg leg =
            now_.mode == Mode::on_surface ? slide_on_surface(proxy) : slide_above(proxy);
        if (leg.end != SlideLeg::End::goes_on) return;
        follow(leg.corner, true);
    }
}

/// Whether the proxy is not behind any more: the front is where it is, and free.
bool MeshContact::front_reached(const Vec3& proxy) const noexcept {
    return now_.mode == Mode::airborne && glm::length(proxy - now_.proxy) <= tolerance_m_;
}

void MeshContact::offer_behind(const Vec3& proxy, ContactSet& contacts) noexcept {
    if (now_.state == SurfaceState::inside) return;
    if (proxy != now_.behind) front_follows(proxy);
    if (front_reached(proxy)) {
        now_.passed = false;
        now_.proxy = proxy;
        return;
    }
    const Vec3 out = now_.proxy - proxy;
    const double depth = glm::length(out);
    if (!(depth - now_.held_depth_m >= -settings_.free_m)) return;
    ContactPlane contact;
    contact.plane.normal = depth > tolerance_m_ ? out / depth
                           : now_.mode == Mode::on_surface
                               ? walk_.outward(now_.spot.facet, now_.spot.side)
                           : now_.guards.size() > 0 ? now_.guards[now_.guards.size() - 1].normal
                                                    : Vec3{0.0};
    contact.plane.anchor = proxy + (depth - now_.held_depth_m) * contact.plane.normal;
    contact.plane.strength_n = now_.strength.offered_n;
    contact.gradient_length = 1.0;
    if (contacts.add(contact)) ++offered_;
}

/// As far as the chord gets no deeper behind the plane across the way out: what yields anyway needs
/// no more.
Chord MeshContact::carry_behind(const Vec3& from, const Vec3& to) noexcept {
    if (now_.state == SurfaceState::inside) return {};
    if (from != now_.behind) front_follows(from);
    const double length = glm::length(to - from);
    const double stride = std::min(1.0, kHeldStride / length);
    const Vec3 out = now_.proxy - from;
    const double depth = glm::length(out);
    if (!(depth > tolerance_m_)) return {stride, false, stride < 1.0};
    const double deeper = -glm::dot(out, to - from) / depth;
    const double room = std::max(now_.held_depth_m + kHeldSlack - depth, tolerance_m_);
    if (stride * deeper > room) return {room / deeper, false};
    return {stride, false, stride < 1.0};
}

void MeshContact::commit_behind(const Vec3& proxy, bool yielded, bool felt) noexcept {
    look_back(proxy);
    if (now_.state != SurfaceState::inside && proxy != now_.behind) front_follows(proxy);
    const bool reached = front_reached(proxy);
    const bool has_yielded =
        now_.state == SurfaceState::yielded || now_.state == SurfaceState::inside;
    // A frame that was cut short may end behind the surface though its last evaluation asked it to
    // go back: it has given way all the same.
    if (!has_yielded && !now_.in_front && !reached) yielded = true;
    // On the other side of a thin body too, whose front it may still draw at with its strength.
    if (now_.in_front) yielded = false;
    // Nothing is inside a sheet.
    bool left = !now_.strength.off && (now_.in_front || mesh_->has_border(now_.gone_through));
    if (left && now_.state == SurfaceState::inside) left = !closest_point(proxy, settings_.free_m);
    now_.state = next_state(now_.state, {felt, yielded, now_.in_front || reached, left});
    if (now_.state == SurfaceState::inside) return;
    if (now_.state == SurfaceState::yielded) {
        const double depth_m = glm::length(now_.proxy - proxy);
        if (now_.strength.is_hard())
            now_.held_depth_m = std::min(now_.held_depth_m, depth_m); // hard again: only outwards
        else if (!felt || yielded)
            now_.held_depth_m = depth_m; // play: it holds where it was pushed to
        return;
    }
    now_.passed = false;
    now_.leaving.clear();
    now_.guards.clear();
    if (reached)
        now_.proxy = proxy;
    else
        alight(proxy, proxy + now_.front_normal);
}

/// On which side of the surface that it last went through the proxy is.
void MeshContact::look_back(const Vec3& proxy) noexcept {
    now_.leaving.clear();
    const Vec3 seen = std::exchange(now_.seen, proxy);
    const std::optional<SurfaceHit> hit = first_hit(proxy, seen);
    if (hit && now_.front_side == 0) {
        const std::optional<SurfaceHit> first = first_hit(seen, proxy);
        now_.front_side = face_seen_from(first ? *first : *hit, seen);
    }
    if (!hit) return;
    // A facet may be oriented the other way round than the one that was passed.
    const Vec3 front_normal =
        walk_.outward(hit->triangle, mesh_->topology().face(hit->triangle, now_.front_side));
    const double height_m = glm::dot(front_normal, proxy - hit->position);
    const double before_m = glm::dot(front_normal, seen - hit->position);
    // Along the facet, from a place on it to another one: rounding would say on which side.
    if (std::max(std::abs(height_m), std::abs(before_m)) < tolerance_m_) return;
    now_.gone_through = hit->triangle;
    now_.front_normal = front_normal;
    now_.in_front = height_m > 0.0;
    if (!now_.in_front) return;
    // In a groove what is in front of one wall's plane may be behind the other wall: the nearest
    // place of the surface tells.
    const double reach_m = glm::length(proxy - hit->position) + tolerance_m_;
    if (const auto near = closest_point(proxy, reach_m))
        now_.in_front = face_seen_from(*near, proxy) == now_.front_side;
}

/// The face of the mesh (MeshTopology::face) from which a point sees that place on it.
std::int8_t MeshContact::face_seen_from(const SurfaceHit& place, const Vec3& point) const noexcept {
    const std::int8_t side =
        walk_.side_seen_from(walk_.spot_at(place.triangle, 1, place.position), point);
    return mesh_->topology().face(place.triangle, side);
}

} // namespace palpate
