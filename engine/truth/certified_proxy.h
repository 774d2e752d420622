// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/scene/scene.h>

namespace palpate {

/// Where a proxy is that no chord takes through the levels that a scene lets one feel, frame by
/// frame: what tells a method that has lost its surface from one that is in free space. By method
/// `adaptive` and contact `volume`, or `guarded` where the scene has it. Empty where levels are
/// not all that is felt, or yield.                                                      [setup]
std::vector<Vec3> certified_proxies(const Scene& scene, std::span<const DeviceState> inputs);

} // namespace palpate
