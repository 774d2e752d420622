// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/path_files.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/report/internal/vtp_text.h>
#include <palpate/engine/text/internal/json_text.h>
#include <palpate/geometry/surface_scene.h>

namespace palpate {
namespace {

using nlohmann::json;

constexpr double kMmPerM = 1e3;

/// How far a contact may be from the mesh that it is of, m: a soft surface is pressed in.
constexpr double kNearMesh = 0.05;

using Frames = std::span<const FrameReport>;

/// Frames of one trial each, in their order.
std::vector<Frames> trials_of(Frames frames) {
    std::vector<Frames> trials;
    for (std::size_t first = 0, n = 1; n <= frames.size(); ++n)
        if (n == frames.size() || frames[n].trial != frames[first].trial) {
            trials.push_back(frames.subspan(first, n - first));
            first = n;
        }
    return trials;
}

/// How long a frame lasts: since the one before it in its trial, else until the next one.
double duration_of(Frames frames, std::size_t n) {
    const auto is_of_trial = [&](std::size_t other) {
        return other < frames.size() && frames[other].trial == frames[n].trial;
    };
    // Not since before silence or frames that are missing; no time that jumps back or is no number.
    const bool goes_on = n > 0 && is_of_trial(n - 1) && is_computed(frames[n - 1].flags) &&
                         frames[n].frame == frames[n - 1].frame + 1;
    if (goes_on) return std::max(0.0, frames[n].time_s - frames[n - 1].time_s);
    return is_of_trial(n + 1) ? std::max(0.0, frames[n + 1].time_s - frames[n].time_s) : 0.0;
}

/// Calls visit(frame's place in run.frames, its touches) for each frame with touches.
template <class Visit>
void for_each_touched_frame(const Run& run, const Visit& visit) {
    std::size_t frame = 0;
    for (std::size_t first = 0; first < run.touches.size();) {
        std::size_t end = first;
        while (end < run.touches.size() && run.touches[end].frame == run.touches[first].frame)
            ++end;
        while (frame < run.frames.size() && run.frames[frame].frame < run.touches[first].frame)
            ++frame;
        if (frame < run.frames.size() && run.frames[frame].frame == run.touches[first].frame)
            visit(frame, std::span(run.touches).subspan(first, end - first));
        first = end;
    }
}

/// What one surface does in one frame.
struct Pushing {
    Vec3 force{0.0};
    double strongest = -1.0;
    Vec3 at{0.0};
};

std::map<std::uint32_t, Pushing> pushing_in(std::span<const RecordedTouch> touches) {
    std::map<std::uint32_t, Pushing> surfaces;
    for (const RecordedTouch& touch : touches) {
        if (touch.phase == Touch::Phase::ended) continue;
        Pushing& one = surfaces[touch.surface];
        one.force += touch.force;
        if (const double force = glm::length(touch.force); force > one.strongest) {
            one.strongest = force;
            one.at = touch.point;
        }
    }
    return surfaces;
}

// --- Markups

json position_of(const Vec3& m) { return {kMmPerM * m.x, kMmPerM * m.y, kMmPerM * m.z}; }

json control_point(std::size_t number, const std::string& label, const json& description,
                   const Vec3& at) {
    return {{"id", std::to_string(number)},
            {"label", label},
            {"description", description.dump(-1, ' ', false, json::error_handler_t::replace)},
            {"position", position_of(at)},
            {"positionStatus", "defined"}};
}

json markup(const char* type, const std::string& name, json points) {
    return {{"type", type},
            {"name", name},
            {"coordinateSystem", "LPS"},
            {"coordinateUnits", "mm"},
            {"locked", true},
            {"controlPoints", std::move(points)}};
}

json column(const char* name, const char* unit, json values) {
    return {{"name", name},
            {"enabled", true},
            {"units", unit},
            {"printFormat", "%-#4.4g"},
            {"controlPointValues", std::move(values)}};
}

/// A path with a point every `step_s`, its first and last frame among them.
json curve(const std::string& name, Frames trial, Vec3 FrameReport::*place, double step_s,
           const Recording& recording) {
    json points = json::array(), times = json::array(), forces = json::array();
    double next_s = trial.front().time_s;
    for (std::size_t n = 0; n < trial.size(); ++n) {
        const FrameReport& frame = trial[n];
        if (frame.time_s < next_s && n + 1 < trial.size()) continue;
        if (!is_finite(frame.*place)) continue;        // a fault of the device: its flag says so
        next_s = frame.time_s + step_s * (1.0 - 1e-6); // times of frames are rounded
        const double force_n = glm::length(frame.force);
        points.push_back(
            control_point(points.size() + 1, fmt::format("{:.3f} s", frame.time_s),
                          {{"time_s", frame.time_s},
                           {"force_n", force_n},
                           {"felt", felt_in_words(frame.surfaces_felt, recording.felt_names)}},
                          frame.*place));
        times.push_back(frame.time_s);
        forces.push_back(force_n);
    }
    json result = markup("Curve", name, std::move(points));
    result["measurements"] = {column("time", "s", std::move(times)),
                              column("force", "N", std::move(forces))};
    result["display"] = {{"pointLabelsVisibility", false}, {"propertiesLabelVisibility", false}};
    return result;
}

json touches_markup(const Recording& recording) {
    json points = json::array(), forces = json::array();
    for (const TouchSpan& span : touch_spans(recording)) {
        const std::string name = span.surface < recording.felt_names.size()
                                     ? recording.felt_names[span.surface]
                                     : fmt::format("surface {}", span.surface);
        points.push_back(control_point(points.size() + 1, name,
                                       {{"time_s", span.strongest_s},
                                        {"began_s", span.began_s},
                                        {"ended_s", span.ended_s},
                                        {"force_n", span.force_n}},
                                       span.at));
        forces.push_back(span.force_n);
    }
    json result = markup("Fiducial", "touches", std::move(points));
    result["measurements"] = json::array({column("force", "N", std::move(forces))});
    return result;
}

json named_markup(std::span<const NamedPlace> named) {
    json points = json::array();
    for (const NamedPlace& place : named)
        points.push_back(control_point(
            points.size() + 1, place.name,
            {{"time_s", place.time_s ? json(*place.time_s) : json(nullptr)}, {"felt", place.felt}},
            place.at));
    return markup("Fiducial", "named places", std::move(points));
}

} // namespace

std::vector<TouchSpan> touch_spans(const Run& run) {
    std::vector<TouchSpan> spans;
    std::map<std::uint32_t, std::size_t> open; // by surface: place in spans
    std::optional<std::size_t> before;
    for_each_touched_frame(run, [&](std::size_t n, std::span<const RecordedTouch> touches) {
        const FrameReport& frame = run.frames[n];
        // A frame without touches or that is missing, or a new trial, has let go of everything.
        if (!before || *before + 1 != n || run.frames[*before].trial != frame.trial ||
            run.frames[*before].frame + 1 != frame.frame)
            open.clear();
        before = n;
        const std::map<std::uint32_t, Pushing> pushing = pushing_in(touches);
        std::erase_if(open, [&](const auto& one) { return !pushing.contains(one.first); });
        for (const auto& [surface, one] : pushing) {
            const auto [found, is_new] = open.try_emplace(surface, spans.size());
            if (is_new) spans.push_back({surface, frame.time_s, frame.time_s, -1.0, 0.0, {}});
            TouchSpan& span = spans[found->second];
            span.ended_s = frame.time_s;
            const double force_n = glm::length(one.force);
            if (force_n <= span.force_n) continue;
            span.force_n = force_n;
            span.strongest_s = frame.time_s;
            span.at = one.at;
        }
    });
    return spans;
}

std::string markups_of(const Recording& recording, std::span<const NamedPlace> named,
                       double step_s) {
    json markups = json::array();
    const std::vector<Frames> trials = trials_of(recording.frames);
    for (const Frames& trial : trials) {
        const std::string which =
            trials.size() > 1 ? fmt::format(", trial {}", trial.front().trial) : std::string();
        markups.push_back(curve("proxy" + which, trial, &FrameReport::proxy, step_s, recording));
        markups.push_back(curve("probe" + which, trial, &FrameReport::probe, step_s, recording));
    }
    markups.push_back(touches_markup(recording));
    if (!named.empty()) markups.push_back(named_markup(named));
    const json document = {
        {"@schema", "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/"
                    "Markups/Resources/Schema/markups-schema-v1.0.3.json#"},
        {"markups", std::move(markups)},
        {"written_by", "palpate"}};
    return internal::json_text(document) + "\n";
}

std::string paths_as_vtp(const Recording& recording) {
    internal::VtpText text;
    internal::VtpArray times{"time_s", 1, {}}, forces{"force_n", 3, {}}, trials{"trial", 1, {}},
        is_proxy{"is_proxy", 1, {}};
    for (const Frames& trial : trials_of(recording.frames))
        for (Vec3 FrameReport::*place : {&FrameReport::probe, &FrameReport::proxy}) {
            for (const FrameReport& frame : trial) {
                if (!is_finite(frame.*place)) continue; // a fault of the device
                text.points_mm.push_back(kMmPerM * (frame.*place));
                times.values.push_back(frame.time_s);
                for (int axis = 0; axis < 3; ++axis)
                    forces.values.push_back(frame.force[axis]);
            }
            text.line_ends.push_back(text.points_mm.size());
            trials.values.push_back(trial.front().trial);
            is_proxy.values.push_back(place == &FrameReport::proxy ? 1.0 : 0.0);
        }
    text.of_points = {std::move(times), std::move(forces)};
    text.of_cells = {std::move(trials), std::move(is_proxy)};
    return text.written("paths of probe and proxy");
}

std::string touched_mesh_as_vtp(const Recording& recording, std::uint32_t surface,
                                const TriangleMesh& mesh) {
    const SurfaceScene queries(std::make_shared<const TriangleMesh>(mesh));
    internal::VtpArray touched{"touched_s", 1, std::vector<double>(mesh.vertices.size())};
    internal::VtpArray force{"force_n", 1, std::vector<double>(mesh.vertices.size())};
    std::vector<std::uint64_t> counted(mesh.vertices.size()); // frame + 1 that was counted last
    for_each_touched_frame(recording, [&](std::size_t n, std::span<const RecordedTouch> touches) {
        for (const RecordedTouch& touch : touches) {
            if (touch.surface != surface || touch.phase == Touch::Phase::ended) continue;
            const auto hit = queries.closest_point(touch.point, kNearMesh);
            if (!hit) continue;
            const auto& corners = mesh.triangles[hit->triangle];
            const std::uint32_t vertex =
                *std::min_element(corners.begin(), corners.end(), [&](auto a, auto b) {
                    return squared_length(mesh.vertices[a] - hit->position) <
                           squared_length(mesh.vertices[b] - hit->position);
                });
            if (std::exchange(counted[vertex], touch.frame + 1) != touch.frame + 1)
                touched.values[vertex] += duration_of(recording.frames, n);
            force.values[vertex] = std::max(force.values[vertex], glm::length(touch.force));
        }
    });
    internal::VtpText text;
    for (const Vec3& p : mesh.vertices)
        text.points_mm.push_back(kMmPerM * p);
    text.triangles = mesh.triangles;
    text.of_points = {std::move(touched), std::move(force)};
    return text.written("what was touched of a surface");
}

} // namespace palpate
