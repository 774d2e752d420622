// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "falcon/core/FalconDevice.h"

namespace libnifalcon {
class FalconFirmwareNovintSDK : public FalconFirmware {};
} // namespace libnifalcon
