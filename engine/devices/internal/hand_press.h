// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <palpate/drivers/simulated_hand.h>
#include <palpate/engine/scene/scene.h>

namespace palpate::internal {

/// What a hand without a path of its own wants: to come from 20 mm in front of where the way from
/// its side to the middle of the scene's surface meets that, to be depth_mm behind it after a
/// second, to stay, and to go back within the last second. Scene frame, m.              [setup]
/// Throws std::runtime_error where that way meets no surface.
std::vector<HandIntent> press_of(const Scene& scene);

} // namespace palpate::internal
