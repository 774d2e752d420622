// SPDX-License-Identifier: Apache-2.0
// The fake's side of falcon/core/FalconDevice.h: a device that takes its firmware at the third try,
// and is homed after 20 exchanges.
#include <falcon/core/FalconDevice.h>

#include <cstring>

#include "fake_hand.h"

namespace libnifalcon {
namespace {

constexpr double kMiddle_m[3] = {0.0, 0.0, 0.125};
bool is_open = false, is_loaded = false, is_homing = false;
int tries = 0, exchanges = 0, code = 0;

} // namespace

FAKE_API bool FalconFirmware::loadFirmware(bool, const unsigned int& size, std::uint8_t* buffer) {
    is_loaded = ++tries % 3 == 0 && size == 4 && buffer[0] == 1;
    return is_loaded;
}

FAKE_API void FalconFirmware::setHomingMode(bool value) { is_homing = value; }

FAKE_API bool FalconFirmware::isHomed() { return is_homing && exchanges > 20; }

FAKE_API unsigned int FalconGrip::getDigitalInputs() const { return 1; }

FAKE_API bool FalconDevice::open(std::uint8_t index) {
    code = 2002;
    if (is_open || index != 0 || fake_state() == FAKE_LOST) return false;
    is_open = true;
    is_loaded = false; // it loses its firmware with its power
    exchanges = 0;
    code = 0;
    fake_begin(kMiddle_m);
    return true;
}

FAKE_API void FalconDevice::close() { is_open = false; }

FAKE_API bool FalconDevice::isFirmwareLoaded() { return is_loaded; }

FAKE_API bool FalconDevice::runIOLoop(std::uint8_t) {
    double velocity[3];
    if (fake_call_fails()) {
        code = 2001;
        return false;
    }
    if (!is_open || !is_loaded) return false;
    fake_push(force_);
    if (fake_state() == FAKE_SILENT) return false; // what is sent arrives, and is not answered
    ++exchanges;
    if (has_kinematic_) fake_move(position_, velocity);
    return true;
}

FAKE_API void FalconDevice::setForce(double force[3]) { std::memcpy(force_, force, sizeof force_); }

FAKE_API int FalconDevice::getErrorCode() { return code; }

} // namespace libnifalcon
