// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/paced_run.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <future>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/run/paced_clock.h>
#include <palpate/engine/run/scheduler.h>
#include <palpate/engine/study/internal/baseline_contestant.h>
#include <palpate/engine/study/internal/study_tally.h>
#include <palpate/engine/truth/frame_truth.h>

namespace palpate {
namespace {

constexpr std::chrono::milliseconds kAsked{100}; // between two calls of progress

/// The probe between the rows of a path, of one trial; `at_s` since its beginning.
DeviceState probe_at(std::span<const DeviceState> path, double at_s, double rate_hz) noexcept {
    const double row = std::clamp(at_s * rate_hz, 0.0, static_cast<double>(path.size() - 1));
    const auto before = static_cast<std::size_t>(row);
    const auto after = std::min(before + 1, path.size() - 1);
    const double share = row - static_cast<double>(before);
    DeviceState state = path[before];
    state.time_s = at_s;
    if (share > 0.0 && path[after].trial == state.trial)
        state.position += share * (path[after].position - state.position);
    return state;
}

std::string name_of(Pace pace, Scheduler scheduler, double rate_hz, bool permitted) {
    return fmt::format("{} {}{}",
                       pace == Pace::locked ? fmt::format("{:.6g} Hz", rate_hz) : "released",
                       scheduler == Scheduler::fifo ? "SCHED_FIFO" : "SCHED_OTHER",
                       permitted ? "" : " not permitted");
}

} // namespace

StudyRun run_at_pace(std::shared_ptr<const Scene> scene, std::span<const DeviceState> inputs,
                     const LoopDescription& settings, Pace pace, Scheduler scheduler,
                     const Progress& progress) {
    SteadyPacedClock clock;
    HapticLoop loop(scene, clock, settings);
    internal::StudyTally tally;
    std::vector<FrameReport> frames; // one per period
    frames.reserve(inputs.size() + 1);
    const double period_us = 1e6 / settings.rate_hz;
    const double duration_us = period_us * static_cast<double>(inputs.size());
    bool permitted = false;
    std::atomic<bool> cancelled{false};
    std::atomic<double> done{0.0};

    const auto run = [&]() noexcept {
        permitted = enter(scheduler);
        if (!permitted) return;
        const double began_us = clock.now_us();
        double tick_us = 0.0;
        for (;;) {
            const double now_us = clock.now_us() - began_us;
            if (cancelled || now_us >= duration_us || frames.size() == frames.capacity()) return;
            FrameReport frame = loop.frame(probe_at(inputs, 1e-6 * now_us, settings.rate_hz));
            if (pace == Pace::locked) frame.late_us = now_us - tick_us;
            tally.add_way(frame, loop.path());
            const bool begins_a_period = now_us >= tick_us;
            if (begins_a_period) {
                frames.push_back(frame);
                done = now_us / duration_us;
                const double ended_us = clock.now_us() - began_us;
                tick_us = period_us * (std::floor(ended_us / period_us) + 1.0);
            }
            if (pace == Pace::locked) clock.sleep_until(began_us + tick_us);
        }
    };
    const std::future<void> ended = std::async(std::launch::async, run);
    while (ended.wait_for(kAsked) != std::future_status::ready)
        if (progress && !progress(done, "in real time")) cancelled = true;
    if (cancelled) throw std::runtime_error("cancelled");

    // As the other rows of its table are measured.
    FrameTruth truth(*scene, internal::the_felt_level(*scene) ? FrameTruth::Measure::levels
                                                              : FrameTruth::Measure::what_is_felt);
    for (const FrameReport& frame : frames) {
        tally.add_frame(frame, settings);
        tally.add_truth(truth.of(frame));
    }
    StudyRun result = std::move(tally).conclude(settings);
    result.is_the_scenes = false;
    result.has_ticks = pace == Pace::locked && permitted;
    result.pace = name_of(pace, scheduler, settings.rate_hz, permitted);
    return result;
}

} // namespace palpate
