// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include <palpate/engine/scene/scene_description.h>

namespace palpate {

/// Whether a surface is felt as soft: somewhere softer than the scene's coupling.       [setup]
bool is_soft(const SceneDescription& scene, const SurfaceDescription& surface);

/// How soft it is felt, as `palpate explain` says it; empty where the scene says nothing of it.
/// [setup]
std::string softness_in_words(const SceneDescription& scene, const SurfaceDescription& surface);

/// Name of the soft surface that an effect makes felt; empty: there is none. The scene's effects
/// name surfaces that exist. [setup]
std::string felt_soft_surface(const SceneDescription& scene);

namespace internal {

/// Refuses an effect, by its index, beside a soft surface where the two are not composed
/// (docs/palpation.md). Volumes, surfaces and effects have been checked. Throws
/// std::invalid_argument as FieldCheck does.                                            [setup]
void check_beside_soft(const SceneDescription& scene, std::size_t effect);

} // namespace internal
} // namespace palpate
