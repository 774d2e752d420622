// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/view_command.h>

#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace palpate {
namespace {

using nlohmann::json;
using namespace view_commands;

constexpr std::string_view kAll = "probe, gain, freeze, restart, record, mark, level, button, iso, "
                                  "labels, save";
constexpr std::size_t kLongestName =
    240;                                // bytes of a mark's: 80 letters, as the page's field takes
constexpr std::size_t kMostLabels = 64; // of a message: what a page may ask for at a time
constexpr double kGreatest = std::numeric_limits<float>::max(); // of a volume's values

/// The keys of one command, each asked for once; is_done() refuses the others.
class Keys {
public:
    explicit Keys(const json& message) : message_(message) {}

    const json& required(const char* key, const char* what) {
        asked_.insert(key);
        const auto found = message_.find(key);
        if (found == message_.end())
            throw std::invalid_argument(fmt::format("\"{}\" is missing; give {}", key, what));
        return *found;
    }
    bool boolean(const char* key) {
        const json& value = required(key, "true or false");
        if (!value.is_boolean()) refuse(key, "true or false");
        return value.get<bool>();
    }
    double number(const char* key, double low, double high) {
        const std::string what = fmt::format("a number in [{}, {}]", low, high);
        const json& value = required(key, what.c_str());
        // The comparison is false of what is not a number.
        const double given = value.is_number() ? value.get<double>() : std::nan("");
        if (!(given >= low && given <= high)) refuse(key, what);
        return given;
    }
    std::size_t count(const char* key, double low) {
        constexpr double kMost = 1e9;
        const double given = number(key, low, kMost);
        if (std::floor(given) != given) refuse(key, "a whole number");
        return static_cast<std::size_t>(given);
    }
    bool has(const char* key) const { return message_.contains(key); }
    std::vector<std::size_t> list(const char* key) {
        const std::string what = fmt::format("a list of 1 to {} whole numbers", kMostLabels);
        const json& value = required(key, what.c_str());
        if (!value.is_array() || value.empty() || value.size() > kMostLabels) refuse(key, what);
        std::vector<std::size_t> numbers;
        numbers.reserve(value.size());
        for (const json& one : value) {
            if (!one.is_number_unsigned()) refuse(key, what);
            numbers.push_back(one.get<std::size_t>());
        }
        return numbers;
    }
    std::string text(const char* key, const char* what) {
        const json& value = required(key, what);
        if (!value.is_string() || value.get_ref<const std::string&>().size() > kLongestName)
            refuse(key, fmt::format("{} of at most {} bytes", what, kLongestName));
        return value.get<std::string>();
    }
    Vec3 place(const char* key) {
        constexpr std::string_view what = "[x, y, z] in m, each within 1000";
        constexpr double kFarthest_m = 1e3;
        const json& value = required(key, what.data());
        if (!value.is_array() || value.size() != 3) refuse(key, what);
        Vec3 place{0.0};
        for (int axis = 0; axis < 3; ++axis) {
            const json& coordinate = value[static_cast<std::size_t>(axis)];
            if (!coordinate.is_number() || !(std::abs(coordinate.get<double>()) <= kFarthest_m))
                refuse(key, what);
            place[axis] = coordinate.get<double>();
        }
        return place;
    }
    /// Refuses what nobody asked for.
    void done() const {
        for (const auto& [key, value] : message_.items())
            if (!asked_.contains(key))
                throw std::invalid_argument(
                    fmt::format("\"{}\" is no key of this command; leave it out", key));
    }

private:
    [[noreturn]] static void refuse(const char* key, std::string_view what) {
        throw std::invalid_argument(fmt::format("\"{}\" is not {}", key, what));
    }

    const json& message_;
    std::set<std::string> asked_{"do"};
};

ViewCommand of(const std::string& what, Keys& keys) {
    if (what == "probe") return Probe{keys.place("at_m")};
    if (what == "gain") {
        EffectGain gain;
        gain.effect = keys.count("effect", 0.0);
        gain.part = keys.text("part", "a name");
        gain.value = keys.number("value", 0.0, 1.0);
        if (gain.part != "strength")
            throw std::invalid_argument(
                fmt::format("an effect has no part \"{}\"; there is \"strength\"", gain.part));
        return gain;
    }
    if (what == "freeze") return Freeze{keys.boolean("on")};
    if (what == "restart") return Restart{};
    if (what == "record") return Record{keys.boolean("on")};
    if (what == "mark") return Mark{keys.text("name", "a text")};
    if (what == "level") {
        Level level;
        level.structure = keys.count("structure", 0.0);
        level.facets = keys.count("facets", 1.0);
        return level;
    }
    if (what == "button") return Button{keys.boolean("on")};
    if (what == "iso") {
        Iso iso{keys.number("value", -kGreatest, kGreatest), false};
        if (keys.has("fine")) iso.is_fine = keys.boolean("fine");
        return iso;
    }
    if (what == "labels") return Labels{keys.list("structures")};
    if (what == "save") {
        Save save;
        if (keys.has("iso")) save.iso = keys.number("iso", -kGreatest, kGreatest);
        if (keys.has("structures")) save.structures = keys.list("structures");
        return save;
    }
    throw std::invalid_argument(
        fmt::format("there is no command \"{}\"; there are {}", what, kAll));
}

} // namespace

ViewCommand parse_view_command(std::string_view text) {
    if (text.size() > kLongestCommand)
        throw std::invalid_argument(
            fmt::format("{} bytes are too many; send at most {}", text.size(), kLongestCommand));
    const json message = json::parse(text, nullptr, false);
    if (!message.is_object())
        throw std::invalid_argument("this is no JSON object; send {\"do\": \"...\"}");
    const auto what = message.find("do");
    if (what == message.end() || !what->is_string())
        throw std::invalid_argument(fmt::format("\"do\" is missing; give one of {}", kAll));
    Keys keys(message);
    ViewCommand command = of(what->get<std::string>(), keys);
    keys.done();
    return command;
}

} // namespace palpate
