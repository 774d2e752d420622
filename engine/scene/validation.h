// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/scene/scene_description.h>

namespace palpate {

// What may be felt, wherever it was made: the reader of scene files asks this, Scene and HapticLoop
// ask it again. All throw std::invalid_argument "FIELD = VALUE is out of range; give a number in
// RANGE", or what else is wrong with which field and what to do, with FILE:LINE in front where the
// scene has one. FIELD as in C++: "effects[2].capture_m".

/// A whole scene: numbers within the ranges of scene_description.h, enumerations that exist, names
/// of volumes, materials and surfaces that the scene has, parts that go together. Opens no file.
/// [setup]
void validate(const SceneDescription& scene);
/// How a loop runs.                                                                      [setup]
void validate(const LoopDescription& loop);
/// What a device declares: nothing that is no number, nothing below 0.                  [setup]
void validate(const DeviceProperties& device);

} // namespace palpate
