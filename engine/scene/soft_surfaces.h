// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_description.h>
#include <palpate/haptics/choices.h>
#include <palpate/haptics/effects/effect.h>

namespace palpate {

/// Whether a surface is felt as soft: somewhere softer than the scene's coupling.       [setup]
bool is_soft(const SceneDescription& scene, const SurfaceDescription& surface);

/// How soft it is felt, as `palpate explain` says it; empty where the scene says nothing of it.
/// [setup]
std::string softness_in_words(const SceneDescription& scene, const SurfaceDescription& surface);

/// What to do so that a surface is felt as soft up to this stiffness, N/m: a stiffer coupling,
/// where one may be so stiff. [setup]
std::string stiffer_coupling_in_words(double stiffness_n_per_m);

/// Whether a soft surface is felt, and it is all that is felt, but for what only pushes: then its
/// tip follows from its front (docs/palpation.md). The scene's effects name surfaces that exist.
/// [setup]
bool is_soft_and_alone(const SceneDescription& scene);
/// The same of what is on in a scene.                                                   [setup]
bool is_soft_and_alone(const Scene& scene);

/// Whether a soft surface is felt that is not all that is felt: its tip is solved, and method
/// adaptive alone is for that (docs/palpation.md).                                       [setup]
bool has_soft_layers(const Scene& scene);

namespace internal {

/// Refuses an effect, by its index, of a soft surface that is not alone, where that would have to
/// act on its front; and such a surface itself (docs/palpation.md). Volumes, surfaces and effects
/// have been checked. Throws std::invalid_argument as FieldCheck does. [setup]
void check_beside_soft(const SceneDescription& scene, std::size_t effect_index);

/// The same of a loop over a scene, which may have another method, and effects of the program's own
/// that hold the tip. In the same words. [setup]
void check_soft_in_loop(const Scene& scene, SteppingMethod method,
                        std::span<const std::shared_ptr<Effect>> custom);

} // namespace internal
} // namespace palpate
