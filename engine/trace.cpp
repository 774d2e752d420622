// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/trace.h>

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/haptic_loop.h>
#include <palpate/engine/orbit.h>
#include <palpate/engine/probe_path.h>

namespace palpate {
namespace {

constexpr std::size_t kFramesPerReport = 500; // between two calls of progress

/// The surfaces that an orbit goes around: the named one, or each that is felt.
std::vector<const SceneSurface*> orbited(const Scene& scene) {
    const DeviceDescription& device = scene.description().device;
    std::vector<const SceneSurface*> surfaces;
    for (const SceneSurface& surface : scene.surfaces())
        if (device.surface.empty() || surface.name == device.surface) surfaces.push_back(&surface);
    if (surfaces.empty())
        throw std::runtime_error(
            fmt::format("{}:{}: [device]: {} is felt by no effect; add an effect for it",
                        scene.description().file.string(), device.line,
                        device.surface.empty() ? "no surface" : "surface " + device.surface));
    return surfaces;
}

/// One orbit after the other, each a trial of its own and with its share of the time.
std::vector<DeviceState> orbits(const Scene& scene, int every) {
    const std::vector<const SceneSurface*> surfaces = orbited(scene);
    const double rate_hz = scene.description().loop.rate_hz;
    DeviceDescription orbit = scene.description().device;
    orbit.speed_m_per_s *= every;
    orbit.duration_s /= static_cast<double>(surfaces.size());
    std::vector<DeviceState> states;
    for (const SceneSurface* surface : surfaces) {
        const std::uint32_t first_trial = states.empty() ? 0 : states.back().trial + 1;
        for (DeviceState state : make_orbit(orbit_target(*surface), orbit, rate_hz)) {
            state.time_s = static_cast<double>(states.size()) / rate_hz;
            state.trial += first_trial;
            states.push_back(state);
        }
    }
    return states;
}

} // namespace

std::vector<DeviceState> device_states(const Scene& scene, int every) {
    const SceneDescription& description = scene.description();
    const DeviceDescription& device = description.device;
    switch (device.kind) {
    case DeviceDescription::Kind::path:
        return read_probe_path(device.file, description.loop.rate_hz, every);
    case DeviceDescription::Kind::orbit:
        return orbits(scene, every);
    case DeviceDescription::Kind::none:
        break;
    }
    throw std::runtime_error(
        fmt::format("{}: the scene has no device; add [device] with type = \"path\" or \"orbit\"",
                    description.file.string()));
}

Trace run_trace(std::shared_ptr<const Scene> scene, std::span<const DeviceState> inputs,
                Clock& clock, const Progress& progress, std::span<const std::uint32_t> steps_left,
                std::span<const FrameReport> recorded) {
    Trace trace;
    trace.frames.reserve(inputs.size());
    for (const SceneSurface& surface : scene->surfaces())
        trace.audits.emplace_back(*scene, surface);
    const bool keeps_steps = scene->description().loop.method == SteppingMethod::paper;

    HapticLoop loop(scene, clock);
    std::size_t replayed = 0;
    for (const DeviceState& input : inputs) {
        std::span<const std::uint32_t> decisions;
        if (!steps_left.empty()) {
            decisions = steps_left.subspan(replayed, recorded[trace.frames.size()].evaluations);
            replayed += decisions.size();
        }
        trace.frames.push_back(loop.frame(input, decisions));
        const FrameReport& frame = trace.frames.back();
        if (keeps_steps && !(frame.flags & kProbeNotFinite))
            trace.steps_left.insert(trace.steps_left.end(), loop.steps_left().begin(),
                                    loop.steps_left().end());
        for (SurfaceAudit& audit : trace.audits)
            audit.add(frame, loop.path());
        if (progress && trace.frames.size() % kFramesPerReport == 0 &&
            !progress(static_cast<double>(trace.frames.size()) / static_cast<double>(inputs.size()),
                      "tracing"))
            throw std::runtime_error("cancelled");
    }
    if (progress) progress(1.0, "tracing");
    return trace;
}

} // namespace palpate
