// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <palpate/engine/scene/scene.h>

namespace palpate {

/// What a scene computes per evaluation, what it leaves out, and why: a table and lines of plain
/// text, what `palpate explain` prints. `prices` are measure_prices().                    [setup]
std::string scene_in_words(const Scene& scene, std::span<const double> prices);

/// The same as JSON text.                                                               [setup]
std::string scene_as_json(const Scene& scene, std::span<const double> prices);

/// What moves a hand, as scenes spell it: "orbit", "hid:wooden", "none" where nothing does. [setup]
std::string device_type(const DeviceDescription& device);

/// How the files of a scene's volumes and meshes were read, where a user should know: "FILE: what",
/// each once.                                                                           [setup]
std::vector<std::string> source_warnings(const Scene& scene);

/// What will not be felt as a scene says it: what nothing certifies, surfaces that are not told
/// apart, effects that are too strong or too many. "FILE: what", a line each.           [setup]
std::vector<std::string> scene_warnings(const Scene& scene);

} // namespace palpate
