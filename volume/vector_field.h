// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include <palpate/geometry/vec.h>

namespace palpate {

/// What a vector field is at a point. U stands for the field's own unit (m/s, T, 1 ...).
struct VectorSample {
    Vec3 value{0.0};      ///< U, scene frame; of a field without sense (fibres) either of the two
    Mat3 derivative{0.0}; ///< derivative * step is the change of `value`, U/m; 0 in fields without
                          ///< sense, where it is not known
    bool valid = false;   ///< false: no data here, or no direction that can be told; the rest is 0
};

/// One loop's access to a vector field. Not for two threads at once. What is marked [loop] neither
/// allocates, locks, throws nor calls the system, ends in bounded time, and gives the same bits for
/// the same point: replay rests on it.
class VectorSampler {
public:
    virtual ~VectorSampler() = default;

    /// Value and derivative at a scene point, m; no data at a point that is not finite.  [loop]
    virtual VectorSample sample(const Vec3& point) noexcept = 0;

    std::uint64_t samples() const noexcept { return samples_; } ///< sample() calls so far [any]

protected:
    std::uint64_t samples_ = 0; ///< implementations count each sample() here
};

/// A vector field over the scene: immutable, shared by all loops. A program may hand in one of its
/// own (VolumeDescription::vector_field): finite at every finite point, and its samplers asked from
/// different threads at once. An effect on fibres takes its values with either sign.
class VectorField {
public:
    virtual ~VectorField() = default;

    /// A new sampler; the field must outlive it.                                        [setup]
    virtual std::unique_ptr<VectorSampler> make_sampler() const = 0;

    /// Where the field has something to show: m, scene frame. A grid has no data outside, a formula
    /// is the same everywhere. [any]
    virtual Box bounds() const = 0;

    /// The smallest length on which the direction turns, m, > 0: a grid's smallest spacing, a
    /// formula's smallest radius of curvature. One step along the field is at most half of it.
    /// [any]
    virtual double feature_size_m() const noexcept = 0;
};

/// Curl of a field from its derivative, U/m: twice the angular velocity of what it carries. [loop]
inline Vec3 curl(const Mat3& derivative) noexcept {
    const Vec3& by_x = derivative[0];
    const Vec3& by_y = derivative[1];
    const Vec3& by_z = derivative[2];
    return {by_y.z - by_z.y, by_z.x - by_x.z, by_x.y - by_y.x};
}

/// Unit tangent of the helix around the z axis through the point, right-handed, all of one pitch:
/// (-y, x, c) / sqrt(x^2 + y^2 + c^2), c = pitch / 2 pi.                                  [setup]
/// On the axis it is z. `radius_m` is the largest radius of interest: it bounds the field and its
/// feature size; the bounds are as long as one turn to either side. Throws std::invalid_argument on
/// a parameter that is not finite or not positive.
std::unique_ptr<VectorField> make_helix(double radius_m, double pitch_m);

} // namespace palpate
