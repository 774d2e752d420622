// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/truth/surface_audit.h>

namespace palpate {

/// A level of a field that a scene lets one feel.
struct FeltLevel {
    std::shared_ptr<const ScalarField> field;
    LevelSettings settings;
    std::optional<FeltSphere> sphere;      ///< where it is one and does not yield
    const SceneSurface* surface = nullptr; ///< null: the zero of a formula, by gradient_surface
    std::uint64_t bit = 0;                 ///< of the surface in FrameReport; 0 past the 64th
};

/// The levels of a scene: of each surface that has a volume, however it is felt, and of each
/// gradient_surface over a formula. The scene must outlive them.                         [setup]
std::vector<FeltLevel> felt_levels(const Scene& scene);

/// Whether nothing draws the proxy along what it touches: of the effects that are on each makes
/// something felt. Then the right place on a sphere is its point nearest to the probe. [setup]
bool only_surfaces_act(const Scene& scene);

/// Whether levels are all that is felt, and none yields: then a proxy is where the levels alone
/// hold it, and one that is elsewhere has lost them.                                     [setup]
bool levels_hold_alone(const Scene& scene);

/// How deep a point is behind a level: distance to a point of the level, m; 0 in front of it. Along
/// the slope and, where that is longer than `deepest_m` or leads nowhere, to the first of the
/// spheres around it, `trust_m` apart, on which one of 26 directions is free: never too small by
/// more than rounding. 50 mm at most.                                                    [setup]
double depth_behind(const FeltLevel& level, FieldSampler& sampler, const Vec3& point,
                    double trust_m, double deepest_m);

} // namespace palpate
