// SPDX-License-Identifier: Apache-2.0
// A mesh that yields: what is felt behind it, and how the proxy comes out again.
//
// Behind the surface the contact goes on in front of it, as if the mesh had held: the front follows
// the proxy over the facets, and its distance from it is the depth. Play is a level at a depth.
#include <palpate/haptics/contact/mesh_contact.h>

#include <algorithm>
#include <cmath>
#include <limits>

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
    constexpr double kNever = std::numeric_limits<double>::infinity();
    const double strength_n = gain.strength_n(settings_.strength_n);
    const bool opens = settings_.yielding == Yielding::opens && !gain.moving && !gain.off();
    offered_strength_n_ = opens ? kNever : strength_n;
    opens_above_n_ = opens ? strength_n : kNever;
    off_ = gain.off();
    if (off_) switch_off();
}

void MeshContact::open() noexcept {
    if (!passed_) pass_through(proxy_);
    state_ = SurfaceState::inside;
}

/// As if open; a proxy that was in front of it still is.
void MeshContact::switch_off() noexcept {
    state_ = SurfaceState::inside;
    if (passed_) return;
    passed_ = in_front_ = true;
    front_side_ = 0;
    seen_ = proxy_;
    // On a facet no ray would tell the side: looked at from a little off it.
    if (mode_ == Mode::on_surface)
        seen_ += kOffTheFacet * tolerance_m_ * walk_.outward(spot_.facet, spot_.side);
    leg_.kind = Leg::Kind::none;
}

double MeshContact::trust_m() const noexcept {
    return passed_ ? kHeldTrust : std::numeric_limits<double>::infinity();
}

/// The surface gives way: from here on the label of its side is that of the front.
void MeshContact::pass_through(const Vec3& proxy) noexcept {
    if (mode_ == Mode::on_surface) {
        front_side_ = spot_.side;
    } else if (const auto near = closest_point(proxy_, kBallRadius)) {
        front_side_ =
            walk_.side_seen_from(walk_.spot_at(near->triangle, 1, near->position), proxy_);
    }
    leg_.kind = Leg::Kind::none;
    passed_ = true;
    in_front_ = false;
    held_depth_m_ = 0.0;
    seen_ = proxy_;
    behind_ = proxy_;
    front_follows(proxy);
}

/// The front goes to where the mesh would hold a proxy that is drawn to `proxy`.
void MeshContact::front_follows(const Vec3& proxy) noexcept {
    behind_ = proxy;
    pull_ = proxy;
    for (int i = 0; i < kFrontLegs; ++i) {
        const SlideLeg leg =
            mode_ == Mode::on_surface ? slide_on_surface(proxy) : slide_above(proxy);
        if (leg.end != SlideLeg::End::goes_on) return;
        follow(leg.corner);
    }
}

/// Whether the proxy is not behind any more: the front is where it is, and free.
bool MeshContact::front_reached(const Vec3& proxy) const noexcept {
    return mode_ == Mode::airborne && glm::length(proxy - proxy_) <= tolerance_m_;
}

void MeshContact::offer_behind(const Vec3& proxy, ContactSet& contacts) noexcept {
    if (state_ == SurfaceState::inside) return;
    if (proxy != behind_) front_follows(proxy);
    if (front_reached(proxy)) {
        passed_ = false;
        proxy_ = proxy;
        return;
    }
    const Vec3 out = proxy_ - proxy;
    const double depth = glm::length(out);
    if (!(depth - held_depth_m_ >= -settings_.free_m)) return;
    ContactPlane contact;
    contact.plane.normal = depth > tolerance_m_        ? out / depth
                           : mode_ == Mode::on_surface ? walk_.outward(spot_.facet, spot_.side)
                           : guards_.size() > 0        ? guards_[guards_.size() - 1].normal
                                                       : Vec3{0.0};
    contact.plane.anchor = proxy + (depth - held_depth_m_) * contact.plane.normal;
    contact.plane.strength_n = offered_strength_n_;
    contact.gradient_length = 1.0;
    if (contacts.add(contact)) ++offered_;
}

/// As far as the chord gets no deeper behind the plane across the way out: what yields anyway needs
/// no more.
Chord MeshContact::carry_behind(const Vec3& from, const Vec3& to) noexcept {
    if (state_ == SurfaceState::inside) return {};
    if (from != behind_) front_follows(from);
    const double length = glm::length(to - from);
    const double stride = std::min(1.0, kHeldStride / length);
    const Vec3 out = proxy_ - from;
    const double depth = glm::length(out);
    if (!(depth > tolerance_m_)) return {stride, false, stride < 1.0};
    const double deeper = -glm::dot(out, to - from) / depth;
    const double room = std::max(held_depth_m_ + kHeldSlack - depth, tolerance_m_);
    if (stride * deeper > room) return {room / deeper, false};
    return {stride, false, stride < 1.0};
}

void MeshContact::commit_behind(const Vec3& proxy, bool yielded, bool felt) noexcept {
    look_back(proxy);
    if (state_ != SurfaceState::inside && proxy != behind_) front_follows(proxy);
    const bool reached = front_reached(proxy);
    bool left = !off_ && (in_front_ || mesh_->has_border()); // nothing is inside a sheet
    if (left && state_ == SurfaceState::inside) left = !closest_point(proxy, settings_.free_m);
    state_ = next_state(state_, {felt, yielded, in_front_ || reached, left});
    if (state_ == SurfaceState::inside) return;
    if (state_ == SurfaceState::yielded) {
        const double depth_m = glm::length(proxy_ - proxy);
        if (std::isinf(offered_strength_n_) && std::isinf(opens_above_n_))
            held_depth_m_ = std::min(held_depth_m_, depth_m); // hard again: only outwards
        else if (!felt || yielded)
            held_depth_m_ = depth_m; // play: it holds where it was pushed to
        return;
    }
    passed_ = false;
    leaving_.clear();
    guards_.clear();
    if (reached)
        proxy_ = proxy;
    else
        alight(proxy, proxy + front_normal_);
}

/// On which side of the surface that it last went through the proxy is.
void MeshContact::look_back(const Vec3& proxy) noexcept {
    leaving_.clear();
    const std::optional<SurfaceHit> hit = first_hit(proxy, seen_);
    if (hit && front_side_ == 0) {
        const std::optional<SurfaceHit> first = first_hit(seen_, proxy);
        const SurfaceHit& passed = first ? *first : *hit;
        front_side_ =
            walk_.side_seen_from(walk_.spot_at(passed.triangle, 1, passed.position), seen_);
    }
    seen_ = proxy;
    if (!hit) return;
    front_normal_ = walk_.outward(hit->triangle, front_side_);
    in_front_ = glm::dot(front_normal_, proxy - hit->position) > 0.0;
}

} // namespace palpate
