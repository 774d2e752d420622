// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <ratio>

namespace palpate {

/// Where the loop reads the time; tests script it.
class Clock {
public:
    virtual ~Clock() = default;
    virtual double now_us() noexcept = 0; ///< us since some fixed instant; never goes back  [loop]
};

/// The system's monotonic clock (read without a system call on Linux).
class SteadyClock final : public Clock {
public:
    double now_us() noexcept override {
        return std::chrono::duration<double, std::micro>(
                   std::chrono::steady_clock::now().time_since_epoch())
            .count();
    }
};

} // namespace palpate
