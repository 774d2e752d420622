// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/run/paced_clock.h>

#include <time.h>

namespace palpate {

void SteadyPacedClock::sleep_until(double deadline_us) noexcept {
    timespec deadline{};
    deadline.tv_sec = static_cast<time_t>(deadline_us * 1e-6);
    deadline.tv_nsec =
        static_cast<long>((deadline_us - 1e6 * static_cast<double>(deadline.tv_sec)) * 1e3);
    // A signal wakes it early; what is left is slept then.
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr) != 0) {
    }
}

} // namespace palpate
