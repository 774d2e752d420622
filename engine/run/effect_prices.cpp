// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/run/effect_prices.h>

#include <algorithm>
#include <vector>

#include <palpate/engine/run/internal/felt_places.h>
#include <palpate/engine/scene/internal/contact_price.h>
#include <palpate/engine/scene/internal/effect_questions.h>
#include <palpate/engine/scene/loop_parts.h>
#include <palpate/engine/scene/scene_surface.h>

namespace palpate {

std::vector<double> measure_prices(const Scene& scene) {
    std::vector<double> prices(scene.plan().effects.size(), 0.0);
    const LoopParts parts = scene.make_parts();
    for (const PlannedEffect& planned : scene.plan().effects) {
        if (!planned.on) continue;
        const EffectDescription& effect = scene.description().effects[planned.effect];
        if (internal::traits_of(effect).part) {
            for (std::size_t i = 0; i < scene.surfaces().size(); ++i) {
                const SceneSurface& surface = scene.surfaces()[i];
                if (surface.name != surface_of(effect)) continue;
                const std::vector<Vec3> places = internal::places_on(surface, 0.0);
                prices[planned.effect] =
                    internal::price_on(effect, {scene, surface, parts.finish[i], places});
            }
            continue;
        }
        const auto& order = scene.effect_order();
        const auto place = std::find(order.begin(), order.end(), planned.effect) - order.begin();
        Effect& built = *parts.effects[static_cast<std::size_t>(place)];
        const std::vector<Vec3> points = internal::places_where_felt(scene, effect, built);
        prices[planned.effect] = internal::median_us(points, [&](const Vec3& from, const Vec3& to) {
            PrimitiveSet primitives;
            built.begin(internal::frame_from(from, to));
            built.gather(from, primitives);
            built.solved(to);
            built.commit({to, 0}); // one that goes along begins its next frame there
        });
    }
    return prices;
}

} // namespace palpate
