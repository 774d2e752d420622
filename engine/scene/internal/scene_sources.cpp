// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/internal/scene_sources.h>

#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_place.h>
#include <palpate/volume/fields/grid_field.h>
#include <palpate/volume/fields/grid_vector_field.h>

namespace palpate {

const SceneFiles& require_files(const SceneFiles* files, const std::string& place,
                                std::string_view need) {
    if (files != nullptr) return *files;
    throw std::runtime_error(fmt::format(
        "{}: nothing here {}: link palpate::files and give the scene SceneResources with "
        "files = palpate::scene_files() (<palpate/engine/baking/scene_files.h>)",
        place, need));
}

namespace internal {

SceneSources::SceneSources(const SceneDescription& scene, const SceneResources& resources)
    : scene_(scene), resources_(resources) {}

SceneReader& SceneSources::reader(const std::string& place, std::string_view need) {
    if (!reader_)
        reader_ = require_files(resources_.files.get(), place, need)
                      .reader(scene_, resources_.extract, resources_.progress);
    return *reader_;
}

SceneReader& SceneSources::reader_of_volume(const std::string& volume) {
    const std::filesystem::path& file = scene_.volumes.at(volume).file;
    return reader(place_of_volume(scene_, volume),
                  file.empty() ? "makes surfaces of voxels" : "reads " + file.string());
}

std::shared_ptr<const ScalarField> SceneSources::as_it_is(const std::string& volume) {
    const VolumeDescription& description = scene_.volumes.at(volume);
    if (description.scalar_field) return description.scalar_field;
    std::shared_ptr<const ScalarField>& field = made_[volume];
    if (field) return field;
    if (description.voxels) {
        field = effect_grid(*description.voxels);
        warnings_[volume] = description.voxels->warnings;
    } else {
        field = make_analytic_field(scene_, volume);
    }
    return field;
}

BakedSurface SceneSources::surface(const std::string& name) {
    const std::string& volume = scene_.surfaces.at(name).volume;
    if (!is_baked(scene_.volumes.at(volume))) return bake_formula(scene_, name, as_it_is(volume));
    return reader_of_volume(volume).surface(name);
}

FoundMesh SceneSources::mesh(const std::string& surface, const BakedSurface& baked,
                             ContactKind contact, const std::string& place) {
    const SurfaceDescription& description = scene_.surfaces.at(surface);
    if (description.triangle_mesh) {
        FoundMesh found;
        found.from_memory = true;
        found.mesh = description.triangle_mesh;
        examine_mesh(found, description, baked, contact, place);
        return found;
    }
    return reader(place, "reads " + description.mesh.string()).mesh(surface, baked, contact, place);
}

std::shared_ptr<const ScalarField> SceneSources::scalars(const std::string& volume) {
    if (scene_.volumes.at(volume).file.empty()) return as_it_is(volume);
    return reader_of_volume(volume).scalars(volume);
}

std::shared_ptr<const VectorField>
SceneSources::vectors(const std::string& volume, VectorSense sense, std::string_view effect) {
    const VolumeDescription& description = scene_.volumes.at(volume);
    if (description.vector_field) return description.vector_field;
    if (description.vector_volume) {
        warnings_[volume] = description.vector_volume->warnings;
        return std::make_shared<GridVectorField>(*description.vector_volume, sense);
    }
    if (!description.file.empty()) return reader_of_volume(volume).vectors(volume, sense, effect);
    const auto metres = [&](const char* key) { return 1e-3 * description.parameters.at(key); };
    return make_helix(metres("radius_mm"), metres("pitch_mm"));
}

VolumeWarnings SceneSources::warnings() const {
    VolumeWarnings all = warnings_;
    if (reader_) all.insert(reader_->warnings().begin(), reader_->warnings().end());
    return all;
}

} // namespace internal
} // namespace palpate
