// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <random>

#include <palpate/drivers/haptic_device.h>

namespace palpate::test {

/// Everything that a cable, an operating system and a worn encoder do to a device, at random: the
/// states that a driver then gives. Its states are a kHz's.
class FaultyDevice final : public HapticDevice {
public:
    enum Fault : std::uint8_t {
        none,
        dropped,   ///< no report: the last state again; stale once that is kSilence_s old
        repeated,  ///< the last report once more, as if it were new: five times at most, since a
                   ///< driver sees that its counter or clock stands still
        truncated, ///< a report that is no use: as dropped
        late,      ///< the loop was: a stale state
        no_number, ///< NaN or infinity in the position
        jumping,   ///< somewhere else, as a lost count or a bit of noise has it
        unplugged, ///< as dropped, and no force arrives
        kFaults
    };
    static constexpr double kSilence_s = 5e-3; ///< silent for longer is stale

    FaultyDevice(HapticDevice& device, std::uint64_t seed) : device_(device), random_(seed) {}

    DeviceProperties properties() const override { return device_.properties(); }

    bool read(DeviceState& state) noexcept override {
        DeviceState now;
        if (!device_.read(now)) return false;
        choose_fault();
        time_s_ = now.time_s;
        switch (fault_) {
        case none:
            keep(now);
            break;
        case repeated: // a report that was read twice says nothing of now
            now = last_;
            break;
        case no_number:
            now.position[static_cast<int>(random_() % 3)] =
                random_() % 2 == 0 ? std::numeric_limits<double>::quiet_NaN()
                                   : std::numeric_limits<double>::infinity();
            break;
        case jumping:
            now.position += 0.05 * Vec3{1.0 + unit(), unit(), unit()};
            break;
        case late:
            now.freshness = Freshness::stale;
            break;
        default:
            now = last_;
            if (time_s_ - last_fresh_s_ > kSilence_s) now.freshness = Freshness::stale;
        }
        state = now;
        return true;
    }
    void write(const Vec3& force) noexcept override {
        device_.write(fault_ == unplugged ? Vec3{0.0} : force);
    }

    Fault fault() const { return fault_; }
    /// Since the last state that was new and true, s.
    double silent_s() const { return time_s_ - last_fresh_s_; }
    const std::array<long, kFaults>& frames() const { return frames_; }

private:
    double unit() { return 0x1p-53 * static_cast<double>(random_() >> 11); }

    static unsigned longest(Fault fault) { // frames
        switch (fault) {
        case none:
            return 1;
        case repeated:
            return 5;
        case unplugged:
            return 500;
        default:
            return 12;
        }
    }

    void keep(const DeviceState& now) {
        last_ = now;
        last_fresh_s_ = now.time_s;
    }

    void choose_fault() {
        if (left_ == 0) {
            // One fault in 400 frames, of a few frames; without a cable for up to half a second.
            fault_ =
                random_() % 400 == 0 ? static_cast<Fault>(1 + random_() % (kFaults - 1)) : none;
            left_ = longest(fault_) == 1 ? 1 : 1 + static_cast<int>(random_() % longest(fault_));
        }
        --left_;
        ++frames_[fault_];
    }

    HapticDevice& device_;
    std::mt19937_64 random_;
    Fault fault_ = none;
    int left_ = 0;
    DeviceState last_;
    double time_s_ = 0.0;
    double last_fresh_s_ = 0.0;
    std::array<long, kFaults> frames_{};
};

} // namespace palpate::test
