// SPDX-License-Identifier: Apache-2.0
// Checks of `palpate validate driver`: what read says, and how long calls take.
#include <palpate/engine/command/driver_trial.h>

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include <palpate/drivers/internal/plugin_library.h>
#include <palpate/geometry/vec.h>

namespace palpate::command {
namespace {

Vec3 vec_of(const double (&v)[3]) { return {v[0], v[1], v[2]}; }

// ---- states -----------------------------------------------------------------------------------

Verdict finite(DriverTrial& trial) {
    int looked_at = 0;
    for (const Exchange& one : trial.exchanges()) {
        if (one.read != PALPATE_PLUGIN_OK) continue;
        ++looked_at;
        if (const char* fault = internal::fault_of(one.state))
            return fail(fmt::format("{} in state {}; return PALPATE_PLUGIN_NOTHING_NEW where there "
                                    "is nothing good",
                                    fault, looked_at));
    }
    return pass(fmt::format("{} states, every number is finite and set", looked_at));
}

Verdict time_forward(DriverTrial& trial) {
    double last_s = -INFINITY;
    int backwards = 0, states = 0;
    for (const Exchange& one : trial.exchanges()) {
        if (one.read != PALPATE_PLUGIN_OK) continue;
        ++states;
        backwards += one.state.time_s < last_s ? 1 : 0;
        last_s = one.state.time_s;
    }
    if (backwards > 0)
        return fail(fmt::format("time_s runs backwards {} times in {} states; take "
                                "CLOCK_MONOTONIC, and leave out what comes out of order",
                                backwards, states));
    return pass(fmt::format("time_s does not run backwards in {} states", states));
}

/// A clock in ms, or one that counts calls, is off by more than a busy machine.
Verdict time_unit(DriverTrial& trial) {
    const std::vector<Exchange> all = trial.exchanges();
    const std::vector<palpate_plugin_state> states = good_states(all);
    if (states.size() < 2)
        return fail("time_s does not grow; set it to when the position was measured");
    const double said_s = states.back().time_s - states.front().time_s;
    const double passed_s = all.back().began_s - all.front().began_s;
    if (said_s > 5.0 * passed_s || said_s < 0.1 * passed_s)
        return fail(fmt::format("time_s grows by {:.3g} in {:.3g} s; it has to be in seconds",
                                said_s, passed_s));
    return pass(fmt::format("time_s grows by {:.3g} in {:.3g} s", said_s, passed_s));
}

/// Far and fast as no handle is that stands on a desk: a length in mm, or degrees.
Verdict position_unit(DriverTrial& trial) {
    constexpr double kFar_m = 5.0, kFast_m_per_s = 20.0;
    constexpr std::size_t kSteps = 10; // at a time, so that rounded times count little
    const std::vector<palpate_plugin_state> states = good_states(trial.exchanges());
    double far_m = 0.0, fast = 0.0;
    for (std::size_t i = 0; i < states.size(); ++i) {
        far_m = std::max(far_m, glm::length(vec_of(states[i].position_m)));
        if (i < kSteps) continue;
        fast = std::max(fast, glm::distance(vec_of(states[i].position_m),
                                            vec_of(states[i - kSteps].position_m)) /
                                  (states[i].time_s - states[i - kSteps].time_s));
    }
    const std::string seen =
        fmt::format("at most {:.3g} m from the origin, {:.3g} m/s at most", far_m, fast);
    if (far_m > kFar_m || fast > kFast_m_per_s)
        return fail(seen + ": no hand does that; position_m has to be in metres");
    return pass(seen);
}

Verdict rate(DriverTrial& trial) {
    const std::vector<Exchange> all = trial.exchanges();
    const std::size_t fresh = good_states(all).size();
    const double share = static_cast<double>(fresh) / static_cast<double>(all.size());
    const std::string seen = fmt::format("{} of {} reads at {:.6g} Hz brought a new state", fresh,
                                         all.size(), trial.properties().rate_hz);
    if (share < 0.1) return fail(seen + "; let rate_hz be the rate at which the device measures");
    if (share < 0.5) return warn(seen + "; a state for each read is felt as smoother");
    return pass(seen);
}

Verdict workspace(DriverTrial& trial) {
    const palpate_plugin_properties said = trial.properties();
    const Vec3 lower = vec_of(said.workspace_lower_m), upper = vec_of(said.workspace_upper_m);
    if (lower == upper) return skip("no workspace is said");
    const Vec3 margin = 0.05 * (upper - lower);
    for (const palpate_plugin_state& state : good_states(trial.exchanges())) {
        const Vec3 p = vec_of(state.position_m);
        if (glm::any(glm::lessThan(p, lower - margin)) ||
            glm::any(glm::greaterThan(p, upper + margin)))
            return fail(fmt::format("({:.4g}, {:.4g}, {:.4g}) m is outside of the workspace; "
                                    "correct the unit, the frame or the workspace",
                                    p.x, p.y, p.z));
    }
    return pass("every position is within the workspace");
}

/// The way and the integral of the velocity over the same time, of pieces that are so long that
/// rounded positions count little; where the handle is too slow for that, of a tenth of a second.
Verdict velocity(DriverTrial& trial) {
    if (trial.properties().measures_velocity == 0) return skip("the device measures no velocity");
    constexpr std::size_t kSteps = 10;
    constexpr double kLongest_s = 0.1;
    const double rounding_m = 4.0 * trial.properties().position_step_m + 50e-6;
    const double far_m = 5.0 * rounding_m; // a velocity of 0 is wrong by twice what is allowed
    const std::vector<palpate_plugin_state> states = good_states(trial.exchanges(0.6));
    struct Pieces {
        int all = 0, wrong = 0;
        bool are_wrong() const { return 4 * wrong > all; }
    } moved, slow;
    double way_m = 0.0;
    Vec3 said{0.0};
    for (std::size_t i = 0, j = 0; j + 1 < states.size();) {
        said += 0.5 * (states[j + 1].time_s - states[j].time_s) *
                (vec_of(states[j].velocity_m_per_s) + vec_of(states[j + 1].velocity_m_per_s));
        ++j;
        const Vec3 gone = vec_of(states[j].position_m) - vec_of(states[i].position_m);
        const bool is_far = glm::length(gone) > far_m;
        if (j - i < kSteps || !(is_far || states[j].time_s - states[i].time_s > kLongest_s))
            continue;
        Pieces& pieces = is_far ? moved : slow;
        ++pieces.all;
        pieces.wrong += glm::distance(said, gone) > 0.3 * glm::length(gone) + rounding_m ? 1 : 0;
        way_m += glm::length(gone);
        said = Vec3(0.0);
        i = j;
    }
    for (const Pieces& pieces : {moved, slow})
        if (pieces.are_wrong())
            return fail(
                fmt::format("the velocity is not that of the positions in {} of {} pieces of the "
                            "way; m/s, device frame, same sign, or measures_velocity = 0",
                            pieces.wrong, pieces.all));
    if (moved.all == 0)
        return skip(fmt::format("the handle did not move by {:.2g} mm in {:g} s; move it",
                                1e3 * far_m, kLongest_s));
    return pass(fmt::format("as the positions have it, over {:.3g} mm", 1e3 * way_m));
}

Verdict buttons(DriverTrial& trial) {
    const std::uint32_t count = trial.properties().buttons;
    const std::uint32_t known = count >= 32 ? ~0u : (1u << count) - 1u;
    for (const palpate_plugin_state& state : good_states(trial.exchanges()))
        if ((state.buttons & ~known) != 0)
            return fail(fmt::format("buttons = {:#x}, and there are {}; bit i is button i",
                                    state.buttons, count));
    return pass(fmt::format("no bit beyond the {} buttons", count));
}

Verdict fresh(DriverTrial& trial) {
    const std::vector<palpate_plugin_state> states = good_states(trial.exchanges());
    const auto stale = std::count_if(states.begin(), states.end(),
                                     [](const auto& state) { return state.is_stale != 0; });
    if (2 * static_cast<std::size_t>(stale) > states.size())
        return fail(fmt::format("is_stale in {} of {} new states; what is new is not stale", stale,
                                states.size()));
    return pass(fmt::format("{} of {} states are fresh", states.size() - stale, states.size()));
}

constexpr std::array<DriverCheck, 9> kStates{{
    {"finite", "first_state", "every number of a state is finite and set", finite},
    {"time_forward", "first_state", "time does not run backwards", time_forward},
    {"time_unit", "finite", "time is in seconds", time_unit},
    {"position_unit", "time_unit", "positions are in metres", position_unit},
    {"rate", "time_unit", "new states come at the rate that it says", rate},
    {"workspace", "position_unit", "positions are within the workspace", workspace},
    {"velocity", "position_unit", "the velocity is that of the positions", velocity},
    {"buttons", "first_state", "no button is down that it does not have", buttons},
    {"fresh", "first_state", "what is new is not said to be stale", fresh},
}};

// ---- calls ------------------------------------------------------------------------------------

/// That calls take no longer than the plug-in says, but for one in twenty.
Verdict call_time(DriverTrial& trial, double Exchange::*spent_s, const char* function) {
    const std::vector<Exchange> all = trial.exchanges();
    const double most_s = trial.properties().longest_call_s;
    const auto slow = std::count_if(all.begin(), all.end(),
                                    [&](const Exchange& one) { return one.*spent_s > most_s; });
    double longest_s = 0.0;
    for (const Exchange& one : all)
        longest_s = std::max(longest_s, one.*spent_s);
    if (20 * static_cast<std::size_t>(slow) > all.size())
        return fail(fmt::format("{} of {} calls of {} take longer than longest_call_s = {:.3g} s; "
                                "do the waiting in a thread of your own, or say how long it takes",
                                slow, all.size(), function, most_s));
    return pass(fmt::format("at most {:.3g} ms, {} of {} beyond {:.3g} ms", 1e3 * longest_s, slow,
                            all.size(), 1e3 * most_s));
}

Verdict read_time(DriverTrial& trial) { return call_time(trial, &Exchange::read_s, "read"); }
Verdict write_time(DriverTrial& trial) { return call_time(trial, &Exchange::write_s, "write"); }

Verdict blocking(DriverTrial& trial) {
    constexpr double kFar_s = 0.1; // no busy machine makes a sleeper so late
    const double most_s = trial.properties().longest_call_s + kFar_s;
    for (const Exchange& one : trial.exchanges(0.6))
        if (std::max(one.read_s, one.write_s) > most_s)
            return fail(fmt::format("a call of {} blocks for {:.3g} s; wait in a thread of your "
                                    "own",
                                    one.read_s > one.write_s ? "read" : "write",
                                    std::max(one.read_s, one.write_s)));
    return pass("no call blocks");
}

Verdict allocation(DriverTrial& trial) {
    if (!can_watch()) return unwatched();
    std::uint64_t most = 0, frames = 0;
    for (const Exchange& one : trial.exchanges()) {
        most = std::max(most, one.watched.allocations);
        frames += one.watched.allocations > 0 ? 1 : 0;
    }
    if (frames > 1) // the first may be a library's
        return fail(fmt::format("read and write allocate in {} frames, up to {} times; allocate in "
                                "open",
                                frames, most));
    return pass("read and write do not allocate");
}

Verdict locks(DriverTrial& trial) {
    if (!can_watch()) return unwatched();
    constexpr double kLong_s = 2e-3;
    const std::vector<Exchange> all = trial.exchanges();
    double longest_s = 0.0;
    std::size_t waits = 0;
    for (const Exchange& one : all) {
        longest_s = std::max(longest_s, one.watched.longest_lock_s);
        waits += one.watched.longest_lock_s > kLong_s ? 1 : 0;
    }
    if (waits > 2 && 50 * waits > all.size()) // one or two a busy machine makes
        return fail(fmt::format("{} of {} frames wait for a lock for more than 2 ms, {:.3g} ms at "
                                "most; hold it only to copy a state",
                                waits, all.size(), 1e3 * longest_s));
    return pass(fmt::format("the longest wait for a lock is {:.3g} ms", 1e3 * longest_s));
}

constexpr std::array<DriverCheck, 5> kCalls{{
    {"read_time", "first_state", "read takes no longer than it says", read_time},
    {"write_time", "first_state", "write takes no longer than it says", write_time},
    {"blocking", "first_state", "no call blocks", blocking},
    {"allocation", "first_state", "read and write allocate nothing", allocation},
    {"locks", "first_state", "no lock is held long", locks},
}};

} // namespace

std::span<const DriverCheck> state_checks() { return kStates; }
std::span<const DriverCheck> call_checks() { return kCalls; }

} // namespace palpate::command
