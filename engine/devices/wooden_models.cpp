// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/devices/wooden_models.h>

#include <algorithm>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include <palpate/engine/devices/internal/shipped_models.h>
#include <palpate/engine/text/text_file.h>

namespace palpate {

namespace {

using nlohmann::json;

/// A value in a message.
std::string short_words(const json& value) {
    if (value.is_structured()) return value.is_array() ? "a list" : "a table";
    constexpr std::size_t kMost = 40;
    return value.dump(-1, ' ', false, json::error_handler_t::replace).substr(0, kMost);
}

/// Reads keys of one file, leniently where they are missing and strictly where they are there.
class ModelReader {
public:
    ModelReader(const json& document, const std::filesystem::path& file)
        : document_(document), file_(file) {}

    [[noreturn]] void refuse(const std::string& what) const {
        throw std::runtime_error(file_.string() + ": " + what);
    }

    bool has(const std::string& key) const { return document_.contains(key); }

    double number(const std::string& key, double otherwise) const {
        const auto found = document_.find(key);
        if (found == document_.end()) return otherwise;
        if (!found->is_number()) refuse(key + " must be a number, not " + short_words(*found));
        return found->get<double>();
    }

    bool flag(const std::string& key, bool otherwise) const {
        const auto found = document_.find(key);
        if (found == document_.end()) return otherwise;
        if (found->is_boolean()) return found->get<bool>();
        if (found->is_number()) return found->get<double>() != 0.0;
        refuse(key + " must be true or false, not " + short_words(*found));
    }

    /// One of two words.
    bool is_second(const std::string& key, const std::string& first, const std::string& second,
                   bool otherwise) const {
        const auto found = document_.find(key);
        if (found == document_.end()) return otherwise;
        if (*found != first && *found != second)
            refuse(key + " must be \"" + first + "\" or \"" + second + "\", not " +
                   short_words(*found));
        return *found == second;
    }

    template <std::size_t N>
    void numbers(const std::string& key, char first, std::array<double, N>& values) const {
        for (std::size_t i = 0; i < N; ++i)
            values[i] =
                number(key + "_" + static_cast<char>(first + static_cast<char>(i)), values[i]);
    }

    /// The reference host's number of its Polhem kinematics, or a name with that word.
    bool is_polhem() const {
        const auto found = document_.find("variant");
        if (found == document_.end()) return false;
        if (found->is_string())
            return *found == "3" || found->get<std::string>().find("olhem") != std::string::npos;
        return *found == 3;
    }

private:
    const json& document_;
    const std::filesystem::path& file_;
};

/// The reference host's defaults, for what a file does not say.
WoodenModel reference_defaults() {
    WoodenModel model;
    model.capstan_diameter_m = {0.010, 0.010, 0.010};
    model.body_diameter_m = {0.160, 0.120, 0.120};
    model.body_length_m = {0.080, 0.205, 0.245};
    model.link_length_m = {0.034, 0.025, 0.190, 0.034};
    model.workspace_origin_m = {0.220, 0.0, 0.080};
    model.torque_constant_nm_per_a = {0.0259, 0.0259, 0.0259};
    model.counts_per_turn = {2000, 2000, 2000, 0, 0, 0};
    return model;
}

/// The reference host has written files whose last entry is followed by a comma.
std::string without_commas_too_many(const std::string& text) {
    std::string kept;
    kept.reserve(text.size());
    std::size_t comma = std::string::npos; // the last one in `kept` that only white space follows
    bool is_in_text = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char letter = text[i];
        if (is_in_text) {
            kept += letter;
            if (letter == '\\' && i + 1 < text.size())
                kept += text[++i];
            else if (letter == '"')
                is_in_text = false;
            continue;
        }
        if (letter == '}' && comma != std::string::npos) kept[comma] = ' ';
        if (letter == ',')
            comma = kept.size();
        else if (std::string_view(" \t\r\n").find(letter) == std::string_view::npos)
            comma = std::string::npos;
        is_in_text = letter == '"';
        kept += letter;
    }
    return kept;
}

json parse(const std::string& text, const std::filesystem::path& file) {
    try {
        return json::parse(without_commas_too_many(text));
    } catch (const json::exception&) {
        throw std::runtime_error(file.string() + ": not a device model in JSON; compare it with "
                                                 "one of drivers/models");
    }
}

} // namespace

