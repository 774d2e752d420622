// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/contact/mesh_contact.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <palpate/geometry/range.h>

namespace palpate {
namespace {

// A flight cut off within this many tolerances has not left the surface.
constexpr double kStillThere = 4.0;
// Beside an uncertain facet by more than this many skins, its plane is not felt any more.
constexpr double kBesideSkins = 2.0;
// Stiffness of the projection onto guard planes: any positive one gives the same point (N/m).
constexpr double kAnyStiffness = 1.0;
// Off a facet's plane by less than this share of the tolerance, a point is on it.
constexpr double kRoundingShare = 0.01;

/// A chord that is free up to where a facet is met: one piece of the way.
Chord met_after(double share) noexcept { return {share, false, share < 1.0}; }

} // namespace

MeshContact::MeshContact(std::shared_ptr<const CertifiedMesh> mesh,
                         const MeshContactSettings& settings)
    : mesh_(required("mesh contact: mesh", std::move(mesh))), settings_(settings), walk_(*mesh_),
      tolerance_m_(mesh_->tolerance_m()), skin_m_(mesh_->skin_m()) {
    set_gain({});
    require("surface: strength_n", settings.strength_n, kPositiveOrInfinite);
    require("surface: free_m", settings.free_m, kPositive);
}

bool MeshContact::restart(const Vec3& proxy) noexcept {
    now_.leg = {};
    now_.guards.clear();
    now_.touch_count = 0;
    now_.yielded = false;
    now_.state = SurfaceState::free;
    now_.passed = false;
    now_.pull = proxy;
    now_.leaving.clear();
    alight(proxy, proxy);
    return false;
}

void MeshContact::rest_on(const MeshSpot& spot) noexcept {
    restart(spot.position);
    MeshSpot front = spot;
    front.side = 1;
    stand(front, spot.position);
}

bool MeshContact::go_on_from(const SurfaceContact& before) noexcept {
    const auto* from = dynamic_cast<const MeshContact*>(&before);
    if (!from) return false;
    const SurfaceStrength own = now_.strength;
    now_ = from->now_;
    now_.strength = own;
    return true;
}

// ---- where the proxy is ------------------------------------------------------------------------

/// The loop says where the proxy is: where it was, or somewhere on the last chord.
void MeshContact::locate(const Vec3& proxy) noexcept {
    const bool arrived = now_.leg.kind != Leg::Kind::none &&
                         (proxy == now_.leg.to || glm::length(proxy - now_.leg.to) <= tolerance_m_);
    if (proxy != now_.proxy || arrived) follow(proxy, arrived);
    now_.leg.kind = Leg::Kind::none;
}

/// `arrived`: at the last leg's end.
void MeshContact::follow(const Vec3& proxy, bool arrived) noexcept {
    const Leg& leg = now_.leg;
    switch (std::exchange(now_.leg.kind, Leg::Kind::none)) {
    case Leg::Kind::flight:
        // Cut off at once, or ended where it began above an uncertain facet: the label holds, as
        // rounding would not tell the side.
        if (now_.mode == Mode::on_surface && (!arrived || (!leg.lands && leg.to == leg.from)) &&
            glm::length(proxy - leg.from) <= kStillThere * tolerance_m_)
            now_.proxy = proxy;
        else if (!arrived)
            alight(proxy, leg.from);
        else if (leg.lands)
            stand(leg.spot, proxy);
        else
            hover(proxy, leg.clear_m);
        return;
    case Leg::Kind::on_surface:
        stand(arrived
                  ? leg.spot
                  : walk_.spot_at(leg.spot.facet, leg.spot.side, on_plane(leg.spot.facet, proxy)),
              proxy);
        return;
    case Leg::Kind::none:
        break;
    }
    // It goes where no chord was asked for: because it yielded, or is set to another place.
    if (now_.yielded)
        pass_through(proxy);
    else
        alight(proxy, now_.proxy);
}

/// A chord may end below its facet by a tolerance. If spots did so too, each would be measured from
/// the one before, and many small chords would lead through. What is off by less is rounding.
Vec3 MeshContact::on_plane(std::uint32_t facet, const Vec3& point) const noexcept {
    const Vec3& normal = mesh_->topology().facet(facet).normal;
    const double height_m = glm::dot(normal, point - mesh_->topology().corner(facet, 0));
    return std::abs(height_m) > kRoundingShare * tolerance_m_ ? point - height_m * normal : point;
}

/// In free space somewhere on a certified chord that came from `seen_from`, or at a start.
void MeshContact::alight(const Vec3& proxy, const Vec3& seen_from) noexcept {
    const std::optional<SurfaceHit> near = closest_point(proxy, kBallRadius);
    if (!near || near->distance_m >= tolerance_m_) {
        hover(proxy, near ? near->distance_m : kBallRadius);
        return;
    }
    MeshSpot spot = walk_.spot_at(near->triangle, 1, near->position);
    spot.side = side_of_hit(spot, seen_from);
    stand(spot, proxy);
}

void MeshContact::hover(const Vec3& proxy, double clear_m) noexcept {
    now_.mode = Mode::airborne;
    now_.proxy = proxy;
    if (clear_m < 0.0) return; // still in the old ball
    now_.ball_center = proxy;
    now_.ball_radius_m = clear_m;
}

void MeshContact::stand(const MeshSpot& spot, const Vec3& proxy) noexcept {
    now_.mode = Mode::on_surface;
    now_.spot = spot;
    now_.proxy = proxy;
    now_.touch_count = 0;
    now_.guards.clear();
}

// ---- planes for the solver ---------------------------------------------------------------------

void MeshContact::offer(const Vec3& proxy, ContactSet& contacts, NearestPlane* nearest) noexcept {
    offered_ = 0;
    if (!now_.passed) locate(proxy);
    if (nearest && !now_.passed)
        nearest->found = nearest_plane(proxy, nearest->pull, nearest->reach_m);
    if (now_.passed) offer_behind(proxy, contacts);
    if (now_.passed) return;
    ContactPlane contact;
    contact.gradient_length = 1.0;
    const auto add = [&](const Vec3& anchor, const Vec3& normal) {
        contact.plane = {anchor, normal, now_.strength.offered_n};
        if (contacts.add(contact)) ++offered_;
    };
    // Guard planes: in the air, and on the surface where a flight above them ended at once.
    const bool airborne = now_.mode == Mode::airborne;
    if (airborne || now_.guards.size() > 0) {
        drop_stale(proxy);
        const std::size_t known = now_.guards.size();
        // Each plane has the whole strength: several of a yielding surface would resist more than
        // it. So there is one, against which the pull leads.
        const bool one = std::isfinite(now_.strength.offered_n);
        const bool own =
            one && !airborne &&
            !(walk_.heading(now_.spot, now_.pull - now_.spot.position).height_m > tolerance_m_);
        if (one && known > 0 && !own) {
            const GuardPlanes::Entry& against = guard_against_pull();
            add(against.anchor, against.normal);
        }
        for (std::size_t i = 0; i < known && !one; ++i)
            add(now_.guards[i].anchor, now_.guards[i].normal);
        if (airborne || (one && offered_ > 0)) return;
    }
    if (now_.spot.feature == MeshSpot::Feature::face) {
        add(now_.spot.position, walk_.outward(now_.spot.facet, now_.spot.side));
        return;
    }
    const Vec3 pull = now_.pull - now_.spot.position;
    const Heading heading = walk_.heading(now_.spot, pull);
    if (now_.touch_count == 0 && heading.height_m > tolerance_m_) return;
    if (std::isfinite(now_.strength.offered_n) && heading.toward != Heading::Toward::face) {
        // What several facets do together: one plane against the pull across the way that is left.
        Vec3 across = pull;
        if (heading.toward == Heading::Toward::edge) {
            const MeshTopology& topology = mesh_->topology();
            const Vec3 along =
                glm::normalize(topology.corner(heading.facet, (heading.edge + 1) % 3) -
                               topology.corner(heading.facet, heading.edge));
            across -= glm::dot(across, along) * along;
        }
        const double length = glm::length(across);
        if (length > tolerance_m_) {
            add(now_.spot.position, -across / length);
            return;
        }
    }
    if (now_.touch_count == 0) {
        if (heading.toward == Heading::Toward::apex)
            touch_all_that_hold(now_.pull);
        else
            touch(heading);
    }
    for (std::size_t i = 0; i < now_.touch_count; ++i)
        add(now_.spot.position, walk_.outward(now_.touches[i].facet, now_.touches[i].side));
}

/// Of the guard planes, of which there is one at least: the one that the pull is farthest behind.
const GuardPlanes::Entry& MeshContact::guard_against_pull() const noexcept {
    std::size_t against = now_.guards.size() - 1; // the newest, where the pull is behind none
    double least = 0.0;
    for (std::size_t i = now_.guards.size(); i-- > 0;) {
        const GuardPlanes::Entry& guard = now_.guards[i];
        const double height_m = glm::dot(guard.normal, now_.pull - guard.anchor);
        if (height_m < least) {
            least = height_m;
            against = i;
        }
    }
    return now_.guards[against];
}

Mat3 MeshContact::distance_hessian(const Vec3& point) const noexcept {
    const MeshSpot& spot = now_.spot;
    const Vec3 way = point - spot.position;
    const double distance = glm::length(way);
    const bool bends = !now_.passed && now_.mode == Mode::on_surface &&
                       spot.feature != MeshSpot::Feature::face && distance > 0.0;
    if (!bends) return Mat3{0.0};
    Mat3 across = Mat3(1.0) - glm::outerProduct(way / distance, way / distance);
    if (spot.feature == MeshSpot::Feature::edge) {
        const MeshTopology& topology = mesh_->topology();
        const Vec3 along = glm::normalize(topology.corner(spot.facet, (spot.index + 1) % 3) -
                                          topology.corner(spot.facet, spot.index));
        across -= glm::outerProduct(along, along); // there it goes along, and `way` is across
    }
    return across / distance;
}

std::optional<SlidingSurface::Face> MeshContact::offer_face(const Vec3& proxy) noexcept {
    if (now_.passed || !now_.strength.is_hard()) return std::nullopt;
    locate(proxy);
    const bool on_face = now_.mode == Mode::on_surface && now_.guards.size() == 0 &&
                         now_.spot.feature == MeshSpot::Feature::face;
    if (now_.passed || !on_face) return std::nullopt;
    offered_ = 1;
    now_.yielded = false;
    return Face{now_.spot.position, walk_.outward(now_.spot.facet, now_.spot.side)};
}

std::optional<ContactPlane> MeshContact::nearest_plane(const Vec3& proxy, const Vec3& pull,
                                                       double reach_m) noexcept {
    ContactPlane contact;
    contact.gradient_length = 1.0;
    if (now_.mode == Mode::airborne) drop_stale(proxy);
    if (now_.mode == Mode::airborne && now_.guards.size() > 0) {
        const auto height_m = [&](std::size_t i) {
            return glm::dot(now_.guards[i].normal, proxy - now_.guards[i].anchor);
        };
        std::size_t nearest = 0;
        for (std::size_t i = 1; i < now_.guards.size(); ++i)
            if (height_m(i) <= height_m(nearest)) nearest = i; // of equal ones the newest
        const GuardPlanes::Entry& guard = now_.guards[nearest];
        contact.plane = {guard.anchor, guard.normal, 0.0};
        if (height_m(nearest) > reach_m) return std::nullopt;
        return contact;
    }
    std::optional<MeshSpot> spot = now_.mode == Mode::on_surface
                                       ? std::optional(now_.spot)
                                       : nearest_spot(proxy, reach_m, proxy);
    if (!spot) return std::nullopt;
    Vec3 normal = walk_.outward(spot->facet, spot->side);
    if (spot->feature != MeshSpot::Feature::face) {
        // Any direction between the facets leads off it: what counts is whence the pull is nearest.
        const double radius_m = glm::length(pull - spot->position) + tolerance_m_;
        if (const auto under_pull = nearest_spot(pull, radius_m, proxy)) {
            spot = under_pull;
            normal = walk_.outward(spot->facet, spot->side);
            const Vec3 way = pull - spot->position;
            const double height_m = glm::length(way);
            if (glm::dot(way, normal) > 0.0) {
                if (spot->feature != MeshSpot::Feature::face && height_m > tolerance_m_)
                    normal = way / height_m;
                // That is then the way it goes, not where it was pressed to.
                now_.pull = spot->position;
                now_.touch_count = 0;
            }
        }
    }
    contact.plane = {spot->position, normal, 0.0};
    return contact;
}

/// The spot of the mesh nearest to a point, on the side that is seen from another.
std::optional<MeshSpot> MeshContact::nearest_spot(const Vec3& point, double radius_m,
                                                  const Vec3& seen_from) noexcept {
    const std::optional<SurfaceHit> near = closest_point(point, radius_m);
    if (!near) return std::nullopt;
    MeshSpot spot = walk_.spot_at(near->triangle, 1, near->position);
    spot.side =
        now_.mode == Mode::on_surface ? now_.spot.side : walk_.side_seen_from(spot, seen_from);
    return spot;
}

void MeshContact::keep_active(const ProxySolution& solution, std::size_t first) noexcept {
    now_.yielded = false;
    for (std::size_t i = 0; i < offered_; ++i)
        if (solution.planes[first + i].state == MultiplierState::saturated) now_.yielded = true;
    if (now_.mode != Mode::on_surface || offered_ < now_.touch_count) return;
    const std::size_t first_touch = first + offered_ - now_.touch_count; // behind the guard planes
    std::size_t kept = 0;
    for (std::size_t i = 0; i < now_.touch_count; ++i)
        if (solution.planes[first_touch + i].state != MultiplierState::released)
            now_.touches[kept++] = now_.touches[i];
    now_.touch_count = kept;
}

void MeshContact::touch(const Heading& heading) noexcept {
    if (heading.toward == Heading::Toward::apex) {
        touch_all_that_hold(now_.pull);
        return;
    }
    touch(heading.facet, heading.side);
    if (heading.toward == Heading::Toward::face) return;
    const Facet& facet = mesh_->topology().facet(heading.facet);
    const auto side = static_cast<std::int8_t>(heading.side * facet.turn[heading.edge]);
    touch(facet.neighbour[heading.edge], side);
}

void MeshContact::touch(std::uint32_t facet, std::int8_t side) noexcept {
    for (std::size_t i = 0; i < now_.touch_count; ++i)
        if (now_.touches[i].facet == facet && now_.touches[i].side == side) return;
    if (now_.touch_count == now_.touches.size()) {
        std::move(now_.touches.begin() + 1, now_.touches.end(), now_.touches.begin());
        --now_.touch_count;
    }
    now_.touches[now_.touch_count++] = {facet, side};
}

/// Of a vertex's facets the few whose planes together hold the proxy there.
void MeshContact::touch_all_that_hold(const Vec3& pull) noexcept {
    Fan facets;
    walk_.facets_at(now_.spot, facets);
    PrimitiveSet planes;
    std::array<Touch, PrimitiveSet::kCapacity> candidates{};
    std::size_t count = 0;
    for (std::size_t i = 0; i < facets.size() && count < candidates.size(); ++i) {
        const Vec3 normal = walk_.outward(facets[i].facet, facets[i].side);
        if (!(glm::dot(normal, pull - now_.spot.position) < 0.0)) continue;
        planes.add({now_.spot.position, normal, std::numeric_limits<double>::infinity()});
        candidates[count++] = {facets[i].facet, facets[i].side};
    }
    const ProxySolution solution = solve_proxy(planes, pull, kAnyStiffness);
    for (std::size_t i = 0; i < count; ++i)
        if (solution.planes[i].state != MultiplierState::released)
            touch(candidates[i].facet, candidates[i].side);
}

// ---- chords ------------------------------------------------------------------------------------

Chord MeshContact::carry(const Vec3& from, const Vec3& to) noexcept {
    if (!now_.passed) locate(from);
    if (now_.passed) return carry_behind(from, to);
    now_.pull = to;
    if (now_.mode == Mode::on_surface) return carry_on_surface(to);
    now_.leaving.clear();
    drop_stale(from);
    return met_after(fly(from, to));
}

Chord MeshContact::carry_on_surface(const Vec3& to) noexcept {
    const Vec3 from = now_.spot.position;
    const WalkStep step = walk_.step(now_.spot, to);
    if (step.end == WalkStep::End::lifts) {
        walk_.facets_at(now_.spot, now_.leaving);
        return met_after(fly(from, to));
    }
    const bool in_the_way = step.heading.height_m < -tolerance_m_;
    if (in_the_way || step.end == WalkStep::End::uncertain) {
        const std::size_t known = now_.touch_count;
        if (now_.spot.feature != MeshSpot::Feature::face) touch(step.heading);
        return {0.0, false, now_.touch_count > known};
    }
    now_.leg = {Leg::Kind::on_surface, from, step.spot.position, true, step.spot, 0.0};
    if (step.end == WalkStep::End::rests) return {1.0, false};
    const double length = glm::length(to - from);
    return met_after(std::min(1.0, glm::length(step.spot.position - from) / length));
}

void MeshContact::commit(const Vec3& proxy, bool yielded, bool felt) noexcept {
    if (!now_.passed) locate(proxy);
    now_.yielded = false;
    if (now_.passed)
        commit_behind(proxy, yielded, felt);
    else
        now_.state = next_state(now_.state, {felt, false, true, true});
}

// ---- uncertain facets --------------------------------------------------------------------------

void MeshContact::guard(const Vec3& anchor, const Vec3& normal, std::uint32_t facet,
                        const Vec3& at) noexcept {
    now_.guards.add({anchor, normal, facet, at});
    guard_added_ = true;
}

/// Forgets planes of facets that the proxy is not over any more, unless they were found just here.
void MeshContact::drop_stale(const Vec3& proxy) noexcept {
    const MeshTopology& topology = mesh_->topology();
    now_.guards.keep_if([&](const GuardPlanes::Entry& entry) {
        if (entry.found_at == proxy) return true;
        if (entry.facet == GuardPlanes::kNoFacet) return false;
        for (int k = 0; k < 3; ++k) {
            const Vec3 from = topology.corner(entry.facet, k);
            const Vec3 edge = topology.corner(entry.facet, (k + 1) % 3) - from;
            const Vec3 inward = glm::cross(topology.facet(entry.facet).normal, edge);
            if (glm::dot(inward, proxy - from) < -kBesideSkins * skin_m_ * glm::length(edge))
                return false;
        }
        return true;
    });
}

} // namespace palpate
