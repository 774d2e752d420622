// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/contact/moving_contact.h>

#include <utility>

#include <palpate/geometry/range.h>

namespace palpate {
namespace {

PlanePrimitive placed(const PlanePrimitive& plane, const RigidMap& map) noexcept {
    return {map.point(plane.anchor), map.direction(plane.normal), plane.strength_n, plane.shares};
}

/// What is felt in the body's frame becomes what the scene has.
void place(ContactPlane& contact, const RigidMap& map) noexcept {
    contact.plane = placed(contact.plane, map);
    if (contact.is_flat()) return; // a facet
    contact.slope = map.direction(contact.slope);
    contact.depth_hessian = map.rotation() * contact.depth_hessian * glm::transpose(map.rotation());
}

} // namespace

MovingContact::MovingContact(std::unique_ptr<SurfaceContact> contact)
    : contact_(required("moving contact: contact", std::move(contact))) {}

// ---- places in both frames ---------------------------------------------------------------------

void MovingContact::remember(const Place& place) noexcept {
    places_[next_] = place;
    next_ = (next_ + 1) % places_.size();
    count_ = std::min(count_ + 1, places_.size());
}

/// A place that the proxy may go to.
Vec3 MovingContact::place_in_body(const Vec3& scene) noexcept {
    if (scene == proxy_.scene) return proxy_.body;
    for (std::size_t i = 0; i < count_; ++i)
        if (places_[i].scene == scene) return places_[i].body;
    const Place place{scene, map_.point_back(scene)};
    remember(place);
    return place.body;
}

/// Where the proxy is now.
Vec3 MovingContact::proxy_in_body(const Vec3& scene) noexcept {
    if (scene != proxy_.scene) proxy_ = {scene, place_in_body(scene)};
    return proxy_.body;
}

/// A place that the contact names: the proxy may go there.
Vec3 MovingContact::place_in_scene(const Vec3& body) noexcept {
    if (body == proxy_.body) return proxy_.scene;
    const Place place{map_.point(body), body};
    remember(place);
    return place.scene;
}

void MovingContact::be_at(const RigidPose& pose, const RigidMap& map) noexcept {
    pose_ = pose;
    map_ = map;
    count_ = next_ = 0;
}

void MovingContact::be_at(const RigidPose& pose) noexcept { be_at(pose, RigidMap(pose)); }

// ---- the contact, seen from the scene ----------------------------------------------------------

bool MovingContact::restart(const Vec3& proxy) noexcept {
    take_goal();
    return restart_at(goal_, proxy);
}

void MovingContact::offer(const Vec3& proxy, ContactSet& contacts, NearestPlane* nearest) noexcept {
    const std::size_t first = contacts.size();
    if (nearest) {
        NearestPlane in_body{map_.point_back(nearest->pull), nearest->reach_m};
        contact_->offer(proxy_in_body(proxy), contacts, &in_body);
        if (in_body.found) place(*in_body.found, map_);
        nearest->found = in_body.found;
    } else {
        contact_->offer(proxy_in_body(proxy), contacts);
    }
    for (std::size_t i = first; i < contacts.size(); ++i)
        place(contacts.edit(i), map_);
}

Chord MovingContact::carry(const Vec3& from, const Vec3& to) noexcept {
    const Vec3 from_body = proxy_in_body(from), to_body = place_in_body(to);
    const Chord chord = contact_->carry(from_body, to_body);
    // Where it stops it is where the contact means, also where the scene's numbers are coarser than
    // what the contact can tell apart: kilometres from the origin.
    if (chord.fraction > 0.0 && chord.fraction < 1.0)
        remember({from + chord.fraction * (to - from),
                  from_body + chord.fraction * (to_body - from_body)});
    return chord;
}

void MovingContact::commit(const Vec3& proxy, bool yielded, bool felt) noexcept {
    contact_->commit(proxy_in_body(proxy), yielded, felt);
}

std::optional<Leash> MovingContact::leash() const noexcept {
    std::optional<Leash> leash = contact_->leash();
    if (leash) leash->guard = map_.point(leash->guard);
    return leash;
}

SlideLeg MovingContact::slide(const Vec3& from, const Vec3& pull) noexcept {
    SlideLeg leg = contact_->sliding()->slide(proxy_in_body(from), map_.point_back(pull));
    leg.corner = place_in_scene(leg.corner);
    return leg;
}

double MovingContact::opens_above_n() const noexcept {
    return contact_->membrane()->opens_above_n();
}

std::optional<Vec3> MovingContact::restore(const Vec3& proxy) noexcept {
    const std::optional<Vec3> nearer = contact_->of_field()->restore(proxy_in_body(proxy));
    return nearer ? std::optional(place_in_scene(*nearer)) : std::nullopt;
}

std::optional<Vec3> MovingContact::settle(const Vec3& proxy) noexcept {
    const std::optional<Vec3> level = contact_->of_field()->settle(proxy_in_body(proxy));
    return level ? std::optional(place_in_scene(*level)) : std::nullopt;
}

std::optional<Vec3> MovingContact::obstructed(const Vec3& from, const Vec3& to,
                                              double fraction) noexcept {
    const Vec3 from_body = proxy_in_body(from);
    const std::optional<Vec3> reached =
        contact_->of_field()->obstructed(from_body, place_in_body(to), fraction);
    return reached ? std::optional(place_in_scene(*reached)) : std::nullopt;
}

std::any MovingContact::save_state() const {
    take_goal();
    return State{contact_->save_state(), pose_, goal_, proxy_};
}

void MovingContact::restore_state(const std::any& state) {
    const auto& from = std::any_cast<const State&>(state);
    contact_->restore_state(from.contact);
    RigidPose dropped; // what was set before is not what the state was on its way to
    asked_.take(dropped);
    goal_ = from.goal;
    be_at(from.pose);
    proxy_ = from.proxy;
}

/// The pose goes on, too; a goal that was set here stands above one that was set there.
bool MovingContact::go_on_from(const SurfaceContact& before) noexcept {
    const auto* from = dynamic_cast<const MovingContact*>(&before);
    if (!from || !contact_->go_on_from(*from->contact_)) return false;
    if (!was_set_) goal_ = from->goal_;
    be_at(from->pose_);
    proxy_ = from->proxy_;
    return true;
}

// ---- its movement ------------------------------------------------------------------------------

bool MovingContact::begin_motion() noexcept {
    count_ = next_ = 0;
    take_goal();
    return goal_ != pose_;
}

void MovingContact::take_goal() const noexcept {
    if (asked_.take(goal_)) was_set_ = true;
}

double MovingContact::turn_left() const noexcept {
    return angle_between(pose_.orientation, goal_.orientation);
}

void MovingContact::try_pose(double share) noexcept {
    tried_ = pose_between(pose_, goal_, share);
    tried_map_ = RigidMap(tried_);
    gone_along_ = {proxy_.scene, tried_map_.point(proxy_.body)};
}

Vec3 MovingContact::along(const Vec3& proxy) noexcept {
    if (proxy != gone_along_.from) gone_along_ = {proxy, tried_map_.point(proxy_in_body(proxy))};
    return gone_along_.to;
}

PlanePrimitive MovingContact::along(const PlanePrimitive& plane) const noexcept {
    return {tried_map_.point(map_.point_back(plane.anchor)),
            tried_map_.direction(map_.direction_back(plane.normal)), plane.strength_n,
            plane.shares};
}

/// Where the proxy is in the body's frame once it is at `to` and the body at the tried pose: the
/// very place where it was, if it goes along.
Vec3 MovingContact::relative_end(const Vec3& from, const Vec3& to) noexcept {
    return to == along(from) ? proxy_in_body(from) : tried_map_.point_back(to);
}

bool MovingContact::goes_along(const Vec3& from, const Vec3& to) noexcept {
    return relative_end(from, to) == proxy_in_body(from);
}

Chord MovingContact::carry_relative(const Vec3& from, const Vec3& to) noexcept {
    const Vec3 end = relative_end(from, to);
    return contact_->carry(proxy_in_body(from), end);
}

bool MovingContact::restart_at(const RigidPose& pose, const Vec3& proxy) noexcept {
    be_at(pose);
    proxy_ = {proxy, map_.point_back(proxy)};
    return contact_->restart(proxy_.body);
}

void MovingContact::take_pose(const Vec3& proxy) noexcept {
    const Vec3 end = relative_end(proxy_.scene, proxy);
    be_at(tried_, tried_map_);
    proxy_ = {proxy, end};
}

} // namespace palpate
