// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/haptics/effects/effect.h>

namespace palpate::internal {

/// Places of a hand at 0.2 m/s, one a millisecond, along an orbit so deep below a surface. None
/// where the orbit's rays miss a surface that is small.                                 [setup]
std::vector<Vec3> places_on(const SceneSurface& surface, double depth_mm);

/// Places of such a hand where `built`, which is made of `effect`, adds something to a frame; any
/// where it adds nothing anywhere that was tried.                                       [setup]
std::vector<Vec3> places_where_felt(const Scene& scene, const EffectDescription& effect,
                                    Effect& built);

/// A frame in which a hand goes from one place to another, m, for an effect alone, which may be of
/// a body that stands still.                                                              [setup]
FrameContext frame_from(const Vec3& from, const Vec3& to) noexcept;

} // namespace palpate::internal
