// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/trace_summary.h>
#include <palpate/engine/run/effect_prices.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <set>
#include <span>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/baking/in_words.h>
#include <palpate/engine/devices/orbit.h>
#include <palpate/engine/devices/surface_tour.h>
#include <palpate/engine/files/sha256.h>
#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/record/recording.h>
#include <palpate/engine/report/internal/machine.h>
#include <palpate/engine/report/internal/spread.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/text/internal/json_text.h>
#include <palpate/version.h>

namespace palpate {
namespace {

using nlohmann::json;

constexpr double kMicrometres = 1e6; // um per m

/// Mean, rms and percentiles of a column.
json statistics(std::vector<double> values) {
    const internal::Spread spread = internal::spread_of(std::move(values));
    if (spread.count == 0) return json::object();
    return {{"frames", spread.count}, {"mean", spread.mean}, {"rms", spread.rms},
            {"p50", spread.p50},      {"p90", spread.p90},   {"p99", spread.p99},
            {"max", spread.max}};
}

template <class Column>
json statistics_of(std::span<const FrameReport> frames, const Column& column) {
    std::vector<double> values;
    values.reserve(frames.size());
    for (const FrameReport& frame : frames)
        values.push_back(column(frame));
    return statistics(std::move(values));
}

json absolute_um(const std::vector<double>& metres) {
    std::vector<double> values;
    values.reserve(metres.size());
    for (double value : metres)
        values.push_back(kMicrometres * std::abs(value));
    return statistics(std::move(values));
}

json machine() {
    const internal::Machine here = internal::this_machine();
    return {{"cpu", here.cpu}, {"cores", here.cores}, {"system", here.system}};
}

json level_summary(const SurfaceAudit& audit) {
    const SceneSurface& surface = audit.surface();
    const SurfaceAudit::Deepest deepest = audit.deepest();
    return {{"level", surface.level.level},
            {"shift_mean_mm", 1e3 * surface.baked.shift.mean_m},
            {"shift_sd_mm", 1e3 * surface.baked.shift.deviation_m},
            {"level_distance_um", absolute_um(audit.level_distance_m())},
            {"frames_inside", audit.frames_inside()},
            {"deepest_chord",
             {{"value_above_level", deepest.above_level},
              {"tolerance", audit.certificate()},
              {"depth_mm", 1e3 * deepest.depth_m},
              {"frame", deepest.frame}}}};
}

json guard_summary(const SurfaceAudit& audit) {
    json summary = {{"leash_mm", 1e3 * audit.surface().leash_m},
                    {"frames", audit.guarded_frames()},
                    {"events", audit.guarded_events()}};
    if (const std::string warning = guard_warning(audit); !warning.empty())
        summary["warning"] = warning;
    return summary;
}

json surface_summary(const SurfaceAudit& audit) {
    const SceneSurface& surface = audit.surface();
    json summary = surface.is_felt_by_mesh()
                       ? json{{"mesh_distance_um", absolute_um(audit.mesh_distance_m())},
                              {"chords_through_mesh", audit.chords_through()}}
                       : level_summary(audit);
    if (!audit.position_error_m().empty())
        summary["position_error_um"] = absolute_um(audit.position_error_m());
    summary["name"] = surface.name;
    summary["contact"] = name(surface.contact);
    summary["baked"] = surface.baked.grid ? json::parse(baked_as_json(surface.baked)) : json();
    summary["mesh"] = surface.mesh.scene ? json::parse(mesh_as_json(surface.mesh)) : json();
    if (surface.contact == ContactKind::guarded) summary["guarded"] = guard_summary(audit);
    return summary;
}

json felt_summary(const Scene& scene, std::span<const FrameReport> frames) {
    json list = json::array();
    const double period_s = 1.0 / scene.description().loop.rate_hz;
    for (const FeltSurface& felt : felt_surfaces(felt_names(scene), frames, period_s))
        list.push_back({{"bit", list.size()},
                        {"name", felt.name},
                        {"frames", felt.frames},
                        {"contact_s", felt.contact_s},
                        {"force_mean_n", felt.force_mean_n},
                        {"force_max_n", felt.force_max_n},
                        {"path_mm", 1e3 * felt.path_m}});
    return list;
}

bool is_generated(const DeviceDescription& device) {
    return device.kind == DeviceDescription::Kind::tour ||
           device.kind == DeviceDescription::Kind::orbit;
}

/// How far each soft surface was pressed in, and with what stiffness, in the frames in which it was
/// the one that was pressed in farthest.
json pressed_summary(const Scene& scene, std::span<const FrameReport> frames) {
    json list = json::array();
    for (std::size_t i = 0; i < scene.surfaces().size(); ++i) {
        std::vector<double> indentation_mm, n_per_mm;
        for (const FrameReport& frame : frames) {
            if (!is_computed(frame.flags)) continue; // held there: nothing was felt
            if (!(frame.indentation_m > 0.0) || frame.pressed_surface != i) continue;
            indentation_mm.push_back(1e3 * frame.indentation_m);
            n_per_mm.push_back(1e-3 * frame.stiffness_n_per_m);
        }
        if (indentation_mm.empty()) continue;
        list.push_back({{"name", scene.surfaces()[i].name},
                        {"indentation_mm", statistics(std::move(indentation_mm))},
                        {"stiffness_n_per_mm", statistics(std::move(n_per_mm))}});
    }
    return list;
}

/// How deep the probe was behind what held it, frame by frame in contact, mm. A path that was
/// generated goes by its own surfaces: not by the front of soft tissue over them.
std::vector<double> depths_mm(const Scene& scene, std::span<const FrameReport> frames) {
    const DeviceDescription& device = scene.description().device;
    const std::string led_over = is_generated(device) ? device.surface : "";
    const auto counts = [&](std::size_t surface) {
        return led_over.empty() ||
               (surface < scene.surfaces().size() && scene.surfaces()[surface].name == led_over);
    };
    std::vector<double> depths;
    depths.reserve(frames.size());
    for (const FrameReport& frame : frames) {
        if (frame.contacts == 0) continue;
        const bool at_front = frame.indentation_m > 0.0 && counts(frame.pressed_surface);
        depths.push_back(1e3 * glm::distance(frame.probe, at_front ? frame.front : frame.proxy));
    }
    return depths;
}

/// What a path that was generated was to do, and what of it came true; null for other devices.
json generated_path(const Scene& scene, std::span<const FrameReport> frames) {
    constexpr double kRounding_mm = 0.05; // a step at 0.2 m/s leaves a probe at 1 mm 20 um deeper
    const DeviceDescription& device = scene.description().device;
    const bool is_tour = device.kind == DeviceDescription::Kind::tour;
    if (!is_generated(device)) return {};
    const double least = is_tour ? device.press_mm : device.depth_min_mm;
    const double most = is_tour ? device.press_mm : device.depth_max_mm;
    const std::vector<double> depths = depths_mm(scene, frames);
    const auto deeper = std::count_if(depths.begin(), depths.end(),
                                      [&](double depth) { return depth > most + kRounding_mm; });
    json path = {{"type", is_tour ? "tour" : "orbit"},
                 {"depth_asked_mm", {least, most}},
                 {"deeper_frames", deeper}};
    for (const SurfaceCoverage& one : tour_coverage(scene, frames))
        path["coverage"].push_back({{"surface", one.surface},
                                    {"area_cm2", 1e4 * one.area_m2},
                                    {"within_mm", 1e3 * one.within_m},
                                    {"felt_percent", 100.0 * one.felt_share}});
    return path;
}

std::ptrdiff_t frames_with(FrameFlag flag, std::span<const FrameReport> frames) {
    return std::count_if(frames.begin(), frames.end(),
                         [&](const FrameReport& frame) { return (frame.flags & flag) != 0; });
}

json flag_summary(std::span<const FrameReport> frames) {
    json flags = json::array();
    for (const FrameFlagText& text : kFrameFlagTexts) {
        if (const auto count = frames_with(text.flag, frames); count > 0)
            flags.push_back({{"name", text.name}, {"frames", count}, {"meaning", text.meaning}});
    }
    return flags;
}

json effect_summary(const Scene& scene) {
    json effects = json::array();
    const std::vector<double> prices = measure_prices(scene);
    for (const PlannedEffect& planned : scene.plan().effects) {
        const EffectDescription& effect = scene.description().effects[planned.effect];
        json entry = {
            {"type", name(effect)}, {"on", planned.on}, {"cost_us", prices[planned.effect]}};
        if (!surface_of(effect).empty()) entry["surface"] = surface_of(effect);
        if (!volume_of(effect).empty()) entry["volume"] = volume_of(effect);
        effects.push_back(entry);
    }
    return effects;
}

/// Level and position errors where the truth is a formula, or a field of the program's own.
json truth(const Scene& scene, const Trace& trace) {
    std::vector<double> position, level; // of all surfaces
    const auto add = [](std::vector<double>& all, std::span<const double> more) {
        all.insert(all.end(), more.begin(), more.end());
    };
    for (const SurfaceAudit& audit : trace.audits) {
        add(position, audit.position_error_m());
        if (audit.surface().is_felt_by_mesh()) continue;
        const std::string& volume = scene.description().surfaces.at(audit.surface().name).volume;
        if (is_exact(scene.description().volumes.at(volume))) add(level, audit.level_distance_m());
    }
    json result = json::object();
    if (!position.empty()) result["position_um"] = absolute_um(position);
    if (!level.empty()) result["level_um"] = absolute_um(level);
    return result;
}

/// How a run kept the clock's pace.
json realtime_summary(const Trace& trace) {
    const RealtimeCounts& counts = *trace.realtime;
    return {
        {"scheduler", counts.scheduler == Scheduler::fifo ? "SCHED_FIFO" : "SCHED_OTHER"},
        {"memory_locked", counts.memory_locked},
        {"overruns_by", {{"own_work", counts.own_work}, {"woken_late", counts.woken_late}}},
        {"missed_periods", counts.missed_periods},
        {"frames_of_a_silent_loop", counts.silent_loop},
        {"frames_of_a_silent_device", counts.silent_device},
        {"frames_not_recorded", counts.dropped},
        {"late_us", statistics_of(trace.frames, [](const FrameReport& f) { return f.late_us; })}};
}

/// At the clock's pace, frames that cost others their period; else what would have.
std::uint64_t overruns_of(const Trace& trace, double rate_hz) {
    if (trace.realtime) return trace.realtime->own_work + trace.realtime->woken_late;
    return static_cast<std::uint64_t>(
        std::count_if(trace.frames.begin(), trace.frames.end(),
                      [&](const FrameReport& f) { return f.spent_us > 1e6 / rate_hz; }));
}

std::string contact_names(const Scene& scene) {
    std::set<std::string> names;
    for (const SceneSurface& surface : scene.surfaces())
        names.insert(std::string(name(surface.contact)));
    std::string text;
    for (const std::string& one : names)
        text += (text.empty() ? "" : ", ") + one;
    return text;
}

/// How many frames were felt before another scene took over.
std::ptrdiff_t frames_of_preview(std::span<const FrameReport> frames) {
    const auto first = std::find_if(frames.begin(), frames.end(), [](const FrameReport& frame) {
        return (frame.flags & kSceneAdopted) != 0;
    });
    return first - frames.begin();
}

/// How many trials begin with a flag, but for the first one.
std::ptrdiff_t begun_with(FrameFlag flag, std::span<const FrameReport> frames) {
    std::ptrdiff_t count = 0;
    for (std::size_t i = 1; i < frames.size(); ++i)
        count += frames[i].trial != frames[i - 1].trial && (frames[i].flags & flag) != 0;
    return count;
}

constexpr std::array<const char*, 3> kOfAllHands{"version", "scene", "machine"};

} // namespace

std::vector<std::string> flags_in_words(std::span<const FrameReport> frames) {
    std::vector<std::string> lines;
    for (const FrameFlagText& text : kFrameFlagTexts)
        if (const auto count = frames_with(text.flag, frames); count > 0) {
            // What was felt at the end of the trial before is let go of within the limit, too.
            const auto at_start = text.flag == kForceSlewed ? begun_with(text.flag, frames) : 0;
            lines.push_back(fmt::format(
                "{} in {} of {} frames{}: {}", text.name, count, frames.size(),
                at_start > 0 ? fmt::format(", {} of them where a trial begins", at_start) : "",
                text.meaning));
        }
    return lines;
}

std::string preview_in_words(const Trace& trace) {
    if (!trace.before) return "all frames felt the preview: the scene itself did not take over";
    const std::ptrdiff_t frames = frames_of_preview(trace.frames);
    return fmt::format(
        "the first {} frames felt the preview, with contact {}; from {:.3f} s on the "
        "scene itself was felt",
        frames, contact_names(*trace.before),
        trace.frames[static_cast<std::size_t>(frames)].time_s);
}

namespace {

json summary_of(const Scene& scene, const Trace& trace) {
    const std::span<const FrameReport> frames = trace.frames;
    const SceneDescription& description = scene.description();
    const auto in_contact = std::count_if(
        frames.begin(), frames.end(), [](const FrameReport& frame) { return frame.contacts > 0; });
    std::set<std::uint32_t> trials;
    for (const FrameReport& frame : frames)
        trials.insert(frame.trial);

    json summary;
    summary["version"] = kVersion;
    summary["scene"] = {{"file", description.file.filename().string()},
                        {"sha256", sha256_of_text(description.text)}};
    summary["machine"] = machine();
    if (!description.device.name.empty()) summary["hand"] = description.device.name;
    summary["method"] = name(description.loop.method);
    summary["contact"] = contact_names(scene);
    if (trace.before)
        summary["preview"] = {{"contact", contact_names(*trace.before)},
                              {"frames", frames_of_preview(frames)}};
    summary["pace"] = trace.realtime ? "realtime" : "asap";
    if (trace.realtime) summary["realtime"] = realtime_summary(trace);
    if (!is_sequence(description.device)) summary["device"] = trace.device.name;
    summary["frames"] = frames.size();
    summary["trials"] = trials.size();
    summary["frames_in_contact"] = in_contact;
    summary["overruns"] = overruns_of(trace, description.loop.rate_hz);
    summary["spent_us"] = statistics_of(frames, [](const FrameReport& f) { return f.spent_us; });
    summary["sub_steps"] = statistics_of(frames, [](const FrameReport& f) { return f.sub_steps; });
    summary["evaluations"] =
        statistics_of(frames, [](const FrameReport& f) { return f.evaluations; });
    const auto mean = [&](auto column) { return statistics_of(frames, column).value("mean", 0.0); };
    summary["queries_per_frame"] = {
        {"field_samples", mean([](const FrameReport& f) { return f.field_samples; })},
        {"roots", mean([](const FrameReport& f) { return f.root_queries; })},
        {"surface_queries", mean([](const FrameReport& f) { return f.surface_queries; })}};
    summary["force_n"] =
        statistics_of(frames, [](const FrameReport& f) { return glm::length(f.force); });
    summary["depth_mm"] = statistics(depths_mm(scene, frames));
    if (const json path = generated_path(scene, frames); !path.is_null())
        summary["generated_path"] = path;
    summary["surfaces"] = json::array();
    for (const SurfaceAudit& audit : trace.audits)
        summary["surfaces"].push_back(surface_summary(audit));
    summary["felt"] = felt_summary(scene, frames);
    if (presses_a_soft_surface(frames)) summary["pressed"] = pressed_summary(scene, frames);
    summary["truth"] = truth(scene, trace);
    summary["flags"] = flag_summary(frames);
    summary["effects"] = effect_summary(scene);
    return summary;
}

} // namespace

std::string summarize(const Scene& scene, const Trace& trace) {
    return internal::json_text(summary_of(scene, trace)) + "\n";
}

std::string summarize(std::span<const HandTrace> hands) {
    json all = json::object();
    all["hands"] = json::array();
    for (const HandTrace& hand : hands) {
        json one = summary_of(*hand.scene, hand.trace);
        for (const char* key : kOfAllHands) {
            all[key] = one[key];
            one.erase(key);
        }
        all["hands"].push_back(std::move(one));
    }
    return internal::json_text(all) + "\n";
}

std::vector<std::string> summaries_of_hands(const std::string& summary) {
    json all = json::parse(summary, nullptr, false);
    const bool has_hands = all.is_object() && all.contains("hands") && all["hands"].is_array();
    if (!has_hands) return {summary};
    std::vector<std::string> each;
    for (json one : all["hands"]) {
        for (const char* key : kOfAllHands)
            if (one.is_object() && all.contains(key)) one[key] = all[key];
        each.push_back(internal::json_text(one) + "\n");
    }
    return each;
}

std::string hand_of_summary(const std::string& summary) {
    const json one = json::parse(summary, nullptr, false);
    const bool has_hand = one.is_object() && one.contains("hand") && one["hand"].is_string();
    return has_hand ? one["hand"].get<std::string>() : "";
}

} // namespace palpate
