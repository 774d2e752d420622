// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include <palpate/drivers/internal/hid_port.h>
#include <palpate/drivers/internal/pid_reports.h>

namespace palpate::internal {
namespace {

constexpr std::uint16_t kPid = 0x0F, kGenericDesktop = 0x01, kButtons = 0x09;
constexpr HidUsage kX = hid_usage(kGenericDesktop, 0x30), kY = hid_usage(kGenericDesktop, 0x31);
constexpr HidUsage kByteCount = hid_usage(kGenericDesktop, 0x3B);
constexpr int kMostButtons = 32;

// Usages on the PID page (USB PID 1.0, 5): collections, each a report, and what is in them.
constexpr std::uint16_t kSetEffect = 0x21, kSetConstantForce = 0x73, kEffectOperation = 0x77,
                        kDeviceGainReport = 0x7D, kBlockLoad = 0x89, kBlockFree = 0x90,
                        kCreateEffect = 0xAB;
constexpr std::uint16_t kEffectIndex = 0x22, kConstantForce = 0x26, kDuration = 0x50, kGain = 0x52,
                        kTriggerButton = 0x53, kDirectionEnable = 0x56, kDirection = 0x57,
                        kMagnitude = 0x70, kStart = 0x79, kStop = 0x7B, kLoopCount = 0x7C,
                        kDeviceGain = 0x7E, kLoaded = 0x8C, kFull = 0x8D;
constexpr std::uint16_t kEnableActuators = 0x97, kDisableActuators = 0x98, kStopAll = 0x99,
                        kReset = 0x9A;

constexpr std::int64_t kLongest =
    0xFFFFFFFF; // of any field: set_value() cuts it to the field's own

constexpr double kTurnDegrees = 360.0;
constexpr double kFromLeftDegrees = 270.0, kFromAheadDegrees = 0.0; // clockwise from ahead

constexpr HidUsage pid(std::uint16_t number) { return hid_usage(kPid, number); }

std::uint16_t usage_of(PidControl what) {
    switch (what) {
    case PidControl::enable_actuators:
        return kEnableActuators;
    case PidControl::disable_actuators:
        return kDisableActuators;
    case PidControl::stop_all:
        return kStopAll;
    case PidControl::reset:
        return kReset;
    }
    return kStopAll;
}

double fraction_of(const HidField& field, std::int64_t value) {
    const auto range = static_cast<double>(field.logical_max - field.logical_min);
    return range > 0.0 ? static_cast<double>(value - field.logical_min) / range : 0.5;
}

} // namespace

HidField PidReports::need(HidReportKind kind, std::uint16_t usage, std::uint16_t collection,
                          const char* what) const {
    if (const HidField* found = descriptor_.find(kind, pid(usage), pid(collection))) return *found;
    throw std::runtime_error(name_ + ": its report descriptor has no " + what +
                             "; without it there are no constant forces: the device cannot be used "
                             "for force");
}

PidReports::PidReports(HidDescriptor descriptor, std::string name)
    : descriptor_(std::move(descriptor)), name_(std::move(name)),
      create_type_(need(HidReportKind::feature, kConstantForce, kCreateEffect,
                        "Create New Effect for constant forces")),
      load_effect_(need(HidReportKind::feature, kEffectIndex, kBlockLoad, "PID Block Load")),
      load_status_(need(HidReportKind::feature, kLoaded, kBlockLoad, "Block Load Status")),
      effect_number_(need(HidReportKind::output, kEffectIndex, kSetEffect, "Set Effect")),
      effect_type_(need(HidReportKind::output, kConstantForce, kSetEffect,
                        "Set Effect for constant forces")),
      force_number_(
          need(HidReportKind::output, kEffectIndex, kSetConstantForce, "Set Constant Force")),
      force_magnitude_(
          need(HidReportKind::output, kMagnitude, kSetConstantForce, "constant force's magnitude")),
      operation_number_(
          need(HidReportKind::output, kEffectIndex, kEffectOperation, "Effect Operation")),
      operation_(need(HidReportKind::output, kStart, kEffectOperation, "start of an effect")) {
    if (!descriptor_.numbered)
        throw std::runtime_error(name_ +
                                 ": its reports are not numbered, as those of force feedback "
                                 "devices are; it cannot be used for force");
    for (const HidField& written : {force_magnitude_, operation_})
        if (descriptor_.report_bytes(written.kind, written.report_id) > kLongestHidReport)
            throw std::runtime_error(name_ + ": its report " + std::to_string(written.report_id) +
                                     " has more than " + std::to_string(kLongestHidReport) +
                                     " bytes, which nothing on USB sends at once; it cannot be "
                                     "used for force");
    const HidField* x = descriptor_.find(HidReportKind::input, kX);
    const HidField* y = descriptor_.find(HidReportKind::input, kY);
    if (x == nullptr || y == nullptr)
        throw std::runtime_error(name_ + ": its report descriptor has no X and Y; a stick with two "
                                         "axes is needed");
    stick_x_ = *x;
    stick_y_ = *y;
    for (std::uint16_t i = 1; i <= kMostButtons; ++i)
        if (const HidField* button = descriptor_.find(HidReportKind::input, hid_usage(kButtons, i));
            button != nullptr && !button->array)
            buttons_.push_back(*button);
}

std::vector<std::uint8_t> PidReports::blank(const HidField& of) const {
    std::vector<std::uint8_t> report(descriptor_.report_bytes(of.kind, of.report_id));
    report.at(0) = of.report_id;
    return report;
}

/// Sets a field of the same kind, where the report has it: what a device leaves out, it does not
/// need.
void PidReports::set(std::vector<std::uint8_t>& report, std::uint16_t usage,
                     std::uint16_t collection, std::int64_t value) const {
    if (const HidField* field =
            descriptor_.find(HidReportKind::output, pid(usage), pid(collection)))
        set_value(*field, report, value);
}

/// No button starts the effect: a number that none has. It is the null value of the field, outside
/// of its range, where there is one.
void PidReports::set_no_button(std::vector<std::uint8_t>& report) const {
    const HidField* found =
        descriptor_.find(HidReportKind::output, pid(kTriggerButton), pid(kSetEffect));
    if (found == nullptr) return;
    HidField field = *found;
    const std::int64_t all_ones = (std::int64_t{1} << std::min<std::uint32_t>(field.bits, 62)) - 1;
    const bool zero_is_null = field.logical_min > 0;
    field.logical_min = field.logical_max = 0; // not held within its range
    set_value(field, report, zero_is_null ? 0 : all_ones);
}

std::vector<std::uint8_t> PidReports::control(PidControl what) const {
    const HidField* field = descriptor_.find(HidReportKind::output, pid(usage_of(what)));
    if (field == nullptr) return {};
    std::vector<std::uint8_t> report = blank(*field);
    set_value(*field, report, *choice_of(*field, pid(usage_of(what))));
    return report;
}

std::vector<std::uint8_t> PidReports::full_gain() const {
    const HidField* field =
        descriptor_.find(HidReportKind::output, pid(kDeviceGain), pid(kDeviceGainReport));
    if (field == nullptr) return {};
    std::vector<std::uint8_t> report = blank(*field);
    set_value(*field, report, field->logical_max);
    return report;
}

std::vector<std::uint8_t> PidReports::create_constant_force() const {
    std::vector<std::uint8_t> report = blank(create_type_);
    set_value(create_type_, report, *choice_of(create_type_, pid(kConstantForce)));
    if (const HidField* count =
            descriptor_.find(HidReportKind::feature, kByteCount, pid(kCreateEffect)))
        set_value(*count, report, 0); // only custom forces bring data
    return report;
}

std::vector<std::uint8_t> PidReports::block_load_request() const { return blank(load_effect_); }

PidBlockLoad PidReports::block_load(std::span<const std::uint8_t> report) const noexcept {
    if (report.empty() || report[0] != load_effect_.report_id) return {};
    const auto effect = value_of(load_effect_, report);
    const auto status = value_of(load_status_, report);
    if (!effect || !status) return {};
    if (status == choice_of(load_status_, pid(kFull))) return {PidLoadStatus::full, 0};
    // Effects count from 1: a 0 is a device that has forgotten to answer.
    if (status != choice_of(load_status_, pid(kLoaded)) || *effect < 1 || *effect > 255) return {};
    return {PidLoadStatus::loaded, static_cast<std::uint8_t>(*effect)};
}

std::vector<std::uint8_t> PidReports::set_effect(std::uint8_t effect, PidAxis axis) const {
    std::vector<std::uint8_t> report = blank(effect_number_);
    set_value(effect_number_, report, effect);
    set_value(effect_type_, report, *choice_of(effect_type_, pid(kConstantForce)));
    // What is infinite, devices disagree about (7FFF, FFFF, 0). The longest that the descriptor
    // allows is infinite or at least half a minute; the effect is started again long before that.
    set(report, kDuration, kSetEffect, kLongest);
    set(report, kGain, kSetEffect, kLongest);
    set_no_button(report);
    set(report, kDirectionEnable, kSetEffect, 1);

    const double degrees = axis == PidAxis::x ? kFromLeftDegrees : kFromAheadDegrees;
    for (const HidField& field : descriptor_.fields) {
        if (field.kind != HidReportKind::output || field.report_id != effect_number_.report_id ||
            !descriptor_.within(field, pid(kDirection)))
            continue;
        const auto turn = static_cast<double>(field.logical_max - field.logical_min);
        set_value(field, report, field.logical_min + std::llround(degrees / kTurnDegrees * turn));
        break; // the first says it in the plane; a second would be the height above it
    }
    return report;
}

std::vector<std::uint8_t> PidReports::constant_force(std::uint8_t effect, double magnitude) const {
    std::vector<std::uint8_t> report = blank(force_number_);
    set_value(force_number_, report, effect);
    set_magnitude(report, magnitude);
    return report;
}

void PidReports::set_magnitude(std::span<std::uint8_t> report, double magnitude) const noexcept {
    const double within = std::isfinite(magnitude) ? std::clamp(magnitude, -1.0, 1.0) : 0.0;
    set_value(force_magnitude_, report,
              std::llround(within * static_cast<double>(force_magnitude_.logical_max)));
}

std::vector<std::uint8_t> PidReports::operation(std::uint8_t effect, PidOperation what) const {
    std::vector<std::uint8_t> report = blank(operation_number_);
    set_value(operation_number_, report, effect);
    const HidUsage usage = pid(what == PidOperation::start ? kStart : kStop);
    if (const HidField* field =
            descriptor_.find(HidReportKind::output, usage, pid(kEffectOperation)))
        set_value(*field, report, *choice_of(*field, usage));
    set(report, kLoopCount, kEffectOperation, 1);
    return report;
}

std::vector<std::uint8_t> PidReports::free_block(std::uint8_t effect) const {
    const HidField* field =
        descriptor_.find(HidReportKind::output, pid(kEffectIndex), pid(kBlockFree));
    if (field == nullptr) return {};
    std::vector<std::uint8_t> report = blank(*field);
    set_value(*field, report, effect);
    return report;
}

std::optional<glm::dvec2> PidReports::stick(std::span<const std::uint8_t> report) const noexcept {
    if (report.empty() || report[0] != stick_x_.report_id) return std::nullopt;
    const auto x = value_of(stick_x_, report);
    const auto y = value_of(stick_y_, report);
    if (!x || !y) return std::nullopt;
    return glm::clamp(
        glm::dvec2(2.0 * fraction_of(stick_x_, *x) - 1.0, 2.0 * fraction_of(stick_y_, *y) - 1.0),
        -1.0, 1.0);
}

double PidReports::stick_step() const noexcept {
    const auto step = [](const HidField& field) {
        const auto range = static_cast<double>(field.logical_max - field.logical_min);
        return range > 0.0 ? 2.0 / range : 0.0;
    };
    return std::max(step(stick_x_), step(stick_y_));
}

std::optional<std::uint32_t>
PidReports::buttons(std::span<const std::uint8_t> report) const noexcept {
    std::uint32_t down = 0;
    bool any = false;
    for (const HidField& button : buttons_) {
        if (report.empty() || report[0] != button.report_id) continue;
        const auto value = value_of(button, report);
        if (!value) continue;
        any = true;
        const std::uint32_t number = button.usages.front() & 0xFFFFu;
        if (*value != 0) down |= 1u << (number - 1);
    }
    return any ? std::optional(down) : std::nullopt;
}

} // namespace palpate::internal
