// SPDX-License-Identifier: Apache-2.0
// How a mesh leads the proxy along itself towards the pull: over its facets, and through the air
// above those that are uncertain.
#include <palpate/haptics/contact/mesh_contact.h>

#include <limits>

namespace palpate {
namespace {

// Legs without length, as round the fan of a vertex, before a slide is given up.
constexpr int kEmptyLegs = 128;
// Looks round an uncertain facet before a slide above it is given up.
constexpr int kGuardedTries = 32;
// A proxy leaves a certified facet for the air above an uncertain one at heights of 1, 2, 4 ..
// skins.
constexpr int kRiseDoublings = 7;
// Pieces of way above it that are looked at before that.
constexpr int kLegsAhead = 8;
// Stiffness of the projection onto guard planes: any positive one gives the same point (N/m).
constexpr double kAnyStiffness = 1.0;

} // namespace

SlideLeg MeshContact::slide(const Vec3& from, const Vec3& pull) noexcept {
    locate(from);
    now_.pull = pull;
    return now_.mode == Mode::on_surface ? slide_on_surface(pull) : slide_above(pull);
}

SlideLeg MeshContact::slide_on_surface(const Vec3& pull) noexcept {
    for (int leg = 0; leg < kEmptyLegs && now_.mode == Mode::on_surface; ++leg) {
        const WalkStep step = walk_.step(now_.spot, pull);
        switch (step.end) {
        case WalkStep::End::rests:
            return {now_.proxy, SlideLeg::End::rests};
        case WalkStep::End::uncertain:
            return rise_above(step.heading, pull);
        case WalkStep::End::arrives:
            now_.leg = {Leg::Kind::on_surface,
                        now_.spot.position,
                        step.spot.position,
                        true,
                        step.spot,
                        0.0};
            break;
        case WalkStep::End::lifts:
            walk_.facets_at(now_.spot, now_.leaving);
            guard_added_ = false;
            fly(now_.spot.position, pull);
            if (now_.leg.to == now_.spot.position && !now_.leg.lands) return rise_above_guard(pull);
            break;
        }
        if (now_.leg.to != now_.spot.position) {
            // Before a surface yields or opens, it has to know where the leg ended.
            const bool settles = step.end == WalkStep::End::arrives && now_.strength.is_hard() &&
                                 walk_.rests_in_facet(step.spot, pull);
            return {now_.leg.to, SlideLeg::End::goes_on, settles};
        }
        follow(now_.leg.to, true); // nowhere else, but on another facet
    }
    return {now_.proxy, SlideLeg::End::stuck};
}

/// In the air: to the pull, or to the point that the guard planes leave nearest to it.
SlideLeg MeshContact::slide_above(const Vec3& pull) noexcept {
    now_.leaving.clear();
    for (int tries = 0; tries < kGuardedTries; ++tries) {
        drop_stale(now_.proxy);
        PrimitiveSet planes;
        for (std::size_t i = 0; i < now_.guards.size(); ++i)
            planes.add({now_.guards[i].anchor, now_.guards[i].normal,
                        std::numeric_limits<double>::infinity()});
        const Vec3 wanted = solve_proxy(planes, pull, kAnyStiffness).proxy;
        if (glm::length(wanted - now_.proxy) <= tolerance_m_)
            return {now_.proxy, SlideLeg::End::rests};
        guard_added_ = false;
        fly(now_.proxy, wanted);
        if (now_.leg.lands || glm::length(now_.leg.to - now_.proxy) > tolerance_m_)
            return {now_.leg.to, SlideLeg::End::goes_on};
        now_.leg.kind = Leg::Kind::none;
        if (!guard_added_) break;
    }
    return {now_.proxy, SlideLeg::End::stuck};
}

/// The same where an uncertain facet is so near that the flight ended where it began.
SlideLeg MeshContact::rise_above_guard(const Vec3& pull) noexcept {
    now_.leg.kind = Leg::Kind::none;
    Heading onto;
    const bool known =
        guard_added_ && now_.guards[now_.guards.size() - 1].facet != GuardPlanes::kNoFacet;
    if (known) {
        const GuardPlanes::Entry& last = now_.guards[now_.guards.size() - 1];
        onto.facet = last.facet;
        const double along = glm::dot(mesh_->topology().facet(last.facet).normal, last.normal);
        onto.side = along < 0.0 ? -1 : 1;
    }
    now_.guards.clear();
    return known ? rise_above(onto, pull) : SlideLeg{now_.proxy, SlideLeg::End::stuck};
}

/// Off a certified facet into the air above an uncertain one: only when what follows is nearer to
/// the pull.
SlideLeg MeshContact::rise_above(const Heading& heading, const Vec3& pull) noexcept {
    const Vec3 from = now_.spot.position;
    walk_.facets_at(now_.spot, now_.leaving);
    const Vec3 normal = walk_.outward(heading.facet, heading.side);
    Vec3 up = normal;
    for (std::size_t i = 0; i < now_.leaving.size(); ++i)
        up += walk_.outward(now_.leaving[i].facet, now_.leaving[i].side);
    up = glm::normalize(up);
    const SlideLeg stuck{now_.proxy, SlideLeg::End::stuck};
    if (!is_finite(up) || !(walk_.heading(now_.spot, skin_m_ * up).height_m > 0.0)) return stuck;

    double height = skin_m_;
    Vec3 risen{0.0};
    bool clear = false;
    for (int i = 0; i < kRiseDoublings && !clear; ++i, height *= 2.0) {
        risen = from + height * up;
        if (first_hit(from, risen)) return stuck;
        clear = !closest_point(risen, skin_m_);
    }
    if (!clear) return stuck;

    now_.guards.clear();
    const Vec3 corner = mesh_->topology().corner(heading.facet, 0);
    guard(corner + skin_m_ * normal, normal, heading.facet, risen);
    if (!gets_nearer_from(risen, pull)) return stuck;
    now_.leg = {Leg::Kind::flight, from, risen, false, {}, skin_m_};
    return {risen, SlideLeg::End::goes_on};
}

/// Whether sliding on from the air at `risen` ends nearer to the pull than the spot is: tried out,
/// and taken back but for the guard planes that it begins with.
bool MeshContact::gets_nearer_from(const Vec3& risen, const Vec3& pull) noexcept {
    const Vec3 proxy = now_.proxy;
    const MeshSpot spot = now_.spot;
    const GuardPlanes guards = now_.guards;
    const double distance = glm::length(spot.position - pull);
    hover(risen, 0.0);
    bool nearer = false;
    for (int i = 0; i < kLegsAhead && !nearer && now_.mode == Mode::airborne; ++i) {
        if (slide_above(pull).end != SlideLeg::End::goes_on) break;
        follow(now_.leg.to, true);
        nearer = glm::length(now_.proxy - pull) <= distance;
    }
    stand(spot, proxy);
    now_.guards = guards;
    now_.leg.kind = Leg::Kind::none;
    return nearer;
}

} // namespace palpate
