// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/contact/guarded_contact.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <palpate/geometry/range.h>

namespace palpate {
namespace {

// The leash's plane holds the proxy at this share of its length: the rest is for chords across it,
// which end farther out before the guard has come along.
constexpr double kHeldShare = 0.8;
// Pieces of way that the guard goes for one piece of the proxy's.
constexpr int kGuardLegs = 256;

// Of the leash: how high the guard tries to go round what keeps it.
constexpr std::array<double, 3> kWayHeights{0.25, 0.5, 1.0};

/// As near to `target` as the mesh lets a guard at `at`.
Vec3 drawn(MeshContact& guard, Vec3 at, const Vec3& target) noexcept {
    for (int leg = 0; leg < kGuardLegs; ++leg) {
        const SlideLeg way = guard.slide(at, target);
        if (way.end != SlideLeg::End::goes_on) break;
        at = way.corner;
    }
    return at;
}

MeshContactSettings guard_settings() { return {}; } // the guard itself never yields

} // namespace

GuardedContact::GuardedContact(std::shared_ptr<const ScalarField> field,
                               const LevelSettings& settings,
                               std::shared_ptr<const CertifiedMesh> mesh, double leash_m,
                               const TextureSettings& texture)
    : mesh_(required("guarded contact: mesh", std::move(mesh))), way_out_(mesh_->scene()),
      walk_(*mesh_), volume_(std::move(field), settings, texture),
      guard_contact_(std::in_place, mesh_, guard_settings()), leash_m_(leash_m) {
    require("guarded contact: leash_m", leash_m, kPositive);
}

bool GuardedContact::restart(const Vec3& proxy) noexcept {
    leash_offered_ = leash_holds_ = regrouped_ = false;
    const bool inside = volume_.restart(proxy);
    on_duty_ = !inside && post_guard(proxy);
    return inside;
}

/// The guard begins where the proxy is or, where that is a little behind the mesh, in front of it
/// there. False where the mesh says that the proxy is deep inside: then there is nothing to hold.
bool GuardedContact::post_guard(const Vec3& proxy) noexcept {
    const double reach_m = kHeldShare * leash_m_;
    followed_ = proxy;
    ++searches_;
    const auto near = mesh_->scene().closest_point(proxy, reach_m);
    if (near) {
        const MeshSpot spot = walk_.spot_at(near->triangle, 1, near->position);
        if (near->distance_m <= mesh_->tolerance_m() || walk_.side_seen_from(spot, proxy) < 0) {
            guard_contact_->rest_on(spot);
            guard_ = spot.position;
            return true;
        }
    } else if (deep_inside(proxy)) {
        return false;
    }
    guard_contact_->restart(proxy);
    guard_ = proxy;
    return true;
}

bool GuardedContact::deep_inside(const Vec3& proxy) noexcept {
    ++searches_;
    return way_out_.meets_a_back(proxy);
}

/// The guard goes along to where the proxy is, as near as the mesh lets it.
void GuardedContact::follow(const Vec3& proxy) noexcept {
    if (!on_duty_ || proxy == followed_) return;
    followed_ = proxy;
    guard_ = drawn(*guard_contact_, guard_, proxy);
    if (glm::length(guard_ - proxy) >= kHeldShare * leash_m_) regroup(proxy);
}

/// The proxy slid out of a fold in which the guard still is, at another nearest place. It has gone
/// nowhere through the mesh if the guard finds a way in the air: up, across and down again. Once a
/// frame.
void GuardedContact::regroup(const Vec3& proxy) noexcept {
    if (regrouped_) return;
    regrouped_ = true;
    ++searches_;
    const auto near = mesh_->scene().closest_point(proxy, kHeldShare * leash_m_);
    if (!near) return;
    for (const double height : kWayHeights) {
        const Vec3 up = height * leash_m_ * near->normal;
        MeshContact scout(*guard_contact_);
        Vec3 at = guard_;
        for (const Vec3& target : {guard_ + up, near->position + up, proxy})
            at = drawn(scout, at, target);
        if (glm::length(at - proxy) >= kHeldShare * leash_m_) {
            searches_ +=
                scout.queries().surface_queries - guard_contact_->queries().surface_queries;
            continue;
        }
        guard_ = at;
        guard_contact_.emplace(scout);
        return;
    }
}

void GuardedContact::set_gain(const Gain& gain) noexcept {
    volume_.set_gain(gain);
    if (gain.off()) on_duty_ = leash_offered_ = leash_holds_ = false;
}

void GuardedContact::offer(const Vec3& proxy, ContactSet& contacts,
                           NearestPlane* nearest) noexcept {
    const std::size_t first = contacts.size();
    volume_.offer(proxy, contacts, nearest);
    volume_planes_ = contacts.size() - first;
    leash_offered_ = false;
    follow(proxy);
    if (!on_duty_) return;
    const double distance = glm::length(guard_ - proxy);
    const double held_m = kHeldShare * leash_m_;
    if (distance < held_m) return;
    ContactPlane contact;
    const Vec3 normal = (guard_ - proxy) / distance;
    contact.plane = {proxy + (distance - held_m) * normal, normal, volume_.offered_strength_n()};
    contact.gradient_length = 1.0;
    contact.depth_hessian = guard_contact_->distance_hessian(proxy);
    contact.plane.shares = volume_planes_ > 0 && std::isfinite(contact.plane.strength_n);
    leash_offered_ = contacts.add(contact);
}

void GuardedContact::keep_active(const ProxySolution& solution, std::size_t first) noexcept {
    if (volume_planes_ > 0) volume_.keep_active(solution, first);
    leash_holds_ = leash_offered_ &&
                   solution.planes[first + volume_planes_].state != MultiplierState::released;
}

Chord GuardedContact::carry(const Vec3& from, const Vec3& to) noexcept {
    const Chord chord = volume_.carry(from, to);
    follow(from);
    if (!on_duty_) return chord;
    const double share = leash_share(from, to);
    return share < chord.fraction ? Chord{share, leash_offered_, false, true} : chord;
}

std::optional<Vec3> GuardedContact::obstructed(const Vec3& from, const Vec3& to,
                                               double fraction) noexcept {
    const std::optional<Vec3> reached = volume_.obstructed(from, to, fraction);
    if (reached && on_duty_ && leash_share(from, *reached) < 1.0) return std::nullopt;
    return reached;
}

/// How much of a chord certainly ends within the leash of where the guard will then be.
double GuardedContact::leash_share(const Vec3& from, const Vec3& to) noexcept {
    // The guard only ever gets nearer: what is within the leash of it now will be.
    const double limit = std::max(leash_m_, glm::length(from - guard_));
    if (glm::length(to - guard_) <= limit) return 1.0;
    // It flies along.
    const double flown = guard_contact_->carry(guard_, to).fraction;
    if (flown >= 1.0) return 1.0;
    const Vec3 chord = to - from;
    const double length = glm::length(chord);
    if (from == guard_) return std::min(1.0, flown + leash_m_ / length);
    // Out of the ball of the leash: |from + t chord - guard| = limit.
    const Vec3 away = from - guard_;
    const double b = glm::dot(away, chord) / length;
    const double c = squared_length(away) - limit * limit; // <= 0
    const double way = -b + std::sqrt(std::max(0.0, b * b - c));
    return std::clamp(way / length, 0.0, 1.0);
}

void GuardedContact::commit(const Vec3& proxy, bool yielded, bool felt) noexcept {
    follow(proxy);
    regrouped_ = false;
    volume_.commit(proxy, yielded, felt);
    const SurfaceState state = volume_.state();
    if (yielded || state == SurfaceState::yielded || state == SurfaceState::inside)
        on_duty_ = false;
    else if (!on_duty_)
        on_duty_ = post_guard(proxy);
    leash_holds_ = leash_holds_ && on_duty_;
}

void GuardedContact::open() noexcept {
    volume_.open();
    on_duty_ = leash_offered_ = leash_holds_ = false;
}

std::any GuardedContact::save_state() const {
    return State{volume_.save_state(), guard_contact_->save_state(), on_duty_, guard_, followed_,
                 leash_holds_};
}

void GuardedContact::restore_state(const std::any& state) {
    const auto& from = std::any_cast<const State&>(state);
    volume_.restore_state(from.volume);
    guard_contact_->restore_state(from.guard_contact);
    on_duty_ = from.on_duty;
    guard_ = from.guard;
    followed_ = from.followed;
    leash_holds_ = from.leash_holds;
}

bool GuardedContact::go_on_from(const SurfaceContact& before) noexcept {
    if (volume_.go_on_from(before)) { // which had no mesh: a guard is posted where this frame ends
        on_duty_ = leash_offered_ = leash_holds_ = false;
        return true;
    }
    const auto* from = dynamic_cast<const GuardedContact*>(&before);
    if (!from) return false;
    volume_.go_on_from(from->volume_);
    guard_contact_->go_on_from(*from->guard_contact_);
    on_duty_ = from->on_duty_;
    guard_ = from->guard_;
    followed_ = from->followed_;
    leash_holds_ = from->leash_holds_;
    return true;
}

QueryCount GuardedContact::queries() const noexcept {
    QueryCount count = volume_.queries();
    count += guard_contact_->queries();
    count.surface_queries += searches_;
    return count;
}

} // namespace palpate
