// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/view_document.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/baking/baking.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/scene/soft_surfaces.h>
#include <palpate/volume/fields/grid_field.h>

namespace palpate {
namespace {

// Of "felt" in a page's frames; its last bit is of the surfaces behind them, together.
constexpr std::size_t kMostBits = kBitOfOthers;

/// Colours that stay apart for eyes that see few, on light and on dark (after Okabe and Ito 2008);
/// bone first.
constexpr std::array<const char*, 8> kColors{"#e3d4b0", "#d55e00", "#0072b2", "#009e73",
                                             "#cc79a7", "#e69f00", "#56b4e9", "#f0e442"};

/// Without the vertices that no triangle has.
void leave_out_unused(TriangleMesh& mesh) {
    constexpr auto kUnused = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> now(mesh.vertices.size(), kUnused);
    std::vector<Vec3> used;
    for (auto& triangle : mesh.triangles)
        for (std::uint32_t& vertex : triangle) {
            std::uint32_t& place = now[vertex];
            if (place == kUnused) {
                place = static_cast<std::uint32_t>(used.size());
                used.push_back(mesh.vertices[vertex]);
            }
            vertex = place;
        }
    mesh.vertices = std::move(used);
}

/// A formula's surface, by its values on a grid. Where its box cuts the material the mesh is open:
/// the grid's own end there is no surface.
std::shared_ptr<const TriangleMesh> mesh_of_formula(const ScalarField& field, double level) {
    constexpr int kNodes = 96; // along the longest edge
    const Box box = field.bounds_at(level);
    if (box.empty() || !is_finite(box.lower) || !is_finite(box.upper)) return nullptr;
    const Vec3 extent = box.extent();
    const double spacing_m = std::max({extent.x, extent.y, extent.z}) / (kNodes - 1);
    if (!(spacing_m > 0.0)) return nullptr;

    VoxelVolume sampled;
    for (int axis = 0; axis < 3; ++axis)
        sampled.size[static_cast<std::size_t>(axis)] =
            static_cast<int>(std::ceil(extent[axis] / spacing_m - 1e-9)) + 1;
    sampled.index_to_scene = {Mat3(spacing_m), box.lower};
    const std::unique_ptr<FieldSampler> sampler = field.make_sampler();
    double lowest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < sampled.size[2]; ++k)
        for (int j = 0; j < sampled.size[1]; ++j)
            for (int i = 0; i < sampled.size[0]; ++i) {
                const double value = sampler->value(sampled.index_to_scene.point(Vec3(i, j, k)));
                lowest = std::min(lowest, value);
                sampled.values.push_back(static_cast<float>(value));
            }
    if (!(lowest < level)) return nullptr;
    auto mesh = std::make_shared<TriangleMesh>(
        GridField(sampled, static_cast<float>(lowest)).preview(level));
    const Vec3 end = sampled.index_to_scene.point(
        Vec3(sampled.size[0] - 1, sampled.size[1] - 1, sampled.size[2] - 1));
    const Vec3 margin(1e-3 * spacing_m);
    const auto is_outside = [&](std::uint32_t vertex) {
        const Vec3& at = mesh->vertices[vertex];
        return glm::any(glm::lessThan(at, box.lower - margin)) ||
               glm::any(glm::greaterThan(at, end + margin));
    };
    std::erase_if(mesh->triangles, [&](const auto& triangle) {
        return std::any_of(triangle.begin(), triangle.end(), is_outside);
    });
    leave_out_unused(*mesh);
    return mesh;
}

/// The mesh that is felt, where one is; else a quick one of the field.
std::shared_ptr<const TriangleMesh> mesh_of(const SceneSurface& surface) {
    if (surface.mesh.scene) return {surface.mesh.scene, &surface.mesh.scene->mesh()};
    if (surface.baked.grid)
        return std::make_shared<TriangleMesh>(surface.baked.grid->preview(surface.baked.level));
    if (surface.baked.field) return mesh_of_formula(*surface.baked.field, surface.baked.level);
    return nullptr;
}

/// The colour that a segmentation gives the first of a surface's labels; nothing where it gives
/// none.
std::optional<std::string> color_of_labels(const SurfaceDescription& surface,
                                           VolumeReader& reader) {
    if (surface.labels.empty() || surface.volume.empty()) return std::nullopt;
    const LabelVolume& volume = reader.labels(surface.volume);
    for (const std::size_t label : find_labels(volume, surface.labels))
        if (const auto& color = volume.labels[label].color)
            return fmt::format("#{:02x}{:02x}{:02x}", (*color)[0], (*color)[1], (*color)[2]);
    return std::nullopt;
}

std::string material_in_words(const SceneDescription& scene, const SceneSurface& surface,
                              const SurfaceDescription& description) {
    std::string words = description.material.empty() ? "" : description.material + ", ";
    const bool soft = is_soft(scene, description), yields = std::isfinite(description.strength_n);
    if (soft) words += softness_in_words(scene, description);
    if (soft && yields) words += ", ";
    if (yields) words += fmt::format("yields above {:.3g} N", description.strength_n);
    if (!soft && !yields) words += "hard";
    return words + fmt::format(", contact {}", name(surface.contact));
}

bool is_scalar(const Scene& scene, const std::string& volume) {
    const auto& surfaces = scene.description().surfaces;
    return scene.effect_field(volume) ||
           std::any_of(surfaces.begin(), surfaces.end(), [&](const auto& surface) {
               return surface.second.volume == volume && surface.second.labels.empty();
           });
}

bool has_labels(const Scene& scene, const std::string& volume) {
    const auto& surfaces = scene.description().surfaces;
    return std::any_of(surfaces.begin(), surfaces.end(), [&](const auto& surface) {
        return surface.second.volume == volume && !surface.second.labels.empty();
    });
}

bool has_voxels(const VolumeDescription& volume) { return !volume.file.empty() || volume.voxels; }

/// A volume that nothing feels is there to be looked at.
bool is_only_seen(const SceneDescription& scene, const std::string& volume) {
    const bool is_felt =
        std::any_of(scene.surfaces.begin(), scene.surfaces.end(),
                    [&](const auto& surface) { return surface.second.volume == volume; }) ||
        std::any_of(scene.effects.begin(), scene.effects.end(),
                    [&](const EffectDescription& effect) { return volume_of(effect) == volume; });
    return !is_felt && scene.volumes.at(volume).labels.empty();
}

/// A label volume for slices: what is felt of it looks like its surface.
LabelSlices labels_of(const std::string& name, const LabelVolume& volume,
                      const SceneDescription& scene, const std::vector<ViewStructure>& structures) {
    LabelSlices slices = label_slices(name, volume);
    for (std::size_t place = 0; place < structures.size(); ++place) {
        const SurfaceDescription& surface = scene.surfaces.at(structures[place].name);
        if (surface.volume != name || surface.labels.empty()) continue;
        for (const std::size_t label : find_labels(volume, surface.labels)) {
            if (label >= slices.labels.size() || slices.labels[label].structure >= 0) continue;
            slices.labels[label].structure = static_cast<int>(place);
            slices.labels[label].color = structures[place].color;
        }
    }
    return slices;
}

/// A volume that nothing feels, where slices can show it. Vectors, segments or a damaged file stop
/// no page: the scene does not need them.
void show_if_it_can_be(const std::string& name, VolumeReader& reader, ViewDocument& document) {
    try {
        document.volumes.push_back(slice_voxels(name, reader.volume(name)));
    } catch (const std::runtime_error& error) {
        document.not_shown.emplace_back(error.what());
    }
}

std::string subject_of(const EffectDescription& effect) {
    if (!surface_of(effect).empty()) return surface_of(effect);
    return volume_of(effect).empty() ? std::string(name(effect)) : volume_of(effect);
}

std::vector<ViewStructure> structures_of(const Scene& scene, VolumeReader& reader) {
    std::vector<ViewStructure> structures;
    for (const SceneSurface& surface : scene.surfaces()) {
        const SurfaceDescription& described = scene.description().surfaces.at(surface.name);
        const std::size_t place = structures.size();
        ViewStructure structure;
        structure.name = surface.name;
        structure.material = material_in_words(scene.description(), surface, described);
        structure.color = color_of_labels(described, reader).value_or(structure_color(place));
        structure.bit = place < kMostBits ? static_cast<int>(place) : -1;
        structure.mesh = mesh_of(surface);
        structures.push_back(std::move(structure));
    }
    return structures;
}

} // namespace

