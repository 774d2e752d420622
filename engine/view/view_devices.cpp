// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/view_devices.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace palpate {

PageDevice::PageDevice(const Vec3& start, double rate_hz) noexcept
    : target_(start), position_(start), period_s_(1.0 / rate_hz) {}

void PageDevice::aim_at(const Vec3& target) noexcept {
    constexpr double kFarthest_m = 1e3;
    if (is_finite(target) && glm::length(target) <= kFarthest_m) aimed_.set(target);
}

void PageDevice::begin_at(const Vec3& position) noexcept { begins_at_.set(position); }

void PageDevice::begin() noexcept {
    if (!begins_at_.take(position_)) return;
    velocity_ = Vec3{0.0};
    rests_ = true;
}

DeviceProperties PageDevice::properties() const {
    DeviceProperties properties;
    properties.name = "the page's mouse";
    return properties;
}

bool PageDevice::read(DeviceState& state) noexcept {
    aimed_.take(target_);
    if (std::exchange(stands_, false)) {
        velocity_ = Vec3{0.0};
    } else if (reads_ > 0 && !rests_) {
        const Vec3 way = target_ - position_;
        const double distance = glm::length(way);
        // As fast as it can still stop in time: v^2 = 2 a d.
        const double speed = std::min({kFastest_m_per_s, kFollow_per_s * distance,
                                       std::sqrt(2.0 * kMostAcceleration_m_per_s2 * distance)});
        const Vec3 wanted = distance > 0.0 ? way * (speed / distance) : Vec3{0.0};
        const Vec3 change = wanted - velocity_;
        const double most = kMostAcceleration_m_per_s2 * period_s_;
        const double length = glm::length(change);
        velocity_ += length > most ? change * (most / length) : change;
        position_ += velocity_ * period_s_;
    }
    state = DeviceState{};
    state.time_s = static_cast<double>(reads_++) * period_s_;
    state.position = position_;
    state.velocity = velocity_;
    return true;
}

SteeredDevice::SteeredDevice(std::vector<DeviceState> states, double rate_hz)
    : states_(std::move(states)), period_s_(1.0 / rate_hz) {
    if (states_.empty())
        throw std::invalid_argument("the device has no states to play; give it a longer path");
}

DeviceProperties SteeredDevice::properties() const {
    if (device_ != nullptr) return device_->properties();
    DeviceProperties properties;
    properties.name = "sequence of states";
    return properties;
}

void SteeredDevice::open() {
    if (device_ != nullptr) device_->open();
}

void SteeredDevice::start() {
    if (device_ == nullptr) {
        next_ = 0;
        reads_ = 0;
        trial_ = 0;
        has_last_ = false;
        return;
    }
    begun_.store(kNoTrial, std::memory_order_relaxed);
    device_->start();
    has_last_ = false; // where it was frozen before is of another run
    has_motors_ = device_->properties().force_n > 0.0;
}

void SteeredDevice::stop() noexcept {
    if (device_ != nullptr) device_->stop();
}

void SteeredDevice::close() noexcept {
    if (device_ != nullptr) device_->close();
}

void SteeredDevice::write(const Vec3& force) noexcept {
    is_taken_ = true;
    if (device_ != nullptr) device_->write(force);
}

bool SteeredDevice::read(DeviceState& state) noexcept {
    const std::uint32_t restarts = restarts_.load(std::memory_order_acquire);
    const bool begins_again = std::exchange(seen_restarts_, restarts) != restarts;
    if (device_ == nullptr) {
        read_states(state, begins_again);
    } else {
        if (begins_again) ++trial_;
        if (mouse_ != nullptr) {
            if (begins_again) mouse_->begin();
            if (begun_.load(std::memory_order_relaxed) == trial_) mouse_->go_on();
        }
        read_device(state, begins_again);
    }
    if (is_pressed()) state.buttons |= 1u;
    return true;
}

bool SteeredDevice::is_pressed() noexcept {
    // A loop that is late reads several states, and takes the last one alone.
    if (!is_taken_) return is_down_;
    const bool was_down = is_down_;
    const std::uint32_t presses = presses_.load(std::memory_order_acquire);
    if (is_down_) {
        is_down_ = presses == seen_presses_ && pressed_.load(std::memory_order_relaxed);
    } else if (presses != seen_presses_) {
        ++seen_presses_;
        is_down_ = true;
    }
    is_taken_ = is_down_ == was_down;
    return is_down_;
}

void SteeredDevice::read_states(DeviceState& state, bool begins_again) noexcept {
    const bool is_frozen_now = is_frozen() && has_last_ && !begins_again;
    if (!is_frozen_now) {
        const std::size_t at = begins_again || next_ == states_.size() ? 0 : next_;
        const bool is_new_trial =
            has_last_ && (at == 0 || states_[at].trial != states_[at - 1].trial);
        trial_ += is_new_trial ? 1 : 0;
        last_ = states_[at];
        next_ = at + 1;
    } else {
        last_.velocity = Vec3{0.0};
    }
    has_last_ = true;
    last_.trial = trial_;
    last_.time_s = period_s_ * static_cast<double>(reads_++);
    state = last_;
}

void SteeredDevice::read_device(DeviceState& state, bool begins_again) noexcept {
    const bool is_held = is_frozen() && has_last_;
    if (is_held && mouse_ != nullptr) mouse_->stand();
    if (!device_->read(state)) {
        state = last_;
        state.freshness = Freshness::stale;
        ended_.store(true, std::memory_order_relaxed);
        return;
    }
    state.trial += trial_;
    if (is_held && has_motors_) {
        state.freshness = Freshness::stale;
    } else if (is_held && !begins_again) { // where a trial begins, the device says
        state.position = last_.position;
        state.velocity = Vec3{0.0};
    }
    last_ = state;
    has_last_ = true;
}

} // namespace palpate
