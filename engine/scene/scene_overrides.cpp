// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/scene_overrides.h>

#include <algorithm>
#include <array>
#include <map>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/scene/contact_choice.h>
#include <palpate/engine/scene/hands.h>
#include <palpate/engine/scene/internal/device_addresses.h>
#include <palpate/engine/scene/internal/scene_ranges.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/text/internal/json_text.h>
#include <palpate/haptics/stepping/stepping.h>

namespace palpate {
namespace {

static_assert(internal::kSubSteps.high == Stepping::kMostEvaluations);

/// The value whose name is `text`; throws with the names there are.
template <class Kind, std::size_t N>
Kind named(const char* option, const std::string& text, const std::array<Kind, N>& kinds) {
    std::string names;
    for (Kind kind : kinds) {
        if (name(kind) == text) return kind;
        names += fmt::format("{}{}", names.empty() ? "" : ", ", name(kind));
    }
    throw std::invalid_argument(fmt::format("{} {}: must be one of {}", option, text, names));
}

template <class Number, class Target>
void set(const char* option, const std::optional<Number>& value, const Range& range,
         Target& target) {
    if (!value) return;
    if (!range.contains(*value))
        throw std::invalid_argument(
            fmt::format("{} {}: must be in {}", option, *value, range.text()));
    target = *value;
}

constexpr std::string_view kRecordedHand = "?hand="; // behind a recording: one of its hands

void set_device(const std::string& text, DeviceDescription& device) {
    using Kind = DeviceDescription::Kind;
    if (!internal::is_utf8(text))
        throw std::invalid_argument(fmt::format(
            "--device {}: is not UTF-8, which a recording cannot keep; give the file another name",
            text));
    const auto behind = [&](std::string_view start) -> std::optional<std::string> {
        if (!text.starts_with(start) || text.size() == start.size()) return std::nullopt;
        return text.substr(start.size());
    };
    if (text == "orbit") {
        device.kind = Kind::orbit;
    } else if (text == "tour") {
        device.kind = Kind::tour;
    } else if (text == "hand") {
        // It takes its time, which an orbit of the scene may not have.
        if (device.kind != Kind::hand && device.duration_s < internal::kPressDurationS.low)
            device.duration_s = DeviceDescription{}.duration_s;
        device.kind = Kind::hand;
        device.file.clear();
    } else if (const auto intent = behind("hand:")) {
        device.kind = Kind::hand;
        device.file = std::filesystem::absolute(*intent);
    } else if (const auto path = behind("path:")) {
        device.kind = Kind::path;
        device.file = std::filesystem::absolute(*path);
    } else if (const auto recording = behind("recording:")) {
        const std::size_t hand = recording->rfind(kRecordedHand);
        device.kind = Kind::recording;
        device.file = std::filesystem::absolute(recording->substr(0, hand));
        device.recorded_hand =
            hand == std::string::npos ? "" : recording->substr(hand + kRecordedHand.size());
    } else if (const auto address = behind("hid:")) {
        device.kind = Kind::hid;
        device.address = *address;
    } else if (const auto plugin = behind("plugin:")) {
        device.kind = Kind::plugin;
        device.address = std::filesystem::absolute(*plugin).string();
    } else if (text == "inverse3" || text.starts_with("inverse3:") ||
               text.starts_with("inverse3?")) {
        device.kind = Kind::inverse3;
        device.address = text.substr(std::string_view("inverse3").size());
    } else if (const auto tool = behind("igtl:")) {
        device.kind = Kind::igtl;
        device.address = *tool;
    } else {
        throw std::invalid_argument(fmt::format(
            "--device {}: must be orbit, tour, path:FILE, recording:FILE, hand, hand:FILE, "
            "hid:ADDRESS, plugin:FILE, inverse3[:ID] or igtl:TRANSFORM@HOST:PORT",
            text));
    }
    internal::check_address(device);
}

/// Devices and the one hand, where a scene has several.
void apply_to_hands(const SceneOverrides& overrides, SceneDescription& scene) {
    const std::vector<std::string> names = hand_names(scene);
    for (const auto& given : overrides.hand_devices) {
        const std::string &name = given.first, &device = given.second; // a lambda may name these
        const auto hand = std::find_if(scene.hands.begin(), scene.hands.end(),
                                       [&](const auto& one) { return one.name == name; });
        if (names.empty())
            throw std::invalid_argument(
                fmt::format("--device {}={}: the scene has one device without a name; give "
                            "--device {}",
                            name, device, device));
        if (hand == scene.hands.end())
            throw std::invalid_argument(fmt::format("--device {}={}: the scene's hands are {}; "
                                                    "name one of them",
                                                    name, device, hands_in_words(names)));
        set_device(device, *hand);
    }
    if (overrides.hand) {
        if (names.empty())
            throw std::invalid_argument(
                fmt::format("--hand {}: the scene has one device without a name; leave it out",
                            *overrides.hand));
        if (std::find(names.begin(), names.end(), *overrides.hand) == names.end())
            throw std::invalid_argument(fmt::format("--hand {}: the scene's hands are {}; name one "
                                                    "of them",
                                                    *overrides.hand, hands_in_words(names)));
        for (const auto& [name, device] : overrides.hand_devices)
            if (name != *overrides.hand)
                throw std::invalid_argument(fmt::format("--device {}={}: --hand {} is alone; leave "
                                                        "one of them out",
                                                        name, device, *overrides.hand));
        scene = of_hand(std::move(scene), *overrides.hand);
    }
    if (!overrides.device) return;
    if (!scene.hands.empty())
        throw std::invalid_argument(
            fmt::format("--device {0}: the scene has the hands {1}; say which one it is for, as "
                        "--device {2}={0}",
                        *overrides.device, hands_in_words(names), names.front()));
    set_device(*overrides.device, scene.device);
}

} // namespace

void add_device(SceneOverrides& overrides, const std::string& words) {
    const std::size_t end = words.find('=');
    const std::string hand = end == std::string::npos ? "" : words.substr(0, end);
    const auto twice = [&](const std::string& of, const std::string& before) {
        throw std::invalid_argument(fmt::format(
            "--device {}: {} is {} already; give one device for each hand", words, of, before));
    };
    if (end == 0 || (is_hand_name(hand) && end + 1 == words.size()))
        throw std::invalid_argument(fmt::format(
            "--device {}: has no {} =; write HAND=DEVICE, as left=orbit, or a device alone", words,
            end == 0 ? "hand before" : "device behind"));
    if (is_hand_name(hand)) { // no other word of a device has '=' so soon
        const auto [at, is_new] = overrides.hand_devices.try_emplace(hand, words.substr(end + 1));
        if (!is_new) twice(hand, at->second);
    } else {
        if (overrides.device) twice("the device", *overrides.device);
        overrides.device = words;
    }
}

void apply(const SceneOverrides& overrides, SceneDescription& scene) {
    apply_to_hands(overrides, scene);
    if (overrides.method)
        scene.loop.method = named("--method", *overrides.method,
                                  std::array{SteppingMethod::single, SteppingMethod::paper,
                                             SteppingMethod::fixed, SteppingMethod::adaptive});
    if (overrides.contact) {
        const ContactKind contact = named("--contact", *overrides.contact,
                                          std::array{ContactKind::mesh, ContactKind::volume,
                                                     ContactKind::guarded, ContactKind::direct});
        for (auto& [surface, description] : scene.surfaces) {
            if (const auto no = obstacle(scene, description, contact))
                throw std::invalid_argument(fmt::format("--contact {}: [surface.{}]: {}; {}",
                                                        name(contact), surface, no->what,
                                                        no->remedy));
            description.contact = contact;
        }
    }
    set("--sub-steps", overrides.sub_steps,
        Range{internal::kSubSteps.low, internal::kSubSteps.high}, scene.loop.sub_steps);
    set("--tolerance-um", overrides.tolerance_um, internal::kToleranceUm, scene.loop.tolerance_um);
    set("--budget-us", overrides.budget_us, internal::budget_range_us(scene.loop.rate_hz),
        scene.loop.budget_us);
    if (overrides.preview.value_or(false)) scene = preview_of(std::move(scene));
}

std::optional<UnreadOption> unread_option(const SceneOverrides& overrides, SteppingMethod method) {
    using Method = SteppingMethod;
    if (overrides.sub_steps && method != Method::fixed)
        return UnreadOption{"sub_steps", Method::fixed};
    if (overrides.tolerance_um && method != Method::adaptive)
        return UnreadOption{"tolerance_um", Method::adaptive};
    if (overrides.budget_us && method != Method::paper)
        return UnreadOption{"budget_us", Method::paper};
    return {};
}

void check_used(const SceneOverrides& overrides, const SceneDescription& scene) {
    if (const auto unread = unread_option(overrides, scene.loop.method)) {
        std::string option(unread->key);
        std::replace(option.begin(), option.end(), '_', '-');
        throw std::invalid_argument(fmt::format(
            "--{}: is of method {} and changes nothing with {}; add --method {}, or leave it out",
            option, name(unread->reads), name(scene.loop.method), name(unread->reads)));
    }
    if (overrides.contact && scene.surfaces.empty())
        throw std::invalid_argument("--contact: the scene has no surface to touch; leave it out");
}

std::string to_json(const SceneOverrides& overrides) {
    nlohmann::json json = nlohmann::json::object();
    const auto put = [&](const char* key, const auto& value) {
        if (value) json[key] = *value;
    };
    put("device", overrides.device);
    put("hand", overrides.hand);
    if (!overrides.hand_devices.empty()) json["hand_devices"] = overrides.hand_devices;
    put("method", overrides.method);
    put("contact", overrides.contact);
    put("sub_steps", overrides.sub_steps);
    put("tolerance_um", overrides.tolerance_um);
    put("budget_us", overrides.budget_us);
    put("every", overrides.every);
    put("preview", overrides.preview);
    return json.dump();
}

SceneOverrides overrides_from_json(const std::string& text) {
    SceneOverrides overrides;
    try {
        const nlohmann::json json = nlohmann::json::parse(text);
        const auto take = [&]<class T>(const char* key, std::optional<T>& value) {
            if (json.contains(key)) value = json.at(key).get<T>();
        };
        take("device", overrides.device);
        take("hand", overrides.hand);
        if (json.contains("hand_devices"))
            overrides.hand_devices =
                json.at("hand_devices").get<std::map<std::string, std::string>>();
        take("method", overrides.method);
        take("contact", overrides.contact);
        take("sub_steps", overrides.sub_steps);
        take("tolerance_um", overrides.tolerance_um);
        take("budget_us", overrides.budget_us);
        take("every", overrides.every);
        take("preview", overrides.preview);
    } catch (const nlohmann::json::exception& error) {
        throw std::runtime_error(
            fmt::format("recording: its overrides are damaged ({})", error.what()));
    }
    return overrides;
}

} // namespace palpate
