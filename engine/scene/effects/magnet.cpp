// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/effects/magnet.h>

#include <algorithm>
#include <array>

#include <palpate/engine/scene/internal/contact_price.h>
#include <palpate/engine/scene/internal/effect_fields.h>
#include <palpate/engine/scene/internal/effect_keys.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/haptics/effects/surface_magnets.h>

namespace palpate::internal::magnet_effect {
namespace {

using effects::Magnet;

constexpr std::array kKeys{kSurfaceKey,
                           SceneKey{"strength_n", "N", kStrengthN, "required",
                                    "The force that it takes to pull the proxy off."},
                           SceneKey{"capture_mm", "mm", kMagnetCaptureMm, "1",
                                    "It snaps on when the proxy is this near at a frame's start."},
                           kPlaceVolumeKey};

Magnet read(const EffectTable& from) {
    from.table.require("strength_n", "give the force in N that it takes to pull the proxy off");
    StrengthByPlace strength = read_strength_by_place(from, kStrengthN, 0.0);
    return {.surface = from.surface,
            .strength_n = strength.strength_n,
            .capture_m = 1e-3 * from.table.number("capture_mm", kMagnetCaptureMm, 1.0),
            .volume = std::move(strength.volume),
            .strength = strength.strength};
}

void check(const EffectCheck& check, const Magnet& effect) {
    check_surface_name(check, effect.surface);
    check.fields.number("strength_n", effect.strength_n, kStrengthN);
    check.fields.number("capture_m", effect.capture_m, scaled(kMagnetCaptureMm, 1e-3));
    check_strength_by_place(check, effect.volume, effect.strength, kStrengthN);
}

EffectNeeds plan(const PlanContext& context, const Magnet& effect) {
    if (effect.strength_n == 0.0) return off("strength_n is 0: it cannot be felt");
    if (context.has_earlier<Magnet>(effect.surface))
        return off("the same surface has a magnet already");
    return on_at_start_of("a plane at the surface's own level that draws from behind: takes the "
                          "surface's sample, or the closest point of its mesh",
                          effect.volume);
}

void finish(const Magnet& effect, SurfaceFinish& finish, const EffectFields& fields) {
    finish.magnet = {effect.strength_n, effect.capture_m,
                     strength_over(effect.volume, effect.strength, fields)};
}

double in_front_m(const Magnet& effect, const SceneSurface&) { return effect.capture_m; }

std::size_t most_primitives(const Magnet&, const SceneSurface&) { return 1; }

double price_us(const Magnet&, const PricedSurface& priced) {
    return std::max(0.0, contact_price(priced, PricedWork::solution, priced.finish.magnet) -
                             contact_price(priced, PricedWork::solution, {}));
}

} // namespace
} // namespace palpate::internal::magnet_effect

namespace palpate::effects {

constinit const internal::EffectRoom<Magnet> Magnet::room{
    .traits = {.name = "magnet",
               .keys = internal::magnet_effect::kKeys,
               .need = internal::FieldNeed::scalar,
               .part = SurfacePart::magnet},
    .read = internal::magnet_effect::read,
    .check = internal::magnet_effect::check,
    .plan = internal::magnet_effect::plan,
    .on_surface = {.finish = internal::magnet_effect::finish,
                   .in_front_m = internal::magnet_effect::in_front_m,
                   .most_primitives = internal::magnet_effect::most_primitives,
                   .price_us = internal::magnet_effect::price_us},
};

} // namespace palpate::effects
