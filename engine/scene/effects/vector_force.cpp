// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/effects/vector_force.h>

#include <array>

#include <palpate/engine/scene/internal/effect_fields.h>
#include <palpate/engine/scene/internal/effect_keys.h>
#include <palpate/haptics/effects/vector_force.h>

namespace palpate::internal::vector_force_effect {
namespace {

using Settings = effects::VectorForce;

constexpr std::array kKeys{kVectorsKey,
                           SceneKey{"strength_n", "N", kStrengthN, "required",
                                    "The force: a number, or a function of the vector's length."},
                           kMovesWithKey};

EffectNeeds plan(const PlanContext&, const Settings& effect) {
    if (effect.strength.is_zero()) return off(kNoStrength);
    return on_at_start("a force along the vector, sampled once a frame", field_of_volume(effect));
}

std::unique_ptr<Effect> make(const Settings& effect, const EffectParts& parts) {
    return std::make_unique<VectorForce>(parts.fields.directed.at(effect.volume), effect.strength);
}

} // namespace
} // namespace palpate::internal::vector_force_effect

namespace palpate::effects {

constinit const internal::EffectRoom<VectorForce> VectorForce::room{
    .traits = {.name = "vector_force",
               .keys = internal::vector_force_effect::kKeys,
               .need = internal::FieldNeed::vector},
    .read = internal::read_over_volume<VectorForce, internal::kStrengthN>,
    .check = internal::check_over_volume<VectorForce, internal::kStrengthN>,
    .plan = internal::vector_force_effect::plan,
    .own = {.order = internal::order_over_volume<VectorForce>,
            .make = internal::vector_force_effect::make},
};

} // namespace palpate::effects
