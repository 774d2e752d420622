// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/view/coarse_mesh.h>
#include <palpate/engine/view/internal/container.h>
#include <palpate/engine/view/internal/page_marks.h>
#include <palpate/engine/view/view_document.h>
#include <palpate/haptics/stepping/frame_flags.h>
#include <palpate/version.h>

namespace palpate {
namespace {

using internal::Container;
using nlohmann::json;

// Of all that is drawn, the least that a structure gets, however small it is beside the others.
constexpr std::size_t kLeastTriangles = 500;

json of(const Vec3& v) { return {v.x, v.y, v.z}; }

json of(const Box& box) { return {of(box.lower), of(box.upper)}; }

const char* name(ViewMode mode) {
    switch (mode) {
    case ViewMode::live:
        return "live";
    case ViewMode::playback:
        return "playback";
    case ViewMode::explore:
        break;
    }
    return "explore";
}

/// One level of detail of structure `id`, in the box of the structure: positions of a coarse one
/// are means, and stay within.
json add_level(Container& container, std::size_t id, const TriangleMesh& mesh, const Box& box) {
    const QuantisedMesh numbers = quantised(mesh, box);
    const std::string place = fmt::format("structure{}/{}", id, mesh.triangles.size());
    return {{"facets", mesh.triangles.size()},
            {"positions", container.add<std::uint16_t>(place + "/positions", numbers.positions)},
            {"indices", container.add<std::uint32_t>(place + "/indices", numbers.indices)}};
}

std::size_t triangles(const ViewStructure& structure) {
    return structure.mesh ? structure.mesh->triangles.size() : 0;
}

json add_structure(Container& container, const ViewStructure& structure, std::size_t id,
                   const std::vector<std::size_t>& most_triangles) {
    json described = {{"id", id},
                      {"name", structure.name},
                      {"color", structure.color},
                      {"material", structure.material},
                      {"bit", structure.bit},
                      {"facets_most", triangles(structure)},
                      {"levels", json::array()}};
    if (triangles(structure) == 0) return described;
    const Box box = box_of(*structure.mesh);
    described["box_m"] = of(box);
    std::size_t last = 0;
    for (const std::size_t most : most_triangles) {
        const TriangleMesh mesh = coarse_mesh(*structure.mesh, most);
        if (mesh.triangles.size() > last)
            described["levels"].push_back(add_level(container, id, mesh, box));
        last = std::max(last, mesh.triangles.size());
    }
    return described;
}

/// Of so many triangles in all, what a structure gets of each level of `detail`.
std::vector<std::size_t> share_of(const ViewStructure& structure, std::size_t all,
                                  const ViewDetail& detail) {
    const double share = static_cast<double>(triangles(structure)) /
                         static_cast<double>(std::max<std::size_t>(all, 1));
    std::vector<std::size_t> most;
    most.reserve(detail.triangles.size());
    for (const std::size_t total : detail.triangles)
        most.push_back(std::max(kLeastTriangles,
                                static_cast<std::size_t>(share * static_cast<double>(total))));
    return most;
}

json add_structures(Container& container, const ViewDocument& document, const ViewDetail& detail) {
    std::size_t all = 0;
    for (const ViewStructure& structure : document.structures)
        all += triangles(structure);
    json structures = json::array();
    for (std::size_t id = 0; id < document.structures.size(); ++id) {
        const ViewStructure& structure = document.structures[id];
        structures.push_back(
            add_structure(container, structure, id, share_of(structure, all, detail)));
    }
    return structures;
}

/// Rows of the 4 x 4 matrix.
json of(const AffineTransform& transform) {
    const Mat3& m = transform.linear;
    const Vec3& o = transform.offset;
    return {m[0].x, m[1].x, m[2].x, o.x, m[0].y, m[1].y, m[2].y, o.y,
            m[0].z, m[1].z, m[2].z, o.z, 0.0,    0.0,    0.0,    1.0};
}

json choice_of(const ViewChoice& choice) {
    json said = {{"data", choice.data}, {"scene", choice.scene}};
    if (!choice.chosen.empty()) said["chosen"] = choice.chosen;
    if (!choice.iso) return said;
    said["range"] = choice.range;
    said["iso"] = *choice.iso;
    said["bounds"] = choice.bounds;
    said["histogram"] = choice.histogram;
    return said;
}

json add_volumes(Container& container, const ViewDocument& document) {
    json volumes = json::array();
    for (const SliceVoxels& volume : document.volumes)
        volumes.push_back({{"name", volume.name},
                           {"shape", volume.shape},
                           {"to_scene", of(volume.index_to_scene)},
                           {"voxels", container.add<std::uint8_t>(
                                          "volume/" + volume.name + "/voxels", volume.values)},
                           {"low", volume.low},
                           {"high", volume.high},
                           {"window", volume.window},
                           {"unit", ""}});
    return volumes;
}

json add_label_volumes(Container& container, const ViewDocument& document) {
    json volumes = json::array();
    for (const LabelSlices& volume : document.labels) {
        json labels = json::array();
        for (const SliceLabel& label : volume.labels)
            labels.push_back(
                {{"name", label.name}, {"color", label.color}, {"structure", label.structure}});
        volumes.push_back({{"name", volume.name},
                           {"shape", volume.shape},
                           {"to_scene", of(volume.index_to_scene)},
                           {"voxels", container.add<std::uint16_t>(
                                          "labels/" + volume.name + "/voxels", volume.values)},
                           {"labels", labels}});
    }
    return volumes;
}

json effects_of(const ViewDocument& document) {
    json effects = json::array();
    for (const ViewEffect& effect : document.effects)
        effects.push_back({{"id", effect.id},
                           {"name", effect.name},
                           {"kind", effect.kind},
                           {"parts", {{{"name", "strength"}, {"gain", 1.0}, {"most", 1.0}}}}});
    return effects;
}

json flags() {
    json flags = json::array();
    int bit = 0;
    for (const FrameFlagText& text : kFrameFlagTexts)
        flags.push_back({{"bit", bit++}, {"name", text.name}, {"remedy", text.meaning}});
    return flags;
}

/// Where to look: around all that is drawn, or the slices where nothing is.
json view_of(const ViewDocument& document) {
    Box box;
    for (const ViewStructure& structure : document.structures)
        if (triangles(structure) > 0) {
            const Box own = box_of(*structure.mesh);
            box.add(own.lower);
            box.add(own.upper);
        }
    if (box.empty() && document.choice) box = document.choice->bounds_m;
    const auto add_corners = [&box](const auto& volume) {
        for (int corner = 0; corner < 8; ++corner)
            box.add(volume.index_to_scene.point(Vec3((corner & 1) * volume.shape[0],
                                                     ((corner >> 1) & 1) * volume.shape[1],
                                                     (corner >> 2) * volume.shape[2])));
    };
    if (box.empty()) {
        std::ranges::for_each(document.volumes, add_corners);
        std::ranges::for_each(document.labels, add_corners);
    }
    constexpr double kAnyRadius_m = 0.1;
    if (box.empty()) return {{"center_m", of(Vec3(0.0))}, {"radius_m", kAnyRadius_m}};
    return {{"center_m", of(box.center())}, {"radius_m", 0.5 * glm::length(box.extent())}};
}

const char* name(SubStep::Kind kind) {
    switch (kind) {
    case SubStep::Kind::none:
        return "rests";
    case SubStep::Kind::look:
        return "looks again";
    case SubStep::Kind::chord:
        return "goes straight";
    case SubStep::Kind::slide:
        return "slides";
    case SubStep::Kind::settle:
        break;
    }
    return "ends the frame";
}

const char* name(ViewStop::By by) {
    switch (by) {
    case ViewStop::By::nothing:
        return "nothing";
    case ViewStop::By::contact:
        return "contact";
    case ViewStop::By::edge:
        return "edge";
    case ViewStop::By::certificate:
        return "certificate";
    case ViewStop::By::leash:
        break;
    }
    return "leash";
}

json planes_of(const ViewSubStep& step) {
    json planes = json::array();
    for (const ViewPlane& plane : step.planes)
        planes.push_back({{"at_m", of(plane.at)},
                          {"normal", of(plane.normal)},
                          {"strength_n", std::isfinite(plane.strength_n) ? json(plane.strength_n)
                                                                         : json(nullptr)},
                          {"structure", plane.structure},
                          {"active", plane.active}});
    return planes;
}

json leashes_of(const ViewSubStep& step) {
    json leashes = json::array();
    for (const ViewLeash& leash : step.leashes)
        leashes.push_back({{"structure", leash.structure},
                           {"guard_m", of(leash.guard)},
                           {"length_m", leash.length_m},
                           {"plane", leash.plane}});
    return leashes;
}

json friction_of(const ViewSubStep& step) {
    json friction = json::array();
    for (const ViewFriction& at : step.friction)
        friction.push_back({{"plane", at.plane},
                            {"apex_m", of(at.apex)},
                            {"axis", of(at.axis)},
                            {"coefficient", at.coefficient},
                            {"normal_n", at.normal_n},
                            {"most_n", at.most_n},
                            {"force_n", at.force_n},
                            {"holds", at.holds}});
    return friction;
}

json sub_step_of(const ViewSubStep& step) {
    json said = {{"kind", name(step.kind)},
                 {"proxy_m", of(step.from)},
                 {"candidate_m", of(step.candidate)},
                 {"wanted_m", of(step.wanted)},
                 {"to_m", of(step.to)},
                 {"pull_m", of(step.pull)},
                 {"stiffness_n_per_m", step.stiffness_n_per_m},
                 {"planes", planes_of(step)}};
    if (step.way.size() > 2) {
        json way = json::array();
        for (const Vec3& corner : step.way)
            way.push_back(of(corner));
        said["way_m"] = std::move(way);
    }
    if (step.stop.by != ViewStop::By::nothing)
        said["stop"] = {{"by", name(step.stop.by)},
                        {"structure", step.stop.structure},
                        {"at_m", of(step.stop.at)}};
    if (!step.leashes.empty()) said["leashes"] = leashes_of(step);
    if (!step.friction.empty()) said["friction"] = friction_of(step);
    return said;
}

/// The sub-steps of each frame, by its number.
json sub_steps_of(const ViewDocument& document) {
    json frames = json::object();
    for (const ViewFrameSteps& frame : document.sub_steps) {
        json steps = json::array();
        for (const ViewSubStep& step : frame.steps)
            steps.push_back(sub_step_of(step));
        frames[std::to_string(frame.frame)] = std::move(steps);
    }
    return frames;
}

/// One column of frames; `of` gives the numbers of one of them.
template <class Number, std::size_t kWidth, class Function>
std::string add_column(Container& container, const char* name, const ViewFrames& frames,
                       const Function& numbers_of) {
    std::vector<Number> column;
    column.reserve(kWidth * frames.frames.size());
    for (const FrameReport& frame : frames.frames)
        for (const auto number : numbers_of(frame))
            column.push_back(static_cast<Number>(number));
    return container.add<Number>(std::string("frames/") + name, column);
}

json add_frames(Container& container, const ViewFrames& frames) {
    const auto scalar = [&]<class Number>(const char* name, auto member, Number) {
        return add_column<Number, 1>(container, name, frames, [member](const FrameReport& frame) {
            return std::array{frame.*member};
        });
    };
    const auto vector = [&](const char* name, Vec3 FrameReport::*member) {
        return add_column<double, 3>(container, name, frames, [member](const FrameReport& frame) {
            const Vec3& v = frame.*member;
            return std::array{v.x, v.y, v.z};
        });
    };
    json columns;
    columns["time_s"] = scalar("time_s", &FrameReport::time_s, double{});
    columns["probe_m"] = vector("probe_m", &FrameReport::probe);
    columns["proxy_m"] = vector("proxy_m", &FrameReport::proxy);
    columns["force_n"] = vector("force_n", &FrameReport::force);
    columns["trial"] = scalar("trial", &FrameReport::trial, std::uint32_t{});
    columns["flags"] = scalar("flags", &FrameReport::flags, std::uint32_t{});
    columns["felt"] =
        add_column<std::uint32_t, 1>(container, "felt", frames, [](const FrameReport& frame) {
            constexpr std::uint32_t kOthers = 1U << kBitOfOthers;
            const auto own = static_cast<std::uint32_t>(frame.surfaces_felt) & ~kOthers;
            return std::array{own | (frame.surfaces_felt >> kBitOfOthers != 0 ? kOthers : 0U)};
        });
    columns["sub_steps"] = scalar("sub_steps", &FrameReport::sub_steps, std::uint32_t{});
    columns["spent_us"] = scalar("spent_us", &FrameReport::spent_us, float{});
    columns["late_us"] = scalar("late_us", &FrameReport::late_us, float{});
    if (presses_a_soft_surface(frames.frames)) {
        columns["indentation_m"] = scalar("indentation_m", &FrameReport::indentation_m, float{});
        columns["stiffness_n_per_m"] =
            scalar("stiffness_n_per_m", &FrameReport::stiffness_n_per_m, float{});
        columns["pressed"] = add_column<std::uint32_t, 1>(
            container, "pressed", frames, [](const FrameReport& frame) {
                return std::array{frame.indentation_m > 0.0 ? frame.pressed_surface + 1 : 0U};
            });
        columns["front_m"] =
            add_column<double, 3>(container, "front_m", frames, [](const FrameReport& frame) {
                const Vec3& v = place_on_surface(frame);
                return std::array{v.x, v.y, v.z};
            });
    }
    return {{"first", frames.first},
            {"count", frames.frames.size()},
            {"lost", frames.lost},
            {"columns", columns}};
}

} // namespace

std::string scene_message(const ViewDocument& document, const ViewDetail& detail,
                          const ViewFrames* frames) {
    Container container("scene");
    json& said = container.document;
    said["title"] = document.title;
    said["mode"] = name(document.mode);
    said["program"] = std::string("palpate ") + kVersion;
    said["rate_hz"] = document.rate_hz;
    said["method"] = document.method;
    said["device"] = document.device;
    said["force_limit_n"] = document.force_limit_n;
    said["axes"] = "LPS";
    said["unit"] = "m";
    said["structures"] = add_structures(container, document, detail);
    said["volumes"] = add_volumes(container, document);
    if (!document.labels.empty()) said["label_volumes"] = add_label_volumes(container, document);
    said["effects"] = effects_of(document);
    said["flags"] = flags();
    said["probe"] = {{"radius_m", 0.0}};
    said["view"] = view_of(document);
    said["marks"] = internal::marks_for_page(document.marks);
    if (!document.sub_steps.empty()) said["details"] = sub_steps_of(document);
    if (document.choice) said["choice"] = choice_of(*document.choice);
    if (frames != nullptr) {
        said["frames"] = add_frames(container, *frames);
        // A recorder that could not keep up has left some out: their numbers are no row.
        const auto& all = frames->frames;
        if (!all.empty() && all.back().frame - all.front().frame + 1 != all.size()) {
            const std::string numbers = add_column<std::uint32_t, 1>(
                container, "number", *frames,
                [](const FrameReport& frame) { return std::array{frame.frame}; });
            said["frames"]["columns"]["number"] = numbers;
        }
    }
    return container.bytes();
}

std::string frames_message(const ViewFrames& frames) {
    Container container("frames");
    container.document["frames"] = add_frames(container, frames);
    return container.bytes();
}

std::string mesh_message(const ViewDocument& document, std::size_t id, std::size_t most_triangles) {
    if (id >= document.structures.size() || triangles(document.structures[id]) == 0)
        throw std::invalid_argument(
            fmt::format("structure {} has no mesh; ask for one of those in the scene's list", id));
    Container container("mesh");
    container.document["structures"] =
        json::array({add_structure(container, document.structures[id], id, {most_triangles})});
    return container.bytes();
}

std::string chosen_message(const std::map<std::size_t, ViewStructure>& structures,
                           const ViewDetail& detail, std::optional<view_commands::Iso> iso) {
    std::size_t all = 0;
    for (const auto& [id, structure] : structures)
        all += triangles(structure);
    Container container("mesh");
    json& said = container.document;
    said["chosen"] = json::array();
    for (const auto& [id, structure] : structures)
        said["chosen"].push_back(
            add_structure(container, structure, id, share_of(structure, all, detail)));
    if (iso) said["iso"] = {{"value", iso->value}, {"fine", iso->is_fine}};
    return container.bytes();
}

} // namespace palpate
