// SPDX-License-Identifier: Apache-2.0
// What a device on USB says of itself and of its state. The first two bytes are the length of the
// report descriptor; the reports follow, each behind its length.
#include <array>
#include <vector>

#include <palpate/drivers/internal/hid_descriptor.h>
#include <palpate/drivers/internal/pid_reports.h>
#include <palpate/drivers/internal/space_mouse_reports.h>
#include <palpate/drivers/internal/wooden_codec.h>

#include "tests/fuzz/target.h"

using namespace palpate;
using namespace palpate::internal;

namespace {

using Report = std::span<const std::uint8_t>;

void take_pid(const PidReports& pid, Report report) {
    if (const auto stick = pid.stick(report))
        test::must(glm::dot(*stick, *stick) <= 2.0 + 1e-9, "a stick beyond its end");
    pid.buttons(report);
    const PidBlockLoad load = pid.block_load(report);
    for (const double magnitude : {-1.0, 0.3, 1e300}) {
        std::vector<std::uint8_t> force = pid.constant_force(load.effect, magnitude);
        pid.set_magnitude(force, -magnitude);
    }
    for (const PidAxis axis : {PidAxis::x, PidAxis::y})
        pid.set_effect(load.effect, axis);
    pid.operation(load.effect, PidOperation::start);
    pid.free_block(load.effect);
    pid.create_constant_force();
    pid.block_load_request();
    pid.full_gain();
    for (const PidControl control : {PidControl::enable_actuators, PidControl::disable_actuators,
                                     PidControl::stop_all, PidControl::reset})
        pid.control(control);
}

void take_wooden(Report report) {
    const std::optional<WoodenLayout> layout = wooden_layout(report.size());
    if (!layout) return;
    const std::optional<WoodenReport> said = decode_wooden(*layout, report);
    if (!said) return;
    std::array<std::uint8_t, kWoodenBuffer> out{};
    const std::array<std::int16_t, 3> currents{said->counters[0], said->counters[1],
                                               said->counters[2]};
    test::must(encode_wooden_currents(*layout, currents, out) <= out.size(), "too long");
    test::must(encode_wooden_counters(*layout, said->counters, out) <= out.size(), "too long");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    test::Input input(data, size);
    const std::size_t length = input.take<std::uint16_t>();
    const auto bytes_of = [](std::string_view text) {
        return Report(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
    };
    HidDescriptor descriptor;
    std::optional<PidReports> pid;
    const std::string_view described = input.rest().substr(0, length);
    if (test::is_taken([&] { descriptor = read_hid_descriptor(bytes_of(described), "/dev/h"); })) {
        wooden_layout(descriptor);
        test::is_taken([&] { pid.emplace(descriptor, "/dev/h"); });
    }
    SpaceMouseReading mouse;
    std::string_view rest = input.rest().substr(described.size());
    while (!rest.empty()) {
        const std::size_t most = static_cast<std::uint8_t>(rest.front());
        rest.remove_prefix(1);
        const Report report = bytes_of(rest.substr(0, most));
        rest.remove_prefix(report.size());
        take_space_mouse_report(report, mouse);
        test::must(is_finite(mouse.deflection.push) && is_finite(mouse.deflection.turn), "a cap");
        take_wooden(report);
        if (pid) take_pid(*pid, report);
        std::vector<std::uint8_t> answer(report.begin(), report.end());
        for (const HidField& field : descriptor.fields)
            if (const auto value = value_of(field, report)) set_value(field, answer, *value);
    }
    return 0;
}
