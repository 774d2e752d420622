// SPDX-License-Identifier: Apache-2.0
// The real one holds Novint's firmware; this one holds nothing of it.
#pragma once

#include <cstdint>

namespace libnifalcon {
const unsigned int NOVINT_FALCON_NVENT_FIRMWARE_SIZE = 4;
const std::uint8_t NOVINT_FALCON_NVENT_FIRMWARE[4] = {1, 2, 3, 4};
} // namespace libnifalcon
