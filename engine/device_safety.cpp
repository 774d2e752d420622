// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/device_safety.h>

#include <algorithm>

#include <fmt/format.h>

namespace palpate {
namespace {

constexpr double kGravity = 9.81;       // m/s^2
constexpr double kOwnForceMargin = 1.2; // over forces that act of themselves: calm is above them
constexpr double kActivePower_w = 0.5;  // a weight of 1 N let down at 0.5 m/s

/// Longest force that an effect exerts without a spring that asks for it, N; 0 where none.
double own_force_n(const EffectDescription& effect) {
    switch (effect.kind) {
    case EffectKind::constant_force:
        return glm::length(Vec3{effect.force_n[0], effect.force_n[1], effect.force_n[2]});
    case EffectKind::gravity_compensation:
        return kGravity * effect.mass_kg;
    case EffectKind::gradient_force:
    case EffectKind::vector_force: {
        double longest = 0.0;
        for (std::size_t i = 0; i < effect.strength.count; ++i)
            longest = std::max(longest, effect.strength.nodes[i].strength_n);
        return longest;
    }
    default:
        return 0.0;
    }
}

/// Whether an effect may pull a hand that has not pressed before, or shakes it.
bool draws(EffectKind kind) {
    return kind == EffectKind::vibration || kind == EffectKind::magnet || kind == EffectKind::guide;
}

} // namespace

SafeCoupling safe_coupling(const CouplingDescription& wanted, double rate_hz,
                           const DeviceProperties& device) {
    SafeCoupling safe{{wanted.stiffness_n_per_m, wanted.damping_n_s_per_m}, {}};
    if (device.force_n <= 0.0) return safe;
    const double b = device.damping_n_s_per_m;
    VirtualCoupling& coupling = safe.coupling;
    coupling.stiffness = std::min(coupling.stiffness, device.stiffness_n_per_m);
    if (b > 0.0) {
        coupling.damping = std::min(coupling.damping, 0.5 * b);
        const double held_s = 0.5 / rate_hz; // on average, of a frame's force
        coupling.stiffness = std::min(coupling.stiffness, (b - coupling.damping) / held_s);
    }
    if (coupling.stiffness < wanted.stiffness_n_per_m ||
        coupling.damping < wanted.damping_n_s_per_m)
        safe.warning = fmt::format(
            "coupling lowered from {:.6g} N/m and {:.6g} N s/m to {:.6g} N/m and {:.6g} N s/m: {}",
            wanted.stiffness_n_per_m, wanted.damping_n_s_per_m, coupling.stiffness,
            coupling.damping,
            coupling.stiffness == device.stiffness_n_per_m
                ? fmt::format("{} is made for no more; write these into [coupling]", device.name)
                : fmt::format("k T/2 + k_d above the damping of {}, {:.6g} N s/m, would give the "
                              "hand energy; write these into [coupling], or raise rate_hz",
                              device.name, b));
    return safe;
}

SafetySettings safety_settings(const SceneDescription& scene, double rate_hz,
                               double stiffness_n_per_m, const DeviceProperties& device) {
    SafetySettings settings;
    settings.force_n = scene.limits.force_n;
    settings.slew_n_per_s = scene.limits.slew_n_per_s;
    settings.period_s = 1.0 / rate_hz;
    if (device.force_n <= 0.0) return settings;

    settings.feedback = ForceFeedback::motors;
    settings.force_n = std::min(settings.force_n, device.force_n);
    settings.passivity.stiffness_n_per_m = stiffness_n_per_m;
    settings.passivity.damping_n_s_per_m = device.damping_n_s_per_m;
    settings.passivity.delay_s = device.delay_s;
    double own_n = 0.0;
    bool active = false;
    for (const EffectDescription& effect : scene.effects) {
        own_n += std::min(own_force_n(effect), settings.force_n);
        active = active || draws(effect.kind);
    }
    settings.small_force_n = std::max(settings.small_force_n, kOwnForceMargin * own_n);
    if (active || own_n > 0.0) settings.passivity.active_w = kActivePower_w;
    return settings;
}

} // namespace palpate
