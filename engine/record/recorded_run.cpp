// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/record/recorded_run.h>

#include <cstdint>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>

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

} // namespace

std::vector<RecordedSource> sources(const Scene& scene) {
    std::vector<RecordedSource> result;
    // The baked key hashes the voxels as they were decoded, wherever the file keeps them.
    for (const SceneSurface& surface : scene.surfaces())
        if (surface.baked.grid) result.push_back({kFieldSource + surface.name, surface.baked.key});
    for (const auto& [name, volume] : scene.description().volumes)
        if (!volume.file.empty() && scene.effect_bounds(name))
            for (const std::filesystem::path& file : source_files(volume.file))
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
    recording.scene_file = std::filesystem::absolute(scene.description().file).string();
    recording.scene_text = scene.description().text;
    recording.overrides = to_json(overrides);
    recording.sources = sources(scene);
    recording.felt_names = felt_names(scene);
    return recording;
}

std::shared_ptr<const Scene> recorded_scene(const Recording& recording,
                                            const std::filesystem::path& file,
                                            const SceneResources& resources) {
    for (const FrameReport& frame : recording.frames)
        if (frame.flags & kLiveGain)
            throw std::runtime_error(fmt::format(
                "{}: frame {} had an effect whose gain was changed while the loop ran, which a "
                "recording does not keep; replay one that was made with all gains at 1",
                file.string(), frame.frame));
    for (std::size_t i = 0; i < recording.frames.size(); ++i)
        if (recording.frames[i].frame != i)
            throw std::runtime_error(fmt::format(
                "{}: frame {} is missing, as the recorder could not keep up with the loop; record "
                "again with less else to do for this machine",
                file.string(), i));
    require_consistent(recording, file);
    SceneDescription description = parse_scene(recording.scene_text, recording.scene_file);
    apply(overrides_from_json(recording.overrides), description);
    auto scene = std::make_shared<const Scene>(std::move(description), resources);
    const std::vector<RecordedSource> now = sources(*scene);
    for (std::size_t i = 0; i < recording.sources.size(); ++i) {
        if (i >= now.size() || now[i].sha256 == recording.sources[i].sha256) continue;
        throw std::runtime_error(fmt::format(
            "{}: {} is not what it was when this was recorded; bring back the one with SHA-256 {}",
            file.string(), recording.sources[i].file, recording.sources[i].sha256));
    }
    if (now.size() != recording.sources.size())
        throw std::runtime_error(fmt::format(
            "{}: was recorded with {} sources, and the scene has {} now, as it names no contact "
            "and "
            "builds with and without CGAL choose different ones; replay it with the build that it "
            "was recorded with",
            file.string(), recording.sources.size(), now.size()));
    return scene;
}

} // namespace palpate
