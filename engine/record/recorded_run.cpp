// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/record/recorded_run.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/files/data_hash.h>
#include <palpate/engine/files/sha256.h>
#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/version.h>
#include <palpate/volume/formats/volume_sources.h>

namespace palpate {
namespace {

constexpr const char* kFieldSource = "volume and settings of surface ";
constexpr const char* kMeshSource = "mesh of surface ";

/// Hash of a mesh's own numbers, wherever it came from.
std::string mesh_hash(const TriangleMesh& mesh) {
    const std::string_view vertices(reinterpret_cast<const char*>(mesh.vertices.data()),
                                    mesh.vertices.size() * sizeof(Vec3));
    const std::string_view triangles(reinterpret_cast<const char*>(mesh.triangles.data()),
                                     mesh.triangles.size() * sizeof(mesh.triangles[0]));
    return sha256_of_text(sha256_of_text(vertices) + sha256_of_text(triangles));
}

/// Whether a surface that is felt, or an effect, uses a volume.
bool uses_volume(const Scene& scene, const std::string& volume) {
    if (scene.effect_bounds(volume)) return true;
    return std::any_of(scene.surfaces().begin(), scene.surfaces().end(), [&](const auto& surface) {
        return scene.description().surfaces.at(surface.name).volume == volume;
    });
}

bool is_made_in_code(const SceneDescription& scene) {
    return scene.text.empty() ||
           std::any_of(scene.volumes.begin(), scene.volumes.end(),
                       [](const auto& volume) { return is_in_memory(volume.second); }) ||
           std::any_of(scene.surfaces.begin(), scene.surfaces.end(),
                       [](const auto& surface) { return surface.second.triangle_mesh != nullptr; });
}

/// A recording that another program edited may not be one run any more.
void require_consistent(const Recording& recording, const std::filesystem::path& file) {
    std::uint64_t evaluations = 0;
    for (const FrameReport& frame : recording.frames)
        evaluations += frame.evaluations;
    const std::size_t decisions = recording.steps_left.size();
    if (recording.frames.size() == recording.inputs.size() &&
        (decisions == 0 || decisions == evaluations))
        return;
    throw std::runtime_error(file.string() +
                             ": its inputs, frames and clock do not belong together; record again");
}

/// Refuses recordings that are not of one run from its beginning.
void require_replayable(const Recording& recording, const std::filesystem::path& file) {
    struct NotKept {
        FrameFlag flag;
        const char* what;
        const char* remedy;
    };
    constexpr std::array<NotKept, 3> not_kept{{
        {kLiveGain, "had an effect whose gain was changed while the loop ran",
         "replay one that was made with all gains at 1"},
        {kBodyMoved, "had a body that was moved while the loop ran",
         "replay one that was made with all bodies where the scene has them"},
        {kSceneAdopted, "felt another scene than the frames before",
         "replay one that was made with one scene"},
    }};
    for (const FrameReport& frame : recording.frames)
        for (const NotKept& one : not_kept)
            if (frame.flags & one.flag)
                throw std::runtime_error(
                    fmt::format("{}: frame {} {}, which a recording does not keep; {}",
                                file.string(), frame.frame, one.what, one.remedy));
    for (std::size_t i = 0; i < recording.frames.size(); ++i)
        if (recording.frames[i].frame != i)
            throw std::runtime_error(fmt::format(
                "{}: frame {} is missing, as the recorder could not keep up with the loop; record "
                "again with less else to do for this machine",
                file.string(), i));
    require_consistent(recording, file);
}

/// Refuses a scene that is not of what was recorded.
void require_same_sources(const Recording& recording, const std::filesystem::path& file,
                          const Scene& scene) {
    const std::vector<RecordedSource> now = sources(scene);
    for (std::size_t i = 0; i < recording.sources.size(); ++i) {
        if (i >= now.size() || now[i].sha256 == recording.sources[i].sha256) continue;
        throw std::runtime_error(fmt::format(
            "{}: {} is not what it was when this was recorded; bring back the one with SHA-256 {} "
            "(this one has {})",
            file.string(), recording.sources[i].file, recording.sources[i].sha256, now[i].sha256));
    }
    if (now.size() != recording.sources.size())
        throw std::runtime_error(fmt::format(
            "{}: was recorded with {} sources, and this scene has {}: it is another scene, or one "
            "that names no contact, for which builds with and without CGAL choose different ones; "
            "give the scene and the build that it was recorded with",
            file.string(), recording.sources.size(), now.size()));
}

/// The scene as the hand of a recording has it; the scene itself where it has one device.
std::shared_ptr<const Scene> as_felt_by(const Recording& recording,
                                        const std::filesystem::path& file,
                                        const std::shared_ptr<const Scene>& scene) {
    if (recording.hand.empty()) return scene;
    try {
        return scene->of_hand(recording.hand);
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(fmt::format("{}: {}", file.string(), error.what()));
    }
}

bool same_bits(double a, double b) {
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

bool same_bits(const Vec3& a, const Vec3& b) {
    return same_bits(a.x, b.x) && same_bits(a.y, b.y) && same_bits(a.z, b.z);
}

/// Everything that frames.csv says; what is felt only where the recording has it.
bool same_frame(const FrameReport& a, const FrameReport& b, bool felt_is_recorded) {
    return (!felt_is_recorded || a.surfaces_felt == b.surfaces_felt) && a.frame == b.frame &&
           a.trial == b.trial && same_bits(a.time_s, b.time_s) && same_bits(a.probe, b.probe) &&
           same_bits(a.proxy, b.proxy) && same_bits(a.force, b.force) &&
           a.sub_steps == b.sub_steps && a.evaluations == b.evaluations &&
           a.contacts == b.contacts && same_bits(a.residual_m, b.residual_m) &&
           a.flags == b.flags && same_bits(a.indentation_m, b.indentation_m) &&
           (!(a.indentation_m > 0.0) ||
            (same_bits(a.stiffness_n_per_m, b.stiffness_n_per_m) && same_bits(a.front, b.front) &&
             a.pressed_surface == b.pressed_surface));
}

/// The touches of one frame: `rows` begins with them, and has them no more afterwards.
std::span<const RecordedTouch> take_touches(std::span<const RecordedTouch>& rows,
                                            std::uint64_t frame) {
    std::size_t count = 0;
    while (count < rows.size() && rows[count].frame == frame)
        ++count;
    const auto taken = rows.first(count);
    rows = rows.subspan(count);
    return taken;
}

} // namespace

std::vector<RecordedSource> sources(const Scene& scene) {
    std::vector<RecordedSource> result;
    // First: where data in memory differs, what was made of it does, too.
    for (const auto& [name, volume] : scene.description().volumes)
        if (is_in_memory(volume) && uses_volume(scene, name))
            result.push_back({data_in_words(name, volume), sha256_of_data(volume)});
    // The baked key hashes the voxels as they were decoded, wherever the file keeps them.
    for (const SceneSurface& surface : scene.surfaces())
        if (surface.baked.grid) result.push_back({kFieldSource + surface.name, surface.baked.key});
    for (const auto& [name, volume] : scene.description().volumes)
        if (!volume.file.empty() && scene.effect_bounds(name))
            for (const std::filesystem::path& file : source_files(volume.file, volume.selection))
                result.push_back({std::filesystem::absolute(file).string(), sha256_of_file(file)});
    for (const PlannedEffect& planned : scene.plan().effects) {
        const std::filesystem::path& file = file_of(scene.description().effects[planned.effect]);
        if (planned.on && !file.empty())
            result.push_back({std::filesystem::absolute(file).string(), sha256_of_file(file)});
    }
    for (const SceneSurface& surface : scene.surfaces())
        if (surface.mesh.scene)
            result.push_back({kMeshSource + surface.name, mesh_hash(surface.mesh.scene->mesh())});
    return result;
}

Recording recorded(const Scene& scene, const SceneOverrides& overrides, const Trace& trace) {
    const Run& run = trace; // a recording has no audits
    Recording recording;
    static_cast<Run&>(recording) = run;
    recording.version = kVersion;
    const std::filesystem::path& file = scene.description().file;
    if (!file.empty()) recording.scene_file = std::filesystem::absolute(file).string();
    if (!is_made_in_code(scene.description())) recording.scene_text = scene.description().text;
    recording.overrides = to_json(overrides);
    if (!overrides.hand) recording.hand = scene.description().device.name;
    recording.sources = sources(scene);
    recording.felt_names = felt_names(scene);
    return recording;
}

std::vector<std::shared_ptr<const Scene>> recorded_scenes(std::span<const Recording> hands,
                                                          const std::filesystem::path& file,
                                                          const SceneResources& resources) {
    for (const Recording& hand : hands)
        require_replayable(hand, file);
    if (hands.empty()) return {};
    const Recording& first = hands.front(); // all have the same scene
    if (first.scene_text.empty())
        throw std::runtime_error(
            fmt::format("{}: a program made its scene, or gave it data in memory, which a "
                        "recording does not keep; replay it in that program, with the "
                        "recorded_scene() that takes a description",
                        file.string()));
    SceneDescription description = parse_scene(first.scene_text, first.scene_file);
    apply(overrides_from_json(first.overrides), description);
    const auto scene = std::make_shared<const Scene>(std::move(description), resources);
    require_same_sources(first, file, *scene);
    std::vector<std::shared_ptr<const Scene>> scenes;
    scenes.reserve(hands.size());
    for (const Recording& hand : hands)
        scenes.push_back(as_felt_by(hand, file, scene));
    return scenes;
}

std::shared_ptr<const Scene> recorded_scene(const Recording& recording,
                                            const std::filesystem::path& file,
                                            const SceneResources& resources) {
    return recorded_scenes({&recording, 1}, file, resources).front();
}

std::shared_ptr<const Scene> recorded_scene(const Recording& recording,
                                            const std::filesystem::path& file,
                                            SceneDescription scene,
                                            const SceneResources& resources) {
    require_replayable(recording, file);
    const auto made = std::make_shared<const Scene>(std::move(scene), resources);
    require_same_sources(recording, file, *made);
    return as_felt_by(recording, file, made);
}

RunDifference difference(const Recording& recording, const Run& again) {
    const bool felt_is_recorded = !recording.felt_names.empty();
    std::span<const RecordedTouch> now = again.touches, then = recording.touches;
    if (then.empty()) now = {}; // as of a version of the format that had none
    RunDifference result;
    for (std::size_t i = 0; i < again.frames.size(); ++i) {
        const auto touches = take_touches(now, i), recorded = take_touches(then, i);
        if (std::equal(touches.begin(), touches.end(), recorded.begin(), recorded.end()) &&
            same_frame(again.frames[i], recording.frames[i], felt_is_recorded))
            continue;
        ++result.frames;
        if (!result.first) result.first = i;
    }
    return result;
}

} // namespace palpate
