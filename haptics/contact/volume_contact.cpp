// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/contact/volume_contact.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <palpate/geometry/range.h>

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
// Normals of a texture turn steadily: planes of its flanks are one patch up to 25 degrees.
constexpr double kTexturePatch = 0.9;
// The layer in which crests may be, in heights times the typical slope: slopes differ.
constexpr double kLayer = 2.0;
// Steps in that layer, of this share of SurfaceTexture::trust_m(): what is grazed between two of
// them is cut by at most 4 % of its height. After so many a free flight takes a rest.
constexpr double kLayerStep = 0.5;
constexpr int kMostLayerSteps = 64;
// A root of the textured level is found when its value is within this share of LevelScale::free.
constexpr double kRootShare = 1e-3;
constexpr int kMostRefinements = 24;

// Of a feature's size: voxels of 0.2 mm have 25 um, finer ones less.
constexpr double kCertificateShare = 0.125;
constexpr double kRoundedSize = 1e-6; // of a feature: the columns of a rotated frame are rounded

Vec3 between(const Vec3& from, const Vec3& to, double t) noexcept { return from + t * (to - from); }

} // namespace

LevelScale LevelScale::of(const ScalarField& field, const LevelSettings& settings) {
    require("surface: level", settings.level, kFiniteRange);
    require("surface: strength_n", settings.strength_n, kPositiveOrInfinite);
    require("surface: certificate_m", settings.certificate_m, kPositive);
    require("surface: free_m", settings.free_m, kPositive);
    const double slope = field.typical_slope(settings.level);
    if (!(slope > 0.0))
        throw std::invalid_argument(
            "surface: its field never has the level; choose one inside the range of its values");
    // Between fine voxels no value is so far above the level: then a certificate would be none.
    const double fine_m = kCertificateShare * field.feature_size_m();
    const bool is_fine = fine_m < settings.certificate_m * (1.0 - kRoundedSize);
    const double certificate_m = is_fine ? fine_m : settings.certificate_m;
    return {certificate_m * slope, 0.05 * slope, settings.free_m * slope,
            0.5 * field.feature_size_m(), slope};
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
                             const LevelSettings& settings, const TextureSettings& texture)
    : field_(required("volume contact: field", std::move(field))), settings_(settings),
      scale_(LevelScale::of(*field_, settings)), bare_trust_m_(scale_.trust_m),
      bare_patch_cosine_(field_->patch_cosine()), patch_cosine_(bare_patch_cosine_),
      sampler_(field_->make_sampler()), texture_(texture, field_->relief_limit_m()),
      level_(settings.level) {
    set_gain({});
    set_texture_gain(1.0);
}

void VolumeContact::set_gain(const Gain& gain) noexcept {
    strength_ = SurfaceStrength::of(settings_.strength_n, settings_.yielding, gain);
    if (strength_.off) open();
}

void VolumeContact::set_texture_gain(double gain) noexcept {
    texture_.set_gain(gain);
    const bool bare = texture_.none();
    scale_.trust_m = bare ? bare_trust_m_ : std::min(bare_trust_m_, texture_.trust_m());
    patch_cosine_ = bare ? bare_patch_cosine_ : std::min(bare_patch_cosine_, kTexturePatch);
}

/// Samples what is felt at the proxy.
void VolumeContact::look(const Vec3& point) noexcept {
    here_ = sampler_->sample(point);
    bare_value_ = here_.value;
    if (!texture_.none()) here_ = texture_.felt(here_, point);
}

double VolumeContact::felt_value(const Vec3& point) noexcept {
    if (texture_.none()) return sampler_->value(point);
    return texture_.felt(sampler_->sample(point), point).value;
}

