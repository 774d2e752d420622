// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/internal/effect_fields.h>

#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/internal/effect_kinds.h>
#include <palpate/haptics/constant_force.h>
#include <palpate/haptics/curve_guide.h>
#include <palpate/haptics/gradient_force.h>
#include <palpate/haptics/gradient_surface.h>
#include <palpate/haptics/gravity_compensation.h>
#include <palpate/haptics/point_guide.h>
#include <palpate/haptics/vector_follow.h>
#include <palpate/haptics/vector_force.h>
#include <palpate/haptics/vector_sheet.h>
#include <palpate/haptics/viscosity.h>
#include <palpate/haptics/workspace.h>
#include <palpate/volume/grid_field.h>
#include <palpate/volume/grid_vector_field.h>
#include <palpate/volume/volume_file.h>

namespace palpate::internal {
namespace {

std::shared_ptr<const ScalarField> scalar_field(const SceneDescription& scene,
                                                const std::string& volume, VolumeReader& reader) {
    if (scene.volumes.at(volume).file.empty()) return reader.formula(volume);
    const VoxelVolume& voxels = reader.volume(volume);
    return std::make_shared<GridField>(voxels, static_cast<float>(value_range(voxels)[0]));
}

std::shared_ptr<const VectorField> vector_field(const SceneDescription& scene,
                                                const std::string& volume, VectorSense sense,
                                                std::string_view effect) {
    const VolumeDescription& description = scene.volumes.at(volume);
    const auto fail = [&](const std::string& what) {
        throw std::runtime_error(fmt::format("{}:{}: [volume.{}]: {}", scene.file.string(),
                                             description.line, volume, what));
    };
    if (description.file.empty()) {
        const auto metres = [&](const char* key) { return 1e-3 * description.parameters.at(key); };
        return make_helix(metres("radius_mm"), metres("pitch_mm"));
    }
    if (!holds_vectors(description.file))
        fail(fmt::format("{} holds no vectors, which {} needs; name a volume of vectors or tensors",
                         description.file.string(), effect));
    const VectorVolume vectors = read_vector_volume(description.file);
    if (vectors.kind == VectorVolume::Kind::symmetric_tensor && sense == VectorSense::directed)
        fail(fmt::format("{} holds tensors, whose directions have no sign, and {} needs one; take "
                         "fibre_follow, or name a volume of vectors",
                         description.file.string(), effect));
    return std::make_shared<GridVectorField>(vectors, sense);
}

} // namespace

void load_field_of(const SceneDescription& scene, const EffectDescription& effect,
                   VolumeReader& reader, EffectFields& fields) {
    const EffectTraits& traits = traits_of(effect.kind);
    const std::string& volume = effect.volume;
    if (volume.empty()) return;
    switch (traits.need) {
    case FieldNeed::none:
        return;
    case FieldNeed::scalar:
        load_scalar_field(scene, volume, reader, fields);
        return;
    case FieldNeed::vector:
        if (!fields.directed.contains(volume))
            fields.directed.emplace(
                volume, vector_field(scene, volume, VectorSense::directed, traits.name));
        return;
    case FieldNeed::axial:
        if (!fields.axial.contains(volume))
            fields.axial.emplace(volume,
                                 vector_field(scene, volume, VectorSense::axial, traits.name));
        return;
    }
}

void load_scalar_field(const SceneDescription& scene, const std::string& volume,
                       VolumeReader& reader, EffectFields& fields) {
    if (!volume.empty() && !fields.scalars.contains(volume))
        fields.scalars.emplace(volume, scalar_field(scene, volume, reader));
}

StrengthOverField strength_over(const EffectDescription& effect, const EffectFields& fields) {
    if (effect.volume.empty()) return {};
    return {fields.scalars.at(effect.volume), effect.strength};
}

std::unique_ptr<Effect> make_effect(const EffectDescription& effect, const EffectFields& fields) {
    const auto scalar = [&] { return fields.scalars.at(effect.volume); };
    const auto directed = [&] { return fields.directed.at(effect.volume); };
    switch (effect.kind) {
    case EffectKind::surface:
    case EffectKind::friction:
    case EffectKind::stick_slip:
    case EffectKind::magnet:
    case EffectKind::texture:
        break;
    case EffectKind::gradient_surface:
        return std::make_unique<GradientSurface>(scalar(), effect.strength);
    case EffectKind::constant_force:
        return std::make_unique<ConstantForce>(
            Vec3{effect.force_n[0], effect.force_n[1], effect.force_n[2]});
    case EffectKind::gradient_force:
        return std::make_unique<GradientForce>(scalar(), effect.strength);
    case EffectKind::viscosity:
        if (effect.volume.empty()) return std::make_unique<Viscosity>(effect.strength(0.0));
        return std::make_unique<Viscosity>(scalar(), effect.strength);
    case EffectKind::vector_force:
        return std::make_unique<VectorForce>(directed(), effect.strength);
    case EffectKind::vector_follow:
        return std::make_unique<VectorFollow>(directed(), effect.strength, effect.guide);
    case EffectKind::fibre_follow:
        return std::make_unique<VectorFollow>(fields.axial.at(effect.volume), effect.strength,
                                              effect.guide);
    case EffectKind::front_shape:
        return std::make_unique<VectorSheet>(directed(), effect.strength, SheetKind::front);
    case EffectKind::guide: {
        GuideSettings settings = effect.guide_settings;
        settings.over = strength_over(effect, fields);
        if (effect.points_m.size() == 1)
            return std::make_unique<PointGuide>(effect.points_m.front(), settings);
        return std::make_unique<CurveGuide>(Polyline(effect.points_m, effect.ends), settings);
    }
    case EffectKind::workspace: {
        LocalStrength strength =
            LocalStrength::holding(effect.guide_settings.strength_n, strength_over(effect, fields));
        if (effect.radius_m > 0.0)
            return std::make_unique<WorkspaceSphere>(effect.center_m, effect.radius_m,
                                                     std::move(strength));
        return std::make_unique<WorkspaceBox>(effect.box_m, std::move(strength));
    }
    case EffectKind::vibration:
        return std::make_unique<ContactVibration>(effect.vibration);
    case EffectKind::gravity_compensation:
        return std::make_unique<GravityCompensation>(effect.mass_kg, effect.down);
    case EffectKind::vortex:
        return std::make_unique<VectorSheet>(directed(), effect.strength, SheetKind::vortex);
    }
    return nullptr;
}

} // namespace palpate::internal
