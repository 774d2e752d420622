// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/internal/effect_fields.h>

#include <palpate/engine/scene/internal/effect_questions.h>

namespace palpate::internal {

void load_field_of(const EffectDescription& effect, SceneSources& sources, EffectFields& fields) {
    const EffectTraits& traits = traits_of(effect);
    const std::string& volume = volume_of(effect);
    if (volume.empty()) return;
    switch (traits.need) {
    case FieldNeed::none:
        return;
    case FieldNeed::scalar:
        load_scalar_field(volume, sources, fields);
        return;
    case FieldNeed::vector:
        if (!fields.directed.contains(volume))
            fields.directed.emplace(volume,
                                    sources.vectors(volume, VectorSense::directed, traits.name));
        return;
    case FieldNeed::axial:
        if (!fields.axial.contains(volume))
            fields.axial.emplace(volume, sources.vectors(volume, VectorSense::axial, traits.name));
        return;
    }
}

void load_scalar_field(const std::string& volume, SceneSources& sources, EffectFields& fields) {
    if (!volume.empty() && !fields.scalars.contains(volume))
        fields.scalars.emplace(volume, sources.scalars(volume));
}

StrengthOverField strength_over(const std::string& volume, const TransferFunction& strength,
                                const EffectFields& fields) {
    if (volume.empty()) return {};
    return {fields.scalars.at(volume), strength};
}

} // namespace palpate::internal
