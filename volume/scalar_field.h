// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include <palpate/geometry/vec.h>

namespace palpate {

/// What a scalar field is at a point. U stands for the field's own unit (HU, T1 signal, metres
/// ...).
struct FieldSample {
    double value = 0.0; ///< U
    Vec3 slope{0.0}; ///< exact derivative of `value` as it is interpolated, U/m; jumps from cell to
                     ///< cell in a grid
    Vec3 gradient{0.0}; ///< continuous gradient, U/m; in a grid node central differences
                        ///< interpolated (numerics 3.3)
    Mat3 hessian{0.0};  ///< derivative of `gradient`, U/m^2: hessian * step is its change; need not
                        ///< be symmetric in a grid
    bool valid = false; ///< false: no data here (outside the grid, all corners NaN); the value is
                        ///< then the background, the rest 0
};

/// One loop's access to a field: keeps what makes the next query cheap. Not for two threads at
/// once. What is marked [loop] neither allocates, locks, throws nor calls the system, ends in
/// bounded time, and gives the same bits for the same point, whatever was asked before: replay
/// rests on it. At a point that is not finite it answers anything, without harm.
class FieldSampler {
public:
    virtual ~FieldSampler() = default;

    /// Value, both gradients and Hessian at a scene point (m).                          [loop]
    virtual FieldSample sample(const Vec3& point) noexcept = 0;

    /// The value alone, U; the background where there is no data.                       [loop]
    virtual double value(const Vec3& point) noexcept = 0;

    /// The smallest t in [0,1] at which the value on the segment from + t (to - from) reaches
    /// `level` from below; 0 when it starts there. The returned t is on the lower side of the root:
    /// no value before it reaches the level, up to rounding. Nothing where there is none. Exact for
    /// the field as interpolated: a cell's cubic, not a march. A segment that is not finite is
    /// answered by 0: it leads nowhere.                                              [loop]
    virtual std::optional<double> first_root(const Vec3& from, const Vec3& to,
                                             double level) noexcept = 0;

    std::uint64_t samples() const noexcept {
        return samples_;
    }                                                       ///< sample() and value() calls so far
    std::uint64_t roots() const noexcept { return roots_; } ///< first_root() calls so far

protected:
    std::uint64_t samples_ = 0; ///< implementations count each sample() and value() here
    std::uint64_t roots_ = 0;   ///< and each first_root() here
};

/// A scalar field over the scene: immutable, shared by all loops; grows into the material, as
/// density does.
///
/// A program may hand in one of its own (VolumeDescription::scalar_field). It promises:
/// - Value, slope, gradient and Hessian are finite at every finite point, also beyond bounds().
/// - The value is continuous where surfaces are to be felt. Its change per metre is nowhere
///   without bound: a level is held to within certificate_m = 25 um times the typical slope, and
///   a wall that is much steeper than typical_slope() is felt as that much less exact.
/// - The gradient points into the material, and turns by little within half of feature_size_m().
///   Where it is 0 at the level, the surface has no normal and is not felt.
/// - Samplers of different loops are asked from different threads at once; const functions of the
///   field from any thread.
/// require_field() (volume_check.h) looks at these with some samples before a scene takes it. A
/// field that breaks them makes surfaces that are felt wrongly, but no force beyond the limits.
class ScalarField {
public:
    virtual ~ScalarField() = default;

    /// A new sampler; the field must outlive it.                                        [setup]
    virtual std::unique_ptr<FieldSampler> make_sampler() const = 0;

    /// Where isosurfaces can be (a formula's: of level 0), m, scene frame. A grid ends there. [any]
    virtual Box bounds() const = 0;

    /// Where the isosurface of this level can be, m, scene frame: of a formula whose level lies off
    /// its own surface more than bounds(). [any]
    virtual Box bounds_at(double level) const {
        (void)level;
        return bounds();
    }

    /// The smallest length on which the gradient turns, m: a grid's smallest spacing, a formula's
    /// smallest radius of curvature. The trust region of a proxy step is half of it. [any]
    virtual double feature_size_m() const noexcept = 0;

    /// What stands on its surfaces may be this high, m: no higher than what they bound. [any]
    virtual double relief_limit_m() const noexcept { return feature_size_m(); }

    /// Cosine above which two normals belong to one smooth patch rather than to a corner. [any]
    virtual double patch_cosine() const noexcept = 0;

    /// Median length of the slope where the field passes `level`, U/m; 0 where it never does.
    /// [setup]
    virtual double typical_slope(double level) const = 0;
};

} // namespace palpate
