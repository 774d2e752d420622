// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace palpate::test {

/// Writes a report descriptor item by item (HID 1.11, 6.2.2), each as short as it can be.
class DescriptorWriter {
public:
    DescriptorWriter& page(std::uint32_t number) { return item(0x04, number); }
    DescriptorWriter& usage(std::uint32_t number) { return item(0x08, number); }
    DescriptorWriter& usages(std::uint32_t first, std::uint32_t last) {
        return item(0x18, first).item(0x28, last);
    }
    DescriptorWriter& range(std::int32_t min, std::int32_t max) {
        return signed_item(0x14, min).signed_item(0x24, max);
    }
    DescriptorWriter& values(std::uint32_t bits, std::uint32_t count) {
        return item(0x74, bits).item(0x94, count);
    }
    DescriptorWriter& id(std::uint32_t number) { return item(0x84, number); }
    DescriptorWriter& push() { return bare(0xA4); }
    DescriptorWriter& pop() { return bare(0xB4); }
    enum Collection : std::uint32_t { physical = 0, application = 1, logical = 2 };
    DescriptorWriter& begin(std::uint32_t usage_number, Collection type = logical) {
        return usage(usage_number).item(0xA0, type);
    }
    DescriptorWriter& end() { return bare(0xC0); }
    enum Flags : std::uint32_t { array = 0, constant = 1, variable = 2, relative = 6 };
    DescriptorWriter& input(Flags flags = variable) { return item(0x80, flags); }
    DescriptorWriter& output(Flags flags = variable) { return item(0x90, flags); }
    DescriptorWriter& feature(Flags flags = variable) { return item(0xB0, flags); }

    const std::vector<std::uint8_t>& bytes() const { return bytes_; }

private:
    DescriptorWriter& bare(std::uint8_t prefix) {
        bytes_.push_back(prefix);
        return *this;
    }
    DescriptorWriter& item(std::uint8_t prefix, std::uint32_t value) {
        const unsigned size = value > 0xFFFF ? 4 : value > 0xFF ? 2 : 1;
        return sized(prefix, value, size);
    }
    DescriptorWriter& signed_item(std::uint8_t prefix, std::int32_t value) {
        const unsigned size = value >= -128 && value <= 127       ? 1
                              : value >= -32768 && value <= 32767 ? 2
                                                                  : 4;
        return sized(prefix, static_cast<std::uint32_t>(value), size);
    }
    DescriptorWriter& sized(std::uint8_t prefix, std::uint32_t value, unsigned size) {
        bytes_.push_back(static_cast<std::uint8_t>(prefix | (size == 4 ? 3 : size)));
        for (unsigned i = 0; i < size; ++i)
            bytes_.push_back(static_cast<std::uint8_t>(value >> 8 * i));
        return *this;
    }

    std::vector<std::uint8_t> bytes_;
};

/// A SpaceMouse: with a cable two reports of 7 bytes for translation and rotation, without one
/// report of 13; two buttons, a lamp.
inline std::vector<std::uint8_t> space_mouse_descriptor(bool wireless) {
    using W = DescriptorWriter;
    W w;
    w.page(0x01).begin(0x08, W::application).begin(0x00, W::physical);
    w.id(1).range(-350, 350).values(16, wireless ? 6 : 3);
    if (wireless) {
        w.usages(0x30, 0x35).input();
    } else {
        w.usages(0x30, 0x32).input(W::relative).id(2).usages(0x33, 0x35).input(W::relative);
    }
    w.end().begin(0x02, W::logical).id(3).page(0x09).usages(1, 2).range(0, 1).values(1, 2).input();
    w.values(14, 1).input(W::constant).end();
    w.page(0x08).begin(0x4B).id(4).usage(0x4B).range(0, 1).values(1, 1).output();
    w.values(7, 1).output(W::constant).end().end();
    return w.bytes();
}

/// What differs between the force feedback sticks that are imitated.
struct PidLayout {
    std::uint8_t set_effect, constant_force, operation, block_free, control, gain; // outputs
    std::uint8_t create, block_load, pool;                                         // features
    std::uint8_t effects = 40;        ///< as many at once
    std::int32_t largest_force = 255; ///< of the magnitude
    bool start_delay = false;         ///< Set Effect has one, and directions of 16 bits
    bool control_bits = false;        ///< Device Control as bits, not as a choice
    std::int32_t first_button = 0;    ///< of Trigger Button, a byte
    std::int32_t last_button = 255;   ///< of Trigger Button
    std::uint32_t padding_bytes = 0;  ///< of no use, behind the magnitude
};

