// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include <palpate/drivers/haptic_device.h>

namespace palpate {

/// A device that plays a given sequence of states: a path, an orbit, a recording. Takes forces and
/// forgets them.
class SequenceDevice final : public HapticDevice {
public:
    /// Plays `states` once, in their order; scene frame, m, s. Not null.                   [setup]
    explicit SequenceDevice(std::shared_ptr<const std::vector<DeviceState>> states)
        : states_(std::move(states)) {}

    DeviceProperties properties() const override {
        DeviceProperties properties;
        properties.name = "sequence of states";
        return properties;
    }

    bool read(DeviceState& state) noexcept override {
        if (next_ >= states_->size()) return false;
        state = (*states_)[next_++];
        return true;
    }
    void write(const Vec3&) noexcept override {}

private:
    std::shared_ptr<const std::vector<DeviceState>> states_;
    std::size_t next_ = 0;
};

} // namespace palpate