/// Where a chord that begins in front meets what is felt, or has gone as far as a look ahead can
/// tell; never behind the exact first root of the field's own level.
std::optional<double> VolumeContact::felt_root(const Vec3& from, const Vec3& to) noexcept {
    if (texture_.none()) return sampler_->first_root(from, to, level_);
    const double crest_level = level_ - kLayer * texture_.highest_m() * scale_.typical_slope;
    std::optional<double> entry = sampler_->first_root(from, to, crest_level);
    if (!entry) return std::nullopt;
    const std::optional<double> of_field = sampler_->first_root(from, to, level_);
    const double end = of_field.value_or(1.0);
    if (end <= *entry) return of_field; // a chord that is not finite
    // A chord with an entry before its end has a length.
    const double step = kLayerStep * scale_.trust_m / glm::length(to - from);
    double low = *entry;
    if (felt_value(between(from, to, low)) >= level_) return refined_root(from, to, 0.0, low);
    for (int i = 0; i < kMostLayerSteps; ++i) {
        const double t = std::min(low + step, end);
        const Vec3 point = between(from, to, t);
        const bool last = t >= end;
        if (felt_value(point) >= level_ || (last && of_field))
            return refined_root(from, to, low, t);
        if (last) return std::nullopt;
        low = t;
        if (sampler_->value(point) >= crest_level) continue;
        entry = sampler_->first_root(point, to, crest_level); // out of the layer
        if (!entry) return std::nullopt;
        low += *entry * (1.0 - t);
    }
    return low;
}

/// Just in front of a root between two shares of a chord, by regula falsi.
double VolumeContact::refined_root(const Vec3& from, const Vec3& to, double low,
                                   double high) noexcept {
    const double near = 0.5 * kRootShare * scale_.free;
    const auto beyond = [&](double t) { return felt_value(between(from, to, t)) - level_ + near; };
    double below = beyond(low);
    double above = beyond(high);
    int side = 0; // of the last value
    for (int i = 0; i < kMostRefinements && below < -near; ++i) {
        const double t = low + (high - low) * below / (below - above); // < 0 - > 0
        const double value = beyond(t);
        if (value < 0.0) {
            low = t;
            below = value;
            if (side < 0) above *= 0.5; // Illinois: no end may stay for ever
            side = -1;
        } else {
            if (value <= near) return t;
            high = t;
            above = value;
            if (side > 0) below *= 0.5;
            side = 1;
        }
    }
    return low;
}

bool VolumeContact::restart(const Vec3& proxy) noexcept {
    bundle_.clear();
    engaged_ = false;
    level_ = settings_.level;
    const bool inside = felt_value(proxy) >= level_;
    state_ = inside ? SurfaceState::inside : SurfaceState::free;
    return inside;
}

void VolumeContact::open() noexcept {
    bundle_.clear();
    state_ = SurfaceState::inside;
}

void VolumeContact::offer(const Vec3& proxy, ContactSet& contacts, NearestPlane* nearest) noexcept {
    engaged_ = false;
    offered_ = 0;
    if (not_felt()) return;
    look(proxy);
    if (nearest) nearest->found = plane_within(here_, proxy, settings_, scale_, nearest->reach_m);
    ContactPlane contact;
    if (!level_plane(here_, proxy, level_, settings_, scale_, contact)) {
        bundle_.clear();
        // Inside without a normal, as on a plateau: not a surface to be met, but a depth not to
        // exceed.
        engaged_ = here_.value >= level_;
        return;
    }
    engaged_ = true;
    bundle_.forget_beyond(proxy, scale_.trust_m);
    bundle_.remember(contact, proxy, patch_cosine_);
    offered_ = bundle_.offer(strength_.offered_n, contacts);
}

void VolumeContact::keep_active(const ProxySolution& solution, std::size_t first) noexcept {
    if (offered_ == bundle_.size()) bundle_.keep_active(solution, first);
}

/// What may deadlock is the field's own certificate, so it is the field that is descended.
std::optional<Vec3> VolumeContact::restore(const Vec3& proxy) noexcept {
    if (not_felt() || !(bare_value_ > level_ + kRestoreShare * scale_.certificate))
        return std::nullopt;
    return downhill(proxy, texture_.none() ? here_ : sampler_->sample(proxy));
}

