// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "falcon/core/FalconDevice.h"

namespace libnifalcon {
class FalconGripFourButton : public FalconGrip {};
} // namespace libnifalcon
