// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/effects/gradient_surface.h>

#include <array>

#include <palpate/engine/scene/internal/effect_fields.h>
#include <palpate/engine/scene/internal/effect_keys.h>
#include <palpate/haptics/effects/gradient_surface.h>

namespace palpate::internal::gradient_surface_effect {
namespace {

using Settings = effects::GradientSurface;

constexpr std::array kKeys{
    kScalarsKey,
    SceneKey{"strength_n", "N", kHoldingN, "required",
             "The force above which it yields: a number, or a function of the volume's value."},
    kMovesWithKey};

EffectNeeds plan(const PlanContext&, const Settings& effect) {
    if (effect.strength.is_zero()) return off(kNoStrength);
    return on_at_proxy("a plane through the proxy, against the gradient", field_of_volume(effect));
}

std::unique_ptr<Effect> make(const Settings& effect, const EffectParts& parts) {
    return std::make_unique<GradientSurface>(parts.fields.scalars.at(effect.volume),
                                             effect.strength);
}

} // namespace
} // namespace palpate::internal::gradient_surface_effect

namespace palpate::effects {

constinit const internal::EffectRoom<GradientSurface> GradientSurface::room{
    .traits = {.name = "gradient_surface",
               .keys = internal::gradient_surface_effect::kKeys,
               .need = internal::FieldNeed::scalar,
               .turn = internal::EffectTurn::guides,
               .stands_for_surface = true},
    .read = internal::read_over_volume<GradientSurface, internal::kHoldingN>,
    .check = internal::check_over_volume<GradientSurface, internal::kHoldingN>,
    .plan = internal::gradient_surface_effect::plan,
    .own = {.order = internal::order_over_volume<GradientSurface>,
            .make = internal::gradient_surface_effect::make},
};

} // namespace palpate::effects
