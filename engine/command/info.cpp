// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/command/command.h>
#include <palpate/engine/recording.h>
#include <palpate/engine/scene_file.h>
#include <palpate/geometry/mesh_file.h>
#include <palpate/volume/volume_file.h>

namespace palpate::command {
namespace {

using nlohmann::json;

json as_json(const Vec3& v, double scale) { return {scale * v.x, scale * v.y, scale * v.z}; }

json volume_info(const std::string& file, std::string& words) {
    const VoxelVolume volume = read_volume(file);
    const auto [low, high] = value_range(volume);
    const Vec3 spacing_mm = 1e3 * volume.spacing_m();
    json directions = json::array();
    for (int row = 0; row < 3; ++row) {
        json line = json::array();
        for (int column = 0; column < 3; ++column)
            line.push_back(volume.index_to_scene.linear[column][row] / (1e-3 * spacing_mm[column]));
        directions.push_back(line);
    }
    words = fmt::format("volume of {} x {} x {} voxels of {:.4g} x {:.4g} x {:.4g} mm, {}, values "
                        "{:.6g} to {:.6g}\n{}\n",
                        volume.size[0], volume.size[1], volume.size[2], spacing_mm.x, spacing_mm.y,
                        spacing_mm.z, volume.source_type, low, high, orientation_in_words(volume));
    for (const std::string& warning : volume.warnings)
        words += "warning: " + warning + "\n";
    return {{"kind", "volume"},
            {"size", volume.size},
            {"spacing_mm", as_json(spacing_mm, 1.0)},
            {"origin_mm", as_json(volume.index_to_scene.offset, 1e3)},
            {"directions", directions},
            {"range", {low, high}},
            {"type", volume.source_type},
            {"orientation", orientation_in_words(volume)},
            {"warnings", volume.warnings}};
}

json mesh_info(const std::string& file, std::string& words) {
    const MeshReport report = inspect(read_ply(file));
    words = fmt::format(
        "mesh of {} vertices and {} triangles in {} components, {}, {}, {} degenerate triangles\n"
        "bounds {:.3f} {:.3f} {:.3f} to {:.3f} {:.3f} {:.3f} mm (LPS), area {:.1f} mm2, smallest "
        "angle {:.1f} "
        "degrees, normals {}\n",
        report.vertices, report.triangles, report.components.size(),
        report.closed() ? "closed" : "not closed",
        report.manifold() ? "2-manifold" : "not manifold", report.degenerate,
        1e3 * report.bounds.lower.x, 1e3 * report.bounds.lower.y, 1e3 * report.bounds.lower.z,
        1e3 * report.bounds.upper.x, 1e3 * report.bounds.upper.y, 1e3 * report.bounds.upper.z,
        1e6 * report.area_m2, report.smallest_angle_deg,
        report.volume_m3 >= 0.0 ? "outwards" : "inwards");
    return {{"kind", "mesh"},
            {"vertices", report.vertices},
            {"triangles", report.triangles},
            {"components", report.components.size()},
            {"bounds_mm", {as_json(report.bounds.lower, 1e3), as_json(report.bounds.upper, 1e3)}},
            {"closed", report.closed()},
            {"manifold", report.manifold()},
            {"degenerate", report.degenerate},
            {"smallest_angle_deg", report.smallest_angle_deg},
            {"area_mm2", 1e6 * report.area_m2}};
}

json scene_info(const std::string& file, std::string& words) {
    const SceneDescription scene = read_scene(file);
    json volumes = json::array();
    for (const auto& [name, volume] : scene.volumes)
        volumes.push_back(name);
    json surfaces = json::array();
    for (const auto& [name, surface] : scene.surfaces)
        surfaces.push_back(name);
    json effects = json::array();
    for (const EffectDescription& effect : scene.effects)
        effects.push_back(name(effect.kind));
    words = fmt::format("scene: volumes {}, surfaces {}, effects {}, method {} at {} Hz\n",
                        volumes.dump(), surfaces.dump(), effects.dump(), name(scene.loop.method),
                        scene.loop.rate_hz);
    return {{"kind", "scene"},
            {"volumes", volumes},
            {"surfaces", surfaces},
            {"effects", effects},
            {"method", name(scene.loop.method)},
            {"rate_hz", scene.loop.rate_hz}};
}

json recording_info(const std::string& file, std::string& words) {
    const Recording recording = read_recording(file);
    const auto in_contact =
        std::count_if(recording.frames.begin(), recording.frames.end(),
                      [](const FrameReport& frame) { return frame.contacts > 0; });
    json sources = json::array();
    for (const RecordedSource& source : recording.sources)
        sources.push_back({{"file", source.file}, {"sha256", source.sha256}});
    words =
        fmt::format("recording of {} frames, {} in contact, of {} by palpate {}\n",
                    recording.frames.size(), in_contact, recording.scene_file, recording.version);
    return {{"kind", "recording"},
            {"frames", recording.frames.size()},
            {"frames_in_contact", in_contact},
            {"scene", recording.scene_file},
            {"version", recording.version},
            {"sources", sources}};
}

int info(const std::string& file, bool as_document) {
    const std::filesystem::path path(file);
    std::string words;
    json document;
    if (path.extension() == ".ply")
        document = mesh_info(file, words);
    else if (path.extension() == ".toml")
        document = scene_info(file, words);
    else if (path.extension() == ".h5")
        document = recording_info(file, words);
    else
        document = volume_info(file, words);
    print(as_document ? document.dump(2) : fmt::format("{}: {}", file, words));
    return kDone;
}

} // namespace

void add_info(CLI::App& app, Run& run) {
    struct Options {
        std::string file;
        bool json = false;
    };
    const auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand(
        "info", "size, spacing, orientation in words, range of a volume, mesh, scene or recording");
    command->add_option("FILE", options->file, "NRRD, NIfTI, .vdb; .ply; .toml; .h5")->required();
    command->add_flag("--json", options->json, "as JSON");
    command->callback(
        [options, &run] { run = [options] { return info(options->file, options->json); }; });
}

} // namespace palpate::command
