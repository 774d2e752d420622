// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <palpate/engine/scene/loop_parts.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_surface.h>

namespace palpate::internal {

/// An effect that is on, as a loop has it.
struct FeltEffect {
    std::string name; ///< as warnings call it: "effect 3 (guide)"
    const Effect* effect = nullptr;
};

/// The most planes that a surface offers in an evaluation.                              [setup]
std::size_t most_planes(const SceneSurface& surface);

/// "effect 3 (guide)", of its index in the scene.                                       [setup]
std::string effect_name(const Scene& scene, std::size_t effect);

/// The scene's effects that are on and more than a property of a surface, of Scene::make_parts().
/// [setup]
std::vector<FeltEffect> felt_effects(const Scene& scene, const LoopParts& parts);

/// What will not be felt as a scene says it: primitives beyond what an evaluation has room for, of
/// the scene's surfaces with their finish and of `effects`; forces of these beyond `limit_n`, the
/// longest that is sent, N; grooves that a surface's own mesh leaves between labels. In words, a
/// line each.                                                                           [setup]
std::vector<std::string> warnings_of(const Scene& scene, std::span<const FeltEffect> effects,
                                     double limit_n);

} // namespace palpate::internal
