// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/run/realtime_run.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/loop/internal/surface_identity.h>
#include <palpate/engine/run/internal/loop_thread.h>
#include <palpate/engine/run/internal/servo_loop.h>
#include <palpate/engine/run/internal/shown_loop.h>
#include <palpate/engine/run/paced_clock.h>
#include <palpate/engine/scene/scene_surface.h>

namespace palpate {
namespace {

using internal::LoopThreadGrants;
using internal::ServoLoop;

constexpr std::chrono::milliseconds kDrained{5}; // between two looks into the rings
constexpr std::chrono::milliseconds kKept{500};  // between two times that what is felt is kept
constexpr double kReserve_s = 2.0; // how long the recorder may be held up before frames drop
// Of as long, on the average: grooves and corners have three, most places one.
constexpr std::size_t kMostTouches = 4;                      // a frame
constexpr std::size_t kMostDecisions = std::size_t{1} << 22; // of as long, some 0.5 us each

/// The loop's thread, from its preparation to its end; it ends before this does.
class ServoThread {
public:
    ServoThread(ServoLoop& servo, const internal::LoopThreadSettings& settings)
        : servo_(servo), ended_(std::async(std::launch::async, [this, settings]() noexcept {
              granted_.set_value(internal::prepare_loop_thread(settings));
              go_.get_future().wait();
              servo_.run();
          })) {}
    ~ServoThread() {
        servo_.ask_to_stop();
        go();
        ended_.wait();
    }
    ServoThread(const ServoThread&) = delete;
    ServoThread& operator=(const ServoThread&) = delete;

    LoopThreadGrants grants() { return granted_.get_future().get(); } ///< once
    void go() {
        if (!std::exchange(gone_, true)) go_.set_value();
    }
    bool has_ended_within(std::chrono::milliseconds wait) const {
        return ended_.wait_for(wait) == std::future_status::ready;
    }

private:
    ServoLoop& servo_;
    std::promise<LoopThreadGrants> granted_;
    std::promise<void> go_;
    bool gone_ = false;
    std::future<void> ended_; // last: its thread uses the others
};

/// Of the whole process: given back when the last loop's thread has ended.
struct LockedMemory {
    LockedMemory() = default;
    ~LockedMemory() { internal::release_memory(); }
    LockedMemory(const LockedMemory&) = delete;
    LockedMemory& operator=(const LockedMemory&) = delete;
};

/// What the loop's thread writes and the recorder reads.
struct Rings {
    Rings(double rate_hz, bool with_steps)
        : reserve(static_cast<std::size_t>(kReserve_s * rate_hz) + 1), keeps_steps(with_steps) {}

    /// Moves the next frame, with its decisions and touches, to the end of `trace`.
    bool pop_into(Trace& trace, RunFrame& run) {
        if (!frames.pop(run)) return false;
        trace.inputs.push_back(run.input);
        trace.frames.push_back(run.frame);
        for (std::uint32_t i = 0, steps = 0; keeps_steps && i < run.frame.evaluations; ++i) {
            decisions.pop(steps);
            trace.steps_left.push_back(steps);
        }
        RecordedTouch touch;
        for (std::uint32_t i = 0; i < run.touches; ++i) {
            touches.pop(touch);
            trace.touches.push_back(touch);
        }
        return true;
    }

    std::size_t reserve; // frames
    bool keeps_steps;
    internal::SpscRing<RunFrame> frames{reserve};
    internal::SpscRing<RecordedTouch> touches{kMostTouches * reserve};
    internal::SpscRing<std::uint32_t> decisions{keeps_steps ? kMostDecisions : 1};
};

/// A fifth more than what drivers hold a force for: a frame that comes a little late is no silence.
constexpr double kLeastRateOfMotors_hz = 1.2e6 / internal::ServoLoop::kHeld_us;

internal::ServoSettings servo_settings(const RealtimeSettings& run, double rate_hz,
                                       const DeviceProperties& device) {
    internal::ServoSettings servo;
    servo.period_us = 1e6 / rate_hz;
    servo.most_frames = run.most_frames;
    servo.longest_us = 1e6 * run.longest_s;
    servo.takes_force = device.force_n > 0.0;
    if (servo.takes_force && rate_hz < kLeastRateOfMotors_hz)
        throw std::invalid_argument(
            fmt::format("rate_hz = {:.6g}: in real time a device with motors needs at least {:g}, "
                        "as drivers hold no force for longer than 20 ms; raise it",
                        rate_hz, kLeastRateOfMotors_hz));
    return servo;
}

/// The scene that is to follow: handed to the loop once, by the thread that records.
class NextScene {
public:
    NextScene(std::shared_ptr<const Scene> now, const RealtimeSettings& settings)
        : now_(std::move(now)), next_(settings.next),
          enough_(static_cast<std::uint64_t>(
              std::ceil(RealtimeSettings::kFree_s * now_->description().loop.rate_hz))) {
        using namespace std::chrono_literals;
        if (next_.valid() && next_.wait_for(0s) == std::future_status::deferred)
            throw std::invalid_argument("the scene that is to follow would never be made: its "
                                        "future is deferred; give one of std::launch::async");
    }

