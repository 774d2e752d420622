// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "tests/support/hid_descriptors.h"
#include "tests/support/hid_firmware.h"

namespace palpate::test {

/// A stick with force feedback: keeps effects, and adds up the forces of those that play. Knows its
/// reports byte by byte.
class PidFirmware final : public HidFirmware {
public:
    struct Effect {
        double from_degrees = 0.0; ///< clockwise from ahead
        int magnitude = 0;
        bool playing = false;
    };

    explicit PidFirmware(const PidLayout& layout) : layout_(layout) {}

    // What a test sets.
    std::array<int, 2> axes{}; ///< right, towards the user; of 32767
    int buttons = 0;
    bool silent = false;
    std::optional<Bytes> instead; ///< sent once in place of the next report
    bool refuses_effects = false;

    // What a test looks at.
    std::map<int, Effect> effects;
    bool actuators = false;
    int gain = 0;
    int starts = 0;           ///< times that an effect was started
    int unknown_reports = 0;  ///< that no host should send
    double largest_force = 0; ///< of all that it was ever told, of 1

    /// Right and towards the user, of 1.
    std::array<double, 2> force() const {
        std::array<double, 2> sum{};
        if (!actuators) return sum;
        for (const auto& [number, effect] : effects) {
            if (!effect.playing) continue;
            const double from = effect.from_degrees * std::numbers::pi / 180.0;
            const double size = static_cast<double>(effect.magnitude) / layout_.largest_force;
            sum[0] -= std::sin(from) * size;
            sum[1] += std::cos(from) * size;
        }
        return sum;
    }

    Bytes descriptor() const override { return pid_descriptor(layout_); }
    bool numbered() const override { return true; }

    void power_on(double time_s) override {
        effects.clear();
        actuators = false;
        gain = 0;
        next_s_ = time_s;
    }

    void receive(std::span<const std::uint8_t> report, double) override {
        const std::uint8_t id = report[0];
        const auto effect = effects.find(report.size() > 1 ? report[1] : 0);
        const bool known = effect != effects.end();
        if (id == layout_.control && report.size() == 2) {
            control(report[1]);
        } else if (id == layout_.gain && report.size() == 2) {
            gain = report[1];
        } else if (id == layout_.set_effect && known && report.size() == set_effect_bytes()) {
            // Direction enabled, and no button that starts it.
            const std::size_t enable = layout_.start_delay ? 13 : 11;
            if (report[enable] != 0x04 || report[enable - 1] != 255 || report[2] != 2)
                ++unknown_reports;
            effect->second.from_degrees =
                layout_.start_delay ? word(report, enable + 1) / 100.0 : report[enable + 1] * 2.0;
        } else if (id == layout_.constant_force && known && report.size() == 4) {
            effect->second.magnitude = static_cast<std::int16_t>(word(report, 2));
            largest_force = std::max({largest_force, std::abs(force()[0]), std::abs(force()[1])});
        } else if (id == layout_.operation && known && report.size() == 4) {
            effect->second.playing = report[2] == 1;
            starts += report[2] == 1 ? 1 : 0;
        } else if (id == layout_.block_free && known && report.size() == 2) {
            effects.erase(effect);
        } else {
            ++unknown_reports;
        }
    }

    bool set_feature(std::span<const std::uint8_t> report) override {
        if (report.size() != 4 || report[0] != layout_.create || report[1] != 2) return false;
        created_ = 0;
        for (int number = 1; number <= layout_.effects && created_ == 0; ++number)
            if (!effects.contains(number)) created_ = number;
        if (created_ != 0 && !refuses_effects) effects[created_] = {};
        return true;
    }

    std::optional<Bytes> get_feature(std::uint8_t id) override {
        if (id != layout_.block_load) return std::nullopt;
        const std::uint8_t loaded = 1, full = 2, failed = 3;
        const std::uint8_t status = refuses_effects ? failed : created_ == 0 ? full : loaded;
        return Bytes{id, static_cast<std::uint8_t>(created_), status, 0, 0};
    }

    std::optional<Bytes> send(double time_s) override {
        if (silent || time_s < next_s_) return std::nullopt;
        next_s_ = time_s + 0.001;
        if (instead) return std::exchange(instead, std::nullopt);
        Bytes report{1, static_cast<std::uint8_t>(buttons)};
        for (const int axis : axes) {
            report.push_back(static_cast<std::uint8_t>(axis & 0xFF));
            report.push_back(static_cast<std::uint8_t>(axis >> 8 & 0xFF));
        }
        return report;
    }

private:
    static int word(std::span<const std::uint8_t> bytes, std::size_t at) {
        return bytes[at] | bytes[at + 1] << 8;
    }
    std::size_t set_effect_bytes() const { return layout_.start_delay ? 22 : 14; }

    /// Numbers, or the bits of these numbers: enable, disable, stop all, reset.
    void control(int what) {
        const auto is = [&](int number) {
            return what == (layout_.control_bits ? 1 << (number - 1) : number);
        };
        if (is(1)) {
            actuators = true;
        } else if (is(2)) {
            actuators = false;
        } else if (is(3)) {
            for (auto& [number, effect] : effects)
                effect.playing = false;
        } else if (is(4)) {
            effects.clear();
            actuators = false;
        } else {
            ++unknown_reports;
        }
    }

    const PidLayout layout_;
    int created_ = 0;
    double next_s_ = 0.0;
};

} // namespace palpate::test
