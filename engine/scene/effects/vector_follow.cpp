// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/effects/vector_follow.h>

#include <array>

#include <palpate/engine/scene/internal/effect_fields.h>
#include <palpate/engine/scene/internal/effect_keys.h>
#include <palpate/haptics/effects/vector_follow.h>

namespace palpate::internal::vector_follow_effect {
namespace {

constexpr SceneKey kStrengthKey{"strength_n", "N", kHoldingN, "required",
                                "The force across above which the proxy slips: a number, or a "
                                "function of the vector's length."};
constexpr SceneKey kGuideKey{
    "guide", "", {}, "streamline", "What is followed: \"tangent\", \"midpoint\", \"streamline\"."};
constexpr std::array kVectorKeys{kVectorsKey, kStrengthKey, kGuideKey, kMovesWithKey};
constexpr std::array kFibreKeys{
    SceneKey{"volume", "", {}, "required", "The volume of vectors or tensors that is sampled."},
    kStrengthKey, kGuideKey, kMovesWithKey};

// In the order of FollowGuide.
constexpr std::array<std::string_view, 3> kGuideNames{"tangent", "midpoint", "streamline"};
constexpr double kSamplesOfGuide = 2.0; // per evaluation, on the streamline

template <class Settings>
Settings read(const EffectTable& from) {
    FollowGuide guide = FollowGuide::streamline;
    if (from.table.has("guide"))
        guide = static_cast<FollowGuide>(from.table.choice("guide", kGuideNames));
    Settings effect = read_over_volume<Settings, kHoldingN>(from);
    effect.guide = guide;
    return effect;
}

template <class Settings>
void check(const EffectCheck& check, const Settings& effect) {
    check.fields.choice("guide", effect.guide, FollowGuide::streamline);
    check_over_volume<Settings, kHoldingN>(check, effect);
}

template <class Settings>
EffectNeeds plan(const Settings& effect, std::string_view how) {
    if (effect.strength.is_zero()) return off(kNoStrength);
    if (effect.guide == FollowGuide::tangent) return on_at_proxy(how, field_of_volume(effect));
    EffectNeeds needs = on_at_start(how, field_of_volume(effect));
    needs.planned.samples = kSamplesOfGuide;
    return needs;
}

EffectNeeds plan_vectors(const PlanContext&, const effects::VectorFollow& effect) {
    return plan(effect, "a line along the streamline through the frame's start");
}

EffectNeeds plan_fibres(const PlanContext&, const effects::FibreFollow& effect) {
    return plan(effect,
                "a line along the fibre through the frame's start, whose sign does not matter");
}

template <class Settings>
std::string order(const Settings& effect) {
    return order_text(effect.volume, static_cast<double>(effect.guide), effect.strength);
}

std::unique_ptr<Effect> make_vectors(const effects::VectorFollow& effect,
                                     const EffectParts& parts) {
    return std::make_unique<VectorFollow>(parts.fields.directed.at(effect.volume), effect.strength,
                                          effect.guide);
}

std::unique_ptr<Effect> make_fibres(const effects::FibreFollow& effect, const EffectParts& parts) {
    return std::make_unique<VectorFollow>(parts.fields.axial.at(effect.volume), effect.strength,
                                          effect.guide);
}

} // namespace
} // namespace palpate::internal::vector_follow_effect

namespace palpate::effects {

constinit const internal::EffectRoom<VectorFollow> VectorFollow::room{
    .traits = {.name = "vector_follow",
               .keys = internal::vector_follow_effect::kVectorKeys,
               .need = internal::FieldNeed::vector,
               .turn = internal::EffectTurn::guides},
    .read = internal::vector_follow_effect::read<VectorFollow>,
    .check = internal::vector_follow_effect::check<VectorFollow>,
    .plan = internal::vector_follow_effect::plan_vectors,
    .own = {.order = internal::vector_follow_effect::order<VectorFollow>,
            .make = internal::vector_follow_effect::make_vectors},
};

constinit const internal::EffectRoom<FibreFollow> FibreFollow::room{
    .traits = {.name = "fibre_follow",
               .keys = internal::vector_follow_effect::kFibreKeys,
               .need = internal::FieldNeed::axial,
               .turn = internal::EffectTurn::guides},
    .read = internal::vector_follow_effect::read<FibreFollow>,
    .check = internal::vector_follow_effect::check<FibreFollow>,
    .plan = internal::vector_follow_effect::plan_fibres,
    .own = {.order = internal::vector_follow_effect::order<FibreFollow>,
            .make = internal::vector_follow_effect::make_fibres},
};

} // namespace palpate::effects
