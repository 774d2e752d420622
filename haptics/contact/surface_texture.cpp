// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/contact/surface_texture.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include <palpate/geometry/range.h>

namespace palpate {
namespace {

constexpr double kTau = 2.0 * std::numbers::pi;
// Of a wavelength, and of the voxels of a volume: within it a plane says where the level is.
constexpr double kTrustOfWave = 1.0 / 4.0;
constexpr double kTrustOfVoxel = 1.0 / 2.0;

std::string in_mm(double length_m) {
    std::array<char, 32> text{};
    const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), 1e3 * length_m,
                                            std::chars_format::general, 6);
    return {text.data(), end};
}

} // namespace

double TextureSettings::highest_m() const noexcept {
    return height_over_value.count > 0 ? height_over_value.strongest() : height_m;
}

SurfaceTexture::SurfaceTexture(const TextureSettings& settings, double limit_m)
    : settings_(settings) {
    if (settings.height_over_value.count > 0)
        settings.height_over_value.check("texture: height_over_value", kNotNegative);
    else
        require("texture: height_m", settings.height_m, kNotNegative);
    const double highest_m = settings.highest_m();
    if (highest_m == 0.0) return;
    if (highest_m > limit_m)
        throw std::invalid_argument("texture: its height of " + in_mm(highest_m) + " mm is above " +
                                    in_mm(limit_m) +
                                    " mm, a voxel of the surface's volume or the radius or half "
                                    "the thickness of its formula; lower it");
    double steepest_m = limit_m;
    if (settings.height_over_value.count > 0) {
        if (!settings.field) throw std::invalid_argument("texture: its height has no field");
        sampler_ = settings.field->make_sampler();
        trust_m_ = kTrustOfVoxel * settings.field->feature_size_m();
    } else {
        require("texture: wavelength_m", settings.wavelength_m, kPositive);
        if (highest_m > kHighestOfWave * settings.wavelength_m)
            throw std::invalid_argument("texture: its height must be at most wavelength / (2 pi)");
        require_direction("texture: direction", settings.direction);
        settings_.direction /= glm::length(settings.direction);
        trust_m_ = kTrustOfWave * settings.wavelength_m;
        steepest_m = std::min(limit_m, kHighestOfWave * settings.wavelength_m);
    }
    highest_gain_ = steepest_m / highest_m;
    gain_ = 1.0;
}

void SurfaceTexture::set_gain(double gain) noexcept { gain_ = std::min(gain, highest_gain_); }

SurfaceTexture::Height SurfaceTexture::of_pattern(const Vec3& point) const noexcept {
    const double k = kTau / settings_.wavelength_m;
    Height h;
    const auto add_wave = [&](const Vec3& u, double amplitude_m) {
        const double phase = k * glm::dot(u, point);
        h.height_m += amplitude_m * (1.0 - std::cos(phase));
        h.gradient += amplitude_m * k * std::sin(phase) * u;
        h.hessian += amplitude_m * k * k * std::cos(phase) * glm::outerProduct(u, u);
    };
    if (settings_.pattern == TexturePattern::grating) {
        add_wave(settings_.direction, 0.5 * settings_.height_m);
        return h;
    }
    for (int axis = 0; axis < 3; ++axis)
        add_wave(Mat3(1.0)[axis], settings_.height_m / 6.0);
    return h;
}

SurfaceTexture::Height SurfaceTexture::of_field(const Vec3& point) noexcept {
    const FieldSample here = sampler_->sample(point);
    if (!here.valid) return {};
    const double rise = settings_.height_over_value.slope(here.value); // m per U
    return {settings_.height_over_value(here.value), rise * here.slope, rise * here.hessian};
}

SurfaceTexture::Height SurfaceTexture::height_at(const Vec3& point) noexcept {
    Height h = sampler_ ? of_field(point) : of_pattern(point);
    h.height_m *= gain_;
    h.gradient *= gain_;
    h.hessian *= gain_;
    return h;
}

FieldSample SurfaceTexture::felt(const FieldSample& bare, const Vec3& point) noexcept {
    const double steepness = glm::length(bare.gradient); // |g|
    if (none() || !bare.valid || !(steepness > 0.0)) return bare;
    const Height h = height_at(point);
    const Vec3 of_steepness = glm::transpose(bare.hessian) * bare.gradient / steepness;
    const Vec3 tilt = steepness * h.gradient + h.height_m * of_steepness; // of h |g|
    FieldSample felt = bare;
    felt.value += h.height_m * steepness;
    felt.slope += tilt;
    felt.gradient += tilt;
    felt.hessian += steepness * h.hessian + glm::outerProduct(h.gradient, of_steepness) +
                    glm::outerProduct(of_steepness, h.gradient);
    return felt;
}

} // namespace palpate
