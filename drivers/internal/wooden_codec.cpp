// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/internal/wooden_codec.h>

#include <algorithm>

namespace palpate::internal {

namespace {

constexpr std::int16_t kButtonFrom = 5000; ///< a gimbal's counter does not get there by itself
constexpr std::int16_t kButtonAdds = 10000;

std::uint16_t unsigned_at(std::span<const std::uint8_t> bytes, std::size_t offset) noexcept {
    return static_cast<std::uint16_t>(bytes[offset] | (bytes[offset + 1] << 8));
}

std::int16_t signed_at(std::span<const std::uint8_t> bytes, std::size_t offset) noexcept {
    return static_cast<std::int16_t>(unsigned_at(bytes, offset));
}

void put(std::span<std::uint8_t> bytes, std::size_t offset, std::int16_t value) noexcept {
    const auto bits = static_cast<std::uint16_t>(value);
    bytes[offset] = static_cast<std::uint8_t>(bits & 0xFF);
    bytes[offset + 1] = static_cast<std::uint8_t>(bits >> 8);
}

constexpr std::size_t length(WoodenLayout layout) noexcept {
    return static_cast<std::size_t>(layout);
}

/// How far a counter has moved, in 16 bits that run over.
double moved(std::int16_t from, std::int16_t to) noexcept {
    return static_cast<std::int16_t>(static_cast<std::uint16_t>(to) -
                                     static_cast<std::uint16_t>(from));
}

} // namespace

std::optional<WoodenLayout> wooden_layout(std::size_t report_length) noexcept {
    for (const auto layout :
         {WoodenLayout::bytes_8, WoodenLayout::bytes_14, WoodenLayout::bytes_64})
        if (length(layout) == report_length) return layout;
    return std::nullopt;
}

std::optional<WoodenLayout> wooden_layout(const HidDescriptor& descriptor) {
    constexpr HidUsage kUsage = hid_usage(0xFFAB, 0x0200);
    const bool ours = !descriptor.collections.empty() &&
                      descriptor.collections.front().usage == kUsage && !descriptor.numbered;
    const std::size_t length = descriptor.report_bytes(HidReportKind::input, 0);
    if (!ours || length != descriptor.report_bytes(HidReportKind::output, 0)) return std::nullopt;
    return wooden_layout(length);
}

std::optional<WoodenReport> decode_wooden(WoodenLayout layout,
                                          std::span<const std::uint8_t> report) noexcept {
    if (report.size() != length(layout)) return std::nullopt;
    WoodenReport decoded;
    for (std::size_t i = 0; i < 3; ++i)
        decoded.counters[i] = signed_at(report, 2 * i);
    if (layout == WoodenLayout::bytes_8) {
        decoded.sequence = unsigned_at(report, 6);
        return decoded;
    }
    for (std::size_t i = 3; i < 6; ++i)
        decoded.counters[i] = signed_at(report, 16 - 2 * i);
    decoded.asks_for_zero = signed_at(report, 12) == 1;
    // The button comes in the board's first gimbal counter, which is that of joint F.
    if (decoded.counters[5] > kButtonFrom) {
        decoded.button = true;
        decoded.counters[5] = static_cast<std::int16_t>(decoded.counters[5] - kButtonAdds);
    }
    return decoded;
}

std::size_t encode_wooden_currents(WoodenLayout layout,
                                   const std::array<std::int16_t, 3>& milliamps,
                                   std::span<std::uint8_t, kWoodenBuffer> report) noexcept {
    std::fill(report.begin(), report.end(), std::uint8_t{0});
    for (std::size_t i = 0; i < 3; ++i)
        put(report, 1 + 2 * i, milliamps[i]);
    return 1 + length(layout);
}

std::size_t encode_wooden_counters(WoodenLayout layout, const std::array<std::int16_t, 6>& counters,
                                   std::span<std::uint8_t, kWoodenBuffer> report) noexcept {
    if (layout == WoodenLayout::bytes_8) return 0;
    std::fill(report.begin(), report.end(), std::uint8_t{0});
    for (std::size_t i = 0; i < 3; ++i) {
        put(report, 1 + 2 * i, counters[5 - i]);
        put(report, 9 + 2 * i, counters[i]);
    }
    put(report, 7, 1);
    return 1 + length(layout);
}

void WoodenCounters::set_home(const WoodenModel& model,
                              const std::array<std::int16_t, 6>& counters) noexcept {
    last_ = counters;
    direction_ = model.count_direction;
    counts_ = model.home_counts;
}

void WoodenCounters::set_kept(const WoodenModel& model,
                              const std::array<std::int16_t, 6>& counters) noexcept {
    last_ = counters;
    direction_ = model.count_direction;
    for (std::size_t i = 0; i < 6; ++i)
        counts_[i] = model.home_counts[i] +
                     direction_[i] * (static_cast<double>(counters[i]) - model.home_counts[i]);
}

void WoodenCounters::follow(const std::array<std::int16_t, 6>& counters) noexcept {
    for (std::size_t i = 0; i < 6; ++i)
        counts_[i] += direction_[i] * moved(last_[i], counters[i]);
    last_ = counters;
}

} // namespace palpate::internal
