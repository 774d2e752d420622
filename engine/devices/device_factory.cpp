// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/devices/device_factory.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include <fmt/format.h>

#include <palpate/drivers/attached_devices.h>
#include <palpate/drivers/igtl_device.h>
#include <palpate/drivers/inverse3_device.h>
#include <palpate/drivers/plugin_device.h>
#include <palpate/drivers/sequence_device.h>
#include <palpate/drivers/simulated_hand.h>
#include <palpate/drivers/transform_device.h>
#include <palpate/engine/devices/hid_device.h>
#include <palpate/engine/devices/internal/device_surfaces.h>
#include <palpate/engine/devices/internal/hand_press.h>
#include <palpate/engine/devices/orbit.h>
#include <palpate/engine/devices/probe_path.h>
#include <palpate/engine/devices/surface_tour.h>
#include <palpate/engine/scene/hands.h>
#include <palpate/engine/scene/internal/scene_ranges.h>
#include <palpate/engine/scene/scene_place.h>
#include <palpate/engine/scene/scene_reader.h>
#include <palpate/engine/scene/scene_surface.h>

namespace palpate {
namespace {

using Kind = DeviceDescription::Kind;

/// Where nothing of a scene is felt yet: trials that begin there begin in front of all of it.
std::function<bool(const Vec3&)> free_of(const Scene& scene) {
    std::vector<OrbitTarget> targets;
    for (const SceneSurface& surface : scene.surfaces())
        targets.push_back(orbit_target(surface));
    return [targets = std::move(targets)](const Vec3& point) {
        return std::none_of(targets.begin(), targets.end(),
                            [&](const OrbitTarget& target) { return target.inside(point); });
    };
}

/// One path after the other, each with trials of its own.
class PathChain {
public:
    explicit PathChain(double rate_hz) : rate_hz_(rate_hz) {}

