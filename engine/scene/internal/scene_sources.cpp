// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/internal/scene_sources.h>

#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/scene/scene.h>

namespace palpate {

const SceneFiles& require_files(const SceneFiles* files, const std::string& place,
                                const std::filesystem::path& file) {
    if (files != nullptr) return *files;
    throw std::runtime_error(fmt::format(
        "{}: nothing here reads {}: link palpate::files and give the scene SceneResources with "
        "files = palpate::scene_files() (<palpate/engine/baking/scene_files.h>)",
        place, file.string()));
}

namespace internal {
namespace {

std::string place_of_volume(const SceneDescription& scene, const std::string& volume) {
    const int line = scene.volumes.at(volume).line;
    if (line == 0) return fmt::format("volumes[\"{}\"]", volume);
    return fmt::format("{}:{}: [volume.{}]", scene.file.empty() ? "scene" : scene.file.string(),
                       line, volume);
}

} // namespace

SceneSources::SceneSources(const SceneDescription& scene, const SceneResources& resources)
    : scene_(scene), resources_(resources) {}

SceneReader& SceneSources::reader(const std::string& place, const std::filesystem::path& file) {
    if (!reader_)
        reader_ = require_files(resources_.files.get(), place, file)
                      .reader(scene_, resources_.extract, resources_.progress);
    return *reader_;
}

SceneReader& SceneSources::reader_of_volume(const std::string& volume) {
    return reader(place_of_volume(scene_, volume), scene_.volumes.at(volume).file);
}

std::shared_ptr<const ScalarField> SceneSources::formula(const std::string& volume) {
    std::shared_ptr<const ScalarField>& field = formulas_[volume];
    if (!field) field = make_analytic_field(scene_, volume);
    return field;
}

BakedSurface SceneSources::surface(const std::string& name) {
    const std::string& volume = scene_.surfaces.at(name).volume;
    if (scene_.volumes.at(volume).file.empty()) return bake_formula(scene_, name, formula(volume));
    return reader_of_volume(volume).surface(name);
}

FoundMesh SceneSources::mesh(const std::string& surface, const BakedSurface& baked,
                             ContactKind contact, const std::string& place) {
    return reader(place, scene_.surfaces.at(surface).mesh).mesh(surface, baked, contact, place);
}

std::shared_ptr<const ScalarField> SceneSources::scalars(const std::string& volume) {
    if (scene_.volumes.at(volume).file.empty()) return formula(volume);
    return reader_of_volume(volume).scalars(volume);
}

std::shared_ptr<const VectorField>
SceneSources::vectors(const std::string& volume, VectorSense sense, std::string_view effect) {
    const VolumeDescription& description = scene_.volumes.at(volume);
    if (!description.file.empty()) return reader_of_volume(volume).vectors(volume, sense, effect);
    const auto metres = [&](const char* key) { return 1e-3 * description.parameters.at(key); };
    return make_helix(metres("radius_mm"), metres("pitch_mm"));
}

} // namespace internal
} // namespace palpate
