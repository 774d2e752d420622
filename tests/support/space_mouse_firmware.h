// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <utility>

#include "tests/support/hid_descriptors.h"
#include "tests/support/hid_firmware.h"

namespace palpate::test {

/// A cap with six degrees of freedom. With a cable two reports in turn, every 8 ms; without one
/// report, every 16 ms. It speaks as long as the cap is deflected, says three times that it is back
/// and then nothing.
class SpaceMouseFirmware final : public HidFirmware {
public:
    enum class Kind { wired, wireless };

    explicit SpaceMouseFirmware(Kind kind) : wireless_(kind == Kind::wireless) {}

    // What a test sets.
    std::array<int, 6> axes{}; ///< X right, Y towards the user, Z down, and about them; of 350
    int buttons = 0;
    bool silent = false;          ///< says nothing, whatever happens to the cap
    std::optional<Bytes> instead; ///< sent once in place of the next report

    // What a test looks at.
    bool lamp = false;
    int reports_sent = 0;
    /// Whether it has told of its rest as often as it does, and is silent.
    bool has_said_rest() const { return rests_ == kRests; }

    Bytes descriptor() const override { return space_mouse_descriptor(wireless_); }
    bool numbered() const override { return true; }

    void power_on(double time_s) override {
        next_s_ = time_s;
        rests_ = kRests;
        lamp = false;
        told_buttons_ = 0;
    }

    void receive(std::span<const std::uint8_t> report, double) override {
        if (report.size() == 2 && report[0] == 4) lamp = report[1] != 0;
    }

    std::optional<Bytes> send(double time_s) override {
        if (silent || time_s < next_s_) return std::nullopt;
        if (instead) return std::exchange(instead, std::nullopt);
        if (buttons != told_buttons_) {
            told_buttons_ = buttons;
            ++reports_sent;
            return Bytes{3, static_cast<std::uint8_t>(buttons), 0};
        }
        const bool deflected = axes != std::array<int, 6>{};
        if (deflected) rests_ = 0;
        if (!deflected && rests_ == kRests) return std::nullopt;
        next_s_ = time_s + (wireless_ ? 0.016 : 0.008);
        ++reports_sent;
        if (wireless_) {
            rests_ += deflected ? 0 : 1;
            return motion(1, 0, 6);
        }
        turn_ = !turn_;
        rests_ += deflected || turn_ ? 0 : 1;
        return turn_ ? motion(1, 0, 3) : motion(2, 3, 3);
    }

private:
    static constexpr int kRests = 3;

    Bytes motion(std::uint8_t id, std::size_t first, std::size_t count) const {
        Bytes report{id};
        for (std::size_t i = first; i < first + count; ++i) {
            report.push_back(static_cast<std::uint8_t>(axes[i] & 0xFF));
            report.push_back(static_cast<std::uint8_t>(axes[i] >> 8 & 0xFF));
        }
        return report;
    }

    const bool wireless_;
    bool turn_ = false;
    int rests_ = kRests;
    int told_buttons_ = 0;
    double next_s_ = 0.0;
};

} // namespace palpate::test
