// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/volume_contact.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace palpate {
namespace {

// A chord may not rise above its start by more than this share of tau: rounding of the value, 1e-9
// HU on CT (contact.md 1.2).
constexpr double kRoundingShare = 1e-10;
// Continuous and trilinear gradient disagree by more than 60 degrees: neither curvature nor the
// mean is worth anything.
constexpr double kReliableCosine = 0.5;
// An obstacle's plane is sampled this share of the chord past the root, where its normal is its
// own.
constexpr double kPastRoot = 0.03;
constexpr int kRestoreHalvings = 5;
// Deeper than this share of tau in the tolerated band, the level comes before anything else
// (contact.md 1.2, step 2).
constexpr double kRestoreShare = 0.7;

Vec3 between(const Vec3& from, const Vec3& to, double t) noexcept { return from + t * (to - from); }

} // namespace

LevelScale LevelScale::of(const ScalarField& field, const LevelSettings& settings) {
    if (!(settings.strength_n > 0.0) || !(settings.certificate_m > 0.0) || !(settings.free_m > 0.0))
        throw std::invalid_argument(
            "surface: strength, certificate and free distance must be above 0");
    const double slope = field.typical_slope(settings.level);
    if (!(slope > 0.0))
        throw std::invalid_argument(
            "surface: no voxel reaches the level; choose one inside the value range");
    return {settings.certificate_m * slope, 0.05 * slope, settings.free_m * slope,
            0.5 * field.feature_size_m()};
}

bool level_plane(const FieldSample& sample, const Vec3& point, double level,
                 const LevelSettings& settings, const LevelScale& scale,
                 ContactPlane& contact) noexcept {
    if (!sample.valid) return false;
    Vec3 gradient = sample.gradient;
    double length = glm::length(gradient);
    const double slope_length = glm::length(sample.slope);
    const bool reliable =
        length > scale.smallest_gradient &&
        glm::dot(gradient, sample.slope) > kReliableCosine * length * slope_length;
    if (!reliable) {
        gradient = sample.slope;
        length = slope_length;
    }
    if (!(length > 0.0)) return false;
    const double depth = (sample.value - level) / length;
    if (depth < -settings.free_m) return false;

    const Vec3 normal = -gradient / length;
    const double to_level = std::clamp(depth, -0.5 * scale.trust_m, 0.5 * scale.trust_m);
    contact.plane = {point + to_level * normal, normal, settings.strength_n};
    contact.level_gap = level - sample.value;
    contact.slope = sample.slope;
    contact.gradient_length = length;
    contact.depth_hessian = reliable ? sample.hessian / length : Mat3{0.0};
    return true;
}

std::optional<ContactPlane> plane_within(const FieldSample& sample, const Vec3& point,
                                         const LevelSettings& settings, const LevelScale& scale,
                                         double reach_m) noexcept {
    LevelSettings within = settings;
    within.free_m = reach_m;
    ContactPlane contact;
    if (!level_plane(sample, point, settings.level, within, scale, contact)) return std::nullopt;
    const double depth_m = -contact.level_gap / contact.gradient_length;
    return depth_m <= 0.5 * scale.trust_m ? std::optional(contact) : std::nullopt;
}

VolumeContact::VolumeContact(std::shared_ptr<const ScalarField> field,
                             const LevelSettings& settings)
    : field_(std::move(field)), settings_(settings), offered_settings_(settings),
      scale_(LevelScale::of(*field_, settings)), patch_cosine_(field_->patch_cosine()),
      sampler_(field_->make_sampler()), level_(settings.level) {
    set_gain({});
}

void VolumeContact::set_gain(const Gain& gain) noexcept {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    const double strength_n = gain.strength_n(settings_.strength_n);
    const bool opens = settings_.yielding == Yielding::opens && !gain.moving && !gain.off();
    offered_settings_.strength_n = opens ? kNever : strength_n;
    opens_above_n_ = opens ? strength_n : kNever;
    off_ = gain.off();
    if (off_) open();
}

bool VolumeContact::restart(const Vec3& proxy) noexcept {
    bundle_.clear();
    engaged_ = false;
    sampled_ = false;
    level_ = settings_.level;
    const bool inside = sampler_->value(proxy) >= level_;
    state_ = inside ? SurfaceState::inside : SurfaceState::free;
    return inside;
}

void VolumeContact::open() noexcept {
    bundle_.clear();
    state_ = SurfaceState::inside;
}

void VolumeContact::offer(const Vec3& proxy, ContactSet& contacts) noexcept {
    engaged_ = false;
    offered_ = 0;
    if (not_felt()) return;
    if (!sampled_) here_ = sampler_->sample(proxy);
    sampled_ = false;
    ContactPlane contact;
    if (!level_plane(here_, proxy, level_, offered_settings_, scale_, contact)) {
        bundle_.clear();
        // Inside without a normal, as on a plateau: not a surface to be met, but a depth not to
        // exceed.
        engaged_ = here_.value >= level_;
        return;
    }
    engaged_ = true;
    // Each plane has the surface's whole strength: several of a yielding surface would resist more
    // than it.
    if (std::isfinite(offered_settings_.strength_n)) bundle_.clear();
    bundle_.forget_beyond(proxy, scale_.trust_m);
    bundle_.remember(contact, proxy, patch_cosine_);
    for (std::size_t i = 0; i < bundle_.size(); ++i)
        if (contacts.add(bundle_[i])) ++offered_;
}

