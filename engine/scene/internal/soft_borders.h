// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <palpate/engine/scene/scene.h>

namespace palpate::internal {

/// Soft surfaces of labels that lie side by side and share a border: each has a front of its own,
/// which pushes a finger near the border to its own side (docs/palpation.md). A line for each two,
/// with the remedy. Surfaces within each other are none. [setup]
std::vector<std::string> warnings_of_soft_borders(const Scene& scene);

} // namespace palpate::internal
