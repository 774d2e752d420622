// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/direct_contact.h>

#include <cmath>

#include <palpate/geometry/range.h>

namespace palpate {
namespace {

constexpr double kAnyDistance =
    1.0; // m: the plane is wanted however far the facet is in front of the level

} // namespace

DirectContact::DirectContact(std::shared_ptr<const SurfaceScene> surface,
                             std::shared_ptr<const ScalarField> field,
                             const LevelSettings& settings)
    : surface_(required("direct contact: surface", std::move(surface))),
      field_(required("direct contact: field", std::move(field))), settings_(settings),
      strength_n_(settings.strength_n), scale_(LevelScale::of(*field_, settings)),
      patch_cosine_(field_->patch_cosine()), sampler_(field_->make_sampler()) {}

bool DirectContact::restart(const Vec3&) noexcept {
    bundle_.clear();
    engaged_ = false;
    return false;
}

/// Once off, it is found again where a ray hits a facet's front: not from inside.
void DirectContact::set_gain(const Gain& gain) noexcept {
    strength_n_ = gain.strength_n(settings_.strength_n);
    if (!gain.off()) return;
    bundle_.clear();
    engaged_ = false;
}

void DirectContact::offer(const Vec3& proxy, ContactSet& contacts) noexcept {
    offered_ = 0;
    if (!engaged_) return;
    bundle_.forget_beyond(proxy, scale_.trust_m);
    // Where the facet was hit, the level may be a facet's chord error away.
    LevelSettings near_the_facet = settings_;
    near_the_facet.free_m = scale_.trust_m;
    near_the_facet.strength_n = strength_n_;
    ContactPlane contact;
    if (level_plane(sampler_->sample(proxy), proxy, settings_.level, near_the_facet, scale_,
                    contact)) {
        // Each plane has the surface's whole strength: of one that yields only the newest.
        if (std::isfinite(strength_n_)) bundle_.clear();
        bundle_.remember(contact, proxy, patch_cosine_);
    } else {
        bundle_.clear();
    }
    engaged_ = bundle_.size() > 0;
    for (std::size_t i = 0; i < bundle_.size(); ++i)
        if (contacts.add(bundle_[i])) ++offered_;
}

std::optional<ContactPlane> DirectContact::nearest(const Vec3& proxy, const Vec3&,
                                                   double reach_m) noexcept {
    if (strength_n_ == 0.0) return std::nullopt;
    return plane_within(sampler_->sample(proxy), proxy, settings_, scale_, reach_m);
}

void DirectContact::keep_active(const ProxySolution& solution, std::size_t first) noexcept {
    if (offered_ == bundle_.size()) bundle_.keep_active(solution, first);
}

Chord DirectContact::carry(const Vec3& from, const Vec3& to) noexcept {
    if (strength_n_ == 0.0) return {};
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
    const double reached = glm::dot(contact.plane.normal, to - contact.plane.anchor);
    if (reached >= -settings_.free_m) return {}; // the chord stays in front of the level there
    bundle_.remember(contact, hit->position, patch_cosine_);
    engaged_ = true;
    return {hit->distance_m / glm::length(chord), false};
}

QueryCount DirectContact::queries() const noexcept {
    return {sampler_->samples(), sampler_->roots(), rays_};
}

} // namespace palpate
