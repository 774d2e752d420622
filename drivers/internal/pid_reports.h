// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <palpate/drivers/internal/hid_descriptor.h>
#include <palpate/geometry/vec.h>

namespace palpate::internal {

/// What can be told to all of a force feedback device (USB PID 1.0, Device Control).
enum class PidControl { enable_actuators, disable_actuators, stop_all, reset };

/// What can be done with one effect.
enum class PidOperation { start, stop };

/// What a device answers when an effect is asked for.
enum class PidLoadStatus { loaded, full, failed };

struct PidBlockLoad {
    PidLoadStatus status = PidLoadStatus::failed;
    std::uint8_t effect = 0; ///< the effect's number from then on, where it is loaded
};

/// Of the two axes of a stick, as HID counts them: x to the right, y towards the user.
enum class PidAxis { x, y };

/// The reports of a USB PID device with which constant forces are made, found by their usages in
/// its report descriptor: ids, widths and ranges differ from device to device. Each function gives
/// a report as hidapi writes it, the id first. Constant after construction.              [any]
class PidReports {
public:
    /// Throws std::runtime_error that names the report that the device has not.         [setup]
    PidReports(HidDescriptor descriptor, std::string name);

    /// Output. Empty where the device knows no such control: some have no reset.
    std::vector<std::uint8_t> control(PidControl what) const;
    /// Output: all effects at full gain; empty where the device has no gain.
    std::vector<std::uint8_t> full_gain() const;
    /// Feature to set: asks for a constant force. What becomes of it, block_load says.
    std::vector<std::uint8_t> create_constant_force() const;
    /// Feature to get: its id and room for it.
    std::vector<std::uint8_t> block_load_request() const;
    PidBlockLoad block_load(std::span<const std::uint8_t> report) const noexcept;
    /// Output: the effect lasts for ever, at full gain, along an axis. Its direction is that from
    /// which a positive force comes (as Linux has it): from the left, so that it is to the right,
    /// and from ahead, so that it is towards the user.
    std::vector<std::uint8_t> set_effect(std::uint8_t effect, PidAxis axis) const;
    /// Output: -1 to 1 of the largest magnitude; what is not finite is 0.
    std::vector<std::uint8_t> constant_force(std::uint8_t effect, double magnitude) const;
    /// The same in place, for the writer: `report` is one that constant_force() made.
    void set_magnitude(std::span<std::uint8_t> report, double magnitude) const noexcept;
    std::vector<std::uint8_t> operation(std::uint8_t effect, PidOperation what) const;
    /// Output: gives the effect's memory back; empty where the device has no such report.
    std::vector<std::uint8_t> free_block(std::uint8_t effect) const;

    /// Input: -1 to 1 along x and y; nothing where the report is another one.
    std::optional<glm::dvec2> stick(std::span<const std::uint8_t> report) const noexcept;
    /// Input: the first 32 buttons; nothing where the report is another one.
    std::optional<std::uint32_t> buttons(std::span<const std::uint8_t> report) const noexcept;

    /// What stick() is rounded to, of 1: that of the coarser axis.
    double stick_step() const noexcept;

    const HidDescriptor& descriptor() const noexcept { return descriptor_; }

private:
    HidField need(HidReportKind kind, std::uint16_t usage, std::uint16_t collection,
                  const char* what) const;
    std::vector<std::uint8_t> blank(const HidField& of) const;
    void set_no_button(std::vector<std::uint8_t>& report) const;
    void set(std::vector<std::uint8_t>& report, std::uint16_t usage, std::uint16_t collection,
             std::int64_t value) const;

    HidDescriptor descriptor_;
    std::string name_;
    HidField create_type_;
    HidField load_effect_;
    HidField load_status_;
    HidField effect_number_;
    HidField effect_type_;
    HidField force_number_;
    HidField force_magnitude_;
    HidField operation_number_;
    HidField operation_;
    HidField stick_x_;
    HidField stick_y_;
    std::vector<HidField> buttons_;
};

} // namespace palpate::internal