std::string structure_color(std::size_t n) {
    return n < kColors.size() ? kColors[n] : made_up_color(n);
}

std::vector<ViewStructure> view_structures(const Scene& scene) {
    VolumeReader reader(scene.description());
    return structures_of(scene, reader);
}

ViewDocument view_document(const Scene& scene, ViewMode mode) {
    const SceneDescription& description = scene.description();
    ViewDocument document;
    document.mode = mode;
    document.title =
        description.file.empty() ? "a scene made in code" : description.file.filename().string();
    document.method = name(description.loop.method);
    document.rate_hz = description.loop.rate_hz;
    document.force_limit_n = description.limits.force_n;

    VolumeReader reader(description);
    document.structures = structures_of(scene, reader);
    for (const auto& [name, volume] : description.volumes) {
        if (has_voxels(volume) && is_scalar(scene, name))
            document.volumes.push_back(slice_voxels(name, reader.volume(name)));
        else if (has_voxels(volume) && is_only_seen(description, name))
            show_if_it_can_be(name, reader, document);
        if (has_labels(scene, name))
            document.labels.push_back(
                labels_of(name, reader.labels(name), description, document.structures));
    }
    for (const PlannedEffect& planned : scene.plan().effects)
        if (planned.on) {
            const EffectDescription& effect = description.effects[planned.effect];
            document.effects.push_back(
                {planned.effect, subject_of(effect), std::string(name(effect))});
        }
    return document;
}

} // namespace palpate
