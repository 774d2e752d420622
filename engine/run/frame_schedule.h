// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace palpate {

/// Why a period of a real-time loop passed without a frame.
enum class Overrun : std::uint8_t {
    none,
    own_work,   ///< the frame before alone took longer than a frame may
    woken_late, ///< the system let the loop begin later than its deadline
};

/// The deadlines of a loop: ticks a period apart, from its start on, never moved. A frame that is
/// late leaves out the ticks that it missed; nothing is caught up with. All times in us of one
/// clock. A pure account: it neither waits nor reads a clock.
class FrameSchedule {
public:
    /// Of the periods that a frame takes, what is left to others. A frame that takes more than the
    /// rest of its period is followed by a pause of this share, and then by the next tick: so a
    /// loop whose frames are all too long takes 94 % of a processor at most. At 95 % the kernel
    /// stops SCHED_FIFO for a twentieth of a second.
    static constexpr double kRest = 0.06;

    /// The first deadline is a period after `start_us`.                                 [setup]
    FrameSchedule(double period_us, double start_us) noexcept
        : period_us_(period_us), start_us_(start_us) {}

    double deadline_us() const noexcept { return at(next_); } ///< of the next frame     [loop]

    /// A frame that begins.
    struct Begin {
        double late_us = 0.0;      ///< after its deadline
        std::uint64_t periods = 1; ///< since the frame before began, by their ticks; 1: in time
    };
    /// At the deadline or later.                                                         [loop]
    Begin begin(double now_us) noexcept {
        Begin begun;
        begun.late_us = std::max(0.0, now_us - deadline_us());
        woken_late_ = static_cast<std::uint64_t>(begun.late_us / period_us_);
        begun.periods = next_ + woken_late_ - current_;
        current_ = next_ + woken_late_;
        began_us_ = now_us;
        return begun;
    }

    /// A frame that has ended.
    struct End {
        std::uint64_t missed = 0; ///< periods without a frame, at its beginning and after its end
        Overrun overrun = Overrun::none; ///< why
    };
    /// Once for each begin().                                                            [loop]
    End end(double now_us) noexcept {
        const double busy_us = now_us - began_us_;
        const bool is_too_long = busy_us > (1.0 - kRest) * period_us_;
        const double pause_us = is_too_long ? busy_us * (kRest / (1.0 - kRest)) : 0.0;
        const auto soonest = static_cast<std::uint64_t>(
            std::ceil(std::max(0.0, now_us + pause_us - start_us_) / period_us_));
        next_ = std::max(current_ + 1, soonest);
        const std::uint64_t after = next_ - current_ - 1;
        End ended;
        ended.missed = woken_late_ + after;
        if (after > 0 && is_too_long)
            ended.overrun = Overrun::own_work;
        else if (ended.missed > 0)
            ended.overrun = Overrun::woken_late;
        return ended;
    }

private:
    double at(std::uint64_t tick) const noexcept {
        return start_us_ + period_us_ * static_cast<double>(tick);
    }

    double period_us_;
    double start_us_;
    std::uint64_t current_ = 0; // tick of the last frame; 0: none yet
    std::uint64_t next_ = 1;
    std::uint64_t woken_late_ = 0; // whole periods, of the last frame
    double began_us_ = 0.0;
};

} // namespace palpate
