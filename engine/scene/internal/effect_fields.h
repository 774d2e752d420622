// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <string>

#include <palpate/engine/scene/internal/scene_sources.h>
#include <palpate/engine/scene/scene_description.h>
#include <palpate/haptics/effects/local_strength.h>
#include <palpate/volume/scalar_field.h>
#include <palpate/volume/vector_field.h>

namespace palpate::internal {

/// The fields of volumes that effects sample, each loaded once, by the volume's name.
struct EffectFields {
    std::map<std::string, std::shared_ptr<const ScalarField>> scalars;
    std::map<std::string, std::shared_ptr<const VectorField>> directed;
    std::map<std::string, std::shared_ptr<const VectorField>> axial;
    VolumeWarnings warnings;
};

/// Loads what an effect samples, if it is not there yet; a formula is the one of `sources`, which
/// surfaces of it have as well.                                                         [setup]
/// Throws std::runtime_error as SceneSources does, and "FILE:LINE: [volume.NAME]: what is wrong;
/// what to do" for a volume that is none of the kind that the effect needs.
void load_field_of(const EffectDescription& effect, SceneSources& sources, EffectFields& fields);

/// The same for a volume of scalars by its name; nothing for an empty name.            [setup]
void load_scalar_field(const std::string& volume, SceneSources& sources, EffectFields& fields);

/// A strength over the value of a volume, whose field must be loaded; nothing for an empty name.
/// [setup]
StrengthOverField strength_over(const std::string& volume, const TransferFunction& strength,
                                const EffectFields& fields);

} // namespace palpate::internal
