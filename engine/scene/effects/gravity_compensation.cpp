// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/effects/gravity_compensation.h>

#include <array>

#include <fmt/format.h>

#include <palpate/engine/scene/internal/effect_keys.h>
#include <palpate/haptics/effects/gravity_compensation.h>

namespace palpate::internal::gravity_compensation_effect {
namespace {

using Settings = effects::GravityCompensation;

constexpr std::array kKeys{
    SceneKey{"mass_kg", "kg", kHandleKg, "required", "The mass of the device's handle."},
    SceneKey{"down", "", kFiniteRange, "required",
             "The direction of gravity [x, y, z], scene frame (LPS), of any length."}};

Settings read(const EffectTable& from) {
    const TomlTable& table = from.table;
    table.require("mass_kg", "give the mass of the device's handle in kg");
    Settings effect;
    effect.mass_kg = table.number("mass_kg", kHandleKg, 0.0);
    effect.down = read_triple(table, "down", ", the direction of gravity", kFiniteRange);
    if (!(glm::length(effect.down) > 0.0))
        table.fail(table.line_of("down"), fmt::format("down {} has no direction", table.where()),
                   "give the direction of gravity, as down = [0, 0, -1]");
    return effect;
}

void check(const EffectCheck& check, const Settings& effect) {
    check.fields.number("mass_kg", effect.mass_kg, kHandleKg);
    check.fields.direction("down", effect.down);
}

EffectNeeds plan(const PlanContext&, const Settings& effect) {
    if (effect.mass_kg == 0.0) return off("mass_kg is 0: there is nothing to carry");
    return on("a force on the device beside the coupling: needs no query");
}

std::string order(const Settings& effect) { return order_text(effect.mass_kg, effect.down); }

std::unique_ptr<Effect> make(const Settings& effect, const EffectParts&) {
    return std::make_unique<GravityCompensation>(effect.mass_kg, effect.down);
}

} // namespace
} // namespace palpate::internal::gravity_compensation_effect

namespace palpate::effects {

constinit const internal::EffectRoom<GravityCompensation> GravityCompensation::room{
    .traits = {.name = "gravity_compensation",
               .keys = internal::gravity_compensation_effect::kKeys,
               .beside_soft = true},
    .read = internal::gravity_compensation_effect::read,
    .check = internal::gravity_compensation_effect::check,
    .plan = internal::gravity_compensation_effect::plan,
    .own = {.order = internal::gravity_compensation_effect::order,
            .make = internal::gravity_compensation_effect::make},
};

} // namespace palpate::effects
