// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include <palpate/engine/devices/inverse_service_list.h>

namespace palpate::internal {

/// {address, answer, reason, grips, devices: [{device_id, type, handedness, calibrated, power,
/// in_use, usable, address}]}. `answer` is nobody, stranger or service.                   [any]
nlohmann::json inverse_service_json(const ListedInverseService& service);

} // namespace palpate::internal
