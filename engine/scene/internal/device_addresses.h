// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/engine/scene/scene_description.h>

namespace palpate::internal {

/// Refuses an address that no device of its kind can have, whatever is attached: an option that
/// there is not, or a value out of range. [setup] Throws std::invalid_argument "what; what to do".
void check_address(const DeviceDescription& device);

} // namespace palpate::internal
