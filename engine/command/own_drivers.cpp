// SPDX-License-Identifier: Apache-2.0
// Palpate's own drivers behind the functions of a plug-in, so that they pass the same checks.
#include <palpate/engine/command/driver_trial.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <palpate/drivers/simulated_hand.h>
#include <palpate/engine/devices/device_factory.h>
#include <palpate/engine/scene/scene_overrides.h>
#include <palpate/version.h>

namespace palpate::command {
namespace {

constexpr double kRate_hz = 1000.0; // a scene's, where it says none

DeviceMaker make_device_of_ours; // of plugin_of()
std::string open_reason;         // of the last open

/// A device of ours, and what was written to it.
struct Own {
    std::unique_ptr<HapticDevice> device;
    double force_n[3] = {};
    bool is_started = false;
    bool has_ended = false;
    std::string reason;
};

Own& own(void* device) { return *static_cast<Own*>(device); }

int open(const palpate_plugin_options* options, void** device) {
    if (options->count > 0) {
        open_reason = std::string("the option ") + options->keys[0] + " is unknown; leave it out";
        return PALPATE_PLUGIN_FAILED;
    }
    try {
        auto opened = std::make_unique<Own>();
        opened->device = make_device_of_ours();
        opened->device->open();
        *device = opened.release();
        return PALPATE_PLUGIN_OK;
    } catch (const std::exception& error) {
        open_reason = error.what();
        return PALPATE_PLUGIN_FAILED;
    }
}

int properties(void* device, palpate_plugin_properties* said) {
    const DeviceProperties known = own(device).device->properties();
    const std::size_t length = std::min(known.name.size(), sizeof said->name - 1);
    std::memcpy(said->name, known.name.data(), length);
    said->rate_hz = kRate_hz;
    said->longest_call_s = 1e-3;
    said->stale_after_s = 0.1;
    said->force_n = known.force_n;
    if (std::isfinite(known.stiffness_n_per_m)) said->stiffness_n_per_m = known.stiffness_n_per_m;
    said->damping_n_s_per_m = known.damping_n_s_per_m;
    said->position_step_m = known.position_step_m;
    said->delay_s = known.delay_s;
    for (int i = 0; i < 3 && !known.workspace_m.empty(); ++i) {
        said->workspace_lower_m[i] = known.workspace_m.lower[i];
        said->workspace_upper_m[i] = known.workspace_m.upper[i];
    }
    said->buttons = 32; // which there are, nobody says
    said->measures_velocity = known.velocity_source == VelocitySource::device ? 1 : 0;
    said->is_simulated = dynamic_cast<SimulatedHand*>(own(device).device.get()) != nullptr ? 1 : 0;
    return PALPATE_PLUGIN_OK;
}

int start(void* device) {
    try {
        own(device).device->start();
        own(device).is_started = true;
        return PALPATE_PLUGIN_OK;
    } catch (const std::exception& error) {
        own(device).reason = error.what();
        return PALPATE_PLUGIN_FAILED;
    }
}

int read(void* device, palpate_plugin_state* said) {
    DeviceState state;
    Own& one = own(device);
    std::copy_n(one.force_n, 3, said->held_force_n);
    if (!one.is_started || one.has_ended || !one.device->read(state)) {
        one.has_ended = one.is_started;
        return PALPATE_PLUGIN_NOTHING_NEW;
    }
    said->time_s = state.time_s;
    for (int i = 0; i < 3; ++i) {
        said->position_m[i] = state.position[i];
        said->velocity_m_per_s[i] = state.velocity[i];
    }
    const Quaternion& q = state.orientation;
    const double turned[4] = {q.w, q.x, q.y, q.z};
    std::copy_n(turned, 4, said->orientation);
    said->buttons = state.buttons;
    said->is_stale = state.freshness == Freshness::stale ? 1 : 0;
    return PALPATE_PLUGIN_OK;
}

int write(void* device, const double force_n[3]) {
    Own& one = own(device);
    if (!one.is_started) return PALPATE_PLUGIN_OK;
    const Vec3 force(force_n[0], force_n[1], force_n[2]);
    one.device->write(force);
    // What the motors hold, a HapticDevice does not say; of what it is sent, this can be said.
    for (double& held : one.force_n)
        held = std::numeric_limits<double>::quiet_NaN();
    return PALPATE_PLUGIN_OK;
}

int stop(void* device) {
    own(device).device->stop();
    own(device).is_started = false;
    std::fill_n(own(device).force_n, 3, 0.0);
    return PALPATE_PLUGIN_OK;
}

void close(void* device) {
    const std::unique_ptr<Own> last(&own(device));
    last->device->close();
}

const char* reason(void* device) {
    return device == nullptr ? open_reason.c_str() : own(device).reason.c_str();
}

} // namespace

DeviceMaker own_driver(const std::string& name) {
    if (name == "hand")
        return [] {
            return std::make_unique<SimulatedHand>(
                HandSettings{}, press_into(Vec3(0.0), Vec3(0.0, 0.0, 1.0), 0.02, 0.005, 2.0, 10.0));
        };
    constexpr std::array<std::string_view, 5> kOthers{"path:", "hid:", "inverse3:", "inverse3?",
                                                      "igtl:"};
    if (name != "inverse3" &&
        std::none_of(kOthers.begin(), kOthers.end(),
                     [&](std::string_view start) { return name.starts_with(start); }))
        return nullptr;
    return [name] {
        SceneOverrides named;
        named.device = name;
        SceneDescription scene; // with nothing but the device
        apply(named, scene);
        return make_device(Scene(scene)).device;
    };
}

const palpate_device_plugin& plugin_of(DeviceMaker make) {
    static const palpate_device_plugin functions{sizeof functions,
                                                 PALPATE_DEVICE_PLUGIN_ABI,
                                                 0,
                                                 "palpate",
                                                 kVersion,
                                                 open,
                                                 properties,
                                                 start,
                                                 read,
                                                 write,
                                                 stop,
                                                 close,
                                                 reason};
    make_device_of_ours = std::move(make);
    return functions;
}

} // namespace palpate::command
