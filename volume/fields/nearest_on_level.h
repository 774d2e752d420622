// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <palpate/geometry/vec.h>
#include <palpate/volume/scalar_field.h>

namespace palpate {

/// The point of a level that is nearest to another, as far as the slope leads there.
struct LevelFoot {
    Vec3 position{0.0};   ///< m, scene frame: on the level to 1e-11 m
    double depth_m = 0.0; ///< distance from the point, m; > 0 where that has a higher value
};

/// Newton steps along the slope find the level, a bracketed root on the line from the point puts a
/// foot on it, and the line is turned along the slope there as long as that brings the foot nearer.
/// So a distance is that to a true point of the level as interpolated, never too small. It is too
/// large where another sheet is nearer than the one that the slope leads to, by a fraction of a
/// percent where a kink between cells holds the foot, and where the point is farther away than the
/// level is round. `feature_size_m` > 0: ScalarField's; nothing where the slope leads nowhere,
/// within 30 steps of at most a feature size each, or farther than `reach_m`. Some 50 samples,
/// bounded; deterministic. m, scene frame. [loop]
std::optional<LevelFoot> foot_on_level(FieldSampler& sampler, double level, double feature_size_m,
                                       const Vec3& point, double reach_m) noexcept;

/// The same, but the level is first looked for from `start`, and the foot then slides along the
/// level as long as that brings it nearer, however far away the point is: up to some ten thousand
/// samples where the level is noise. [setup]
std::optional<LevelFoot> nearest_on_level(FieldSampler& sampler, double level,
                                          double feature_size_m, const Vec3& point,
                                          const Vec3& start, double reach_m) noexcept;

} // namespace palpate
