// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene.h>

#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/haptics/constant_force.h>
#include <palpate/haptics/direct_contact.h>
#include <palpate/haptics/gradient_surface.h>
#include <palpate/volume/analytic_fields.h>
#include <palpate/volume/volume_file.h>

namespace palpate {
namespace {

SceneSurface build_surface(const SceneDescription& scene, const std::string& name,
                           VolumeReader& reader, const SceneResources& resources) {
    const SurfaceDescription& description = scene.surfaces.at(name);
    SceneSurface surface;
    surface.name = name;
    surface.contact = description.contact;
    surface.baked = bake_surface(scene, name, reader, resources.cache, resources.progress);
    surface.level.level = surface.baked.level;
    surface.level.strength_n = description.strength_n;
    if (description.contact == ContactKind::direct) {
        if (std::isfinite(description.strength_n))
            throw std::runtime_error(fmt::format(
                "{}:{}: [surface.{}]: contact = \"direct\" does not yield, strength_n = {} needs "
                "contact = \"volume\"",
                scene.file.string(), description.line, name, description.strength_n));
        const BakedMesh mesh =
            mesh_surface(surface.baked, mesh_settings(description, surface.baked),
                         resources.extract, resources.cache, resources.progress);
        surface.mesh = std::make_shared<SurfaceScene>(mesh.mesh);
    }
    return surface;
}

std::shared_ptr<const ScalarField> volume_field(const SceneDescription& scene,
                                                const std::string& volume) {
    const VolumeDescription& description = scene.volumes.at(volume);
    if (description.file.empty()) return make_analytic_field(scene, volume);
    const VoxelVolume voxels = read_volume(description.file, description.selection);
    return std::make_shared<GridField>(voxels, static_cast<float>(value_range(voxels)[0]));
}

} // namespace

std::shared_ptr<const ScalarField> make_analytic_field(const SceneDescription& scene,
                                                       const std::string& volume) {
    const VolumeDescription& description = scene.volumes.at(volume);
    const auto metres = [&](const char* key) { return 1e-3 * description.parameters.at(key); };
    try {
        if (description.analytic == "sphere_cavity") return make_sphere_cavity(metres("radius_mm"));
        if (description.analytic == "solid_sphere") return make_solid_sphere(metres("radius_mm"));
        if (description.analytic == "bumpy_cavity")
            return make_bumpy_cavity(metres("radius_mm"), metres("amplitude_mm"),
                                     metres("wavelength_mm"));
        if (description.analytic == "slab") return make_slab(metres("thickness_mm"));
        if (description.analytic == "wedge")
            return make_wedge(description.parameters.at("angle_deg"));
        if (description.analytic == "torus")
            return make_torus(metres("radius_mm"), metres("tube_mm"));
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(fmt::format("{}:{}: [volume.{}]: {}", scene.file.string(),
                                             description.line, volume, error.what()));
    }
    throw std::runtime_error(fmt::format("{}:{}: [volume.{}] is not given by a formula",
                                         scene.file.string(), description.line, volume));
}

Scene::Scene(SceneDescription description, const SceneResources& resources)
    : description_(std::move(description)), plan_(plan_effects(description_)) {
    VolumeReader reader(description_);
    for (const auto& [name, surface] : description_.surfaces)
        if (plan_.uses_surface(description_, name))
            surfaces_.push_back(build_surface(description_, name, reader, resources));
    for (const PlannedEffect& planned : plan_.effects) {
        const EffectDescription& effect = description_.effects[planned.effect];
        if (planned.on && effect.kind == EffectKind::gradient_surface &&
            !fields_.contains(effect.volume))
            fields_.emplace(effect.volume, volume_field(description_, effect.volume));
    }
    for (const SceneSurface& surface : surfaces_) {
        try {
            LevelScale::of(*surface.baked.field, surface.level);
        } catch (const std::invalid_argument& error) {
            throw std::runtime_error(fmt::format(
                "{}:{}: [surface.{}]: {}", description_.file.string(),
                description_.surfaces.at(surface.name).line, surface.name, error.what()));
        }
    }
}

std::unique_ptr<SurfaceContact> Scene::make_contact(const SceneSurface& surface) const {
    if (surface.contact == ContactKind::direct)
        return std::make_unique<DirectContact>(surface.mesh, surface.baked.field, surface.level);
    return std::make_unique<VolumeContact>(surface.baked.field, surface.level);
}

std::shared_ptr<const ScalarField> Scene::effect_field(const std::string& volume) const {
    const auto found = fields_.find(volume);
    return found == fields_.end() ? nullptr : found->second;
}

std::vector<std::unique_ptr<SurfaceContact>> Scene::make_contacts() const {
    std::vector<std::unique_ptr<SurfaceContact>> contacts;
    for (const SceneSurface& surface : surfaces_)
        contacts.push_back(make_contact(surface));
    return contacts;
}

std::vector<std::unique_ptr<Effect>> Scene::make_effects() const {
    std::vector<std::unique_ptr<Effect>> effects;
    for (const PlannedEffect& planned : plan_.effects) {
        if (!planned.on) continue;
        const EffectDescription& effect = description_.effects[planned.effect];
        if (effect.kind == EffectKind::gradient_surface)
            effects.push_back(
                std::make_unique<GradientSurface>(fields_.at(effect.volume), effect.strength));
        if (effect.kind == EffectKind::constant_force)
            effects.push_back(std::make_unique<ConstantForce>(
                Vec3{effect.force_n[0], effect.force_n[1], effect.force_n[2]}));
    }
    return effects;
}

} // namespace palpate
