// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/effects/vector_sheet.h>

#include <array>

#include <palpate/engine/scene/internal/effect_fields.h>
#include <palpate/engine/scene/internal/effect_keys.h>
#include <palpate/haptics/effects/vector_sheet.h>

namespace palpate::internal::vector_sheet_effect {
namespace {

constexpr std::array kKeys{
    kVectorsKey,
    SceneKey{"strength_n", "N", kHoldingN, "required",
             "The force above which the proxy slips: a number, or a function of the vector's "
             "length."},
    kMovesWithKey};

constexpr double kFurtherSamples = 1.0; // per evaluation: halfway to the frame's end
constexpr double kStartSamples = 2.0;   // at most, to guess that end

template <class Settings>
EffectNeeds plan(const Settings& effect, std::string_view how) {
    if (effect.strength.is_zero()) return off(kNoStrength);
    EffectNeeds needs = on_at_start(how, field_of_volume(effect));
    needs.planned.samples = kFurtherSamples;
    needs.planned.start_samples += kStartSamples;
    return needs;
}

EffectNeeds plan_front(const PlanContext&, const effects::FrontShape& effect) {
    return plan(effect, "two opposed planes across the vector, through the frame's start; at start "
                        "up to 2 samples more, to guess the end");
}

EffectNeeds plan_vortex(const PlanContext&, const effects::Vortex& effect) {
    return plan(effect, "two opposed planes about the axis of rotation, through the frame's start; "
                        "at start up to 2 samples more, to guess the end");
}

template <class Settings, SheetKind kKind>
std::unique_ptr<Effect> make(const Settings& effect, const EffectParts& parts) {
    return std::make_unique<VectorSheet>(parts.fields.directed.at(effect.volume), effect.strength,
                                         kKind);
}

} // namespace
} // namespace palpate::internal::vector_sheet_effect

namespace palpate::effects {

constinit const internal::EffectRoom<FrontShape> FrontShape::room{
    .traits = {.name = "front_shape",
               .keys = internal::vector_sheet_effect::kKeys,
               .need = internal::FieldNeed::vector,
               .turn = internal::EffectTurn::guides},
    .read = internal::read_over_volume<FrontShape, internal::kHoldingN>,
    .check = internal::check_over_volume<FrontShape, internal::kHoldingN>,
    .plan = internal::vector_sheet_effect::plan_front,
    .own = {.order = internal::order_over_volume<FrontShape>,
            .make = internal::vector_sheet_effect::make<FrontShape, SheetKind::front>},
};

constinit const internal::EffectRoom<Vortex> Vortex::room{
    .traits = {.name = "vortex",
               .keys = internal::vector_sheet_effect::kKeys,
               .need = internal::FieldNeed::vector,
               .turn = internal::EffectTurn::guides},
    .read = internal::read_over_volume<Vortex, internal::kHoldingN>,
    .check = internal::check_over_volume<Vortex, internal::kHoldingN>,
    .plan = internal::vector_sheet_effect::plan_vortex,
    .own = {.order = internal::order_over_volume<Vortex>,
            .make = internal::vector_sheet_effect::make<Vortex, SheetKind::vortex>},
};

} // namespace palpate::effects
