// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/effects/constant_force.h>

#include <array>

#include <palpate/engine/scene/internal/effect_keys.h>
#include <palpate/haptics/effects/constant_force.h>

namespace palpate::internal::constant_force_effect {
namespace {

using Settings = effects::ConstantForce;

constexpr std::array kKeys{
    SceneKey{"force_n", "N", kAxisForceN, "required", "The force [x, y, z], scene frame (LPS)."}};

Settings read(const EffectTable& from) {
    return {.force_n = read_triple(from.table, "force_n", " in N", kAxisForceN)};
}

void check(const EffectCheck& check, const Settings& effect) {
    check.fields.triple("force_n", effect.force_n, kAxisForceN);
}

EffectNeeds plan(const PlanContext&, const Settings& effect) {
    if (effect.force_n == Vec3{0.0}) return off("force_n is 0: it cannot be felt");
    return on("shifts the probe's target exactly: needs no query");
}

std::string order(const Settings& effect) { return order_text(effect.force_n); }

std::unique_ptr<Effect> make(const Settings& effect, const EffectParts&) {
    return std::make_unique<ConstantForce>(effect.force_n);
}

} // namespace
} // namespace palpate::internal::constant_force_effect

namespace palpate::effects {

constinit const internal::EffectRoom<ConstantForce> ConstantForce::room{
    .traits = {.name = "constant_force",
               .keys = internal::constant_force_effect::kKeys,
               .beside_soft = true},
    .read = internal::constant_force_effect::read,
    .check = internal::constant_force_effect::check,
    .plan = internal::constant_force_effect::plan,
    .own = {.order = internal::constant_force_effect::order,
            .make = internal::constant_force_effect::make},
};

} // namespace palpate::effects
