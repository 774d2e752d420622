// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/haptics/contact/latest.h>

namespace palpate {

/// A hand that goes where a page's mouse says, in the scene frame. It moves as a hand can, however
/// far the mouse jumps: no faster than kFastest_m_per_s, sped up and slowed down by no more than
/// kMostAcceleration_m_per_s2. Takes no force. Its time is its own: one period with each read().
class PageDevice final : public HapticDevice {
public:
    static constexpr double kFastest_m_per_s = 0.5;            ///< of a hand that feels, m/s
    static constexpr double kMostAcceleration_m_per_s2 = 10.0; ///< m/s^2
    static constexpr double kFollow_per_s = 30.0; ///< of what is left of the way, a second

    /// Rests at `start`, m, scene frame. `rate_hz` > 0.                                  [setup]
    PageDevice(const Vec3& start, double rate_hz) noexcept;

    /// Where the hand is wanted, m, scene frame; what is not finite, or beyond 1e3 m, is left
    /// alone. From one thread at a time.                                                   [any]
    void aim_at(const Vec3& target) noexcept;
    /// Rests there (m, scene frame) when the next run or trial begins, until go_on(): it comes to
    /// no surface before the loop has begun in front. From one thread at a time.           [any]
    void begin_at(const Vec3& position) noexcept;
    /// A trial begins with the next read().                                               [loop]
    void begin() noexcept;
    /// From the next read() on it goes to where it is wanted.                             [loop]
    void go_on() noexcept { rests_ = false; }
    /// Stands still in the next read().                                                   [loop]
    void stand() noexcept { stands_ = true; }

    DeviceProperties properties() const override;
    /// Its clock begins anew with each run.                                               [setup]
    void start() override {
        reads_ = 0;
        begin();
    }
    bool read(DeviceState& state) noexcept override;
    void write(const Vec3&) noexcept override {}

private:
    Latest<Vec3> aimed_;
    Latest<Vec3> begins_at_;
    Vec3 target_;
    Vec3 position_;
    Vec3 velocity_{0.0};
    double period_s_;
    std::uint64_t reads_ = 0;
    bool rests_ = false;
    bool stands_ = false;
};

/// A device that a page may freeze and restart while it is read. Everything else is the device's.
class SteeredDevice final : public HapticDevice {
public:
    /// Of a device that follows a hand; it must outlive this. Frozen, one with motors counts as
    /// stale, so that its force goes to zero, and the probe of another stays where it is. A restart
    /// begins a new trial, with a page's mouse where its begin_at() said.               [setup]
    explicit SteeredDevice(HapticDevice& device)
        : device_(&device), mouse_(dynamic_cast<PageDevice*>(&device)) {}
    /// Of states that are known, one each period of `rate_hz`: they begin again, with a new trial,
    /// at their end and at a restart, and stay where they are while frozen. Time goes on within a
    /// run. Throws std::invalid_argument where there are none.                           [setup]
    SteeredDevice(std::vector<DeviceState> states, double rate_hz);

    /// The probe stays where it is, or goes on.                                            [any]
    void freeze(bool on) noexcept { frozen_.store(on, std::memory_order_relaxed); }
    bool is_frozen() const noexcept { return frozen_.load(std::memory_order_relaxed); } ///< [any]
    /// A new trial with the next state.                                                    [any]
    void restart() noexcept { restarts_.fetch_add(1, std::memory_order_release); }
    /// A frame of this trial (DeviceState::trial) was computed: a page's mouse rests no longer
    /// where the trial begins. A loop may be late, and what it does not compute begins no trial.
    ///                                                                                      [any]
    void trial_has_begun(std::uint32_t trial) noexcept {
        begun_.store(trial, std::memory_order_relaxed);
    }
    /// Button 0 of the page, beside the device's own. Each press is seen in a state, and its end in
    /// another one, however short it was and however late the loop is.                     [any]
    void press(bool on) noexcept {
        if (!pressed_.exchange(on) && on) presses_.fetch_add(1, std::memory_order_release);
    }

    DeviceProperties properties() const override;
    void open() override;
    /// States and their clock begin anew with each run; a device does as it does.         [setup]
    void start() override;
    void stop() noexcept override;
    void close() noexcept override;
    /// Of a device without a state any more, its last one, stale.                         [loop]
    bool read(DeviceState& state) noexcept override;
    void write(const Vec3& force) noexcept override;

    /// The device has no state any more.                                                   [any]
    bool has_ended() const noexcept { return ended_.load(std::memory_order_relaxed); }

private:
    static constexpr std::uint32_t kNoTrial = 0xffff'ffff;

    void read_states(DeviceState& state, bool begins_again) noexcept;
    void read_device(DeviceState& state, bool begins_again) noexcept;
    bool is_pressed() noexcept;

    HapticDevice* device_ = nullptr; ///< null: of states
    PageDevice* mouse_ = nullptr;    ///< the same, where it is one
    std::vector<DeviceState> states_;
    double period_s_ = 0.0;
    bool has_motors_ = false;
    std::size_t next_ = 0;
    std::uint64_t reads_ = 0;
    std::uint32_t trial_ = 0; ///< of states: of those that are read; of a device: beside its own
    std::uint32_t seen_restarts_ = 0;
    std::uint32_t seen_presses_ = 0;
    bool is_down_ = false; ///< in the last state
    bool is_taken_ = true; ///< a frame has had the button as it is
    DeviceState last_;
    bool has_last_ = false;
    std::atomic<bool> frozen_{false};
    std::atomic<bool> pressed_{false};
    std::atomic<std::uint32_t> presses_{0};
    std::atomic<bool> ended_{false};
    std::atomic<std::uint32_t> restarts_{0};
    std::atomic<std::uint32_t> begun_{kNoTrial};
};

} // namespace palpate