    void add(std::vector<DeviceState> path) {
        const std::uint32_t first_trial = states_.empty() ? 0 : states_.back().trial + 1;
        for (DeviceState& state : path) {
            state.time_s = static_cast<double>(states_.size()) / rate_hz_;
            state.trial += first_trial;
            states_.push_back(state);
        }
    }
    std::size_t size() const { return states_.size(); }
    std::vector<DeviceState> take() { return std::move(states_); }

private:
    double rate_hz_;
    std::vector<DeviceState> states_;
};

/// An orbit around each surface, with its share of the time.
std::vector<DeviceState> orbits(const Scene& scene, int every, std::vector<std::string>& notes) {
    const std::vector<const SceneSurface*> surfaces = internal::surfaces_of_device(scene);
    const double rate_hz = scene.description().loop.rate_hz;
    const std::function<bool(const Vec3&)> is_free = free_of(scene);
    DeviceDescription orbit = scene.description().device;
    orbit.speed_m_per_s *= every;
    orbit.duration_s /= static_cast<double>(surfaces.size());
    if (orbit.duration_s * rate_hz < 1.0)
        throw std::runtime_error(
            fmt::format("{}: duration_s = {} leaves no frame for each of {} surface{}; raise it",
                        place_of_device(scene.description()), scene.description().device.duration_s,
                        surfaces.size(), surfaces.size() == 1 ? "" : "s"));
    PathChain chain(rate_hz);
    for (const SceneSurface* surface : surfaces) {
        Orbit found;
        try {
            found = find_orbit(orbit_target(scene, *surface), orbit, rate_hz, is_free);
        } catch (const std::runtime_error& error) {
            throw std::runtime_error(fmt::format("{}: surface {}: {}",
                                                 place_of_device(scene.description()),
                                                 surface->name, error.what()));
        }
        if (found.spiral_share < 1.0)
            notes.push_back(fmt::format(
                "the orbit around {} ends after {:.0f} % of its {} turn{}, as its time is over: "
                "raise duration_s{}",
                surface->name, 100.0 * found.spiral_share, found.turns, found.turns == 1 ? "" : "s",
                orbit.turns > 0 ? " or leave out turns" : " or speed_m_per_s"));
        else if (orbit.turns == 0 && found.turns == internal::kOrbitTurns.high &&
                 static_cast<double>(found.states.size()) < 0.9 * orbit.duration_s * rate_hz)
            notes.push_back(fmt::format(
                "the orbit around {} ends after {:.3g} of {:.3g} s, with the {} turns that it may "
                "have: lower duration_s or speed_m_per_s",
                surface->name, static_cast<double>(found.states.size()) / rate_hz, orbit.duration_s,
                found.turns));
        chain.add(std::move(found.states));
    }
    return chain.take();
}

/// A tour over each surface, as long as it takes.
std::vector<DeviceState> tours(const Scene& scene, std::vector<std::string>& notes) {
    constexpr std::size_t kMostFrames = 4000000; // over an hour at 1 kHz, a gigabyte of frames.csv
    const double rate_hz = scene.description().loop.rate_hz;
    const std::function<bool(const Vec3&)> is_free = free_of(scene);
    const DeviceDescription& tour = scene.description().device;
    PathChain chain(rate_hz);
    for (const SceneSurface* surface : internal::surfaces_of_device(scene))
        chain.add(make_tour(mesh_of(*surface), orbit_target(scene, *surface), tour, rate_hz,
                            kMostFrames - chain.size(), is_free));
    if (chain.size() == kMostFrames)
        notes.push_back(fmt::format("the tour ends after {} frames, before it was everywhere: "
                                    "raise spacing_mm or speed_m_per_s",
                                    kMostFrames));
    return chain.take();
}

/// Median of a frame's time in a recording's inputs; 0 where it does not show. A device that
/// reports more seldom than the loop runs says a time in several frames: so it is taken over many,
/// from one new time to another.
double median_period_s(const std::vector<DeviceState>& states) {
    constexpr std::size_t kFrames = 100; // one more or less is 1 %
    std::vector<std::size_t> news;       // frames with another time than the one before
    for (std::size_t i = 1; i < states.size(); ++i)
        if (states[i].time_s != states[i - 1].time_s) news.push_back(i);
    std::vector<double> periods;
    for (std::size_t first = 0, last = 0; first < news.size(); ++first) {
        while (last + 1 < news.size() && news[last] - news[first] < kFrames)
            ++last;
        if (last > first)
            periods.push_back((states[news[last]].time_s - states[news[first]].time_s) /
                              static_cast<double>(news[last] - news[first]));
    }
    if (periods.empty()) return 0.0;
    const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
    std::nth_element(periods.begin(), middle, periods.end());
    return *middle;
}

std::vector<DeviceState> recorded_states(const Scene& scene) {
    const std::filesystem::path& file = scene.description().device.file;
    const double rate_hz = scene.description().loop.rate_hz;
    std::vector<DeviceState> states =
        require_files(scene.files(), place_of_device(scene.description()), "reads " + file.string())
            .recorded_inputs(file, scene.description().device.recorded_hand);
    if (states.empty())
        throw std::runtime_error(file.string() +
                                 ": has no frames to play; record a longer run with `palpate "
                                 "trace`");
    // A device's own time may jitter, and frames may be missing here and there.
    const double period_s = median_period_s(states);
    if (period_s > 0.0 && std::abs(period_s * rate_hz - 1.0) > 0.1)
        throw std::runtime_error(
            fmt::format("{}: was recorded at {:.6g} frames a second and the scene runs at {:.6g}; "
                        "set rate_hz under [loop] to that of the recording",
                        file.string(), 1.0 / period_s, rate_hz));
    return states;
}

void check_every(const DeviceDescription& device, int every) {
    if (every == 1 || (every > 1 && takes_every(device))) return;
    throw std::invalid_argument(
        every < 1 ? fmt::format("every = {}; give an integer >= 1", every)
                  : std::string("every: takes each K-th row of a path or an orbit, and the device "
                                "is neither; leave it out"));
}

SceneDevice make_sequence(const Scene& scene, int every) {
    std::vector<std::string> notes;
    auto states =
        std::make_shared<const std::vector<DeviceState>>(device_states(scene, every, &notes));
    const std::size_t count = states->size();
    return {std::make_unique<SequenceDevice>(std::move(states)), {}, count, std::move(notes)};
}

/// Where a path of the scene leads an arm.
std::vector<HandIntent> intents_along(const std::filesystem::path& file, double rate_hz,
                                      int every) {
    const std::vector<DeviceState> wanted = read_probe_path(file, rate_hz, every);
    if (wanted.back().trial != 0)
        throw std::runtime_error(file.string() +
                                 ": has several trials, and a hand only goes on from where it is; "
                                 "give a path with one");
    std::vector<HandIntent> intents;
    intents.reserve(wanted.size());
    for (const DeviceState& state : wanted)
        intents.push_back({state.time_s, state.position});
    return intents;
}

/// An arm that wants the probe somewhere, and a device in its hand.
SceneDevice make_hand(const Scene& scene, int every) {
    const DeviceDescription& description = scene.description().device;
    const HandDescription& hand = description.hand;
    const double rate_hz = scene.description().loop.rate_hz;
    std::vector<HandIntent> intents = description.file.empty()
                                          ? internal::press_of(scene)
                                          : intents_along(description.file, rate_hz, every);
    const auto frames =
        static_cast<std::uint64_t>(std::llround(intents.back().time_s * rate_hz)) + 1;
    const DevicePlacement placement(description.placement);
    for (HandIntent& intent : intents)
        intent.position = placement.place_in_device(intent.position);
    HandSettings settings;
    settings.arm.stiffness_n_per_m = hand.stiffness_n_per_m;
    settings.arm.tremor_m = 1e-6 * hand.tremor_um;
    settings.mechanism.damping_n_s_per_m = hand.damping_n_s_per_m;
    settings.mechanism.step_m = 1e-6 * hand.step_um;
    settings.transport.read_delay_s = settings.transport.write_delay_s = 1e-3 * hand.delay_ms;
    settings.rate_hz = rate_hz;
    settings.duration_s = static_cast<double>(frames) / rate_hz;
    settings.seed = static_cast<std::uint64_t>(hand.seed);
    try {
        return {std::make_unique<SimulatedHand>(settings, std::move(intents)), {}, frames};
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(fmt::format("{}: {}; give the hand another path or other settings",
                                             place_of_device(scene.description()), error.what()));
    }
}

/// A tool that a server of OpenIGTLink sends.
std::unique_ptr<HapticDevice> make_tool(const std::string& text) {
    const IgtlAddress address = igtl_address(text);
    if (address.host.empty())
        throw std::runtime_error(fmt::format(
            "igtl:{}: names no server; write igtl:{}@HOST:PORT, or use `palpate serve`, whose "
            "clients send it",
            text, text));
    return std::make_unique<IgtlDevice>(address);
}

SceneDevice make_attached(const Scene& scene) {
    const DeviceDescription& device = scene.description().device;
    try {
        if (device.kind == Kind::plugin)
            return {std::make_unique<PluginDevice>(plugin_address(device.address)), {}};
        if (device.kind == Kind::inverse3)
            return {std::make_unique<Inverse3Device>(
                        Inverse3Device::Settings{.address = inverse3_address(device.address)}),
                    {}};
        if (device.kind == Kind::igtl) return {make_tool(device.address), {}};
        return {make_hid_device(device.address, attached_devices()), {}};
    } catch (const std::runtime_error& error) {
        throw DeviceError(error.what());
    }
}

[[noreturn]] void refuse_no_device(const Scene& scene) {
    if (const auto hands = hand_names(scene.description()); !hands.empty())
        throw std::runtime_error(fmt::format(
            "{}: the scene has the hands {}, and one of them is asked for; say which: --hand "
            "NAME, or in a program the scene's of_hand()",
            place_of_scene(scene.description()), hands_in_words(hands)));
    throw std::runtime_error(
        fmt::format("{}: the scene has no device; add [device] with type = \"path\" or \"orbit\"",
                    place_of_scene(scene.description())));
}

} // namespace

bool is_sequence(const DeviceDescription& device) noexcept {
    return device.kind == Kind::path || device.kind == Kind::orbit || device.kind == Kind::tour ||
           device.kind == Kind::recording;
}

bool takes_every(const DeviceDescription& device) noexcept {
    return device.kind == Kind::path || device.kind == Kind::orbit ||
           (device.kind == Kind::hand && !device.file.empty());
}

std::vector<DeviceState> device_states(const Scene& scene, int every,
                                       std::vector<std::string>* notes) {
    std::vector<std::string> unread;
    std::vector<std::string>& told = notes != nullptr ? *notes : unread;
    told.clear();
    const DeviceDescription& device = scene.description().device;
    if (is_sequence(device)) check_every(device, every);
    switch (device.kind) {
    case Kind::path:
        return read_probe_path(device.file, scene.description().loop.rate_hz, every);
    case Kind::orbit:
        return orbits(scene, every, told);
    case Kind::tour:
        return tours(scene, told);
    case Kind::recording:
        return recorded_states(scene);
    case Kind::none:
        refuse_no_device(scene);
    case Kind::hand:
    case Kind::hid:
    case Kind::plugin:
    case Kind::inverse3:
    case Kind::igtl:
        break;
    }
    throw std::runtime_error(
        fmt::format("{}: what a hand does is not known before; record it with `palpate trace` and "
                    "give that with type = \"recording\"",
                    place_of_device(scene.description())));
}

SceneDevice make_device(const Scene& scene, int every) {
    const DeviceDescription& description = scene.description().device;
    if (description.kind == Kind::none) refuse_no_device(scene);
    check_every(description, every);
    if (is_sequence(description)) return make_sequence(scene, every);
    SceneDevice made =
        description.kind == Kind::hand ? make_hand(scene, every) : make_attached(scene);
    if (description.kind != Kind::igtl) // whose poses are in the scene's frame
        made.placement = DevicePlacement(description.placement);
    return made;
}

std::string device_complaint(const HapticDevice& device) {
    if (const auto* plugin = dynamic_cast<const PluginDevice*>(&device)) return plugin->complaint();
    if (const auto* arm = dynamic_cast<const Inverse3Device*>(&device)) return arm->complaint();
    if (const auto* tool = dynamic_cast<const IgtlDevice*>(&device)) return tool->complaint();
    if (const auto* tool = dynamic_cast<const TransformDevice*>(&device)) return tool->complaint();
    return {};
}

bool has_failed(const HapticDevice& device) {
    if (const auto* tool = dynamic_cast<const IgtlDevice*>(&device)) return tool->has_failed();
    const auto* served = dynamic_cast<const TransformDevice*>(&device);
    return served != nullptr && served->counts().used == 0;
}

RunningDevice::RunningDevice(HapticDevice& device) : device_(device) {
    try {
        device_.open();
        device_.start();
    } catch (const std::exception& error) {
        device_.stop();
        device_.close();
        throw DeviceError(error.what());
    }
}

RunningDevice::~RunningDevice() {
    device_.write(Vec3{0.0});
    device_.stop();
    device_.close();
}

} // namespace palpate
