// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/effects/surface.h>

#include <array>

#include <palpate/engine/scene/contact_choice.h>
#include <palpate/engine/scene/internal/contact_price.h>
#include <palpate/engine/scene/internal/effect_keys.h>
#include <palpate/engine/scene/internal/plan_warnings.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/scene/soft_surfaces.h>

namespace palpate::internal::surface_effect {
namespace {

using effects::Surface;

constexpr std::array kKeys{kSurfaceKey};

Surface read(const EffectTable& from) { return {.surface = from.surface}; }

void check(const EffectCheck& check, const Surface& effect) {
    check_surface_name(check, effect.surface);
}

/// Also by an effect that is off.
bool is_named_already(const PlanContext& context, const std::string& surface) {
    for (const PlannedEffect& planned : context.earlier) {
        const EffectDescription& effect = context.scene.effects[planned.effect];
        if (makes_surface_felt(effect) && surface_of(effect) == surface) return true;
    }
    return false;
}

EffectNeeds plan(const PlanContext& context, const Surface& effect) {
    const SurfaceDescription& surface = context.scene.surfaces.at(effect.surface);
    const ContactChoice choice = choose_contact(context.scene, surface, context.extraction);
    EffectNeeds needs = is_named_already(context, effect.surface)
                            ? off("the same surface is felt already")
                        : surface.strength_n == 0.0 ? off("strength_n is 0: it cannot be felt")
                                                    : on("felt up to its strength; " + choice.why);
    if (const std::string soft = softness_in_words(context.scene, surface);
        needs.planned.on && !soft.empty())
        needs.planned.reason += "; " + soft;
    PlannedEffect& planned = needs.planned;
    planned.contact = name(choice.kind);
    if (!planned.on) return needs;
    planned.needs_mesh = needs_mesh(choice.kind);
    planned.rays = planned.needs_mesh ? 1.0 : 0.0;
    if (samples_field(choice.kind)) {
        planned.samples = 1.0;
        needs.at_proxy = field_of_surface(context.scene, effect.surface);
    }
    const bool certified_by_field =
        choice.kind == ContactKind::volume || choice.kind == ContactKind::guarded;
    planned.roots = certified_by_field ? 1.0 : 0.0;
    planned.needs_hessian = certified_by_field;
    if (!surface.strength_volume.empty()) {
        planned.start_samples = 1.0;
        needs.at_start = {FieldNeed::scalar, surface.strength_volume, ""};
    }
    return needs;
}

std::size_t most_primitives(const Surface&, const SceneSurface& surface) {
    return most_planes(surface);
}

double price_us(const Surface&, const PricedSurface& priced) { return bare_price(priced); }

} // namespace
} // namespace palpate::internal::surface_effect

namespace palpate::effects {

constinit const internal::EffectRoom<Surface> Surface::room{
    .traits = {.name = "surface",
               .keys = internal::surface_effect::kKeys,
               .part = SurfacePart::strength,
               .beside_soft = true},
    .read = internal::surface_effect::read,
    .check = internal::surface_effect::check,
    .plan = internal::surface_effect::plan,
    .on_surface = {.most_primitives = internal::surface_effect::most_primitives,
                   .price_us = internal::surface_effect::price_us},
};

} // namespace palpate::effects
