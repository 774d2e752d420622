// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include <palpate/engine/scene/scene.h>

namespace palpate {

/// What a scene computes per evaluation, what it leaves out, and why: a table and lines of plain
/// text, what `palpate explain` prints. `prices` are measure_prices().                    [setup]
std::string scene_in_words(const Scene& scene, std::span<const double> prices);

/// The same as JSON text.                                                               [setup]
std::string scene_as_json(const Scene& scene, std::span<const double> prices);

/// What moves a hand, as scenes spell it: "orbit", "hid:wooden", "none" where nothing does. [setup]
std::string device_type(const DeviceDescription& device);

} // namespace palpate