    void see(const FrameReport& frame) noexcept {
        const bool is_free = is_computed(frame.flags) && frame.surfaces_felt == 0;
        free_ = is_free ? free_ + 1 : 0;
        if (handed_in_ && (frame.flags & kSceneAdopted) != 0) adopted_ = true;
    }

    void adopt_when_it_can(HapticLoop& loop, const RunWatch& watch) {
        using namespace std::chrono_literals;
        if (!next_.valid() || next_.wait_for(0s) != std::future_status::ready) return;
        try {
            const std::shared_ptr<const Scene>& next = next_.get();
            if (next == nullptr)
                throw std::invalid_argument("the scene that is to follow is null; give a scene");
            if (!waits_) {
                require_same_surfaces(*next);
                waits_ = !goes_on_in_contact(*next);
            }
            if (*waits_ && free_ < enough_) return;
            loop.adopt(next);
            handed_in_ = true;
        } catch (const std::exception& error) {
            if (watch.warning)
                watch.warning(fmt::format("what is felt stays a preview: {}", error.what()));
        }
        next_ = {};
    }

    /// What was felt first, once another one is felt.
    std::shared_ptr<const Scene> before() const { return adopted_ ? now_ : nullptr; }

private:
    /// Frames and recordings name surfaces by their places.
    void require_same_surfaces(const Scene& next) const {
        const bool same =
            std::equal(now_->surfaces().begin(), now_->surfaces().end(), next.surfaces().begin(),
                       next.surfaces().end(), [](const SceneSurface& a, const SceneSurface& b) {
                           return a.name == b.name;
                       });
        if (!same)
            throw std::invalid_argument("the scene that is to follow feels other surfaces; give it "
                                        "the same ones");
    }

    /// Whether each surface's contact goes on from the preview's, wherever the proxy is.
    bool goes_on_in_contact(const Scene& next) const {
        const auto before = internal::surface_identities(*now_);
        const auto after = internal::surface_identities(next);
        return std::equal(after.begin(), after.end(), before.begin(), before.end(),
                          [](const auto& a, const auto& b) { return a.goes_on_from(b); });
    }

    std::shared_ptr<const Scene> now_;
    std::shared_future<std::shared_ptr<const Scene>> next_;
    std::uint64_t enough_;
    std::optional<bool> waits_; // for a free hand; known once the scene is there
    std::uint64_t free_ = 0;    // frames on end that felt no surface
    bool handed_in_ = false;
    bool adopted_ = false;
};

/// Frees what a run without an end has recorded so far.
void forget_frames(Run& run) {
    run.inputs.clear();
    run.frames.clear();
    run.steps_left.clear();
    run.touches.clear();
}

void count(const RunFrame& run, RealtimeCounts& counts) {
    counts.own_work += run.overrun == Overrun::own_work ? 1 : 0;
    counts.woken_late += run.overrun == Overrun::woken_late ? 1 : 0;
    counts.missed_periods += run.missed;
    counts.silent_loop += run.silence == Silence::loop ? 1 : 0;
    counts.silent_device += run.silence == Silence::device ? 1 : 0;
}

/// A device that is open and started, under the loop's scheduler: its own threads must not starve
/// while the loop waits for what they bring.
class StartedDevice {
public:
    StartedDevice(HapticDevice& device, Scheduler scheduler)
        : as_the_loop_(std::in_place, scheduler), running_(device) {
        as_the_loop_.reset();
    }

private:
    std::optional<internal::ScheduledAs> as_the_loop_;
    RunningDevice running_;
};

/// One hand: everything that its loop needs, and what comes of it. All but the loop's thread is of
/// the thread that made it.
class HandRun {
public:
    explicit HandRun(const RealtimeHand& hand)
        : hand_(hand), loop_settings_(hand.scene->description().loop),
          started_(hand.placed.device, hand.settings.scheduler), trace_(begun()),
          loop_(hand.scene, clock_, loop_settings_, trace_.device), shown_(loop_, hand.watch),
          rings_(loop_settings_.rate_hz, loop_settings_.method == SteppingMethod::paper),
          servo_(loop_, hand.placed.device, hand.placed.placement, clock_,
                 servo_settings(hand.settings, loop_settings_.rate_hz, trace_.device),
                 rings_.frames, rings_.keeps_steps ? &rings_.decisions : nullptr, &rings_.touches),
          next_(hand.scene, hand.settings) {}
    HandRun(const HandRun&) = delete;
    HandRun& operator=(const HandRun&) = delete;

