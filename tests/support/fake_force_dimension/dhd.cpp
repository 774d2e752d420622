// SPDX-License-Identifier: Apache-2.0
// The fake's side of dhdc.h: one device, in metres, called by its user.
#include <dhdc.h>

#include "fake_hand.h"

namespace {

constexpr double kWatchdogStep_s = 125e-6; // the manual's
bool is_open = false, has_force = false;
const char* last_error = "no error";

int failed(const char* why) {
    last_error = why;
    return -1;
}

} // namespace

extern "C" {

FAKE_API int dhdOpen() {
    const double middle[3] = {0.0, 0.0, 0.0};
    if (is_open || fake_state() == FAKE_LOST) return failed("no device found");
    is_open = true;
    fake_begin(middle);
    return 0;
}

FAKE_API int dhdClose(char) {
    is_open = has_force = false;
    return 0;
}

FAKE_API const char* dhdGetSystemName(char) { return "fake omega.3"; }

FAKE_API int dhdEnableForce(unsigned char value, char) {
    if (fake_call_fails()) return failed("communication error");
    has_force = value == DHD_ON;
    return 0;
}

FAKE_API int dhdSetWatchdog(unsigned char value, char) {
    fake_set_watchdog(value * kWatchdogStep_s);
    return 0;
}

FAKE_API int dhdGetPosition(double* x, double* y, double* z, char) {
    double position[3], velocity[3];
    if (fake_call_fails()) return failed("communication error");
    if (fake_state() == FAKE_SILENT) return DHD_TIMEGUARD;
    fake_move(position, velocity);
    *x = position[0], *y = position[1], *z = position[2];
    return 0;
}

FAKE_API int dhdGetLinearVelocity(double* x, double* y, double* z, char) {
    double position[3], velocity[3];
    if (fake_call_fails()) return failed("communication error");
    fake_move(position, velocity);
    *x = velocity[0], *y = velocity[1], *z = velocity[2];
    return 0;
}

FAKE_API unsigned int dhdGetButtonMask(char) { return 1; }

FAKE_API int dhdSetForce(double x, double y, double z, char) {
    const double force[3] = {x, y, z}, none[3] = {0.0, 0.0, 0.0};
    if (fake_call_fails()) return failed("communication error");
    fake_push(has_force ? force : none);
    return x * x + y * y + z * z > 12.0 * 12.0 ? DHD_MOTOR_SATURATED : 0;
}

FAKE_API int dhdStop(char) {
    const double none[3] = {0.0, 0.0, 0.0};
    has_force = false;
    fake_push(none);
    return fake_state() == FAKE_LOST ? failed("communication error") : 0;
}

FAKE_API const char* dhdErrorGetLastStr() { return last_error; }

FAKE_API double dhdGetTime() { return fake_now_s(); }
}
