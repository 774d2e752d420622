// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/drivers/internal/space_mouse_reports.h>
#include <palpate/drivers/space_mouse.h>

namespace palpate::internal {

/// A probe that a deflected cap drives: deflection -> speed -> place, kept within a box. It begins
/// in the middle of the box. Device frame.
class RateControlledProbe {
public:
    /// Throws std::invalid_argument that names the setting, its range and value.        [setup]
    explicit RateControlledProbe(const SpaceMouseSettings& settings);

    /// Moves on by `seconds`; not by more than 0.05 s however long the pause was: a probe does not
    /// jump because a program was held up. At a side of the box it slides along.         [loop]
    ///   v = speed * dead_zone(push),   p' = clamp(p + v dt),   q' = exp(w dt) q
    void advance(const SpaceMouseDeflection& deflection, double seconds) noexcept;

    /// Whether a deflection moves it: it is beyond the dead zone.                         [loop]
    bool moved_by(const SpaceMouseDeflection& deflection) const noexcept;

    const Vec3& position() const noexcept { return position_; } ///< m
    const Vec3& velocity() const noexcept { return velocity_; } ///< m/s, as it has moved
    const Quaternion& orientation() const noexcept { return orientation_; }

private:
    Vec3 rate(const Vec3& deflection) const noexcept;

    SpaceMouseSettings settings_;
    Vec3 position_{0.0};
    Vec3 velocity_{0.0};
    Quaternion orientation_{1.0, 0.0, 0.0, 0.0};
};

} // namespace palpate::internal