std::optional<Vec3> VolumeContact::settle(const Vec3& proxy) noexcept {
    if (not_felt()) return std::nullopt;
    look(proxy);
    engaged_ = true; // the chord to the level is judged by the certificate, not as a stop
    const bool behind = here_.value > level_;
    if (behind && texture_.none()) return downhill(proxy, here_);
    const double slope = glm::length(here_.slope);
    if (!here_.valid || !(slope > 0.0)) return std::nullopt;
    const double step = std::min(2.0 * std::abs(level_ - here_.value) / slope, scale_.trust_m);
    const Vec3 target = proxy + ((behind ? -step : step) / slope) * here_.slope;
    const Vec3& front = behind ? target : proxy;
    const Vec3& back = behind ? proxy : target;
    const std::optional<double> root = felt_root(front, back);
    return root ? std::optional(between(front, back, *root)) : std::nullopt;
}

/// A point down the field's slope with nothing higher in between, at the level if it is passed.
std::optional<Vec3> VolumeContact::downhill(const Vec3& proxy, const FieldSample& at) noexcept {
    const double slope = glm::length(at.slope);
    if (!at.valid || !(slope > 0.0)) return std::nullopt;

    const Vec3 direction = -at.slope / slope;
    double step = std::min(2.0 * (at.value - level_) / slope, scale_.trust_m);
    const double ceiling = at.value + kRoundingShare * scale_.certificate;
    for (int halving = 0; halving <= kRestoreHalvings; ++halving, step *= 0.5) {
        const Vec3 target = proxy + step * direction;
        const double value = sampler_->value(target);
        if (!(value < at.value) || sampler_->first_root(proxy, target, ceiling)) continue;
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
    if (!engaged_) return {felt_root(from, to).value_or(1.0), false};
    const double limit =
        std::max(level_ + scale_.certificate, bare_value_ + kRoundingShare * scale_.certificate);
    return {sampler_->first_root(from, to, limit).value_or(1.0), true};
}

std::optional<Vec3> VolumeContact::obstructed(const Vec3& from, const Vec3& to,
                                              double fraction) noexcept {
    if (not_felt()) return std::nullopt;
    std::optional<Vec3> reached;
    double blocked_at = fraction;
    if (here_.value < level_) {
        if (const std::optional<double> root = felt_root(from, to)) {
            reached = between(from, to, *root);
            blocked_at = *root;
        }
    }
    const Vec3 beyond = between(from, to, blocked_at + kPastRoot);
    ContactPlane contact;
    const FieldSample there = texture_.felt(sampler_->sample(beyond), beyond);
    if (level_plane(there, beyond, level_, settings_, scale_, contact))
        bundle_.remember(contact, from, patch_cosine_);
    return reached;
}

void VolumeContact::commit(const Vec3& proxy, bool yielded, bool felt) noexcept {
    const bool hard = strength_.is_hard();
    // A hard surface is left when it is not felt, and never moves its level (composition.md 4.1).
    if (hard && level_ == settings_.level && !not_felt()) {
        state_ = next_state(state_, {felt, false, true, true});
        return;
    }
    const double value = felt_value(proxy), before = level_;
    state_ = next_state(state_, {felt, yielded, value < settings_.level,
                                 !strength_.off && value < settings_.level - scale_.free});
    if (state_ != SurfaceState::yielded)
        level_ = settings_.level;
    else if (hard)
        level_ = std::clamp(value, settings_.level, level_); // once it was not: only outwards
    else if (yielded || !felt)
        level_ = std::max(settings_.level, value); // play: it holds where it was pushed to
    if (level_ != before) bundle_.sink(level_ - before);
}

std::any VolumeContact::save_state() const {
    return State{strength_, texture_.gain(), level_, state_, bundle_};
}

void VolumeContact::restore_state(const std::any& state) {
    const auto& from = std::any_cast<const State&>(state);
    strength_ = from.strength;
    set_texture_gain(from.texture_gain);
    level_ = from.level;
    state_ = from.state;
    bundle_ = from.bundle;
}

bool VolumeContact::go_on_from(const SurfaceContact& before) noexcept {
    const auto* from = dynamic_cast<const VolumeContact*>(&before);
    if (!from) return false;
    level_ = from->level_;
    state_ = from->state_;
    bundle_ = from->bundle_;
    return true;
}

QueryCount VolumeContact::queries() const noexcept {
    return {sampler_->samples() + texture_.samples(), sampler_->roots(), 0};
}

} // namespace palpate
