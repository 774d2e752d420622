// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/haptics/stepping/clock.h>

namespace palpate {

/// A clock that can be waited for; tests script it.
class PacedClock : public Clock {
public:
    /// Returns at `deadline_us` of now_us() or later, never before.                      [loop]
    virtual void sleep_until(double deadline_us) noexcept = 0;
};

/// CLOCK_MONOTONIC.
class SteadyPacedClock final : public PacedClock {
public:
    double now_us() noexcept override { return clock_.now_us(); }
    void sleep_until(double deadline_us) noexcept override;

private:
    SteadyClock clock_;
};

} // namespace palpate
