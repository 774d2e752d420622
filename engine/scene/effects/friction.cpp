// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/effects/friction.h>

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include <palpate/engine/scene/internal/contact_price.h>
#include <palpate/engine/scene/internal/effect_keys.h>
#include <palpate/engine/scene/internal/plan_warnings.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/haptics/effects/coulomb_friction.h>
#include <palpate/haptics/solver/proxy_solver.h>
#include <palpate/haptics/stepping/subdivision.h>

namespace palpate::internal::friction_effect {
namespace {

constexpr std::array kKeys{
    kSurfaceKey,
    SceneKey{"static", "", kCoefficient, "as the surface's material; else required",
             "The coefficient at rest."},
    SceneKey{"dynamic", "", kCoefficient, "as the surface's material; else as static",
             "The coefficient while sliding, at most the one at rest."}};

template <class Settings>
Settings read(const EffectTable& from) {
    const FrictionCoefficients read =
        read_friction(from.table, material_of(from.scene, from.surface));
    return {.surface = from.surface, .static_mu = read.static_mu, .dynamic_mu = read.dynamic_mu};
}

template <class Settings>
void check(const EffectCheck& check, const Settings& effect) {
    const FieldCheck& fields = check.fields;
    check_surface_name(check, effect.surface);
    fields.number("static_mu", effect.static_mu, kCoefficient);
    fields.number("dynamic_mu", effect.dynamic_mu, kCoefficient);
    if (effect.dynamic_mu > effect.static_mu)
        fields.fail(
            "dynamic_mu",
            fmt::format("= {} is above static_mu = {}", effect.dynamic_mu, effect.static_mu),
            "give at most as much friction while sliding as at rest");
}

FrictionCoefficients coefficients_of(const effects::Friction& effect) {
    return {effect.static_mu, effect.dynamic_mu, false};
}
FrictionCoefficients coefficients_of(const effects::StickSlip& effect) {
    return {effect.static_mu, effect.dynamic_mu, true};
}

template <class Settings>
EffectNeeds plan(const PlanContext& context, const Settings& effect, std::string_view how) {
    if (coefficients_of(effect).none()) return off("static is 0: it cannot be felt");
    if (context.has_earlier<effects::Friction, effects::StickSlip>(effect.surface))
        return off("the same surface has friction already");
    return on(how);
}

EffectNeeds plan_friction(const PlanContext& context, const effects::Friction& effect) {
    return plan(context, effect,
                "a line along each contact's normal, as strong as the coefficient times what "
                "presses: needs no query");
}

EffectNeeds plan_stick_slip(const PlanContext& context, const effects::StickSlip& effect) {
    return plan(context, effect, "friction that comes to rest after each slip: needs no query");
}

template <class Settings>
void finish(const Settings& effect, SurfaceFinish& finish, const EffectFields&) {
    finish.friction = coefficients_of(effect);
}

/// A line for each plane of the surface.
template <class Settings>
std::size_t most_primitives(const Settings&, const SceneSurface& surface) {
    return most_planes(surface);
}

/// What friction adds to the solution of one contact that slides.
template <class Settings>
double price_us(const Settings& effect, const PricedSurface&) {
    CoulombFriction friction({coefficients_of(effect)});
    ContactPlane contact;
    contact.plane = {Vec3{0.0}, Vec3{0.0, 0.0, 1.0}, kInfinity};
    const std::vector<Vec3> points(2000, Vec3{1e-3, 0.0, -1e-3});
    const auto price = [&](bool rubs) {
        return median_us(points, [&](const Vec3& from, const Vec3& to) {
            ContactSet contacts;
            contacts.add(contact);
            PrimitiveSet primitives;
            primitives.add(contact.plane);
            if (!rubs) return static_cast<void>(solve_proxy(primitives, to, kPricedStiffness));
            friction.begin();
            friction.gather(from - to, contacts, primitives);
            int work = Subdivision::kWorkOfSolvers;
            ProxySolution solution;
            friction.solve(primitives, to, kPricedStiffness, work, solution);
        });
    };
    return std::max(0.0, price(true) - price(false));
}

template <class Settings>
constexpr OnSurface<Settings> kOnSurface{.finish = finish<Settings>,
                                         .most_primitives = most_primitives<Settings>,
                                         .price_us = price_us<Settings>};

} // namespace
} // namespace palpate::internal::friction_effect

namespace palpate::effects {

constinit const internal::EffectRoom<Friction> Friction::room{
    .traits = {.name = "friction",
               .keys = internal::friction_effect::kKeys,
               .part = SurfacePart::friction,
               .beside_soft = true},
    .read = internal::friction_effect::read<Friction>,
    .check = internal::friction_effect::check<Friction>,
    .plan = internal::friction_effect::plan_friction,
    .on_surface = internal::friction_effect::kOnSurface<Friction>,
};

constinit const internal::EffectRoom<StickSlip> StickSlip::room{
    .traits = {.name = "stick_slip",
               .keys = internal::friction_effect::kKeys,
               .part = SurfacePart::friction,
               .beside_soft = true},
    .read = internal::friction_effect::read<StickSlip>,
    .check = internal::friction_effect::check<StickSlip>,
    .plan = internal::friction_effect::plan_stick_slip,
    .on_surface = internal::friction_effect::kOnSurface<StickSlip>,
};

} // namespace palpate::effects
