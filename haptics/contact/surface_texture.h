// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <numbers>

#include <palpate/haptics/choices.h>
#include <palpate/volume/scalar_field.h>
#include <palpate/volume/transfer_function.h>

namespace palpate {

/// What is on top of a surface: a height h(x) >= 0 in front of its level.
struct TextureSettings {
    TexturePattern pattern = TexturePattern::bumps; ///< unused with `field`
    double height_m = 0.0;      ///< H: of the highest crests, m, [0, wavelength_m / (2 pi)]
    double wavelength_m = 2e-3; ///< m, > 0
    Vec3 direction{1, 0, 0};    ///< of a grating: across its grooves, of any length > 0

    TransferFunction height_over_value; ///< with nodes: h is this function of the value of `field`,
                                        ///< and of no pattern; its strengths are read as m, finite
    std::shared_ptr<const ScalarField> field; ///< for height_over_value; else null

    /// Nothing can be felt of it.                                                        [any]
    bool none() const noexcept { return highest_m() == 0.0; }
    double highest_m() const noexcept; ///< of all heights, m                             [any]
};

/// The texture of one loop's contact with a surface whose level is f = c:
///   f + h |g| = c,   g the continuous gradient of f
/// is what is felt instead: the crests stand h in front of the level as far as f grows evenly, in
/// distances exactly, in scanned data within the blur of an edge. A flank of a pattern is no
/// steeper than 1/2, so what is felt has one level along each normal. As h >= 0 it lies nowhere
/// behind f = c, whose certificate therefore goes on holding. The pattern's second derivatives are
/// exact; of |g| the first ones are, the second are left out. Not for two threads at once.
class SurfaceTexture {
public:
    /// H / wavelength at most: the slope of a wave is at most pi H / wavelength.
    static constexpr double kHighestOfWave = 0.5 / std::numbers::pi;

    /// Throws std::invalid_argument on settings out of range, and where the highest crests are
    /// above `limit_m`, the relief_limit_m() of the surface's field.                    [setup]
    SurfaceTexture(const TextureSettings& settings, double limit_m);

    /// Heights times a gain >= 0 from now on, as far as the flanks and the limit allow; 0: none.
    /// [loop]
    void set_gain(double gain) noexcept;
    double gain() const noexcept { return gain_; }      ///< of the heights now         [loop]
    bool none() const noexcept { return gain_ == 0.0; } ///< with this gain               [loop]
    double highest_m() const noexcept { return gain_ * settings_.highest_m(); } ///< [loop]
    /// The longest step in which its planes are trusted, m.                              [any]
    double trust_m() const noexcept { return trust_m_; }

    /// What is felt at a point of which the surface's field is `bare`.                   [loop]
    FieldSample felt(const FieldSample& bare, const Vec3& point) noexcept;

    std::uint64_t samples() const noexcept { return sampler_ ? sampler_->samples() : 0; } ///< [any]

private:
    struct Height {
        double height_m = 0.0;
        Vec3 gradient{0.0}; // no unit
        Mat3 hessian{0.0};  // 1/m
    };
    Height height_at(const Vec3& point) noexcept;
    Height of_pattern(const Vec3& point) const noexcept;
    Height of_field(const Vec3& point) noexcept;

    TextureSettings settings_;
    double highest_gain_ = 0.0;
    double gain_ = 0.0;
    double trust_m_ = 0.0;
    std::unique_ptr<FieldSampler> sampler_; // of settings_.field
};

} // namespace palpate
