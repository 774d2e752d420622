// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <palpate/engine/study/internal/interleaved.h>
#include <palpate/engine/truth/felt_level.h>

namespace palpate::internal {

/// The one level that is felt in a scene, if it is one.                                  [setup]
std::optional<FeltLevel> the_felt_level(const Scene& scene);

/// The mesh that baseline finger_proxy goes on: that of the one surface that is felt or, where it
/// is the level of a formula and `resources` can extract, one of it from where proxies touch it,
/// with the surface's own criteria or 2 mm and 0.2 mm. Null where there is none.         [setup]
/// Throws std::runtime_error when cancelled.
std::shared_ptr<const SurfaceScene> mesh_to_walk_on(const Scene& scene,
                                                    const SceneResources* resources,
                                                    const ConvergedProxies* converged);

/// Adds an entry like this one for each baseline that it can have: kBaselines over its scene's one
/// felt level, and finger_proxy on a mesh that is not null.                              [setup]
void add_baselines(const StudyEntry& like, std::shared_ptr<const SurfaceScene> mesh,
                   std::vector<StudyEntry>& entries);

/// Adds finger_proxy alone, on a mesh that is not null.                                  [setup]
void add_finger_proxy(const StudyEntry& like, std::shared_ptr<const SurfaceScene> mesh,
                      std::vector<StudyEntry>& entries);

/// The baseline of an entry, over the one level of its scene or on its mesh: it must have what the
/// kind needs.                                                                           [setup]
std::unique_ptr<Contestant> make_baseline_contestant(const StudyEntry& entry, Clock& clock);

} // namespace palpate::internal