/// As of adapters that put old sticks on USB: short reports, directions of a byte.
constexpr PidLayout kAdapterLayout{0x01, 0x05, 0x0A, 0x0B, 0x0C,  0x0D, 0x05,
                                   0x06, 0x07, 40,   255,  false, false};
/// As of open wheel and stick controllers: ids from 0x11 on for features, 16 bits everywhere.
constexpr PidLayout kBoardLayout{0x01, 0x05, 0x0A, 0x0B,  0x0C, 0x0D, 0x11,
                                 0x12, 0x13, 40,   32767, true, true};

/// A stick with two axes and eight buttons (input report 1) that makes constant forces, and others
/// which nobody asks for.
inline std::vector<std::uint8_t> pid_descriptor(const PidLayout& layout) {
    using W = DescriptorWriter;
    W w;
    w.page(0x01).begin(0x04, W::application);
    w.id(1).page(0x09).usages(1, 8).range(0, 1).values(1, 8).input();
    w.page(0x01).usage(0x30).usage(0x31).range(-32767, 32767).values(16, 2).input();

    const auto byte = [&w](std::uint32_t usage, std::int32_t most) -> W& {
        return w.usage(usage).range(0, most).values(8, 1);
    };
    const auto index = [&]() -> W& { return w.usage(0x22).range(1, layout.effects).values(8, 1); };
    const auto effect_types = [&w]() -> W& { // one more than is needed, so that a choice counts
        return w.begin(0x25).usage(0x40).usage(0x26).range(1, 2).values(8, 1);
    };
    w.page(0x0F).begin(0x92).id(2).range(0, 1).values(1, 2).usage(0x9F).usage(0xA0).input();
    w.values(6, 1).input(W::constant).end();

    w.begin(0x21).id(layout.set_effect);
    index().output();
    effect_types().output(W::array).end();
    w.usage(0x50).usage(0x54).usage(0x51).range(0, 32767).values(16, 3).output();
    if (layout.start_delay) w.usage(0xA7).values(16, 1).output();
    byte(0x52, 255).output();
    w.usage(0x53).range(layout.first_button, layout.last_button).values(8, 1).output();
    w.begin(0x55).page(0x01).usage(0x30).usage(0x31).range(0, 1).values(1, 2).output().end();
    w.page(0x0F).usage(0x56).range(0, 1).values(1, 1).output().values(5, 1).output(W::constant);
    w.begin(0x57).page(0x0A).usage(1).usage(2);
    if (layout.start_delay)
        w.range(0, 36000).values(16, 2).output();
    else
        w.range(0, 180).values(8, 2).output();
    w.end().page(0x0F);
    if (layout.start_delay) // two offsets of blocks: the real one ends so too
        w.begin(0x58).usage(0x0A0001).usage(0x0A0002).range(0, 32765).values(16, 2).output().end();
    w.end();

    w.begin(0x73).id(layout.constant_force);
    index().output();
    w.usage(0x70).range(-layout.largest_force, layout.largest_force).values(16, 1).output();
    if (layout.padding_bytes > 0) w.values(8, layout.padding_bytes).output(W::constant);
    w.end();

    w.begin(0x77).id(layout.operation);
    index().output();
    w.begin(0x78).usage(0x79).usage(0x7A).usage(0x7B).range(1, 3).values(8, 1).output(W::array);
    w.end();
    byte(0x7C, 255).output().end();

    w.begin(0x90).id(layout.block_free);
    index().output().end();

    w.begin(0x96).id(layout.control).usages(0x97, 0x9C);
    if (layout.control_bits) {
        w.range(0, 1).values(1, 6).output().values(2, 1).output(W::constant);
    } else {
        w.range(1, 6).values(8, 1).output(W::array);
    }
    w.end();

    w.begin(0x7D).id(layout.gain);
    byte(0x7E, 255).output().end();

    w.begin(0xAB).id(layout.create);
    effect_types().feature(W::array).end();
    w.page(0x01).usage(0x3B).range(0, 511).values(10, 1).feature();
    w.values(6, 1).feature(W::constant).page(0x0F).end();

    w.begin(0x89).id(layout.block_load);
    index().feature();
    w.begin(0x8B).usage(0x8C).usage(0x8D).usage(0x8E).range(1, 3).values(8, 1).feature(W::array);
    w.end().usage(0xAC).range(0, 32767).values(16, 1).feature().end();

    w.begin(0x7F).id(layout.pool).usage(0x80).range(0, 32767).values(16, 1).feature().end();
    w.end();
    return w.bytes();
}

} // namespace palpate::test
