// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace palpate::test {

using Bytes = std::vector<std::uint8_t>;

/// What runs on a simulated HID device, without a clock and without a cable: HidNode and others
/// bring both. Called by one thread at a time, whichever.
class HidFirmware {
public:
    virtual ~HidFirmware() = default;

    virtual Bytes descriptor() const = 0;
    /// Whether its reports begin with a number; else the host's leading 0 stays in the kernel.
    virtual bool numbered() const { return false; }

    /// The cable is in: everything starts anew.
    virtual void power_on(double time_s) = 0;
    /// An output report, as it is on the wire.
    virtual void receive(std::span<const std::uint8_t> report, double time_s) = 0;
    /// The next input report that is due, if any; asked about every ms until there is none.
    virtual std::optional<Bytes> send(double time_s) = 0;

    /// A feature report, number first; false: refused.
    virtual bool set_feature(std::span<const std::uint8_t>) { return false; }
    /// The feature report of that number, number first; nothing: refused.
    virtual std::optional<Bytes> get_feature(std::uint8_t) { return std::nullopt; }
};

} // namespace palpate::test
