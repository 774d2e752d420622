// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/trace_summary_reader.h>

#include <algorithm>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/haptics/stepping/frame_flags.h>

namespace palpate::internal {
namespace {

using nlohmann::json;

/// An object of a summary together with where it is, for messages.
class Object {
public:
    Object(const json& value, std::string title, std::string path)
        : value_(value), title_(std::move(title)), path_(std::move(path)) {
        if (!value_.is_object()) fail("is not an object");
    }

    Number number(const char* key) const {
        const json* value = find(key);
        if (value == nullptr) return std::nullopt;
        if (!value->is_number()) child(key).fail("is not a number");
        return value->get<double>();
    }
    std::string text(const char* key) const {
        const json* value = find(key);
        if (value == nullptr) return {};
        if (!value->is_string()) child(key).fail("is not a text");
        return value->get<std::string>();
    }
    Object object(const char* key) const {
        static const json kEmpty = json::object();
        const json* value = find(key);
        return {value == nullptr ? kEmpty : *value, title_, path_ + "." + key};
    }
    std::vector<Object> list(const char* key) const {
        const json* value = find(key);
        if (value == nullptr) return {};
        if (!value->is_array()) child(key).fail("is not a list");
        std::vector<Object> objects;
        for (const json& entry : *value)
            objects.emplace_back(entry, title_, path_ + "." + key);
        return objects;
    }

private:
    const json* find(const char* key) const {
        const auto found = value_.find(key);
        return found == value_.end() || found->is_null() ? nullptr : &*found;
    }
    /// Only to name a value in a message.
    Object child(const char* key) const {
        Object named = *this;
        named.path_ += std::string(".") + key;
        return named;
    }
    [[noreturn]] void fail(std::string_view what) const {
        throw std::runtime_error(fmt::format(
            "{}: summary{} {}; write it again with `palpate trace`", title_, path_, what));
    }

    const json& value_;
    std::string title_;
    std::string path_;
};

SpreadSummary read_spread(const Object& object) {
    return {object.number("frames"), object.number("mean"), object.number("rms"),
            object.number("p50"),    object.number("p99"),  object.number("max")};
}

SurfaceSummary read_surface(const Object& object) {
    SurfaceSummary surface;
    surface.name = object.text("name");
    surface.contact = object.text("contact");
    surface.level = object.number("level");
    surface.shift_mean_mm = object.number("shift_mean_mm");
    surface.shift_sd_mm = object.number("shift_sd_mm");
    surface.distance_um = read_spread(object.object("level_distance_um"));
    if (!surface.distance_um.rms)
        surface.distance_um = read_spread(object.object("mesh_distance_um"));
    surface.position_um = read_spread(object.object("position_error_um"));
    surface.chords_through_mesh = object.number("chords_through_mesh");
    surface.guarded_frames = object.object("guarded").number("frames");
    surface.guarded_events = object.object("guarded").number("events");
    const Object chord = object.object("deepest_chord");
    surface.chord_value = chord.number("value_above_level");
    surface.chord_tolerance = chord.number("tolerance");
    surface.chord_depth_mm = chord.number("depth_mm");
    surface.chord_frame = chord.number("frame");
    return surface;
}

FeltSummary read_felt(const Object& object) {
    return {object.text("name"),           object.number("frames"),      object.number("contact_s"),
            object.number("force_mean_n"), object.number("force_max_n"), object.number("path_mm")};
}

PathSummary read_path(const Object& object) {
    PathSummary path;
    path.type = object.text("type");
    path.deeper_frames = object.number("deeper_frames");
    for (const Object& one : object.list("coverage"))
        path.coverage.push_back({one.text("surface"), one.number("area_cm2"),
                                 one.number("within_mm"), one.number("felt_percent")});
    return path;
}

FlagSummary read_flag(const Object& object) {
    FlagSummary flag{object.text("name"), object.text("meaning"), object.number("frames")};
    for (const FrameFlagText& known : kFrameFlagTexts)
        if (flag.meaning.empty() && flag.name == known.name) flag.meaning = known.meaning;
    return flag;
}

EffectSummary read_effect(const Object& object) {
    const std::string surface = object.text("surface");
    return {object.text("type"), surface.empty() ? object.text("volume") : surface,
            object.number("cost_us")};
}

} // namespace

TraceSummary read_trace_summary(const std::string& title, const std::string& text) {
    const json parsed = json::parse(text, nullptr, false);
    if (parsed.is_discarded())
        throw std::runtime_error(title +
                                 ": summary is not JSON; write it again with `palpate trace`");
    const Object root(parsed, title, "");

    TraceSummary summary;
    summary.version = root.text("version");
    summary.scene_file = root.object("scene").text("file");
    summary.scene_hash = root.object("scene").text("sha256");
    summary.method = root.text("method");
    summary.contact = root.text("contact");
    summary.pace = root.text("pace");
    summary.cpu = root.object("machine").text("cpu");
    summary.system = root.object("machine").text("system");
    summary.cores = root.object("machine").number("cores");
    summary.frames = root.number("frames");
    summary.trials = root.number("trials");
    summary.frames_in_contact = root.number("frames_in_contact");
    summary.overruns = root.number("overruns");
    summary.spent_us = read_spread(root.object("spent_us"));
    summary.sub_steps = read_spread(root.object("sub_steps"));
    summary.evaluations = read_spread(root.object("evaluations"));
    summary.force_n = read_spread(root.object("force_n"));
    summary.depth_mm = read_spread(root.object("depth_mm"));
    summary.path = read_path(root.object("generated_path"));
    summary.truth_level_um = read_spread(root.object("truth").object("level_um"));
    summary.truth_position_um = read_spread(root.object("truth").object("position_um"));
    summary.field_samples = root.object("queries_per_frame").number("field_samples");
    summary.roots = root.object("queries_per_frame").number("roots");
    summary.surface_queries = root.object("queries_per_frame").number("surface_queries");
    for (const Object& entry : root.list("surfaces"))
        summary.surfaces.push_back(read_surface(entry));
    for (const Object& entry : root.list("felt"))
        summary.felt.push_back(read_felt(entry));
    for (const Object& entry : root.list("pressed"))
        summary.pressed.push_back({entry.text("name"), read_spread(entry.object("indentation_mm")),
                                   read_spread(entry.object("stiffness_n_per_mm"))});
    for (const Object& entry : root.list("flags"))
        summary.flags.push_back(read_flag(entry));
    for (const Object& entry : root.list("effects"))
        summary.effects.push_back(read_effect(entry));
    return summary;
}

Number largest(const std::vector<SurfaceSummary>& surfaces,
               Number (*number)(const SurfaceSummary&)) {
    Number most;
    for (const SurfaceSummary& surface : surfaces)
        if (const Number one = number(surface)) most = most ? std::max(*most, *one) : *one;
    return most;
}

} // namespace palpate::internal
