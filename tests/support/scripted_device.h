// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/run/paced_clock.h>

namespace palpate::test {

/// A clock that stands still but for what is slept and what the test lets pass.
class StandingClock final : public PacedClock {
public:
    double now_us() noexcept override { return now_us_; }
    void sleep_until(double deadline_us) noexcept override {
        now_us_ = std::max(now_us_, deadline_us) + late_us_;
        late_us_ = 0.0;
    }
    void pass(double us) noexcept { now_us_ += us; }
    void wake_late(double us) noexcept { late_us_ = us; } ///< once

private:
    double now_us_ = 7.0e6;
    double late_us_ = 0.0;
};

/// A device that keeps what is done to it. Its time goes on by reading, 1 ms a state.
class ScriptedDevice final : public HapticDevice {
public:
    double force_n = 10.0;         ///< that it can hold; 0: it takes none
    std::size_t states = 1u << 30; ///< that it has
    std::string refusal;           ///< of open(), if any
    std::function<void(std::size_t read, DeviceState&)> on_read; ///< changes a state

    std::vector<std::string> calls; ///< open, start, stop, close
    std::vector<Vec3> forces;       ///< written, all of them
    std::size_t reads = 0;

    DeviceProperties properties() const override {
        DeviceProperties properties;
        properties.name = "scripted";
        properties.force_n = force_n;
        return properties;
    }
    void open() override {
        calls.push_back("open");
        if (!refusal.empty()) throw std::runtime_error(refusal);
    }
    void start() override { calls.push_back("start"); }
    void stop() noexcept override { calls.push_back("stop"); }
    void close() noexcept override { calls.push_back("close"); }
    bool read(DeviceState& state) noexcept override {
        if (reads >= states) return false;
        state = DeviceState{};
        state.time_s = 1e-3 * static_cast<double>(reads);
        state.position = {0.0, 0.0, 0.04}; // 10 mm into a ball of 50 mm, from its middle or from
                                           // wherever on_read says that it begins
        if (on_read) on_read(reads, state);
        ++reads;
        return true;
    }
    void write(const Vec3& force) noexcept override { forces.push_back(force); }
};

} // namespace palpate::test