    /// The loop's thread, which waits for go().
    void prepare() {
        const internal::LoopThreadSettings settings{hand_.settings.scheduler, hand_.settings.cpu};
        thread_.emplace(servo_, settings);
        const LoopThreadGrants grants = thread_->grants();
        counts_.scheduler = grants.scheduler ? settings.scheduler : Scheduler::ordinary;
        counts_.memory_locked = grants.memory;
        for (const std::string& refusal : internal::refusals(settings, grants))
            if (hand_.watch.warning) hand_.watch.warning(refusal);
    }
    void go() {
        thread_->go();
        kept_at_ = std::chrono::steady_clock::now();
    }
    void ask_to_stop() noexcept { servo_.ask_to_stop(); }
    bool has_ended_within(std::chrono::milliseconds wait) const {
        return thread_->has_ended_within(wait);
    }

    /// Takes what has come since the last time; false where who watches wants an end.
    bool look() {
        record();
        next_.adopt_when_it_can(loop_, hand_.watch);
        if (hand_.watch.kept && std::chrono::steady_clock::now() - kept_at_ >= kKept) {
            hand_.watch.kept(trace_);
            kept_at_ = std::chrono::steady_clock::now();
        }
        return !hand_.watch.progress || hand_.watch.progress(done(), "in real time");
    }

    /// Once the thread has ended.
    Trace result() {
        thread_.reset();
        record();
        if (hand_.watch.kept) hand_.watch.kept(trace_);
        counts_.dropped = servo_.dropped();
        trace_.realtime = counts_;
        trace_.before = next_.before();
        if (hand_.watch.progress) hand_.watch.progress(1.0, "in real time");
        return std::move(trace_);
    }

private:
    Trace begun() const {
        Trace trace;
        trace.device = hand_.placed.placement.to_scene(hand_.placed.device.properties());
        warn_of_coupling(*hand_.scene, trace.device, hand_.watch);
        return trace;
    }
    void record() {
        RunFrame run;
        while (rings_.pop_into(trace_, run)) {
            count(run, counts_);
            next_.see(run.frame);
            if (hand_.watch.frame) hand_.watch.frame(run);
            ++recorded_;
            if (hand_.settings.keep == RealtimeSettings::Keep::none) forget_frames(trace_);
        }
    }
    double done() const {
        const auto frames = static_cast<double>(recorded_);
        const double by_frames = frames / static_cast<double>(hand_.settings.most_frames);
        const double by_time = frames / (hand_.settings.longest_s * loop_settings_.rate_hz);
        return std::clamp(std::max(by_frames, by_time), 0.0, 1.0);
    }

    const RealtimeHand& hand_;
    const LoopDescription loop_settings_;
    SteadyPacedClock clock_;
    StartedDevice started_;
    Trace trace_;
    HapticLoop loop_;
    internal::ShownLoop shown_;
    Rings rings_;
    ServoLoop servo_;
    RealtimeCounts counts_;
    NextScene next_;
    std::uint64_t recorded_ = 0; // frames
    std::chrono::steady_clock::time_point kept_at_{};
    std::optional<ServoThread> thread_; // last: it uses the others
};

} // namespace

void check_duty(const LoopDescription& loop) {
    const double most_us = RealtimeSettings::kMostDuty * 1e6 / loop.rate_hz;
    if (budget_of(loop) > most_us * (1.0 + 1e-12)) // 0.9 has no exact double
        throw std::invalid_argument(fmt::format(
            "budget_us = {:.6g} leaves less than a tenth of the period in real time; set it to "
            "{:.6g} or less at {:.6g} Hz",
            budget_of(loop), most_us, loop.rate_hz));
}

Trace run_realtime(std::shared_ptr<const Scene> scene, const PlacedDevice& placed,
                   const RealtimeSettings& settings, const RunWatch& watch) {
    const RealtimeHand hand{std::move(scene), placed, settings, watch};
    return std::move(run_realtime({&hand, 1}).front());
}

std::vector<Trace> run_realtime(std::span<const RealtimeHand> hands) {
    for (const RealtimeHand& hand : hands)
        check_duty(hand.scene->description().loop);
    const LockedMemory locked; // until all threads have ended
    std::vector<std::unique_ptr<HandRun>> runs;
    runs.reserve(hands.size());
    for (const RealtimeHand& hand : hands)
        runs.push_back(std::make_unique<HandRun>(hand));
    const auto stop_all = [&]() noexcept {
        for (const auto& run : runs)
            run->ask_to_stop();
    };
    try {
        for (const auto& run : runs)
            run->prepare();
        for (const auto& run : runs)
            run->go();
        for (bool is_over = false; !is_over;) {
            is_over = true;
            for (const auto& run : runs)
                is_over =
                    run->has_ended_within(kDrained / static_cast<int>(runs.size())) && is_over;
            bool goes_on = true;
            for (const auto& run : runs)
                if (!is_over) goes_on = run->look() && goes_on;
            if (!goes_on) stop_all();
        }
    } catch (...) {
        stop_all(); // before the first of them is waited for
        throw;
    }
    std::vector<Trace> traces;
    traces.reserve(runs.size());
    for (const auto& run : runs)
        traces.push_back(run->result());
    return traces;
}

} // namespace palpate
