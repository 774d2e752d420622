// SPDX-License-Identifier: Apache-2.0
//
// A Novint Falcon for Palpate, by libnifalcon.
//
//     g++ -std=c++20 -shared -fPIC -fvisibility=hidden -I PREFIX/include
//         falcon.cpp -o falcon.so -lnifalcon -lpthread
//     palpate validate driver ./falcon.so
//     palpate trace SCENE --pace realtime --device plugin:./falcon.so
//
// The option index=NUMBER chooses one of several. Each exchange with the device sends a force and
// brings a position, so a thread of ours makes them, 1000 a second. It shares a few numbers with
// Palpate's read and write, under a mutex that is held only to copy them. libnifalcon's units are
// ours, its axes are x to the right, y up, z towards the user.
//
// After start, pull the grip out and push it in once: so its encoders find their zero.
//
// Not run with a device by its authors: their tests run it with a fake of the library. Begin with
// small forces.
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>

#include <falcon/core/FalconDevice.h>
#include <falcon/firmware/FalconFirmwareNovintSDK.h>
#include <falcon/grip/FalconGripFourButton.h>
#include <falcon/kinematic/FalconKinematicStamper.h>
#include <falcon/util/FalconFirmwareBinaryNvent.h>

#include <palpate/device_plugin.h>

namespace {

using Vector = std::array<double, 3>;

constexpr double kLongestForce_n = 8.0; // the data sheet's 2 lb, and a little less
constexpr double kForceHold_s = 0.05;   // a force that nobody has renewed for longer ends
constexpr double kMiddle_m = 0.125;     // of its workspace, in front of its base, about
constexpr int kFirmwareTries = 10;      // it often fails at first
constexpr auto kHoming = std::chrono::seconds(9);
constexpr auto kPeriod = std::chrono::milliseconds(1);

double now_s() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

struct Device {
    libnifalcon::FalconDevice falcon;
    std::thread thread;
    std::atomic<bool> is_started{false};
    char reason[200] = "";

