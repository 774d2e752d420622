// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/contact/direct_contact.h>

#include <algorithm>
#include <cmath>

#include <palpate/geometry/range.h>

namespace palpate {
namespace {

constexpr double kAnyDistance =
    1.0; // m: the plane is wanted however far the facet is in front of the level

// Normals that differ by less than 60 degrees are of one sheet: a wall seen from both sides, and
// the two flanks of a crease, are not.
constexpr double kSamePatch = 0.5;

double depth_m(const ContactPlane& contact) noexcept {
    return -contact.level_gap / contact.gradient_length;
}

} // namespace

DirectContact::DirectContact(std::shared_ptr<const SurfaceScene> surface,
                             std::shared_ptr<const ScalarField> field,
                             const LevelSettings& settings)
    : surface_(required("direct contact: surface", std::move(surface))), way_out_(*surface_),
      field_(required("direct contact: field", std::move(field))), settings_(settings),
      strength_n_(settings.strength_n), scale_(LevelScale::of(*field_, settings)),
      patch_cosine_(field_->patch_cosine()), sampler_(field_->make_sampler()) {}

/// Behind a facet, but not behind the level, no ray would find what the proxy is at.
bool DirectContact::restart(const Vec3& proxy) noexcept {
    bundle_.clear();
    met_.clear();
    felt_ = false;
    const FieldSample here = sampler_->sample(proxy);
    const bool in_front = here.valid && here.value <= settings_.level + scale_.free;
    engaged_ = in_front && (plane_within(here, proxy, settings_, scale_, scale_.trust_m) ||
                            behind_a_facet(proxy));
    return false;
}

bool DirectContact::behind_a_facet(const Vec3& proxy) noexcept {
    ++rays_;
    return way_out_.meets_a_back(proxy);
}

/// Once off, it is found again where a ray hits a facet's front: not from inside.
void DirectContact::set_gain(const Gain& gain) noexcept {
    strength_n_ = gain.strength_n(settings_.strength_n);
    if (!gain.off()) return;
    bundle_.clear();
    met_.clear();
    engaged_ = felt_ = false;
}

void DirectContact::offer(const Vec3& proxy, ContactSet& contacts, NearestPlane* nearest) noexcept {
    if (nearest && strength_n_ > 0.0)
        nearest->found =
            plane_within(sampler_->sample(proxy), proxy, settings_, scale_, nearest->reach_m);
    offered_ = 0;
    depth_m_ = 0.0;
    if (!engaged_) return;
    bundle_.take_over(met_, patch_cosine_);
    bundle_.forget_beyond(proxy, scale_.trust_m);
    // Where the facet was hit, the level may be a facet's chord error away.
    LevelSettings near_the_facet = settings_;
    near_the_facet.free_m = scale_.trust_m;
    near_the_facet.strength_n = strength_n_;
    ContactPlane contact;
    if (level_plane(sampler_->sample(proxy), proxy, settings_.level, near_the_facet, scale_,
                    contact)) {
        bundle_.remember(contact, proxy, patch_cosine_);
        depth_m_ = std::max(0.0, depth_m(contact));
    } else {
        bundle_.clear();
        engaged_ = behind_a_facet(proxy); // so far in front of the level, or where it has no slope
    }
    offered_ = bundle_.offer(strength_n_, contacts);
}

void DirectContact::keep_active(const ProxySolution& solution, std::size_t first) noexcept {
    if (offered_ == bundle_.size()) bundle_.keep_active(solution, first);
}

Chord DirectContact::carry(const Vec3& from, const Vec3& to) noexcept {
    if (strength_n_ == 0.0) return {};
    if (!SurfaceScene::answers_at(from) || !SurfaceScene::answers_at(to))
        return {surface_->is_away(from, to) ? 1.0 : 0.0, false}; // nobody can say more
    ++rays_;
    const std::optional<SurfaceHit> hit = surface_->first_hit(from, to);
    const Vec3 chord = to - from;
    if (!hit || glm::dot(hit->normal, chord) >= 0.0) return {}; // nothing, or a facet's back

    // One Newton step from the facet to the level: the facet is up to its chord error away from it.
    ContactPlane contact;
    LevelSettings at_any_distance = settings_;
    at_any_distance.free_m = kAnyDistance;
    at_any_distance.strength_n = strength_n_;
    if (!level_plane(sampler_->sample(hit->position), hit->position, settings_.level,
                     at_any_distance, scale_, contact))
        return {};
    // In front of the level there, or hardly deeper than it begins where the level is followed: the
    // chord passes the facet. The next begins behind it, where rays see nothing more of the
    // surface: from here on its level is followed.
    const double reached = glm::dot(contact.plane.normal, to - contact.plane.anchor);
    const double tolerated_m = offered_ > 0 ? std::max(settings_.free_m, depth_m_) : 0.0;
    const bool passes = reached >= -tolerated_m || is_offered(contact, *hit);
    engaged_ = true;
    if (passes) return {};
    met_.remember(contact, hit->position, patch_cosine_);
    return {hit->distance_m / glm::length(chord), false};
}

/// Whether a facet that was met is of the patch whose plane the proxy has just been offered: what
/// is wanted behind it has been weighed against it already.
bool DirectContact::is_offered(const ContactPlane& contact, const SurfaceHit& hit) const noexcept {
    if (offered_ == 0 || hit.distance_m > scale_.trust_m) return false;
    for (std::size_t i = 0; i < bundle_.size(); ++i)
        if (glm::dot(bundle_[i].plane.normal, contact.plane.normal) > kSamePatch) return true;
    return false;
}

std::any DirectContact::save_state() const {
    return State{strength_n_, engaged_, felt_, bundle_, met_};
}

void DirectContact::restore_state(const std::any& state) {
    const auto& from = std::any_cast<const State&>(state);
    strength_n_ = from.strength_n;
    engaged_ = from.engaged;
    felt_ = from.felt;
    bundle_ = from.bundle;
    met_ = from.met;
}

bool DirectContact::go_on_from(const SurfaceContact& before) noexcept {
    const auto* from = dynamic_cast<const DirectContact*>(&before);
    if (!from) return false;
    engaged_ = from->engaged_;
    felt_ = from->felt_;
    bundle_ = from->bundle_;
    met_ = from->met_;
    return true;
}

QueryCount DirectContact::queries() const noexcept {
    return {sampler_->samples(), sampler_->roots(), rays_};
}

} // namespace palpate
