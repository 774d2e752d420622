// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/internal/effect_fields.h>

#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/scene/internal/effect_questions.h>
#include <palpate/volume/fields/grid_field.h>
#include <palpate/volume/fields/grid_vector_field.h>
#include <palpate/volume/formats/vector_file.h>
#include <palpate/volume/formats/volume_file.h>

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
    const EffectTraits& traits = traits_of(effect);
    const std::string& volume = volume_of(effect);
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

StrengthOverField strength_over(const std::string& volume, const TransferFunction& strength,
                                const EffectFields& fields) {
    if (volume.empty()) return {};
    return {fields.scalars.at(volume), strength};
}

} // namespace palpate::internal