WoodenModel parse_wooden_model(const std::string& text, const std::filesystem::path& file) {
    const json document = parse(text, file);
    const ModelReader reader(document, file);
    if (!document.is_object()) reader.refuse("not a table of keys and values");

    WoodenModel model = reference_defaults();
    const bool polhem = reader.is_polhem();
    model.name = file.stem().string();
    if (reader.has("name")) {
        if (!document["name"].is_string()) reader.refuse("name must be a text");
        model.name = document["name"].get<std::string>();
    }
    if (reader.is_second("linkage", "parallelogram", "polhem", polhem))
        model.linkage = WoodenLinkage::polhem;
    const bool kept = reader.is_second("zeroing", "host", "device", polhem);
    model.zeroing = kept ? WoodenZeroing::device : WoodenZeroing::host;

    reader.numbers("diameter_capstan", 'a', model.capstan_diameter_m);
    reader.numbers("diameter_body", 'a', model.body_diameter_m);
    reader.numbers("length_body", 'a', model.body_length_m);
    const std::array links{"0", "2", "3", "4"};
    for (std::size_t i = 0; i < links.size(); ++i)
        model.link_length_m[i] =
            reader.number(std::string("length_link_") + links[i], model.link_length_m[i]);
    const std::array axes{"x", "y", "z"};
    for (int i = 0; i < 3; ++i)
        model.workspace_origin_m[i] =
            reader.number(std::string("workspace_origin_") + axes[static_cast<std::size_t>(i)],
                          model.workspace_origin_m[i]);
    model.workspace_radius_m = reader.number("workspace_radius", model.workspace_radius_m);
    reader.numbers("torque_constant_motor", 'a', model.torque_constant_nm_per_a);
    reader.numbers("cpr_encoder", 'a', model.counts_per_turn);
    reader.numbers("calibrate_enc", 'a', model.home_counts);
    model.force_n = reader.number("max_linear_force", model.force_n);
    model.stiffness_n_per_m = reader.number("max_linear_stiffness", model.stiffness_n_per_m);

    // The reference host negates the base's counters where it sets them to zero itself.
    if (!kept) model.count_direction = {-1, -1, -1, 1, 1, 1};
    reader.numbers("count_direction", 'a', model.count_direction);
    for (std::size_t i = 0; i < 6; ++i) {
        const std::string key = (i < 3 ? "motor_and_body_aligned_" : "enc_and_body_aligned_") +
                                std::string(1, static_cast<char>('a' + static_cast<char>(i)));
        // default_woody, which stands for what is missing, has B aligned. The base's counters turn
        // against motors that are aligned, the gimbal's with encoders that are.
        const double aligned = i < 3 ? -1.0 : 1.0;
        model.joint_sign[i] = reader.flag(key, i == 1) ? aligned : -aligned;
    }
    try {
        check(model);
    } catch (const std::invalid_argument& error) {
        reader.refuse(error.what());
    }
    return model;
}

std::vector<std::string> wooden_model_names() {
    std::vector<std::string> names;
    for (const auto& model : internal::shipped_models())
        names.emplace_back(model.name);
    return names;
}

WoodenModel wooden_model(const std::string& name) {
    const std::filesystem::path file(name);
    if (file.extension() == ".json")
        return parse_wooden_model(read_text_file(file, "a device model (JSON)"), file);
    std::string known;
    for (const auto& model : internal::shipped_models()) {
        if (model.name == name) return parse_wooden_model(std::string(model.text), name);
        known += (known.empty() ? "" : ", ") + std::string(model.name);
    }
    throw std::runtime_error(name + ": no device model of that name; there are " + known +
                             ", or give a file, NAME.json");
}

} // namespace palpate
