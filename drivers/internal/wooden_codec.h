// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <palpate/drivers/internal/hid_descriptor.h>
#include <palpate/drivers/wooden_model.h>

/// The reports of the WoodenHaptics family: bytes to numbers and back, nothing else. Numbers are
/// little-endian 16-bit integers, packed, without checksum or time.                        [any]
namespace palpate::internal {

/// Three generations of boards; the numbers are the lengths of their reports, both ways.
enum class WoodenLayout : std::uint8_t { bytes_8 = 8, bytes_14 = 14, bytes_64 = 64 };

/// Room for the longest report with its number.
constexpr std::size_t kWoodenBuffer = 65;

/// Which layout has reports of that length; nothing: none has.
std::optional<WoodenLayout> wooden_layout(std::size_t report_length) noexcept;

/// Which layout a descriptor declares; nothing where it is not of a device of this family: usage
/// FFAB/0200, unnumbered reports, equally long both ways.
std::optional<WoodenLayout> wooden_layout(const HidDescriptor& descriptor);

/// What the device says. Counters 0 to 2 of the base, 3 to 5 of the gimbal's joints D, E, F: the
/// board has those in reverse order.
struct WoodenReport {
    std::array<std::int16_t, 6> counters{};
    std::uint16_t sequence = 0; ///< bytes_8: one more at each report; else 0
    bool button = false;        ///< of the handle; the board adds 10000 to a counter for it
    bool asks_for_zero = false; ///< its calibration button was pressed; until it is given counters
};

/// Nothing when the length is not the layout's.
std::optional<WoodenReport> decode_wooden(WoodenLayout layout,
                                          std::span<const std::uint8_t> report) noexcept;

/// The report, with its number 0, that sets the motors' currents, mA. Returns its length.
std::size_t encode_wooden_currents(WoodenLayout layout,
                                   const std::array<std::int16_t, 3>& milliamps,
                                   std::span<std::uint8_t, kWoodenBuffer> report) noexcept;

/// The report that sets the counters (order of WoodenReport), the motors being without current
/// meanwhile. Returns its length, 0 for bytes_8, which has no such report.
std::size_t encode_wooden_counters(WoodenLayout layout, const std::array<std::int16_t, 6>& counters,
                                   std::span<std::uint8_t, kWoodenBuffer> report) noexcept;

/// Follows counters beyond their 16 bits, from where they were first seen: right as long as none
/// moves by more than 32767 between two reports.
class WoodenCounters {
public:
    /// The counters stand at home now: whatever they read is model.home_counts.
    void set_home(const WoodenModel& model, const std::array<std::int16_t, 6>& counters) noexcept;
    /// They read what the device has kept.
    void set_kept(const WoodenModel& model, const std::array<std::int16_t, 6>& counters) noexcept;
    /// The next report's.
    void follow(const std::array<std::int16_t, 6>& counters) noexcept;
    const std::array<double, 6>& counts() const noexcept { return counts_; }

private:
    std::array<std::int16_t, 6> last_{};
    std::array<double, 6> direction_{};
    std::array<double, 6> counts_{};
};

} // namespace palpate::internal
