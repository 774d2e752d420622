// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>

#include <palpate/drivers/internal/space_mouse_reports.h>

namespace palpate::internal {
namespace {

constexpr std::uint8_t kTranslation = 0x01, kRotation = 0x02, kButtons = 0x03, kBattery = 0x17;
constexpr std::uint8_t kButtonCodes = 0x1C; // arrays of 16-bit codes: the Enterprise's many buttons
constexpr std::size_t kAxes = 6;            // bytes of three axes
constexpr double kFullDeflection = 350.0;   // logical maximum of every model; real caps exceed it
constexpr std::size_t kButtonBytes = 4;     // those that a bitmap of 32 holds
constexpr std::uint16_t kMostButtonCode = 31;

double deflection(std::span<const std::uint8_t> report, std::size_t at) {
    const auto raw = static_cast<std::int16_t>(report[at] | report[at + 1] << 8);
    return std::clamp(raw / kFullDeflection, -1.0, 1.0);
}

/// Three axes as the device counts them, to the frame that is ours.
Vec3 axes(std::span<const std::uint8_t> report, std::size_t at) {
    const double right = deflection(report, at);
    const double towards_user = deflection(report, at + 2);
    const double down = deflection(report, at + 4);
    return {towards_user, right, -down};
}

std::uint32_t bitmap(std::span<const std::uint8_t> bytes) {
    std::uint32_t buttons = 0;
    for (std::size_t i = 0; i < std::min(bytes.size(), kButtonBytes); ++i)
        buttons |= static_cast<std::uint32_t>(bytes[i]) << 8 * i;
    return buttons;
}

/// Codes count from 1; 0 fills up.
std::uint32_t from_codes(std::span<const std::uint8_t> bytes) {
    std::uint32_t buttons = 0;
    for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
        const auto code = static_cast<std::uint16_t>(bytes[i] | bytes[i + 1] << 8);
        if (code >= 1 && code <= kMostButtonCode + 1) buttons |= 1u << (code - 1);
    }
    return buttons;
}

} // namespace

SpaceMouseNews take_space_mouse_report(std::span<const std::uint8_t> report,
                                       SpaceMouseReading& reading) noexcept {
    if (report.size() < 2) return SpaceMouseNews::nothing;
    const std::uint8_t id = report[0];
    if (id == kTranslation && report.size() >= 1 + kAxes) {
        reading.deflection.push = axes(report, 1);
        if (report.size() >= 1 + 2 * kAxes) reading.deflection.turn = axes(report, 1 + kAxes);
        return SpaceMouseNews::motion;
    }
    if (id == kRotation && report.size() >= 1 + kAxes) {
        reading.deflection.turn = axes(report, 1);
        return SpaceMouseNews::motion;
    }
    if (id == kButtons) {
        reading.buttons = bitmap(report.subspan(1));
        return SpaceMouseNews::buttons;
    }
    if (id == kButtonCodes) {
        reading.buttons = from_codes(report.subspan(1));
        return SpaceMouseNews::buttons;
    }
    if (id == kBattery) {
        reading.battery_percent = report[1];
        return SpaceMouseNews::battery;
    }
    return SpaceMouseNews::nothing;
}

} // namespace palpate::internal
