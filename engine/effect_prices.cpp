// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include <palpate/engine/internal/effect_kinds.h>
#include <palpate/engine/orbit.h>
#include <palpate/engine/trace.h>

namespace palpate {
namespace {

constexpr std::size_t kPoints = 2000; // evaluations timed
constexpr std::size_t kPerReading =
    10; // evaluations between two readings of the clock, whose cost is then below 1 %
constexpr double kSpeed = 0.2; // m/s: how far apart a hand's frames are

/// Places where a hand would be along an orbit on the surface. None where the orbit's rays miss a
/// surface that is small: its price is then not known.
std::vector<Vec3> places_on(const SceneSurface& surface) {
    std::vector<Vec3> points;
    DeviceDescription orbit;
    orbit.depth_min_mm = orbit.depth_max_mm = 0.0;
    orbit.speed_m_per_s = kSpeed;
    orbit.duration_s = kPoints / 1000.0 + 0.5;
    try {
        for (const DeviceState& state : make_orbit(orbit_target(surface), orbit, 1000.0))
            points.push_back(state.position);
    } catch (const std::runtime_error&) {
        points.clear();
    }
    return points;
}

/// The same across the box of a field.
std::vector<Vec3> places_across(const Box& box) {
    std::vector<Vec3> points;
    for (std::size_t i = 0; i < kPoints; ++i)
        points.push_back(box.center() +
                         Vec3{(static_cast<double>(i) - kPoints / 2.0) * kSpeed / 1000.0, 0, 0});
    return points;
}

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
    if (contact.slides()) return contact.slide(proxy, hand).corner;
    return proxy + contact.carry(proxy, hand).fraction * (hand - proxy);
}

double surface_price(const Scene& scene, const SceneSurface& surface) {
    const std::unique_ptr<SurfaceContact> contact = scene.make_contact(surface);
    const std::vector<Vec3> points = places_on(surface);
    if (points.empty()) return 0.0;
    contact->restart(points.front());
    Vec3 proxy = points.front();
    // The volume's contacts take the hand's own places, which are on the level; a mesh's side is a
    // label, which only its own way tells.
    const bool own_way = surface.is_felt_by_mesh();
    return median_us(points, [&](const Vec3& from, const Vec3& to) {
        ContactSet planes;
        contact->offer(own_way ? proxy : from, planes);
        if (own_way)
            proxy = followed(*contact, proxy, to);
        else
            contact->carry(from, to);
    });
}

/// What friction adds to the solution of one contact that slides.
double friction_price(const FrictionCoefficients& coefficients) {
    CoulombFriction friction({coefficients});
    ContactPlane contact;
    contact.plane = {Vec3{0.0}, Vec3{0.0, 0.0, 1.0}, std::numeric_limits<double>::infinity()};
    const std::vector<Vec3> points(kPoints, Vec3{1e-3, 0.0, -1e-3});
    const double k = 500.0; // N/m: any
    const auto price = [&](bool rubs) {
        return median_us(points, [&](const Vec3& from, const Vec3& to) {
            const std::array<std::size_t, 2> first{0, 1};
            ContactSet contacts;
            contacts.add(contact);
            PrimitiveSet primitives;
            primitives.add(contact.plane);
            if (!rubs) return static_cast<void>(solve_proxy(primitives, to, k));
            friction.begin();
            friction.gather(from - to, contacts, first, primitives);
            static_cast<void>(friction.solve(primitives, to, k));
        });
    };
    return std::max(0.0, price(true) - price(false));
}

/// What a texture adds to a surface's sample.
double texture_price(const SceneSurface& surface) {
    SurfaceTexture texture(surface.texture, surface.baked.field->relief_limit_m());
    const auto sampler = surface.baked.field->make_sampler();
    const std::vector<Vec3> points = places_on(surface);
    if (points.empty()) return 0.0;
    const FieldSample bare = sampler->sample(points.front());
    double felt = 0.0;
    const double price = median_us(points, [&](const Vec3& from, const Vec3&) {
        felt += texture.felt(bare, from).value; // else there would be nothing to time
    });
    return std::isfinite(felt) ? price : 0.0;
}

double price_on(const SceneSurface& surface, const Scene& scene, const EffectDescription& effect) {
    if (effect.kind == EffectKind::surface) return surface_price(scene, surface);
    if (effect.kind == EffectKind::texture) return texture_price(surface);
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
            for (const SceneSurface& surface : scene.surfaces())
                if (surface.name == effect.surface)
                    prices[planned.effect] = price_on(surface, scene, effect);
            continue;
        }
        const auto& order = scene.effect_order();
        const auto place = std::find(order.begin(), order.end(), planned.effect) - order.begin();
        Effect& built = *parts.effects[static_cast<std::size_t>(place)];
        std::vector<Vec3> points(kPoints, Vec3{0.0});
        if (const std::optional<Box> bounds = scene.effect_bounds(effect.volume))
            points = places_across(*bounds);
        prices[planned.effect] = median_us(points, [&](const Vec3& from, const Vec3& to) {
            PrimitiveSet primitives;
            built.begin({to, from});
            built.gather(from, primitives);
        });
    }
    return prices;
}

} // namespace palpate
