// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <palpate/engine/scene/scene.h>

namespace palpate {

/// How the files of a scene's volumes and meshes were read, where a user should know: "FILE: what",
/// each once.                                                                           [setup]
std::vector<std::string> source_warnings(const Scene& scene);

/// What will not be felt as a scene says it: what nothing certifies, surfaces that are not told
/// apart, effects that are too strong or too many. "FILE: what", a line each.           [setup]
std::vector<std::string> scene_warnings(const Scene& scene);

} // namespace palpate