std::optional<ContactPlane> VolumeContact::nearest(const Vec3& proxy, const Vec3&,
                                                   double reach_m) noexcept {
    if (not_felt()) return std::nullopt;
    here_ = sampler_->sample(proxy);
    sampled_ = true;
    return plane_within(here_, proxy, settings_, scale_, reach_m);
}

void VolumeContact::keep_active(const ProxySolution& solution, std::size_t first) noexcept {
    if (offered_ == bundle_.size()) bundle_.keep_active(solution, first);
}

std::optional<Vec3> VolumeContact::restore(const Vec3& proxy) noexcept {
    if (not_felt() || !(here_.value > level_ + kRestoreShare * scale_.certificate))
        return std::nullopt;
    return downhill(proxy);
}

std::optional<Vec3> VolumeContact::settle(const Vec3& proxy) noexcept {
    if (not_felt()) return std::nullopt;
    here_ = sampler_->sample(proxy);
    engaged_ = true; // the chord to the level is judged by the certificate, not as a stop
    if (here_.value > level_) return downhill(proxy);
    const double slope = glm::length(here_.slope);
    if (!here_.valid || !(slope > 0.0)) return std::nullopt;
    const double step = std::min(2.0 * (level_ - here_.value) / slope, scale_.trust_m);
    const Vec3 target = proxy + (step / slope) * here_.slope;
    const std::optional<double> root = sampler_->first_root(proxy, target, level_);
    return root ? std::optional(between(proxy, target, *root)) : std::nullopt;
}

/// A point down the slope with nothing higher in between, at the level if it is passed.
std::optional<Vec3> VolumeContact::downhill(const Vec3& proxy) noexcept {
    const double slope = glm::length(here_.slope);
    if (!here_.valid || !(slope > 0.0)) return std::nullopt;

    const Vec3 direction = -here_.slope / slope;
    double step = std::min(2.0 * (here_.value - level_) / slope, scale_.trust_m);
    const double ceiling = here_.value + kRoundingShare * scale_.certificate;
    for (int halving = 0; halving <= kRestoreHalvings; ++halving, step *= 0.5) {
        const Vec3 target = proxy + step * direction;
        const double value = sampler_->value(target);
        if (!(value < here_.value) || sampler_->first_root(proxy, target, ceiling)) continue;
        bundle_.clear();
        if (value >= level_) return target;
        // Past the level: back to where it is met from below.
        const std::optional<double> root = sampler_->first_root(target, proxy, level_);
        return root ? between(target, proxy, *root) : target;
    }
    return std::nullopt;
}

Chord VolumeContact::carry(const Vec3& from, const Vec3& to) noexcept {
    if (not_felt()) return {};
    const double limit = engaged_ ? std::max(level_ + scale_.certificate,
                                             here_.value + kRoundingShare * scale_.certificate)
                                  : level_;
    return {sampler_->first_root(from, to, limit).value_or(1.0), engaged_};
}

std::optional<Vec3> VolumeContact::obstructed(const Vec3& from, const Vec3& to,
                                              double fraction) noexcept {
    if (not_felt()) return std::nullopt;
    std::optional<Vec3> reached;
    double blocked_at = fraction;
    if (here_.value < level_) {
        if (const std::optional<double> root = sampler_->first_root(from, to, level_)) {
            reached = between(from, to, *root);
            blocked_at = *root;
        }
    }
    const Vec3 beyond = between(from, to, blocked_at + kPastRoot);
    ContactPlane contact;
    if (level_plane(sampler_->sample(beyond), beyond, level_, offered_settings_, scale_, contact))
        bundle_.remember(contact, from, patch_cosine_);
    return reached;
}

void VolumeContact::commit(const Vec3& proxy, bool yielded, bool felt) noexcept {
    const bool hard = std::isinf(offered_settings_.strength_n) && std::isinf(opens_above_n_);
    // A hard surface is left when it is not felt, and never moves its level (composition.md 4.1).
    if (hard && level_ == settings_.level && !not_felt()) {
        state_ = next_state(state_, {felt, false, true, true});
        return;
    }
    const double value = sampler_->value(proxy);
    state_ = next_state(state_, {felt, yielded, value < settings_.level,
                                 !off_ && value < settings_.level - scale_.free});
    if (state_ != SurfaceState::yielded)
        level_ = settings_.level;
    else if (hard)
        level_ = std::clamp(value, settings_.level, level_); // once it was not: only outwards
    else if (yielded || !felt)
        level_ = std::max(settings_.level, value); // play: it holds where it was pushed to
}

QueryCount VolumeContact::queries() const noexcept {
    return {sampler_->samples(), sampler_->roots(), 0};
}

} // namespace palpate
