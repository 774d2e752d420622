// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <vector>

#include <palpate/drivers/simulated_hand.h>
#include <palpate/engine/devices/orbit.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/scene/soft_surfaces.h>

#include "tests/support/scripted_clock.h"

namespace palpate::test {

/// What stands between coupling and motors.
enum class Protection {
    limits,     ///< force and slew limits alone
    controller, ///< the safety chain, but with the stiffness that was asked for
    chain       ///< the safety chain with the stiffness that it lowers
};

/// Where a hand presses: a point of a surface, and the direction out of it, of length 1.
struct PressedPoint {
    Vec3 point{0.0};
    Vec3 outward{0.0, 0.0, 1.0};
};

/// The first surface that is soft; without one, the first.
inline const SceneSurface& pressed_surface(const Scene& scene) {
    for (const SceneSurface& surface : scene.surfaces())
        if (is_soft(scene.description(), scene.description().surfaces.at(surface.name)))
            return surface;
    return scene.surfaces().front();
}

/// Where a ray from outside along -toward first meets the surface that is pressed, or where that
/// changes its stiffness most; and the direction out of it there. Throws std::runtime_error where
/// the ray meets none, or the surface has no field.
inline PressedPoint pressed_point(const Scene& scene, const Vec3& toward) {
    const SceneSurface& surface = pressed_surface(scene);
    if (const BakedStiffness& beneath = surface.baked.stiffness; beneath.map && surface.baked.field)
        return {beneath.steepest_at,
                -glm::normalize(
                    surface.baked.field->make_sampler()->sample(beneath.steepest_at).slope)};
    const OrbitTarget target = orbit_target(surface);
    const Vec3 center = target.bounds.center();
    const Vec3 from = center + glm::length(target.bounds.extent()) * toward;
    const auto share = target.first_crossing(from, center);
    if (!share || !surface.baked.field)
        throw std::runtime_error("the ray to the middle of the surface meets no level of a field");
    const Vec3 point = from + *share * (center - from);
    return {point, -glm::normalize(surface.baked.field->make_sampler()->sample(point).slope)};
}

/// What a press came to.
struct Press {
    double stiffness_n_per_m = 0.0;   ///< of the coupling, as used
    double oscillation_m_per_s = 0.0; ///< rms of the handle's velocity, 20-400 Hz, in the last
                                      ///< second of holding
    double slow_m_per_s = 0.0;        ///< the same of 5-20 Hz, where the tremor is
    double hand_work_j = 0.0;  ///< most that the hand had been given beyond what it had put in
    double motor_work_j = 0.0; ///< the same of the motors' work, before the device's own losses
    double force_n = 0.0;      ///< longest force that was sent
    double step_n = 0.0;       ///< largest change of it in one frame
    double pressed_n = 0.0;    ///< mean length of the force in the last second of holding
    double held_m = 0.0;       ///< rms of the handle about its mean in that second
    std::uint32_t flags = 0;   ///< FrameFlag bits that were seen
};

/// Root of the mean square that a signal has between two frequencies, over its whole length:
/// Fourier coefficients with a Hann window.
inline double rms_between(const std::vector<Vec3>& signal, double rate_hz, double low_hz,
                          double high_hz) {
    const auto n = static_cast<double>(signal.size());
    const double two_pi = 2.0 * std::numbers::pi;
    double power = 0.0;
    for (double bin = std::ceil(low_hz * n / rate_hz); bin <= high_hz * n / rate_hz; ++bin) {
        Vec3 cosines{0.0}, sines{0.0};
        for (std::size_t i = 0; i < signal.size(); ++i) {
            const auto at = static_cast<double>(i);
            const double window = 0.5 - 0.5 * std::cos(two_pi * at / n);
            const double angle = two_pi * std::fmod(bin * at, n) / n;
            cosines += window * std::cos(angle) * signal[i];
            sines += window * std::sin(angle) * signal[i];
        }
        // A sine of amplitude A has A^2/2; the window's mean square is 3/8.
        power += 2.0 * (squared_length(cosines) + squared_length(sines)) / (n * n * 0.375);
    }
    return std::sqrt(power);
}

/// Root of the mean square of how far places are from their mean, m.
inline double rms_about_mean(const std::vector<Vec3>& places) {
    const auto n = static_cast<double>(places.size());
    Vec3 mean{0.0};
    for (const Vec3& place : places)
        mean += place / n;
    double square = 0.0;
    for (const Vec3& place : places)
        square += squared_length(place - mean) / n;
    return std::sqrt(square);
}

/// A hand that holds loosely, which is the hard case: a firm one damps what the loop excites. The
/// device has a delay, half of it each way with a little jitter, and encoders of that step.
inline HandSettings pressing_hand(double delay_s, double step_m) {
    HandSettings settings;
    settings.arm.damping_n_s_per_m = 3.0;
    settings.grip = {600.0, 1.0, 0.0};
    settings.transport = {0.5 * delay_s, 0.5 * delay_s, delay_s > 0.0 ? 0.1e-3 : 0.0};
    settings.mechanism.step_m = step_m;
    return settings;
}

inline constexpr double kPressApproach_s = 0.5;
inline constexpr double kPressHold_s = 2.5;

/// A hand with these intents, which holds until `ends_s` and lets go within kPressApproach_s, in
/// closed loop with the scene at asap pace.
inline Press follow(const std::shared_ptr<const Scene>& scene, const HandSettings& settings,
                    const std::vector<HandIntent>& intents, double ends_s, Protection protection) {
    SimulatedHand hand(settings, intents);
    DeviceProperties properties = hand.properties();
    if (protection == Protection::limits) properties = DeviceProperties{};
    if (protection == Protection::controller) properties.damping_n_s_per_m = 0.0;
    ScriptedClock clock;
    LoopDescription stepping = scene->description().loop;
    stepping.rate_hz = settings.rate_hz;
    HapticLoop loop(scene, clock, stepping, properties);

    ends_s += settings.arm.reaction_s;
    const auto frames =
        static_cast<long>(settings.rate_hz * (ends_s + kPressApproach_s + 0.2)); // and is free
    Press result;
    result.stiffness_n_per_m = loop.coupling().stiffness;
    std::vector<Vec3> velocities, places;
    Vec3 before{0.0};
    for (long frame = 0; frame < frames; ++frame) {
        DeviceState state;
        hand.read(state);
        const FrameReport report = loop.frame(state);
        hand.write(report.force);
        const SimulatedHand::Truth truth = hand.truth();
        result.hand_work_j = std::max(result.hand_work_j, truth.hand_work_j);
        result.motor_work_j = std::max(result.motor_work_j, truth.motor_work_j);
        result.force_n = std::max(result.force_n, glm::length(report.force));
        result.step_n = std::max(result.step_n, glm::length(report.force - before));
        result.flags |= report.flags;
        before = report.force;
        if (state.time_s >= ends_s - 1.0 && state.time_s < ends_s) {
            velocities.push_back(truth.handle_velocity);
            places.push_back(truth.handle);
            result.pressed_n += glm::length(report.force);
        }
    }
    result.pressed_n /= static_cast<double>(velocities.size());
    result.held_m = rms_about_mean(places);
    result.oscillation_m_per_s = rms_between(velocities, settings.rate_hz, 20.0, 400.0);
    result.slow_m_per_s = rms_between(velocities, settings.rate_hz, 5.0, 20.0);
    return result;
}

/// A hand that comes from 5 mm in front of the surface, intends to be 10 mm behind it, holds, and
/// goes back.
inline Press press(const std::shared_ptr<const Scene>& scene, const PressedPoint& where,
                   const HandSettings& settings, Protection protection) {
    return follow(
        scene, settings,
        press_into(where.point, where.outward, 5e-3, 10e-3, kPressApproach_s, kPressHold_s),
        kPressApproach_s + kPressHold_s, protection);
}

/// The tremor of a hand that touches nothing, rms of the handle's velocity in 5-20 Hz, m/s.
inline double free_tremor(const HandSettings& settings) {
    SimulatedHand hand(settings, {{0.0, Vec3{0.0}}});
    std::vector<Vec3> velocities;
    DeviceState state;
    while (hand.read(state) && state.time_s < 3.0)
        if (state.time_s >= 2.0) velocities.push_back(hand.truth().handle_velocity);
    return rms_between(velocities, settings.rate_hz, 5.0, 20.0);
}

/// Whether the loop shakes the hand more than the hand itself does: above 20 Hz as much as its
/// tremor, or where the tremor is twice as much.
inline bool oscillates(const Press& press, double tremor_m_per_s) {
    return press.oscillation_m_per_s > tremor_m_per_s || press.slow_m_per_s > 2.0 * tremor_m_per_s;
}

} // namespace palpate::test
