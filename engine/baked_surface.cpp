// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/baked_surface.h>

#include <algorithm>
#include <map>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/recording.h>
#include <palpate/engine/scene.h>
#include <palpate/geometry/mesh_file.h>
#include <palpate/geometry/surface_seeds.h>
#include <palpate/volume/volume_file.h>

namespace palpate {
namespace {

// Raised whenever the same inputs would bake or mesh differently: old cache files are then no
// longer found.
constexpr int kCacheVersion = 1;
// The continuous gradient's stencil needs two voxels of background (contact.md 1.1).
constexpr int kPadding = 2;

void report(const Progress& progress, double fraction, std::string_view what) {
    if (progress && !progress(fraction, what)) throw std::runtime_error("cancelled");
}

std::string where(const SceneDescription& scene, const std::string& surface) {
    const int line = scene.surfaces.at(surface).line;
    if (line == 0) return scene.file.string(); // made from options, not from a scene file
    return fmt::format("{}:{}: [surface.{}]", scene.file.string(), line, surface);
}

std::string policy_text(const ComponentPolicy& keep) {
    return fmt::format("{}/{}/{:a}", static_cast<int>(keep.kind), keep.count, keep.volume_mm3);
}

/// Hash of the voxels as they were decoded, whatever container they came in, and of every setting.
std::string bake_key(const VoxelVolume& volume, const SurfaceDescription& surface) {
    std::string text = fmt::format("palpate bake {}\n{} {} {}\n", kCacheVersion, volume.size[0],
                                   volume.size[1], volume.size[2]);
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row)
            text += fmt::format("{:a} ", volume.index_to_scene.linear[column][row]);
    for (int row = 0; row < 3; ++row)
        text += fmt::format("{:a} ", volume.index_to_scene.offset[row]);
    text += fmt::format("\n{:a} {:a} {} {}\n", surface.iso_value, surface.smooth_voxels,
                        static_cast<int>(surface.iso_after_smoothing), policy_text(surface.keep));
    const std::string_view voxels(reinterpret_cast<const char*>(volume.values.data()),
                                  volume.values.size() * sizeof(float));
    return sha256_of_text(text + sha256_of_text(voxels));
}

nlohmann::json to_json(const BakedSurface& baked) {
    nlohmann::json components = nlohmann::json::array();
    for (const VolumeComponent& component : baked.components)
        components.push_back(
            {{"voxels", component.voxels},
             {"volume_mm3", component.volume_mm3},
             {"kept", component.kept},
             {"sample_m", {component.sample.x, component.sample.y, component.sample.z}}});
    return {{"level", baked.level},
            {"shift_mean_m", baked.shift.mean_m},
            {"shift_deviation_m", baked.shift.deviation_m},
            {"shift_points", baked.shift.points},
            {"components", components}};
}

void from_json(const nlohmann::json& json, BakedSurface& baked) {
    baked.level = json.at("level");
    baked.shift = {json.at("shift_mean_m"), json.at("shift_deviation_m"), json.at("shift_points")};
    for (const nlohmann::json& one : json.at("components")) {
        const nlohmann::json& at = one.at("sample_m");
        baked.components.push_back({one.at("voxels"), one.at("volume_mm3"), one.at("kept"),
                                    Vec3{at.at(0), at.at(1), at.at(2)}});
    }
}

/// What an earlier run baked under this key; false where there is nothing usable, which is then
/// baked again.
bool read_cached(const std::filesystem::path& file, BakedSurface& baked) {
    if (!std::filesystem::exists(file)) return false;
    try {
        std::map<std::string, std::string> metadata;
        std::shared_ptr<const GridField> grid = GridField::read_vdb(file, metadata);
        from_json(nlohmann::json::parse(metadata.at("palpate_baked")), baked);
        baked.grid = grid;
        baked.field = grid;
        baked.from_cache = true;
        return true;
    } catch (const std::exception&) {
        return false;
    }
}

void require_level_in_range(const VoxelVolume& volume, double level, const std::string& place) {
    const auto [low, high] = value_range(volume);
    if (level > low && level <= high) return;
    throw std::runtime_error(
        fmt::format("{}: iso_value {} is reached by no voxel; choose one above {} and up to {}",
                    place, level, low, high));
}

BakedSurface bake_grid(const VoxelVolume& original, const SurfaceDescription& surface,
                       const std::string& place, const Progress& progress) {
    const auto [low, high] = value_range(original);
    const float background = static_cast<float>(low);
    VoxelVolume baking = padded(original, kPadding, background);
    BakedSurface baked;
    baked.level = surface.iso_value;
    if (surface.smooth_voxels > 0.0) {
        report(progress, 0.1, "smoothing");
        const VoxelVolume before = baking;
        smooth(baking, surface.smooth_voxels);
        report(progress, 0.4, "choosing the level again");
        if (surface.iso_after_smoothing == SurfaceDescription::IsoAfterSmoothing::keep_position)
            baked.level = level_keeping_position(before, surface.iso_value, baking);
        require_level_in_range(baking, baked.level, place);
        baked.shift = surface_shift(before, surface.iso_value, baking, baked.level);
    }
    report(progress, 0.7, "finding components");
    const double margin = 1e-3 * (high - low); // as 1 HU of about 4000
    baked.components = remove_components(baking, baked.level, surface.keep, margin);
    if (std::none_of(baked.components.begin(), baked.components.end(),
                     [](const VolumeComponent& component) { return component.kept; }))
        throw std::runtime_error(place +
                                 ": keep leaves no component; lower the volume that it asks for");
    report(progress, 0.9, "building the grid");
    baked.grid = std::make_shared<GridField>(baking, background);
    baked.field = baked.grid;
    return baked;
}

} // namespace

