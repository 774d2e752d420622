// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/loop/device_safety.h>

#include <algorithm>

#include <fmt/format.h>

namespace palpate {

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
            coupling.stiffness < wanted.stiffness_n_per_m &&
                    coupling.damping == wanted.damping_n_s_per_m &&
                    coupling.stiffness == device.stiffness_n_per_m
                ? fmt::format("{} is made for no more; write these into [coupling]", device.name)
                : fmt::format("k T/2 + k_d above the damping of {}, {:.6g} N s/m, would give the "
                              "hand energy; write these into [coupling], or raise rate_hz",
                              device.name, b));
    return safe;
}

SafetySettings safety_settings(const LimitsDescription& limits, double rate_hz,
                               double stiffness_n_per_m, const DeviceProperties& device) {
    SafetySettings settings;
    settings.force_n = limits.force_n;
    settings.slew_n_per_s = limits.slew_n_per_s;
    settings.period_s = 1.0 / rate_hz;
    // At 50 Hz a frame is as long as the time constant; not all of the stiffness goes in one.
    settings.soften_s = std::max(settings.soften_s, 2.0 * settings.period_s);
    if (device.force_n <= 0.0) return settings;

    settings.feedback = ForceFeedback::motors;
    settings.force_n = std::min(settings.force_n, device.force_n);
    settings.passivity.stiffness_n_per_m = stiffness_n_per_m;
    settings.passivity.damping_n_s_per_m = device.damping_n_s_per_m;
    settings.passivity.delay_s = device.delay_s;
    // What a hand may get and how fast it can move is said of the hand; the chain counts in the
    // scene.
    settings.fastest_m_per_s *= device.scale;
    settings.unasked_w *= device.scale;
    settings.passivity.bank_j *= device.scale;
    settings.passivity.reserve_j *= device.scale;
    return settings;
}

} // namespace palpate
