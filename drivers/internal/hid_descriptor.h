// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace palpate::internal {

/// A usage with its page, as report descriptors name things: page * 65536 + number.
using HidUsage = std::uint32_t;

constexpr HidUsage hid_usage(std::uint16_t page, std::uint16_t number) noexcept {
    return static_cast<HidUsage>(page) << 16 | number;
}

enum class HidReportKind : std::uint8_t { input, output, feature };

/// One value of a report, or several beside each other that mean the same.
struct HidField {
    HidReportKind kind = HidReportKind::input;
    std::uint8_t report_id = 0;   ///< 0: the device does not number its reports
    bool array = false;           ///< its value chooses one of `usages`, counted from logical_min
    std::vector<HidUsage> usages; ///< what it means; an array: what its values mean, in order
    std::size_t collection = 0;   ///< innermost one that it is in, in HidDescriptor::collections
    std::uint32_t first_bit = 0;  ///< counted from the report's first byte, the id's included
    std::uint32_t bits = 0;       ///< of one value, 1 to 32
    std::uint32_t count = 1;      ///< how many values beside each other
    std::int64_t logical_min = 0; ///< negative: values are two's complement
    std::int64_t logical_max = 0;
};

/// A collection, by its usage and the one around it.
struct HidCollection {
    static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
    HidUsage usage = 0;
    std::size_t parent = kNone;
};

/// What a device's reports hold: its report descriptor, read.
struct HidDescriptor {
    std::vector<HidCollection> collections;
    std::vector<HidField> fields; ///< padding and values wider than 32 bits are left out
    std::map<std::pair<HidReportKind, std::uint8_t>, std::uint32_t> report_bits; ///< without the id
    bool numbered = false; ///< each report begins with its id

    /// Bytes of a report as hidapi reads it: with the id where reports are numbered; 0 where there
    /// is no such report.                                                               [any]
    std::size_t report_bytes(HidReportKind kind, std::uint8_t id) const;

    /// The longest report of a kind, bytes, as above.                                    [any]
    std::size_t longest_report(HidReportKind kind) const;

    /// Whether a field is inside a collection of this usage, however deep.               [any]
    bool within(const HidField& field, HidUsage collection) const;

    /// The first field of a kind that has a usage, inside a collection (0: anywhere).    [any]
    const HidField* find(HidReportKind kind, HidUsage usage, HidUsage collection = 0) const;
};

/// Reads a report descriptor. Throws std::runtime_error with `name` (the device's path), the byte
/// and what is wrong with it: a descriptor that cannot be trusted is not guessed at.     [setup]
/// Long items and delimiters are passed over; at most 4096 bytes, as the kernel has it.
HidDescriptor read_hid_descriptor(std::span<const std::uint8_t> bytes, const std::string& name);

/// A field's value; nothing where the report is too short for it.                       [any]
std::optional<std::int64_t> value_of(const HidField& field, std::span<const std::uint8_t> report,
                                     std::uint32_t index = 0) noexcept;

/// Puts a value, clamped to the field's logical range, into a report that is long enough; one that
/// is not stays as it is.                                                               [any]
void set_value(const HidField& field, std::span<std::uint8_t> report, std::int64_t value,
               std::uint32_t index = 0) noexcept;

/// The value with which an array, or a field of one bit, says `usage`; nothing where it cannot.
///                                                                                      [any]
std::optional<std::int64_t> choice_of(const HidField& field, HidUsage usage) noexcept;

} // namespace palpate::internal
