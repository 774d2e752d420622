// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/effects/viscosity.h>

#include <array>

#include <fmt/format.h>

#include <palpate/engine/scene/internal/effect_fields.h>
#include <palpate/engine/scene/internal/effect_keys.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/haptics/effects/viscosity.h>

namespace palpate::internal::viscosity_effect {
namespace {

using Settings = effects::Viscosity;

constexpr const char* kKey = "damping_n_s_per_m";
constexpr std::array kKeys{
    SceneKey{"volume", "", {}, "none", "The volume of scalars whose value the damping is over."},
    SceneKey{"surface", "", {}, "none", "The surface that it is inside of, or several of them."},
    SceneKey{kKey, "N s/m", kDamping, "as the surface's material; else required",
             "The damping: a number, or with a volume a function of its value."},
    kMovesWithKey};

/// A mesh alone has no inside.
constexpr const char* kNoInside = "is a mesh alone, which has no inside to be viscous";
constexpr const char* kNoInsideRemedy = "name a surface of a volume";

/// Inside of a surface.
TransferFunction read_damping_inside(const EffectTable& from) {
    const TomlTable& table = from.table;
    const SurfaceDescription& surface = from.scene.surfaces.at(from.surface);
    if (surface.volume.empty())
        table.fail(table.line_of("surface"),
                   fmt::format("surface \"{}\" {} {}", from.surface, table.where(), kNoInside),
                   kNoInsideRemedy);
    const std::optional<double> of_material =
        material_of(from.scene, from.surface).damping_n_s_per_m;
    if (!of_material)
        table.require(kKey, surface.material.empty()
                                ? "give it in N s/m, or give the surface a material that has it"
                                : fmt::format("give it in N s/m, here or in [material.{}]",
                                              surface.material));
    return TransferFunction::constant(table.number(kKey, kDamping, of_material.value_or(0.0)));
}

Settings read(const EffectTable& from) {
    const TomlTable& table = from.table;
    if (table.has("volume") && table.has("surface"))
        table.fail(table.line_of("surface"),
                   fmt::format("volume and surface {} exclude each other", table.where()),
                   "keep one of them");
    Settings effect;
    effect.surface = from.surface;
    if (table.has("volume")) effect.volume = read_effect_volume(from, FieldNeed::scalar);
    if (!effect.surface.empty()) {
        effect.strength = read_damping_inside(from);
        return effect;
    }
    effect.strength = read_effect_function(from, kKey, kDamping, "N s/m");
    require_volume(from, kKey, "N s/m");
    return effect;
}

void check(const EffectCheck& check, const Settings& effect) {
    const FieldCheck& fields = check.fields;
    fields.function("strength", effect.strength, kDamping);
    if (!effect.volume.empty() && !effect.surface.empty())
        fields.fail("surface", "and volume exclude each other", "keep one of them");
    if (!effect.volume.empty()) return check_field_volume(check, FieldNeed::scalar, effect.volume);
    if (effect.strength.count > 1)
        fields.fail("strength", "is a function, and no volume says of what",
                    "name the volume, or give one number of N s/m");
    if (effect.surface.empty()) return;
    check_surface_name(check, effect.surface);
    if (check.scene.surfaces.at(effect.surface).volume.empty())
        fields.fail("surface", fmt::format("= \"{}\" {}", effect.surface, kNoInside),
                    kNoInsideRemedy);
}

EffectNeeds plan(const PlanContext& context, const Settings& effect) {
    constexpr const char* how = "a spring to the frame's start: an exact shift and scale";
    if (effect.strength.is_zero())
        return off("damping_n_s_per_m is 0 everywhere: it cannot be felt");
    if (!effect.surface.empty())
        return on_at_start(how, field_of_surface(context.scene, effect.surface));
    return on_at_start_of(how, effect.volume);
}

std::string order(const Settings& effect) {
    return order_text(effect.surface, effect.volume, effect.strength);
}

/// Behind a surface, from where its certificate allows nobody who has not gone through.
TransferFunction damping_inside(const SceneSurface& surface, double damping_n_s_per_m) {
    const double level = surface.level.level;
    const LevelScale scale = LevelScale::of(*surface.baked.field, surface.level);
    TransferFunction damping;
    damping.count = 2;
    damping.nodes[0] = {level + scale.certificate, 0.0};
    damping.nodes[1] = {level + 2.0 * scale.certificate, damping_n_s_per_m};
    return damping;
}

std::unique_ptr<Effect> make(const Settings& effect, const EffectParts& parts) {
    if (parts.surface != nullptr)
        return std::make_unique<Viscosity>(parts.surface_field,
                                           damping_inside(*parts.surface, effect.strength(0.0)));
    if (effect.volume.empty()) return std::make_unique<Viscosity>(effect.strength(0.0));
    return std::make_unique<Viscosity>(parts.fields.scalars.at(effect.volume), effect.strength);
}

} // namespace
} // namespace palpate::internal::viscosity_effect

namespace palpate::effects {

constinit const internal::EffectRoom<Viscosity> Viscosity::room{
    .traits = {.name = "viscosity",
               .keys = internal::viscosity_effect::kKeys,
               .need = internal::FieldNeed::scalar},
    .read = internal::viscosity_effect::read,
    .check = internal::viscosity_effect::check,
    .plan = internal::viscosity_effect::plan,
    .own = {.order = internal::viscosity_effect::order, .make = internal::viscosity_effect::make},
};

} // namespace palpate::effects
