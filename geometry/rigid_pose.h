// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/geometry/vec.h>

namespace palpate {

/// Where a rigid body is: how its own frame lies in the scene. The pose {} leaves it where it is.
struct RigidPose {
    Vec3 position{0.0};                         ///< of the body's origin, m, scene frame
    Quaternion orientation{1.0, 0.0, 0.0, 0.0}; ///< body -> scene, of length 1, as (w, x, y, z)

    friend bool operator==(const RigidPose&, const RigidPose&) = default;
};

/// A pose as a map of points and directions: p -> rotation p + position. [any]
class RigidMap {
public:
    RigidMap() noexcept = default;                    ///< leaves all where it is
    explicit RigidMap(const RigidPose& pose) noexcept ///< of a body that is there
        : rotation_(glm::mat3_cast(pose.orientation)), position_(pose.position) {}

    /// From the body's frame to the scene's, m.
    Vec3 point(const Vec3& body) const noexcept { return rotation_ * body + position_; }
    Vec3 direction(const Vec3& body) const noexcept { return rotation_ * body; } ///< the same
    /// From the scene's frame to the body's, m: v R is the transpose of R times v.
    Vec3 point_back(const Vec3& scene) const noexcept { return (scene - position_) * rotation_; }
    Vec3 direction_back(const Vec3& scene) const noexcept {
        return scene * rotation_;
    }                                                           ///< the same
    const Mat3& rotation() const noexcept { return rotation_; } ///< body -> scene
    const Vec3& position() const noexcept { return position_; } ///< of the body's origin, m

private:
    Mat3 rotation_{1.0};
    Vec3 position_{0.0};
};

/// The angle between two orientations, rad, [0, pi].                                    [any]
inline double angle_between(const Quaternion& a, const Quaternion& b) noexcept {
    // By the sine of half of it, which keeps its digits where the angle is small.
    const Quaternion turn = glm::conjugate(a) * b;
    const double sine = glm::length(Vec3(turn.x, turn.y, turn.z)), square = sine * sine;
    if (sine < 0.02) // from one frame to the next: the arcsine's series, to 3e-12 of it
        return 2.0 * sine * (1.0 + square * (1.0 / 6.0 + square * (3.0 / 40.0)));
    return 2.0 * std::atan2(sine, std::abs(turn.w));
}

/// The pose at `share` of the way, [0, 1]: the origin goes straight, and the body turns about it by
/// the shorter way at a constant rate. At 1 it is `to`, to the bit.                     [any]
inline RigidPose pose_between(const RigidPose& from, const RigidPose& to, double share) noexcept {
    if (share >= 1.0) return to;
    return {from.position + share * (to.position - from.position),
            glm::slerp(from.orientation, to.orientation, share)};
}

} // namespace palpate
