// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/haptics/stepping/clock.h>

namespace palpate::test {

/// A clock that advances by the same amount at every reading.
class ScriptedClock final : public Clock {
public:
    explicit ScriptedClock(double step_us = 0.0) : step_us_(step_us) {}
    double now_us() noexcept override { return now_us_ += step_us_; }
    void set_step_us(double step_us) noexcept { step_us_ = step_us; }

private:
    double step_us_;
    double now_us_ = 0.0;
};

} // namespace palpate::test
