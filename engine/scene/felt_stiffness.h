// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_surface.h>

namespace palpate {

/// The stiffness that the hand feels of a surface of the scene where it begins to press at a place
/// of it, m, scene frame, N/m: with what lies beneath. Of a hard one the coupling's.      [any]
double stiffness_at(const Scene& scene, const SceneSurface& surface, const Vec3& place);

} // namespace palpate
