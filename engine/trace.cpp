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

const SceneSurface& orbited(const Scene& scene, const std::string& name) {
    const DeviceDescription& device = scene.description().device;
    const std::string place =
        fmt::format("{}:{}: [device]", scene.description().file.string(), device.line);
    for (const SceneSurface& surface : scene.surfaces())
        if (name.empty() ? scene.surfaces().size() == 1 : surface.name == name) return surface;
    throw std::runtime_error(name.empty() ? place + ": orbit needs to know its surface, as the "
                                                    "scene does not have exactly one that is "
                                                    "felt; add surface = \"...\""
                                          : place + ": surface " + name +
                                                " is not felt by any effect; add an effect for it");
}

} // namespace

std::vector<DeviceState> device_states(const Scene& scene, int every) {
    const SceneDescription& description = scene.description();
    const DeviceDescription& device = description.device;
    switch (device.kind) {
    case DeviceDescription::Kind::path:
        return read_probe_path(device.file, description.loop.rate_hz, every);
    case DeviceDescription::Kind::orbit: {
        const SceneSurface& surface = orbited(scene, device.surface);
        DeviceDescription faster = device;
        faster.speed_m_per_s *= every;
        return make_orbit(*surface.baked.field, surface.level.level, faster,
                          description.loop.rate_hz);
    }
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
