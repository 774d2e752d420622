// SPDX-License-Identifier: Apache-2.0
// Checks of `palpate validate driver`: what the motors do with forces.
#include <palpate/engine/command/driver_trial.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include <palpate/drivers/internal/plugin_library.h>
#include <palpate/engine/loop/device_safety.h>

namespace palpate::command {
namespace {

Vec3 vec_of(const double (&v)[3]) { return {v[0], v[1], v[2]}; }

/// Throws where the device has no motors, or may not be pushed.
void require_push(DriverTrial& trial) {
    if (trial.properties().force_n <= 0.0) throw skip("the device takes no force");
    if (!trial.may_push()) throw skip("needs longer forces: let go of the device and add --forces");
}

/// What is held a moment after a force was written twice; throws where the plug-in does not say.
Vec3 held_after(DriverTrial& trial, const double (&force_n)[3]) {
    Exchange last{};
    for (int i = 0; i < 3; ++i) {
        last = trial.exchange(force_n);
        trial.wait_for_next();
    }
    trial.exchange({0.0, 0.0, 0.0});
    const Vec3 held = vec_of(last.state.held_force_n);
    if (std::isnan(held.x) && std::isnan(held.y) && std::isnan(held.z)) throw skip(kUnseen);
    return held;
}

Verdict force_taken(DriverTrial& trial) {
    constexpr double kTouch_n = 0.02;
    const double small_n = trial.properties().force_n > 0.0 ? kTouch_n : 0.0;
    int failed = 0, frames = 0;
    const auto all = trial.exchanges_with(0.3, [&](const Exchange&, double(&force_n)[3]) {
        force_n[frames % 3] = frames % 2 == 0 ? small_n : -small_n;
        ++frames;
    });
    for (const Exchange& one : all)
        failed += one.write != PALPATE_PLUGIN_OK ? 1 : 0;
    if (failed > 0)
        return fail(fmt::format("write fails {} of {} times ({}); take every force up to force_n",
                                failed, all.size(),
                                internal::reason_of(trial.plugin(), trial.opened())));
    return pass(fmt::format("{} forces were taken", all.size()));
}

Verdict force_limit(DriverTrial& trial) {
    require_push(trial);
    trial.first_state();
    const double most_n = trial.properties().force_n;
    const double held_n = glm::length(held_after(trial, {3.0 * most_n, 0.0, 0.0}));
    if (!(held_n <= most_n * 1.001))
        return fail(fmt::format("{:.4g} N are held, and force_n is {:.4g}; shorten what is longer",
                                held_n, most_n));
    return pass(fmt::format("of {:.3g} N {:.3g} N are held", 3.0 * most_n, held_n));
}

Verdict force_not_finite(DriverTrial& trial) {
    require_push(trial);
    trial.first_state();
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    constexpr double kInf = std::numeric_limits<double>::infinity();
    for (const auto& wrong :
         {std::array{kNan, 0.0, 0.0}, std::array{0.0, -kInf, 0.0}, std::array{0.0, kNan, kInf}}) {
        held_after(trial, {0.0, 0.0, 0.0}); // whether it says anything
        const Vec3 held = held_after(trial, {wrong[0], wrong[1], wrong[2]});
        if (!is_finite(held)) return fail("a force that is no number is held; hold zero instead");
    }
    return pass("no force that is no number is held");
}

/// A force for some time, and the way of the handle meanwhile.
struct Push {
    Vec3 force{0.0};
    Vec3 way_m{0.0};
};

/// Forces of random sign for 40 ms each, along all axes at once.
std::vector<Push> push_at_random(DriverTrial& trial) {
    constexpr int kPushes = 60;
    constexpr double kPush_s = 0.04;
    constexpr int kFewest = 4; // frames, of a device that takes long
    const double force_n = std::min(2.0, 0.25 * trial.properties().force_n);
    std::mt19937_64 random = random_numbers(1);
    std::vector<Push> pushes(kPushes);
    Vec3 place = vec_of(trial.first_state().state.position_m);
    for (Push& push : pushes) {
        const Vec3 begin = place;
        double push_n[3];
        for (double& value : push_n)
            value = random() % 2 == 0 ? force_n : -force_n;
        const double began_s = monotonic_s();
        for (int i = 0; i < kFewest || monotonic_s() - began_s < kPush_s; ++i) {
            const Exchange one = trial.exchange(push_n);
            if (one.read == PALPATE_PLUGIN_OK && internal::fault_of(one.state) == nullptr)
                place = vec_of(one.state.position_m);
            trial.wait_for_next();
        }
        push = {vec_of(push_n), place - begin};
    }
    trial.exchange({0.0, 0.0, 0.0});
    return pushes;
}

double product(const std::vector<double>& a, const std::vector<double>& b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

void take_out(std::vector<double>& from, const std::vector<double>& part) {
    const double square = product(part, part);
    const double share = square > 0.0 ? product(from, part) / square : 0.0;
    for (std::size_t i = 0; i < from.size(); ++i)
        from[i] -= share * part[i];
}

/// What of `ways` is no linear function of what was known before: least squares, by orthogonal
/// parts.
std::vector<double> unexpected(std::vector<double> ways, std::vector<std::vector<double>> known) {
    for (std::size_t i = 0; i < known.size(); ++i) {
        take_out(ways, known[i]);
        for (std::size_t j = i + 1; j < known.size(); ++j)
            take_out(known[j], known[i]);
    }
    return ways;
}

/// Each push times the part of its way that the push, the way and the drift before it do not tell:
/// neither a heavy handle that goes on nor a hand that moves it slowly counts. Positive on the
/// average where a force moves the handle its way.
std::vector<double> works_j(const std::vector<Push>& pushes, int axis) {
    const std::size_t count = pushes.size() - 1;
    std::vector<double> ways(count), last_ways(count), last_forces(count), works(count);
    for (std::size_t i = 0; i < count; ++i) {
        ways[i] = pushes[i + 1].way_m[axis];
        last_ways[i] = pushes[i].way_m[axis];
        last_forces[i] = pushes[i].force[axis];
    }
    ways = unexpected(std::move(ways), {std::vector<double>(count, 1.0), last_ways, last_forces});
    for (std::size_t i = 0; i < count; ++i)
        works[i] = pushes[i + 1].force[axis] * ways[i];
    return works;
}

/// How far the mean is from zero, in standard errors.
double significance(const std::vector<double>& values) {
    const auto n = static_cast<double>(values.size());
    double sum = 0.0, squares = 0.0;
    for (const double value : values) {
        sum += value;
        squares += value * value;
    }
    const double spread = squares / n - (sum / n) * (sum / n);
    return spread > 0.0 ? sum / n / std::sqrt(spread / n) : 0.0;
}

Verdict force_sign(DriverTrial& trial) {
    require_push(trial);
    constexpr double kSure = 3.0;
    const std::vector<Push> pushes = push_at_random(trial);
    std::vector<double> all;
    all.reserve(3 * pushes.size());
    for (int axis = 0; axis < 3; ++axis) {
        const std::vector<double> works = works_j(pushes, axis);
        if (significance(works) < -kSure)
            return fail(
                fmt::format("a force along {} moves the handle the other way; turn its sign "
                            "or its axes",
                            "xyz"[axis]));
        all.insert(all.end(), works.begin(), works.end());
    }
    const double sure = significance(all);
    if (sure < -kSure) return fail("forces move the handle the other way; turn their sign or axes");
    if (sure < kSure)
        return skip("no force moves the handle for sure: it is held, or plays a path");
    return pass(fmt::format("forces move the handle their way, {:.2g} standard errors sure", sure));
}

/// A spring to where it is, as stiff as Palpate would make it for this device: the handle comes to
/// rest, or follows who moves it.
Verdict passivity(DriverTrial& trial) {
    require_push(trial);
    constexpr double kFast_m_per_s = 0.5;
    const palpate_plugin_properties& said = trial.properties();
    const SafeCoupling safe =
        safe_coupling({500.0, 0.0}, said.rate_hz, internal::device_properties(said));
    const double stiffness = safe.coupling.stiffness;
    const Vec3 rest = vec_of(trial.first_state().state.position_m);
    Vec3 place = rest;
    const auto all = trial.exchanges_with(1.5, [&](const Exchange& one, double(&force_n)[3]) {
        if (one.read == PALPATE_PLUGIN_OK && internal::fault_of(one.state) == nullptr)
            place = vec_of(one.state.position_m);
        Vec3 force = stiffness * (rest - place);
        const double length = glm::length(force);
        if (length > said.force_n) force *= said.force_n / length;
        for (int i = 0; i < 3; ++i)
            force_n[i] = force[i];
    });
    trial.exchange({0.0, 0.0, 0.0});
    const std::vector<palpate_plugin_state> states = good_states(all);
    constexpr std::size_t kSteps = 10;
    double fastest = 0.0;
    for (std::size_t i = 2 * states.size() / 3; i + kSteps < states.size(); ++i)
        fastest = std::max(fastest, glm::distance(vec_of(states[i + kSteps].position_m),
                                                  vec_of(states[i].position_m)) /
                                        (states[i + kSteps].time_s - states[i].time_s));
    if (fastest > kFast_m_per_s)
        return fail(fmt::format("a spring of {:.4g} N/m shakes the handle at {:.3g} m/s; say the "
                                "true delay_s and damping_n_s_per_m, and a lower stiffness_n_per_m",
                                stiffness, fastest));
    return pass(
        fmt::format("a spring of {:.4g} N/m holds it, {:.3g} m/s at most", stiffness, fastest));
}

Verdict watchdog(DriverTrial& trial) {
    if (trial.properties().force_n <= 0.0) return skip("the device takes no force");
    constexpr double kTouch_n = 0.02;
    trial.first_state();
    for (int i = 0; i < 3; ++i) {
        trial.exchange({kTouch_n, 0.0, 0.0});
        trial.wait_for_next();
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    palpate_plugin_state state = internal::unknown_state();
    trial.plugin().read(trial.opened(), &state);
    const double held_n = glm::length(vec_of(state.held_force_n));
    trial.exchange({0.0, 0.0, 0.0});
    if (std::isnan(held_n)) return skip(kUnseen);
    if (held_n > 0.0)
        return warn(
            "a force is held 0.3 s after the last call; a program that hangs would leave it "
            "there: let it end after 50 ms");
    return pass("0.3 s after the last call no force is held");
}

constexpr std::array<DriverCheck, 6> kForces{{
    {"force_taken", "first_state", "forces within its limit are taken", force_taken},
    {"force_limit", "first_state", "a longer force is shortened", force_limit},
    {"force_not_finite", "first_state", "a force that is no number is not held", force_not_finite},
    {"force_sign", "position_unit", "a force moves the handle its way", force_sign},
    {"passivity", "force_sign", "a spring does not shake the handle", passivity},
    {"watchdog", "first_state", "a force ends when nobody calls any more", watchdog},
}};

} // namespace

std::span<const DriverCheck> force_checks() { return kForces; }

} // namespace palpate::command
