// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/run/trace.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/drivers/sequence_device.h>
#include <palpate/engine/loop/device_safety.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/run/internal/shown_loop.h>
#include <palpate/engine/scene/scene_surface.h>

namespace palpate {
namespace {

constexpr std::size_t kFramesPerReport = 500; // between two calls of progress

/// Decisions of an earlier run, frame by frame; of none, where there are none.
class Decisions {
public:
    Decisions(std::span<const std::uint32_t> steps_left, std::span<const FrameReport> recorded)
        : steps_left_(steps_left), recorded_(recorded) {}

    std::span<const std::uint32_t> of(std::size_t frame) {
        if (steps_left_.empty()) return {};
        const auto decisions = steps_left_.subspan(at_, recorded_[frame].evaluations);
        at_ += decisions.size();
        return decisions;
    }

private:
    std::span<const std::uint32_t> steps_left_;
    std::span<const FrameReport> recorded_;
    std::size_t at_ = 0;
};

/// Frames back to back, of a device that is started and is what `properties` say, scene frame;
/// `expected` of them, or nobody knows how many.
Trace trace_device(std::shared_ptr<const Scene> scene, const LoopDescription& description,
                   const PlacedDevice& placed, const DeviceProperties& properties, Clock& clock,
                   std::uint64_t most_frames, std::uint64_t expected, const RunWatch& watch,
                   Decisions decisions) {
    Trace trace;
    trace.device = properties;
    for (const SceneSurface& surface : scene->surfaces())
        trace.audits.emplace_back(*scene, surface);
    const bool keeps_steps = description.method == SteppingMethod::paper;

    constexpr std::uint64_t most_reserved = 1u << 17; // some limits are never reached
    trace.inputs.reserve(std::min(expected, most_reserved));
    trace.frames.reserve(std::min(expected, most_reserved));

    HapticLoop loop(scene, clock, description, properties);
    const internal::ShownLoop shown(loop, watch);
    DeviceState state;
    while (trace.frames.size() < most_frames && placed.device.read(state)) {
        RunFrame run;
        if (state.freshness == Freshness::stale) run.silence = Silence::device;
        run.input = placed.placement.to_scene(state);
        run.frame = loop.frame(run.input, decisions.of(trace.frames.size()));
        placed.device.write(placed.placement.to_device(run.frame.force));
        const std::size_t touches_before = trace.touches.size();
        trace.inputs.push_back(run.input);
        trace.frames.push_back(run.frame);
        if (keeps_steps)
            trace.steps_left.insert(trace.steps_left.end(), loop.steps_left().begin(),
                                    loop.steps_left().end());
        for (const Touch& touch : loop.touches())
            trace.touches.push_back({touch, run.frame.frame});
        run.touches = static_cast<std::uint32_t>(trace.touches.size() - touches_before);
        for (SurfaceAudit& audit : trace.audits)
            audit.add(run.frame, loop.path());
        if (watch.frame) watch.frame(run);
        const double done =
            expected > 0 ? static_cast<double>(trace.frames.size()) / static_cast<double>(expected)
                         : 0.0;
        if (watch.progress && trace.frames.size() % kFramesPerReport == 0 &&
            !watch.progress(done, "tracing"))
            throw std::runtime_error("cancelled");
    }
    if (watch.progress) watch.progress(1.0, "tracing");
    return trace;
}

/// The frames of given inputs.
Trace trace_inputs(std::shared_ptr<const Scene> scene, const LoopDescription& loop,
                   std::vector<DeviceState> inputs, const DeviceProperties& properties,
                   Clock& clock, const RunWatch& watch, Decisions decisions) {
    const std::size_t count = inputs.size();
    SequenceDevice sequence(std::make_shared<const std::vector<DeviceState>>(std::move(inputs)));
    return trace_device(std::move(scene), loop, {sequence, {}}, properties, clock, count, count,
                        watch, decisions);
}

} // namespace

Trace run_trace(std::shared_ptr<const Scene> scene, const PlacedDevice& placed, Clock& clock,
                std::uint64_t most_frames, const RunWatch& watch) {
    const RunningDevice running(placed.device);
    const DeviceProperties properties = placed.placement.to_scene(placed.device.properties());
    warn_of_coupling(*scene, properties, watch);
    const bool is_bounded = most_frames < std::numeric_limits<std::uint64_t>::max();
    const LoopDescription loop = scene->description().loop;
    return trace_device(std::move(scene), loop, placed, properties, clock, most_frames,
                        is_bounded ? most_frames : 0, watch, Decisions({}, {}));
}

Trace run_trace(std::shared_ptr<const Scene> scene, std::span<const DeviceState> inputs,
                Clock& clock, const Progress& progress) {
    const LoopDescription loop = scene->description().loop;
    return run_trace(std::move(scene), loop, {inputs.begin(), inputs.end()}, clock, progress);
}

Trace run_trace(std::shared_ptr<const Scene> scene, const LoopDescription& loop,
                std::vector<DeviceState> inputs, Clock& clock, const Progress& progress) {
    RunWatch watch;
    watch.progress = progress;
    return trace_inputs(std::move(scene), loop, std::move(inputs), {}, clock, watch,
                        Decisions({}, {}));
}

Trace run_again(std::shared_ptr<const Scene> scene, const Run& run, const Progress& progress) {
    RunWatch watch;
    watch.progress = progress;
    return run_again(std::move(scene), run, watch);
}

Trace run_again(std::shared_ptr<const Scene> scene, const Run& run, const RunWatch& watch) {
    SteadyClock clock;
    const LoopDescription loop = scene->description().loop;
    return trace_inputs(std::move(scene), loop, run.inputs, run.device, clock, watch,
                        Decisions(run.steps_left, run.frames));
}

void audit(std::shared_ptr<const Scene> scene, Trace& trace, const Progress& progress) {
    if (trace.realtime && trace.realtime->dropped > 0) return;
    if (trace.before) return;
    if (std::any_of(trace.frames.begin(), trace.frames.end(),
                    [](const FrameReport& frame) { return (frame.flags & kNotRepeatable) != 0; }))
        return;
    trace.audits = run_again(std::move(scene), trace, progress).audits;
}

void warn_of_coupling(const Scene& scene, const DeviceProperties& device, const RunWatch& watch) {
    const SceneDescription& description = scene.description();
    const std::string warning =
        safe_coupling(description.coupling, description.loop.rate_hz, device).warning;
    if (!warning.empty() && watch.warning) watch.warning(warning);
}

} // namespace palpate
