// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_surface.h>

namespace palpate::internal {

/// The surfaces that a device without a path of its own goes to: the one that it names, or each
/// that is felt, at least one. [setup]
/// Throws std::runtime_error "FILE:LINE: [device]: ..." with the reason where there is none.
std::vector<const SceneSurface*> surfaces_of_device(const Scene& scene);

} // namespace palpate::internal