    std::mutex mutex; // of what follows, in our axes
    Vector position_m{}, force_n{}, held_n{};
    double measured_s = 0.0, told_s = -1e9, held_s = -1e9;
    unsigned int buttons = 0;
};

char open_reason[200] = "";

Device& of(void* opened) { return *static_cast<Device*>(opened); }

int fail(char (&reason)[200], const char* what, const char* remedy, int code = 0) {
    std::snprintf(reason, sizeof reason, "libnifalcon: %s (code %d); %s", what, code, remedy);
    return PALPATE_PLUGIN_FAILED;
}

/// A force, and its answer: where the grip is. False where nothing has come.
bool exchange(Device& device) {
    Vector force{};
    {
        const std::lock_guard lock(device.mutex);
        if (now_s() - device.told_s <= kForceHold_s) force = device.force_n;
    }
    double theirs[3] = {force[1], force[2], force[0]};
    device.falcon.setForce(theirs);
    if (!device.falcon.runIOLoop()) return false;
    const double* at = device.falcon.getPosition();
    const std::lock_guard lock(device.mutex);
    device.position_m = {at[2] - kMiddle_m, at[0], at[1]};
    device.buttons = device.falcon.getFalconGrip()->getDigitalInputs() & 0xFu;
    device.held_n = force;
    device.measured_s = device.held_s = now_s();
    return true;
}

bool has_firmware(libnifalcon::FalconDevice& falcon) {
    using namespace libnifalcon;
    if (falcon.isFirmwareLoaded()) return true;
    for (int i = 0; i < kFirmwareTries; ++i)
        if (falcon.getFalconFirmware()->loadFirmware(
                false, NOVINT_FALCON_NVENT_FIRMWARE_SIZE,
                const_cast<std::uint8_t*>(NOVINT_FALCON_NVENT_FIRMWARE)))
            return true;
    return false;
}

int open_falcon(Device& device, std::uint8_t index) {
    libnifalcon::FalconDevice& falcon = device.falcon;
    falcon.setFalconFirmware<libnifalcon::FalconFirmwareNovintSDK>();
    falcon.setFalconKinematic<libnifalcon::FalconKinematicStamper>();
    falcon.setFalconGrip<libnifalcon::FalconGripFourButton>();
    if (!falcon.open(index))
        return fail(open_reason, "no Falcon can be opened",
                    "plug it in and give it power, and let this user open the USB device",
                    falcon.getErrorCode());
    if (has_firmware(falcon)) return PALPATE_PLUGIN_OK;
    fail(open_reason, "it does not take its firmware", "unplug it, wait, plug it in again",
         falcon.getErrorCode());
    falcon.close();
    return PALPATE_PLUGIN_FAILED;
}

int device_open(const palpate_plugin_options* options, void** opened) try {
    long index = 0;
    for (std::size_t i = 0; i < options->count; ++i) {
        char* end = nullptr;
        if (std::strcmp(options->keys[i], "index") != 0)
            return fail(open_reason, "an option is not \"index\"", "leave it out");
        index = std::strtol(options->values[i], &end, 10);
        if (*end != '\0' || index < 0 || index > 7)
            return fail(open_reason, "index is no number from 0 to 7", "as ?index=0");
    }
    auto device = std::make_unique<Device>();
    if (open_falcon(*device, static_cast<std::uint8_t>(index)) != PALPATE_PLUGIN_OK)
        return PALPATE_PLUGIN_FAILED;
    *opened = device.release();
    return PALPATE_PLUGIN_OK;
} catch (const std::exception& error) {
    return fail(open_reason, error.what(), "end other programs");
}

int device_properties(void*, palpate_plugin_properties* properties) {
    std::snprintf(properties->name, sizeof properties->name, "Novint Falcon");
    properties->rate_hz = 1000.0;
    properties->longest_call_s = 1e-3;
    properties->stale_after_s = 0.02;
    properties->force_n = kLongestForce_n;
    properties->position_step_m = 60e-6; // 400 dpi
    properties->delay_s = 2e-3;          // an exchange, and the wait for the next one
    properties->buttons = 4;
    return PALPATE_PLUGIN_OK;
}

int device_start(void* opened) try {
    Device& device = of(opened);
    device.falcon.getFalconFirmware()->setHomingMode(true);
    const auto until = std::chrono::steady_clock::now() + kHoming;
    while (!device.falcon.getFalconFirmware()->isHomed()) {
        if (std::chrono::steady_clock::now() > until)
            return fail(device.reason, "its grip was not moved to its ends",
                        "pull it out and push it in, and start again",
                        device.falcon.getErrorCode());
        device.falcon.runIOLoop();
        std::this_thread::sleep_for(kPeriod);
    }
    device.is_started = true;
    device.thread = std::thread([&device] {
        while (device.is_started) {
            exchange(device);
            std::this_thread::sleep_for(kPeriod);
        }
    });
    return PALPATE_PLUGIN_OK;
} catch (const std::exception& error) {
    of(opened).is_started = false;
    return fail(of(opened).reason, error.what(), "end other programs");
}

int device_read(void* opened, palpate_plugin_state* state) {
    Device& device = of(opened);
    const std::lock_guard lock(device.mutex);
    const bool is_held = now_s() - device.held_s <= kForceHold_s;
    for (int i = 0; i < 3; ++i) {
        state->held_force_n[i] = is_held ? device.held_n[i] : 0.0;
        state->position_m[i] = device.position_m[i];
    }
    state->time_s = device.measured_s;
    state->buttons = device.buttons;
    return device.measured_s > 0.0 ? PALPATE_PLUGIN_OK : PALPATE_PLUGIN_NOTHING_NEW;
}

int device_write(void* opened, const double force_n[3]) {
    Device& device = of(opened);
    if (!device.is_started) return PALPATE_PLUGIN_OK;
    const double length = std::hypot(force_n[0], force_n[1], force_n[2]);
    const double share = length > kLongestForce_n ? kLongestForce_n / length : 1.0;
    const std::lock_guard lock(device.mutex);
    for (int i = 0; i < 3; ++i)
        device.force_n[i] = std::isfinite(length) ? share * force_n[i] : 0.0;
    device.told_s = now_s();
    return PALPATE_PLUGIN_OK;
}

int device_stop(void* opened) {
    Device& device = of(opened);
    device.is_started = false;
    if (device.thread.joinable()) device.thread.join();
    device.told_s = -1e9; // no force from here on
    for (int i = 0; i < 50 && !exchange(device); ++i)
        std::this_thread::sleep_for(kPeriod);
    device.measured_s = 0.0; // what was measured is not of the next start
    return PALPATE_PLUGIN_OK;
}

void device_close(void* opened) {
    of(opened).falcon.close();
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
        .name = "libnifalcon",
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
