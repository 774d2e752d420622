// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/internal/inverse3_messages.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include <nlohmann/json.hpp>

namespace palpate::internal {

using Json = nlohmann::json;

namespace {

/// The members of every kind of grip that a service has.
constexpr std::array<const char*, 3> kGrips{"verse_grip", "wireless_verse_grip",
                                            "custom_verse_grip"};
constexpr const char* kArms = "inverse3";

bool is_id(std::string_view text) {
    constexpr std::size_t kLongest = 64;
    return !text.empty() && text.size() <= kLongest &&
           std::all_of(text.begin(), text.end(), [](char c) {
               return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                      c == '.' || c == '_' || c == ':' || c == '-';
           });
}

/// A JSON object, or discarded: nothing is thrown.
Json object_in(std::string_view text) {
    Json json = Json::parse(text, nullptr, false);
    if (!json.is_object()) return {Json::value_t::discarded};
    return json; // moved: a copy would go as deep as the text
}

/// A member; null where there is none.
const Json& member(const Json& json, const char* key) {
    static const Json kNothing;
    if (!json.is_object()) return kNothing;
    const auto found = json.find(key);
    return found != json.end() ? *found : kNothing;
}

/// A text that is as harmless as an id; else empty.
std::string word(const Json& json) {
    if (!json.is_string()) return "";
    const auto& text = json.get_ref<const std::string&>();
    return is_id(text) ? text : std::string();
}

bool flag(const Json& json, bool otherwise) {
    return json.is_boolean() ? json.get<bool>() : otherwise;
}

std::optional<double> number(const Json& json) {
    if (!json.is_number()) return std::nullopt;
    const double value = json.get<double>();
    return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::optional<Vec3> vector(const Json& json) {
    const auto x = number(member(json, "x")), y = number(member(json, "y")),
               z = number(member(json, "z"));
    if (!x || !y || !z) return std::nullopt;
    return Vec3(*x, *y, *z);
}

std::optional<Quaternion> unit_quaternion(const Json& json) {
    const std::optional<Vec3> axis = vector(json);
    const auto w = number(member(json, "w"));
    if (!axis || !w) return std::nullopt;
    const Quaternion q(*w, axis->x, axis->y, axis->z);
    constexpr double kLoosest = 1e-2; // of its length: the grip sends 16 bits a number
    const double length = std::sqrt(glm::dot(q, q));
    if (!(std::abs(length - 1.0) <= kLoosest)) return std::nullopt;
    return glm::normalize(q);
}

/// The one with the id in a list; null where there is none, or two.
const Json* one_of(const Json& list, std::string_view id) {
    if (!list.is_array()) return nullptr;
    const Json* found = nullptr;
    for (const Json& device : list) {
        const Json& said = member(device, "device_id");
        if (!said.is_string() || said.get_ref<const std::string&>() != id) continue;
        if (found != nullptr) return nullptr;
        found = &device;
    }
    return found;
}

ServiceDevice device_in(const Json& json) {
    const Json& config = member(json, "config");
    const Json& status = member(json, "status");
    ServiceDevice device;
    device.id = word(member(json, "device_id"));
    device.type = word(member(config, "type"));
    device.handedness = word(member(config, "handedness"));
    device.is_calibrated = flag(member(status, "calibrated"), true);
    device.has_power = flag(member(status, "power_supply"), true);
    device.is_in_use = flag(member(status, "in_use"), false);
    return device;
}

/// Buttons are called a, b, c in the documents of 3.1 to 3.5; with a wire there is one.
std::uint32_t buttons_in(const Json& state) {
    constexpr std::array<const char*, 3> kNames{"a", "b", "c"};
    const Json& buttons = member(state, "buttons");
    std::uint32_t down = flag(member(state, "button"), false) ? 1u : 0u;
    for (std::size_t i = 0; i < kNames.size(); ++i)
        if (flag(member(buttons, kNames[i]), false)) down |= 1u << i;
    return down;
}

void read_grip(const Json& json, std::string_view id, DeviceState& state) {
    for (const char* kind : kGrips) {
        const Json* grip = one_of(member(json, kind), id);
        if (grip == nullptr) continue;
        const Json& said = member(*grip, "state");
        if (const auto turn = unit_quaternion(member(said, "orientation")))
            state.orientation = from_service(*turn);
        state.buttons = buttons_in(said);
        return;
    }
}

void append(std::string& text, double value) {
    std::array<char, 32> digits{};
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
    text.append(digits.data(), end);
}

} // namespace

// A difference, as -0 would be sent for a force of zero.
Vec3 from_service(const Vec3& vector) noexcept { return {0.0 - vector.y, vector.x, vector.z}; }
Vec3 to_service(const Vec3& vector) noexcept { return {vector.y, 0.0 - vector.x, vector.z}; }

Quaternion from_service(const Quaternion& turn) noexcept {
    const Vec3 axis = from_service(Vec3(turn.x, turn.y, turn.z));
    return {turn.w, axis.x, axis.y, axis.z};
}

std::optional<ServiceInventory> inventory_in(std::string_view text) {
    const Json json = object_in(text);
    if (json.is_discarded() || !member(json, kArms).is_array()) return std::nullopt;
    ServiceInventory inventory;
    bool has_settings = !member(json, "session_id").is_null();
    for (const Json& one : member(json, kArms)) {
        ServiceDevice device = device_in(one);
        has_settings = has_settings || !member(member(one, "config"), "basis").is_null();
        if (!device.id.empty()) inventory.devices.push_back(std::move(device));
    }
    for (const char* kind : kGrips)
        if (const Json& list = member(json, kind); list.is_array())
            for (const Json& grip : list)
                if (std::string id = word(member(grip, "device_id")); !id.empty())
                    inventory.grips.push_back(std::move(id));
    inventory.key = has_settings ? ForceKey::vector : ForceKey::values;
    return inventory;
}

ServiceReading reading_in(std::string_view text, std::string_view id, std::string_view grip) {
    using Fault = ServiceReading::Fault;
    ServiceReading reading;
    const auto without_state = [&](Fault fault) {
        reading.fault = fault;
        return reading;
    };
    const Json json = object_in(text);
    if (json.is_discarded() || !member(json, kArms).is_array())
        return without_state(Fault::unreadable);
    const Json* device = one_of(member(json, kArms), id);
    if (device == nullptr) return without_state(Fault::not_there);
    const Json& said = member(*device, "state");
    const auto position = vector(member(said, "cursor_position"));
    const Json& moves = member(said, "cursor_velocity");
    const auto velocity = moves.is_null() ? std::optional(Vec3(0.0)) : vector(moves);
    if (!position || !velocity || !(glm::length(*position) <= kFarthestReach_m) ||
        !(glm::length(*velocity) <= kFastestReach_m_per_s))
        return without_state(Fault::out_of_range);
    if (!flag(member(member(*device, "status"), "calibrated"), true))
        return without_state(Fault::uncalibrated);
    reading.state.position = from_service(*position);
    reading.state.velocity = from_service(*velocity);
    if (const auto echo = vector(member(said, "current_cursor_force")))
        reading.force_echo = from_service(*echo);
    if (!grip.empty()) read_grip(json, grip, reading.state);
    return reading;
}

std::string greeting(const ServiceInventory& inventory, std::string_view id) {
    if (inventory.key != ForceKey::vector) return "";
    return R"({"session":{"configure":{"profile":{"name":"palpate"},)"
           R"("basis":{"permutation":"XYZ"}}},"inverse3":[{"device_id":")" +
           std::string(id) + R"(","configure":{"preset":{"preset":"defaults"}}}]})";
}

std::string inventory_request() { return R"({"session":{"force_render_full_state":{}}})"; }

std::string force_command(std::string_view id, ForceKey key, const Vec3& force) {
    const Vec3 sent = is_finite(force) ? to_service(force) : Vec3{0.0};
    std::string text;
    text.reserve(160);
    text += R"({"inverse3":[{"device_id":")";
    text += id;
    text += R"(","commands":{"set_cursor_force":{")";
    text += key == ForceKey::vector ? "vector" : "values";
    text += R"(":{"x":)";
    append(text, sent.x);
    text += R"(,"y":)";
    append(text, sent.y);
    text += R"(,"z":)";
    append(text, sent.z);
    text += "}}}}]}";
    return text;
}

const char* in_words(ServiceReading::Fault fault) noexcept {
    switch (fault) {
    case ServiceReading::Fault::none:
        break;
    case ServiceReading::Fault::unreadable:
        return "a message is no JSON object with states";
    case ServiceReading::Fault::not_there:
        return "a message has no such device, or two";
    case ServiceReading::Fault::out_of_range:
        return "a position is missing, or a number is beyond what an arm does";
    case ServiceReading::Fault::uncalibrated:
        return "the device is not calibrated";
    }
    return "nothing";
}

} // namespace palpate::internal