BakedSurface bake_surface(const SceneDescription& scene, const std::string& surface,
                          const std::filesystem::path& cache, const Progress& progress) {
    const SurfaceDescription& description = scene.surfaces.at(surface);
    const VolumeDescription& source = scene.volumes.at(description.volume);
    if (source.file.empty()) {
        BakedSurface baked;
        baked.field = make_analytic_field(scene, description.volume);
        baked.level = description.iso_value;
        return baked;
    }

    report(progress, 0.0, "reading " + source.file.filename().string());
    const VoxelVolume volume = read_volume(source.file);
    require_level_in_range(volume, description.iso_value, where(scene, surface));
    const std::string key = bake_key(volume, description);
    const std::filesystem::path file = cache / (key.substr(0, 32) + ".vdb");
    BakedSurface baked;
    if (cache.empty() || !read_cached(file, baked)) {
        baked = bake_grid(volume, description, where(scene, surface), progress);
        if (!cache.empty()) {
            std::filesystem::create_directories(cache);
            baked.grid->write_vdb(file, {{"palpate_baked", to_json(baked).dump()}});
        }
    }
    baked.key = key;
    report(progress, 1.0, "field ready");
    return baked;
}

BakedMesh mesh_surface(const BakedSurface& surface, const IsosurfaceSettings& settings,
                       const IsosurfaceExtractor& extract, const std::filesystem::path& cache,
                       const Progress& progress) {
    if (!surface.grid)
        throw std::runtime_error(
            "a surface given by a formula is not meshed; use contact = \"volume\"");
    const std::string key = sha256_of_text(fmt::format(
        "palpate mesh {} {} {:a} {:a} {:a} {:a}", kCacheVersion, surface.key, surface.level,
        settings.facet_angle_deg, settings.facet_size_m, settings.facet_distance_m));
    const std::filesystem::path file = cache / (key.substr(0, 32) + ".ply");
    BakedMesh result;
    if (!cache.empty() && std::filesystem::exists(file)) {
        result.mesh = std::make_shared<TriangleMesh>(read_ply(file));
        result.from_cache = true;
    } else {
        if (!extract)
            throw std::runtime_error("this build has no CGAL to extract a mesh with; use contact = "
                                     "\"volume\", or build with it");
        report(progress, 0.0, "extracting");
        const std::unique_ptr<FieldSampler> sampler = surface.field->make_sampler();
        Isosurface wanted;
        wanted.value = [&sampler, level = surface.level](const Vec3& p) {
            return sampler->value(p) - level;
        };
        wanted.bounds = surface.field->bounds();
        wanted.seeds = choose_seeds(surface.grid->preview(surface.level), settings.facet_size_m,
                                    kSmallestComponentTriangles);
        result.mesh = std::make_shared<TriangleMesh>(extract(wanted, settings, progress));
        if (!cache.empty()) {
            std::filesystem::create_directories(cache);
            write_ply(*result.mesh, file, {"palpate mesh " + key});
            // Millimetres and back round: the first run takes the same bits as every later one.
            result.mesh = std::make_shared<TriangleMesh>(read_ply(file));
        }
    }
    return result;
}

} // namespace palpate
