// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/baking/baking.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/baking/in_words.h>
#include <palpate/engine/baking/internal/baked_field.h>
#include <palpate/engine/baking/internal/baked_report.h>
#include <palpate/engine/baking/internal/baked_stiffness.h>
#include <palpate/engine/files/data_hash.h>
#include <palpate/engine/files/sha256.h>
#include <palpate/engine/scene/internal/progress.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_place.h>
#include <palpate/geometry/formats/mesh_file.h>
#include <palpate/geometry/surface_seeds.h>
#include <palpate/volume/formats/label_file.h>
#include <palpate/volume/formats/volume_sources.h>

namespace palpate {
namespace {

// Raised whenever the same inputs would bake or mesh differently: old cache files are then no
// longer found.
constexpr int kCacheVersion = 6;

std::string policy_text(const ComponentPolicy& keep) {
    return fmt::format("{}/{}/{:a}", static_cast<int>(keep.kind), keep.count, keep.volume_mm3);
}

std::string region_text(const std::optional<Box>& region_mm) {
    if (!region_mm) return "all";
    std::string text;
    for (const Vec3& corner : {region_mm->lower, region_mm->upper})
        text += fmt::format("{:a} {:a} {:a} ", corner.x, corner.y, corner.z);
    return text;
}

/// A line of each file that a volume is read from: its hash. Slices of a folder are in any order.
/// Of a header's several files the names count too: with their contents swapped they are another
/// volume.
void add_hashes(const std::filesystem::path& file, std::vector<std::string>& hashes) {
    const std::vector<std::filesystem::path> files = source_files(file, {});
    const bool named = files.size() > 2 && !std::filesystem::is_directory(file);
    for (const std::filesystem::path& source : files) {
        std::string name;
        if (named) name = " " + source.lexically_relative(file.parent_path()).generic_string();
        if (std::filesystem::exists(source)) hashes.push_back(sha256_of_file(source) + name);
    }
}

/// Hash of what a volume is read from and of how it is read; where a file lies does not matter.
std::string source_key(const VolumeDescription& volume) {
    if (is_in_memory(volume)) return sha256_of_data(volume);
    std::vector<std::string> hashes;
    add_hashes(volume.file, hashes);
    if (!volume.selection.reference.empty()) add_hashes(volume.selection.reference, hashes);
    std::sort(hashes.begin(), hashes.end());
    std::string text = fmt::format("{} {} {} {}\n", volume.selection.series, volume.selection.grid,
                                   static_cast<int>(volume.selection.slices),
                                   static_cast<int>(volume.selection.nifti_transform));
    for (const std::string& hash : hashes)
        text += hash + "\n";
    return sha256_of_text(text);
}

/// The file that names a volume's labels; empty where there is none, or they are in memory.
std::filesystem::path name_table_of(const VolumeDescription& volume) {
    if (!volume.labels.empty() || volume.file.empty()) return volume.labels;
    return find_name_table(volume.file);
}

/// The hash of everything that decides on a baked field.
std::string bake_key(const std::string& source, const VolumeDescription& volume,
                     const SurfaceDescription& surface, const std::vector<std::string>& alike) {
    std::string text = fmt::format("palpate bake {}\n{}\n{:a} {:a} {} {} {}\n", kCacheVersion,
                                   source, surface.iso_value, smoothing_of(surface),
                                   static_cast<int>(iso_rule_of(surface)),
                                   policy_text(surface.keep), region_text(surface.region_mm));
    if (surface.labels.empty()) {
        // It decides whether the level is refused, so what was kept without it is not taken.
        const internal::LabelMark mark = internal::label_mark(volume.file);
        if (mark != internal::LabelMark::none)
            text += fmt::format("label mark {}\n", static_cast<int>(mark));
    } else {
        const std::filesystem::path table = name_table_of(volume);
        if (!table.empty()) text += sha256_of_file(table) + "\n";
        for (const std::string& label : surface.labels)
            text += fmt::format("{} {}\n", label.size(), label);
        for (const std::string& label : alike)
            text += fmt::format("beside {} {}\n", label.size(), label);
    }
    return sha256_of_text(text);
}

/// What an earlier run baked under this name; false where there is nothing usable, which is then
/// baked again.
bool read_cached(const ResultCache& cache, const std::string& name, BakedSurface& baked) {
    const auto file = cache.find(name);
    if (!file) return false;
    try {
        std::map<std::string, std::string> metadata;
        std::shared_ptr<const GridField> grid = GridField::read_vdb(*file, metadata);
        baked = internal::baked_from_json(metadata.at("palpate_baked"));
        baked.grid = grid;
        baked.field = grid;
        baked.from_cache = true;
        return true;
    } catch (const std::exception&) {
        return false;
    }
}

/// The mesh of an earlier run, or null where there is none that can be read.
std::shared_ptr<const TriangleMesh> cached_mesh(const ResultCache& cache, const std::string& name) {
    const auto file = cache.find(name);
    if (!file) return nullptr;
    try {
        return std::make_shared<TriangleMesh>(read_ply(*file));
    } catch (const std::exception&) {
        return nullptr;
    }
}

/// Refuses what would fill the memory: CGAL's triangles take some 500 bytes each while it works.
void require_affordable(const TriangleMesh& preview, double facet_size_m) {
    constexpr double most_triangles = 5e6;
    double area_m2 = 0.0;
    for (const auto& t : preview.triangles) {
        const Vec3& a = preview.vertices[t[0]];
        area_m2 +=
            0.5 * glm::length(glm::cross(preview.vertices[t[1]] - a, preview.vertices[t[2]] - a));
    }
    // An equilateral triangle in a circle of that radius; most are smaller.
    const double triangles = area_m2 / (1.3 * facet_size_m * facet_size_m);
    if (triangles <= most_triangles) return;
    throw std::runtime_error(fmt::format(
        "a surface of {:.3g} mm2 would have some {:.2g} million facets of {:.3g} mm; give a larger "
        "facet_size_mm (--facet-size), or a smaller region_mm",
        1e6 * area_m2, 1e-6 * triangles, 1e3 * facet_size_m));
}

/// Millimetres and back round: the run that extracts a mesh takes the same bits as one that reads
/// it.
void round_as_written(TriangleMesh& mesh) {
    for (Vec3& vertex : mesh.vertices)
        for (int axis = 0; axis < 3; ++axis)
            vertex[axis] = (1e3 * vertex[axis]) / 1e3;
}

} // namespace

struct VolumeReader::Kept {
    std::string volume_name, labels_name;
    VoxelVolume volume;
    LabelVolume labels;
    std::map<std::string, std::string> keys;
};

namespace {

/// Reads a volume's files; what is wrong with them is also said of the scene's line that names
/// them.
template <class Read>
void read_for(const SceneDescription& scene, const std::string& name, const Read& read) {
    try {
        read();
    } catch (const std::runtime_error& error) {
        if (scene.volumes.at(name).line <= 0) throw; // the file says enough
        throw std::runtime_error(fmt::format("{}: {}", place_of_volume(scene, name), error.what()));
    }
}

/// The map of a soft surface over what lies beneath it, from the cache where it is there.
BakedStiffness stiffness_beneath(const SceneDescription& scene, const std::string& surface,
                                 const BakedSurface& baked, VolumeReader& reader,
                                 const ResultCache& cache, const Progress& progress) {
    const SurfaceDescription& description = scene.surfaces.at(surface);
    std::string text =
        fmt::format("palpate stiffness {}\n{}\n{:a} {:a}\n", kCacheVersion, baked.key,
                    description.contact_radius_mm, internal::steepest_allowed_per_m(scene));
    for (const auto& [label, ratio] : description.beneath)
        text += fmt::format("{} {} {:a}\n", label.size(), label, ratio);
    const std::string name = sha256_of_text(text).substr(0, 32) + ".vdb";
    if (const auto file = cache.find(name)) {
        try {
            return internal::read_stiffness(*file);
        } catch (const std::exception&) {
            // Of no use: made again below.
        }
    }
    internal::report(progress, 0.95, "mapping what lies beneath");
    BakedStiffness stiffness = internal::bake_stiffness(
        scene, surface, baked, reader.labels(description.volume), place_of_surface(scene, surface));
    if (stiffness.map)
        cache.keep(name, [&](const std::filesystem::path& file) {
            internal::write_stiffness(stiffness, file);
        });
    return stiffness;
}

} // namespace

VolumeReader::VolumeReader(const SceneDescription& scene)
    : scene_(scene), kept_(std::make_unique<Kept>()) {}
VolumeReader::~VolumeReader() = default;

const VoxelVolume& VolumeReader::volume(const std::string& name) {
    const VolumeDescription& source = scene_.volumes.at(name);
    if (source.voxels) return *source.voxels;
    if (kept_->volume_name == name) return kept_->volume;
    kept_->volume_name.clear();
    kept_->volume = {}; // before the next one takes its memory
    read_for(scene_, name, [&] { kept_->volume = read_volume(source.file, source.selection); });
    kept_->volume_name = name;
    return kept_->volume;
}

const LabelVolume& VolumeReader::labels(const std::string& name) {
    const VolumeDescription& source = scene_.volumes.at(name);
    if (source.label_volume) return *source.label_volume;
    if (kept_->labels_name == name) return kept_->labels;
    kept_->labels_name.clear();
    kept_->labels = {};
    read_for(scene_, name, [&] {
        kept_->labels = read_label_volume(source.file, source.labels, source.selection);
    });
    kept_->labels_name = name;
    return kept_->labels;
}

const std::string& VolumeReader::key(const std::string& name) {
    std::string& key = kept_->keys[name];
    if (key.empty()) read_for(scene_, name, [&] { key = source_key(scene_.volumes.at(name)); });
    return key;
}

BakedSurface bake_surface(const SceneDescription& scene, const std::string& surface,
                          VolumeReader& reader, const ResultCache& cache,
                          const Progress& progress) {
    const SurfaceDescription& description = scene.surfaces.at(surface);
    const VolumeDescription& source = scene.volumes.at(description.volume);
    if (!is_baked(source))
        return bake_formula(scene, surface,
                            source.scalar_field ? source.scalar_field
                                                : make_analytic_field(scene, description.volume));

    internal::report(progress, 0.0,
                     source.file.empty() ? "baking " + description.volume
                                         : "reading " + source.file.filename().string());
    const std::vector<std::string> alike = labels_felt_alike(scene, surface);
    const std::string key = bake_key(reader.key(description.volume), source, description, alike);
    const std::string name = key.substr(0, 32) + ".vdb";
    BakedSurface baked;
    if (!read_cached(cache, name, baked)) {
        const std::string place = place_of_surface(scene, surface);
        baked = description.labels.empty()
                    ? internal::bake_level(source, reader.volume(description.volume), description,
                                           place, progress)
                    : internal::bake_labels(source, reader.labels(description.volume), description,
                                            alike, place, progress);
        cache.keep(name, [&baked](const std::filesystem::path& file) {
            baked.grid->write_vdb(file, {{"palpate_baked", baked_as_json(baked)}});
        });
    }
    // Not of the content, which names the cached field.
    if (source.voxels) baked.warnings = source.voxels->warnings;
    if (source.label_volume) baked.warnings = source.label_volume->warnings;
    baked.key = key;
    if (!description.beneath.empty())
        baked.stiffness = stiffness_beneath(scene, surface, baked, reader, cache, progress);
    internal::report(progress, 1.0, "field ready");
    return baked;
}

BakedSurface bake_surface(const SceneDescription& scene, const std::string& surface,
                          const ResultCache& cache, const Progress& progress) {
    VolumeReader reader(scene);
    return bake_surface(scene, surface, reader, cache, progress);
}

BakedMesh mesh_surface(const BakedSurface& surface, const IsosurfaceSettings& settings,
                       const IsosurfaceExtractor& extract, const ResultCache& cache,
                       const Progress& progress) {
    if (!surface.grid)
        throw std::runtime_error(
            "a surface given by a formula or by a field of the program's own is not meshed; use "
            "contact = \"volume\"");
    const std::string key = sha256_of_text(fmt::format(
        "palpate mesh {} {} {:a} {:a} {:a} {:a}", kCacheVersion, surface.key, surface.level,
        settings.facet_angle_deg, settings.facet_size_m, settings.facet_distance_m));
    const std::string name = key.substr(0, 32) + ".ply";
    BakedMesh result;
    result.mesh = cached_mesh(cache, name);
    result.from_cache = result.mesh != nullptr;
    if (!result.mesh) {
        if (!extract)
            throw std::runtime_error(
                "there is no CGAL to extract a mesh with: set SceneResources::extract in a "
                "program, or build with CGAL; or use contact = \"volume\", or name a mesh file");
        internal::report(progress, 0.0, "extracting");
        const std::unique_ptr<FieldSampler> sampler = surface.field->make_sampler();
        Isosurface wanted;
        wanted.value = [&sampler, level = surface.level](const Vec3& p) {
            return sampler->value(p) - level;
        };
        wanted.bounds = surface.field->bounds_at(surface.level);
        const TriangleMesh preview = surface.grid->preview(surface.level);
        require_affordable(preview, settings.facet_size_m);
        wanted.seeds = choose_seeds(preview, settings.facet_size_m, kSmallestComponentTriangles);
        if (wanted.seeds.empty())
            throw std::runtime_error(
                "the surface is of a few voxels, too small to make a mesh of; use contact = "
                "\"volume\", or give the volume with finer voxels");
        auto mesh = std::make_shared<TriangleMesh>(extract(wanted, settings, progress));
        cache.keep(name, [&](const std::filesystem::path& to) {
            write_ply(*mesh, to, {"palpate mesh " + key});
        });
        round_as_written(*mesh);
        result.mesh = std::move(mesh);
    }
    return result;
}

} // namespace palpate
