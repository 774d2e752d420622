// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <palpate/engine/internal/effect_kinds.h>
#include <palpate/engine/internal/felt_places.h>
#include <palpate/engine/trace.h>

namespace palpate {
namespace {

constexpr std::size_t kPerReading =
    10; // evaluations between two readings of the clock, whose cost is then below 1 %
constexpr double kStiffness = 500.0; // N/m: any

/// Median us of `evaluate(from, to)` over successive points.
template <class Evaluate>
double median_us(const std::vector<Vec3>& points, const Evaluate& evaluate) {
    SteadyClock clock;
    std::vector<double> readings;
    for (std::size_t i = 0; i + kPerReading < points.size(); i += kPerReading) {
        const double began = clock.now_us();
        for (std::size_t k = 0; k < kPerReading; ++k)
            evaluate(points[i + k], points[i + k + 1]);
        readings.push_back((clock.now_us() - began) / kPerReading);
    }
    if (readings.empty()) return 0.0;
    std::nth_element(readings.begin(), readings.begin() + readings.size() / 2, readings.end());
    return readings[readings.size() / 2];
}

/// A piece of way of a proxy that follows the hand: led where the surface leads, else towards it.
Vec3 followed(SurfaceContact& contact, const Vec3& proxy, const Vec3& hand) {
    if (SlidingSurface* surface = contact.sliding()) return surface->slide(proxy, hand).corner;
    return proxy + contact.carry(proxy, hand).fraction * (hand - proxy);
}

/// What an evaluation costs that feels a surface, as the proxy goes along it; with the solution,
/// and a magnet that holds it, where there is one.
double contact_price(const Scene& scene, const SceneSurface& surface, bool solves,
                     const SurfaceMagnet& magnet) {
    const std::unique_ptr<SurfaceContact> contact = scene.make_contact(surface);
    const std::vector<Vec3> points = internal::places_on(surface, 0.0);
    if (points.empty()) return 0.0;
    LoopMagnet loop_magnet(magnet);
    contact->restart(points.front());
    Vec3 proxy = points.front();
    // The volume's contacts take the hand's own places, which are on the level; a mesh's side is a
    // label, which only its own way tells.
    const bool own_way = surface.is_felt_by_mesh();
    return median_us(points, [&](const Vec3& from, const Vec3& to) {
        const Vec3 at = own_way ? proxy : from;
        ContactSet planes;
        if (!magnet.none()) loop_magnet.begin({to, at});
        loop_magnet.offer(at, to, *contact, planes);
        loop_magnet.gather(planes);
        if (solves) {
            PrimitiveSet primitives;
            for (std::size_t i = 0; i < planes.size(); ++i)
                primitives.add(planes[i].plane);
            static_cast<void>(solve_proxy(primitives, to, kStiffness));
        }
        if (own_way)
            proxy = followed(*contact, proxy, to);
        else
            contact->carry(from, to);
    });
}

/// A surface as if nothing but itself were felt on it.
SceneSurface without_texture(SceneSurface surface) {
    surface.texture = {};
    return surface;
}

double surface_price(const Scene& scene, const SceneSurface& surface) {
    return contact_price(scene, without_texture(surface), false, {});
}

/// What a texture adds to its surface.
double texture_price(const Scene& scene, const SceneSurface& surface) {
    return std::max(0.0, contact_price(scene, surface, false, {}) - surface_price(scene, surface));
}

/// What a magnet that holds adds to its surface.
double magnet_price(const Scene& scene, const SceneSurface& surface, const SurfaceMagnet& magnet) {
    return std::max(0.0, contact_price(scene, surface, true, magnet) -
                             contact_price(scene, surface, true, {}));
}

/// What friction adds to the solution of one contact that slides.
double friction_price(const FrictionCoefficients& coefficients) {
    CoulombFriction friction({coefficients});
    ContactPlane contact;
    contact.plane = {Vec3{0.0}, Vec3{0.0, 0.0, 1.0}, std::numeric_limits<double>::infinity()};
    const std::vector<Vec3> points(2000, Vec3{1e-3, 0.0, -1e-3});
    const auto price = [&](bool rubs) {
        return median_us(points, [&](const Vec3& from, const Vec3& to) {
            ContactSet contacts;
            contacts.add(contact);
            PrimitiveSet primitives;
            primitives.add(contact.plane);
            if (!rubs) return static_cast<void>(solve_proxy(primitives, to, kStiffness));
            friction.begin();
            friction.gather(from - to, contacts, primitives);
            int work = Subdivision::kWorkOfSolvers;
            static_cast<void>(friction.solve(primitives, to, kStiffness, work));
        });
    };
    return std::max(0.0, price(true) - price(false));
}

double price_on(const Scene& scene, std::size_t surface, const SurfaceFinish& finish,
                const EffectDescription& effect) {
    const SceneSurface& of = scene.surfaces()[surface];
    if (effect.kind == EffectKind::surface) return surface_price(scene, of);
    if (effect.kind == EffectKind::texture) return texture_price(scene, of);
    if (effect.kind == EffectKind::magnet) return magnet_price(scene, of, finish.magnet);
    return effect.friction.none() ? 0.0 : friction_price(effect.friction);
}

} // namespace

std::vector<double> measure_prices(const Scene& scene) {
    std::vector<double> prices(scene.plan().effects.size(), 0.0);
    const LoopParts parts = scene.make_parts();
    for (const PlannedEffect& planned : scene.plan().effects) {
        if (!planned.on) continue;
        const EffectDescription& effect = scene.description().effects[planned.effect];
        if (internal::traits_of(effect.kind).of_surface) {
            for (std::size_t i = 0; i < scene.surfaces().size(); ++i)
                if (scene.surfaces()[i].name == effect.surface)
                    prices[planned.effect] = price_on(scene, i, parts.finish[i], effect);
            continue;
        }
        const auto& order = scene.effect_order();
        const auto place = std::find(order.begin(), order.end(), planned.effect) - order.begin();
        Effect& built = *parts.effects[static_cast<std::size_t>(place)];
        const std::vector<Vec3> points = internal::places_where_felt(scene, effect, built);
        prices[planned.effect] = median_us(points, [&](const Vec3& from, const Vec3& to) {
            PrimitiveSet primitives;
            built.begin({to, from});
            built.gather(from, primitives);
        });
    }
    return prices;
}

} // namespace palpate
