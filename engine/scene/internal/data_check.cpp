// SPDX-License-Identifier: Apache-2.0
// Where a scene has its volumes and meshes from: one source each, and sound where it is in memory.
#include <string>
#include <vector>

#include <palpate/engine/scene/internal/field_check.h>
#include <palpate/geometry/mesh_check.h>
#include <palpate/volume/volume_check.h>

namespace palpate::internal {
namespace {

constexpr std::string_view kSources =
    "a file, a formula (analytic), or data in memory (voxels, label_volume, vector_volume, "
    "scalar_field, vector_field)";

/// The sources that a volume names, by their fields.
std::vector<std::string_view> sources_of(const VolumeDescription& volume) {
    std::vector<std::string_view> sources;
    if (!volume.file.empty()) sources.emplace_back("file");
    if (!volume.analytic.empty()) sources.emplace_back("analytic");
    if (volume.voxels) sources.emplace_back("voxels");
    if (volume.label_volume) sources.emplace_back("label_volume");
    if (volume.vector_volume) sources.emplace_back("vector_volume");
    if (volume.scalar_field) sources.emplace_back("scalar_field");
    if (volume.vector_field) sources.emplace_back("vector_field");
    return sources;
}

} // namespace

void check_volume_source(const FieldCheck& check, const VolumeDescription& volume) {
    const std::vector<std::string_view> sources = sources_of(volume);
    if (sources.empty())
        check.fail("file", "and analytic are both empty, and nothing is in memory",
                   "give " + std::string(kSources));
    if (sources.size() > 1)
        check.fail(sources[0], "and " + std::string(sources[1]) + " exclude each other",
                   "keep one of them");
    if (!is_in_memory(volume)) return;
    if (!volume.labels.empty())
        check.fail("labels", "is a table of names for a file",
                   "leave it empty, and give names in label_volume");
    const std::string what = check.path(sources[0]);
    if (volume.voxels) require_volume(what, *volume.voxels);
    if (volume.label_volume) require_volume(what, *volume.label_volume);
    if (volume.vector_volume) require_volume(what, *volume.vector_volume);
    if (volume.scalar_field) require_field(what, *volume.scalar_field);
    if (volume.vector_field) require_field(what, *volume.vector_field);
}

void check_mesh_source(const FieldCheck& check, const SurfaceDescription& surface) {
    if (surface.volume.empty() && !has_mesh(surface))
        check.fail("volume", "and mesh are both empty",
                   "name a volume, or give a mesh (mesh or triangle_mesh), or both");
    if (!surface.triangle_mesh) return;
    if (!surface.mesh.empty())
        check.fail("mesh", "and triangle_mesh exclude each other", "keep one of them");
    const MeshFileSettings as_default;
    if (surface.mesh_file.frame != as_default.frame || surface.mesh_file.unit != as_default.unit)
        check.fail("mesh_file", "is how a file is to be read, and triangle_mesh is none",
                   "leave it as it is by default; triangle_mesh is LPS and in m");
    require_mesh(check.path("triangle_mesh"), *surface.triangle_mesh);
}

bool is_of_vectors(const VolumeDescription& volume) {
    return volume.analytic == "helix" || volume.vector_volume || volume.vector_field;
}

bool is_of_scalars(const VolumeDescription& volume) {
    return !is_of_vectors(volume) && (is_in_memory(volume) || !volume.analytic.empty());
}

bool is_of_labels(const VolumeDescription& volume) {
    return !volume.labels.empty() || volume.label_volume;
}

std::string_view kind_in_words(const VolumeDescription& volume) {
    if (!volume.analytic.empty())
        return is_of_vectors(volume) ? "a formula of vectors" : "a formula of scalars";
    if (is_of_vectors(volume)) return "data of vectors";
    return volume.label_volume ? "data of labels" : "data of scalars";
}

} // namespace palpate::internal
