// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace libnifalcon {
class FalconKinematicStamper {};
} // namespace libnifalcon
