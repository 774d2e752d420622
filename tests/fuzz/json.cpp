// SPDX-License-Identifier: Apache-2.0
// JSON: a device's model, options of a run, a summary, what the page of palpate view asks for, what
// Haply's Inverse Service says.
#include <palpate/drivers/internal/inverse3_messages.h>
#include <palpate/drivers/wooden_model.h>
#include <palpate/engine/devices/wooden_models.h>
#include <palpate/engine/report/internal/trace_summary_reader.h>
#include <palpate/engine/scene/scene_overrides.h>
#include <palpate/engine/view/view_command.h>

#include "tests/fuzz/target.h"

using namespace palpate;

namespace {

void take_reading(const internal::ServiceReading& reading) {
    constexpr double kRounding = 1.0 + 1e-9;
    const DeviceState& state = reading.state;
    test::must(glm::length(state.position) <= internal::kFarthestReach_m * kRounding, "too far");
    test::must(glm::length(state.velocity) <= internal::kFastestReach_m_per_s * kRounding,
               "too fast");
    test::must(!reading.force_echo || is_finite(*reading.force_echo), "a force that is none");
}

void take_from_service(std::string_view text) {
    for (const char* grip : {"", "61576"})
        take_reading(internal::reading_in(text, "A", grip));
    const auto said = internal::inventory_in(text);
    if (!said) return;
    ++test::taken;
    for (const internal::ServiceDevice& device : said->devices) {
        test::must(!device.id.empty() && device.id.size() <= 64, "an id");
        internal::greeting(*said, device.id);
        internal::force_command(device.id, said->key, Vec3(1e300));
        take_reading(internal::reading_in(text, device.id, ""));
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string text(test::as_text(data, size));
    test::is_taken([&] {
        const WoodenModel model = parse_wooden_model(text, "model.json");
        check(model);
        test::must(wooden_home_force_n(model) >= 0.0, "a force");
    });
    test::is_taken([&] {
        SceneDescription scene;
        apply(overrides_from_json(text), scene);
    });
    test::is_taken([&] { internal::read_trace_summary("summary.json", text); });
    test::is_taken([&] {
        const ViewCommand command = parse_view_command(text);
        if (const auto* probe = std::get_if<view_commands::Probe>(&command))
            test::must(is_finite(probe->at), "a probe that is nowhere");
        if (const auto* gain = std::get_if<view_commands::EffectGain>(&command))
            test::must(gain->value >= 0.0 && gain->value <= 1.0, "a gain out of range");
        if (const auto* mark = std::get_if<view_commands::Mark>(&command))
            test::must(mark->name.size() <= 200, "a name that is too long");
        if (const auto* level = std::get_if<view_commands::Level>(&command))
            test::must(level->facets >= 1, "a mesh of nothing");
    });
    take_from_service(text);
    return 0;
}
