// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdlib>

#include "tests/support/hid_firmware.h"

namespace palpate::test {

/// The board of a WoodenHaptics device, by the length of its reports. 8: sends freely. 14 and 64:
/// one report, then none until it is written to.
class WoodenFirmware final : public HidFirmware {
public:
    static constexpr double kWatchdogS = 0.5;
    static constexpr double kPeriodS = 0.001; ///< of a full-speed bus

    explicit WoodenFirmware(std::size_t report_size) : size_(report_size) {}

    // What a test sets.
    std::array<int, 6> counters{}; ///< in the order of the board's reports: a b c d e f
    bool keeps_counters = false;   ///< over power_on(); else they are `power_on_counters`
    std::array<int, 6> power_on_counters{};
    bool calibration_button = false; ///< pressed since the counters were last set
    bool silent = false;             ///< says nothing
    bool spent_first_report = false; ///< its report after power_on() went to somebody before
    std::optional<Bytes> instead;    ///< sent once in place of the next report

    // What a test looks at.
    std::array<int, 3> milliamps{}; ///< of the motors, as long as they are enabled
    bool motors_on = false;
    int largest_milliamps = 0;  ///< of all that it was ever sent
    int reports_received = 0;   ///< that were valid
    int reports_ignored = 0;    ///< of another length
    int counters_set = 0;       ///< times
    int watchdog_trips = 0;     ///< times
    bool last_was_zero = false; ///< the last valid report had no current
    int reports_sent = 0;       ///< since power_on()

    Bytes descriptor() const override {
        const auto n = static_cast<std::uint8_t>(size_);
        return {0x06, 0xAB, 0xFF, 0x0A, 0x00, 0x02, 0xA1, 0x01, 0x75, 0x08, 0x15, 0x00, 0x25, 0xFF,
                0x95, n,    0x09, 0x01, 0x81, 0x02, 0x95, n,    0x09, 0x02, 0x91, 0x02, 0xC0};
    }

    void power_on(double time_s) override {
        if (!keeps_counters) counters = power_on_counters;
        owes_report_ = !spent_first_report;
        motors_on = false;
        milliamps = {};
        reports_sent = 0;
        next_s_ = time_s;
        heard_s_ = time_s;
    }

    void receive(std::span<const std::uint8_t> report, double time_s) override {
        if (report.size() != size_) {
            ++reports_ignored;
            return;
        }
        ++reports_received;
        heard_s_ = time_s;
        owes_report_ = true;
        motors_on = true;
        if (size_ > 8 && at(report, 6) == 1) {
            counters = {at(report, 8), at(report, 10), at(report, 12),
                        at(report, 0), at(report, 2),  at(report, 4)};
            calibration_button = false;
            ++counters_set;
            milliamps = {};
            return;
        }
        for (std::size_t i = 0; i < 3; ++i) {
            milliamps[i] = at(report, 2 * i);
            largest_milliamps = std::max(largest_milliamps, std::abs(milliamps[i]));
        }
        last_was_zero = milliamps == std::array<int, 3>{};
    }

    std::optional<Bytes> send(double time_s) override {
        if (motors_on && time_s - heard_s_ > kWatchdogS) {
            motors_on = false;
            milliamps = {};
            ++watchdog_trips;
        }
        const bool free_running = size_ == 8;
        if (silent || time_s < next_s_ || (!free_running && !owes_report_)) return std::nullopt;
        owes_report_ = false;
        next_s_ = std::max(next_s_ + kPeriodS, time_s);
        ++reports_sent;
        if (instead) {
            const Bytes odd = *instead;
            instead.reset();
            return odd;
        }
        Bytes report(size_, 0);
        for (std::size_t i = 0; i < (free_running ? 3 : 6); ++i)
            put(report, 2 * i, counters[i]);
        if (free_running) put(report, 6, reports_sent);
        if (!free_running) put(report, 12, calibration_button ? 1 : 0);
        return report;
    }

private:
    static int at(std::span<const std::uint8_t> bytes, std::size_t offset) {
        return static_cast<std::int16_t>(bytes[offset] | (bytes[offset + 1] << 8));
    }
    static void put(Bytes& bytes, std::size_t offset, int value) {
        bytes.at(offset) = static_cast<std::uint8_t>(value & 0xFF);
        bytes.at(offset + 1) = static_cast<std::uint8_t>((value >> 8) & 0xFF);
    }

    std::size_t size_;
    bool owes_report_ = true;
    double next_s_ = 0.0;
    double heard_s_ = 0.0;
};

} // namespace palpate::test
