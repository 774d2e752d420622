// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/effects/gradient_force.h>

#include <array>

#include <palpate/engine/scene/internal/effect_fields.h>
#include <palpate/engine/scene/internal/effect_keys.h>
#include <palpate/haptics/effects/gradient_force.h>

namespace palpate::internal::gradient_force_effect {
namespace {

using Settings = effects::GradientForce;

constexpr std::array kKeys{kScalarsKey,
                           SceneKey{"strength_n", "N", kStrengthN, "required",
                                    "The force: a number, or a function of the volume's value."},
                           kMovesWithKey};

EffectNeeds plan(const PlanContext&, const Settings& effect) {
    if (effect.strength.is_zero()) return off(kNoStrength);
    return on_at_start("a force against the gradient, sampled once a frame",
                       field_of_volume(effect));
}

std::unique_ptr<Effect> make(const Settings& effect, const EffectParts& parts) {
    return std::make_unique<GradientForce>(parts.fields.scalars.at(effect.volume), effect.strength);
}

} // namespace
} // namespace palpate::internal::gradient_force_effect

namespace palpate::effects {

constinit const internal::EffectRoom<GradientForce> GradientForce::room{
    .traits = {.name = "gradient_force",
               .keys = internal::gradient_force_effect::kKeys,
               .need = internal::FieldNeed::scalar},
    .read = internal::read_over_volume<GradientForce, internal::kStrengthN>,
    .check = internal::check_over_volume<GradientForce, internal::kStrengthN>,
    .plan = internal::gradient_force_effect::plan,
    .own = {.order = internal::order_over_volume<GradientForce>,
            .make = internal::gradient_force_effect::make},
};

} // namespace palpate::effects
