// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/run/internal/servo_loop.h>

#include <algorithm>

namespace palpate::internal {
namespace {

// A device whose time goes on by reading follows the clock through a pause of this many periods; a
// longer one stops its time.
constexpr std::uint64_t kMostReads = 1000;

} // namespace

ServoLoop::ServoLoop(HapticLoop& loop, HapticDevice& device, const DevicePlacement& placement,
                     PacedClock& clock, const ServoSettings& settings, SpscRing<RunFrame>& frames,
                     SpscRing<std::uint32_t>* decisions, SpscRing<RecordedTouch>* touches) noexcept
    : loop_(loop), device_(device), placement_(placement), clock_(clock), settings_(settings),
      frames_(frames), decisions_(decisions), touches_(touches) {}

void ServoLoop::run() noexcept {
    const double started_us = clock_.now_us();
    FrameSchedule schedule(settings_.period_us, started_us);
    double last_us = started_us; // when the frame before began
    double ends_by_us = 0.0;     // once the run is ending
    DeviceState newest;
    Vec3 force{0.0}; // that the device has, scene frame
    const auto end = [&](double now_us) {
        if (!ending_) ends_by_us = now_us + kRelease_us;
        ending_ = true;
    };
    for (std::uint64_t count = 0;; ++count) {
        clock_.sleep_until(schedule.deadline_us());
        const double began_us = clock_.now_us();
        const FrameSchedule::Begin begun = schedule.begin(began_us);
        if (!ending_ &&
            (count >= settings_.most_frames || began_us - started_us > settings_.longest_us ||
             asked_.load(std::memory_order_relaxed)))
            end(began_us);
        if (ending_ && (!settings_.takes_force || began_us >= ends_by_us)) break;

        if (DeviceState state; read(count == 0 ? 1 : begun.periods, state))
            newest = state;
        else if (!settings_.takes_force || force == Vec3{0.0})
            break;
        else
            end(began_us);
        DeviceState state = newest;
        RunFrame run;
        const double gap_us = count == 0 ? 0.0 : began_us - last_us;
        run.silence = silence_of(state, gap_us);
        if (run.silence != Silence::none) state.freshness = Freshness::stale;
        last_us = began_us;
        run.input = placement_.to_scene(state);
        run.frame = loop_.frame(run.input);
        force = to_be_sent(run.frame.force, gap_us, began_us);
        device_.write(placement_.to_device(force));

        run.frame.late_us = begun.late_us;
        const FrameSchedule::End ended = schedule.end(clock_.now_us());
        run.missed = ended.missed;
        run.overrun = ended.overrun;
        hand_over(run);
        if (ending_ && force == Vec3{0.0}) break;
    }
    device_.write(Vec3{0.0});
}

/// The state at this tick. A device whose time goes on by reading, a path or a simulated hand, did
/// not wait for the periods that were missed.
bool ServoLoop::read(std::uint64_t periods, DeviceState& state) noexcept {
    for (std::uint64_t i = std::min(periods, kMostReads); i > 0; --i)
        if (!device_.read(state)) return false;
    return true;
}

Silence ServoLoop::silence_of(const DeviceState& state, double gap_us) const noexcept {
    if (ending_) return Silence::ending;
    if (state.freshness == Freshness::stale) return Silence::device;
    double longest_us = std::max(kLongestGap_us, kLongestGapPeriods * settings_.period_us);
    if (settings_.takes_force) longest_us = std::min(longest_us, kHeld_us);
    return gap_us > longest_us ? Silence::loop : Silence::none;
}

/// Zero for a hand that the driver has let go of, as the loop stood still for longer than a driver
/// holds a force: between two frames, or in this one. What still fades in the frames would be a
/// kick there.
Vec3 ServoLoop::to_be_sent(const Vec3& force, double gap_us, double began_us) noexcept {
    if (!settings_.takes_force) return force;
    was_let_go_ = (was_let_go_ || gap_us > kHeld_us) && force != Vec3{0.0};
    return was_let_go_ || clock_.now_us() - began_us > kHeld_us ? Vec3{0.0} : force;
}

/// A frame with its decisions and touches, or none of them: a recording has no use for one without
/// the others. The periods that it missed are told with the next one.
void ServoLoop::hand_over(RunFrame& frame) noexcept {
    const auto decisions = decisions_ ? loop_.steps_left() : std::span<const std::uint32_t>{};
    const auto touches = touches_ ? loop_.touches() : std::span<const Touch>{};
    if (frames_.room() == 0 || (decisions_ && decisions_->room() < decisions.size()) ||
        (touches_ && touches_->room() < touches.size())) {
        dropped_.fetch_add(1, std::memory_order_relaxed);
        missed_untold_ += frame.missed;
        return;
    }
    frame.missed += std::exchange(missed_untold_, 0);
    if (decisions_) decisions_->push(decisions);
    for (const Touch& touch : touches)
        touches_->push(RecordedTouch{touch, frame.frame.frame});
    frame.touches = static_cast<std::uint32_t>(touches.size());
    frames_.push(frame);
}

} // namespace palpate::internal
