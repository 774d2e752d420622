// SPDX-License-Identifier: Apache-2.0
//
// An omega, delta, sigma or lambda of Force Dimension for Palpate, by their DHD library.
//
//     g++ -std=c++20 -shared -fPIC -fvisibility=hidden -I PREFIX/include
//         force_dimension.cpp -o force_dimension.so -ldhd
//     palpate validate driver ./force_dimension.so
//     palpate trace SCENE --pace realtime --device plugin:./force_dimension.so?force_n=12
//
// The option force_n is the longest force of your model's data sheet (12 N without it, which is the
// omega.3's). Their axes and units are ours: x towards the user, y to the right, z up, metres and
// newtons. All their functions are called by us, and take well under a millisecond.
//
// Not run with a device by its authors: their tests run it with a fake of the library. Begin with
// small forces.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>

#include <dhdc.h>

#include <palpate/device_plugin.h>

namespace {

constexpr unsigned char kWatchdog = 240; // x 125 us: the device ends a force that is 30 ms old
constexpr double kWatchdog_s = 240 * 125e-6;

struct Device {
    char id = -1;
    double longest_force_n = 12.0;
    bool is_started = false;
    double held_n[3] = {}; // what it was told last,
    double told_s = 0.0;   // and when
    char reason[200] = "";
};

char open_reason[200] = "";

Device& of(void* opened) { return *static_cast<Device*>(opened); }

int fail(char (&reason)[200], const char* what, const char* remedy) {
    std::snprintf(reason, sizeof reason, "Force Dimension: %s; %s", what, remedy);
    return PALPATE_PLUGIN_FAILED;
}

int read_options(const palpate_plugin_options& options, Device& device) {
    for (std::size_t i = 0; i < options.count; ++i) {
        if (std::strcmp(options.keys[i], "force_n") != 0)
            return fail(open_reason, "an option is not \"force_n\"", "leave it out");
        char* end = nullptr;
        device.longest_force_n = std::strtod(options.values[i], &end);
        if (*end != '\0' || !(device.longest_force_n > 0.0 && device.longest_force_n <= 100.0))
            return fail(open_reason, "force_n is no number above 0, up to 100", "as ?force_n=12");
    }
    return PALPATE_PLUGIN_OK;
}

int device_open(const palpate_plugin_options* options, void** opened) {
    std::unique_ptr<Device> device(new (std::nothrow) Device);
    if (!device) return fail(open_reason, "there is no memory", "end other programs");
    if (read_options(*options, *device) != PALPATE_PLUGIN_OK) return PALPATE_PLUGIN_FAILED;
    const int id = dhdOpen();
    if (id < 0)
        return fail(open_reason, dhdErrorGetLastStr(),
                    "switch it on, calibrate it, and let this user open the USB device");
    device->id = static_cast<char>(id);
    *opened = device.release();
    return PALPATE_PLUGIN_OK;
}

int device_properties(void* opened, palpate_plugin_properties* properties) {
    const Device& device = of(opened);
    std::snprintf(properties->name, sizeof properties->name, "%s", dhdGetSystemName(device.id));
    properties->rate_hz = 1000.0;
    properties->longest_call_s = 1e-3;
    properties->stale_after_s = 0.02;
    properties->force_n = device.longest_force_n;
    properties->delay_s = 0.5e-3; // a transfer each way
    properties->buttons = 8;
    properties->measures_velocity = 1; // their estimate
    return PALPATE_PLUGIN_OK;
}

int device_start(void* opened) {
    Device& device = of(opened);
    if (dhdEnableForce(DHD_ON, device.id) < 0)
        return fail(device.reason, dhdErrorGetLastStr(), "press the force button on its base");
    dhdSetWatchdog(kWatchdog, device.id); // older devices have none: then its own button ends it
    device.is_started = true;
    return PALPATE_PLUGIN_OK;
}

int device_read(void* opened, palpate_plugin_state* state) {
    Device& device = of(opened);
    const double now_s = dhdGetTime();
    const bool is_held = device.is_started && now_s - device.told_s <= kWatchdog_s;
    for (int i = 0; i < 3; ++i)
        state->held_force_n[i] = is_held ? device.held_n[i] : 0.0;
    double(&p)[3] = state->position_m;
    double(&v)[3] = state->velocity_m_per_s;
    const int result = dhdGetPosition(&p[0], &p[1], &p[2], device.id);
    if (result == DHD_TIMEGUARD) return PALPATE_PLUGIN_NOTHING_NEW;
    if (result < 0 || dhdGetLinearVelocity(&v[0], &v[1], &v[2], device.id) < 0)
        return fail(device.reason, dhdErrorGetLastStr(), "look at its cable and its power");
    state->time_s = now_s;
    state->buttons = dhdGetButtonMask(device.id) & 0xFFu;
    return PALPATE_PLUGIN_OK;
}

int device_write(void* opened, const double force_n[3]) {
    Device& device = of(opened);
    if (!device.is_started) return PALPATE_PLUGIN_OK;
    const double length = std::hypot(force_n[0], force_n[1], force_n[2]);
    double kept_n[3] = {};
    for (int i = 0; i < 3 && std::isfinite(length); ++i)
        kept_n[i] = length > device.longest_force_n ? force_n[i] * (device.longest_force_n / length)
                                                    : force_n[i];
    // DHD_MOTOR_SATURATED is no failure: a motor is at its limit.
    if (dhdSetForce(kept_n[0], kept_n[1], kept_n[2], device.id) < 0)
        return fail(device.reason, dhdErrorGetLastStr(), "look at its cable and its power");
    std::memcpy(device.held_n, kept_n, sizeof kept_n);
    device.told_s = dhdGetTime();
    return PALPATE_PLUGIN_OK;
}

int device_stop(void* opened) {
    Device& device = of(opened);
    dhdSetForce(0.0, 0.0, 0.0, device.id);
    dhdStop(device.id); // without motors: its brakes hold it softly
    device.is_started = false;
    return PALPATE_PLUGIN_OK;
}

void device_close(void* opened) {
    dhdClose(of(opened).id);
    delete &of(opened);
}

const char* device_reason(void* opened) {
    return opened == nullptr ? open_reason : of(opened).reason;
}

} // namespace

const palpate_device_plugin* palpate_device_plugin_entry(void) {
    static const palpate_device_plugin functions = {
        .size = sizeof functions,
        .abi = PALPATE_DEVICE_PLUGIN_ABI,
        .reserved = 0,
        .name = "Force Dimension",
        .version = "1.0",
        .open = device_open,
        .properties = device_properties,
        .start = device_start,
        .read = device_read,
        .write = device_write,
        .stop = device_stop,
        .close = device_close,
        .reason = device_reason,
    };
    return &functions;
}
