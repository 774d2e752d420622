// SPDX-License-Identifier: Apache-2.0
// Checks of `palpate validate effect`: what a hand feels of it in a loop.
#include <palpate/engine/command/effect_trial.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <utility>

#include <fmt/format.h>

#include <palpate/drivers/simulated_hand.h>

namespace palpate::command {
namespace {

constexpr double kPeriod_s = 1e-3;

DeviceState at(const Vec3& place, int frame, std::uint32_t trial = 0) {
    DeviceState state;
    state.time_s = kPeriod_s * frame;
    state.position = place;
    state.trial = trial;
    return state;
}

bool same(const Vec3& a, const Vec3& b) {
    for (int i = 0; i < 3; ++i)
        if (std::bit_cast<std::uint64_t>(a[i]) != std::bit_cast<std::uint64_t>(b[i])) return false;
    return true;
}

bool same(const FrameReport& a, const FrameReport& b) {
    return same(a.force, b.force) && same(a.proxy, b.proxy) && a.evaluations == b.evaluations &&
           a.sub_steps == b.sub_steps;
}

/// The way's frames from `begin` to `end`, both counted round and round.
std::vector<FrameReport> felt(EffectTrial& trial, HapticLoop& loop, int begin, int end,
                              std::uint32_t number = 0) {
    std::vector<FrameReport> reports;
    reports.reserve(static_cast<std::size_t>(end - begin));
    const std::vector<Vec3>& way = trial.way();
    for (int frame = begin; frame < end; ++frame)
        reports.push_back(
            loop.frame(at(way[static_cast<std::size_t>(frame) % way.size()], frame, number)));
    return reports;
}

/// The first frame that differs; -1: none.
long first_difference(const std::vector<FrameReport>& a, const std::vector<FrameReport>& b) {
    for (std::size_t i = 0; i < a.size(); ++i)
        if (!same(a[i], b[i])) return static_cast<long>(i);
    return -1;
}

int frames_of(EffectTrial& trial) { return static_cast<int>(trial.way().size()); }

/// Places of the way, evenly.
std::vector<Vec3> some_places(EffectTrial& trial, std::size_t count) {
    std::vector<Vec3> places;
    places.reserve(count);
    for (std::size_t i = 0; i < count; ++i)
        places.push_back(trial.way()[i * trial.way().size() / count]);
    return places;
}

// ---- whether it is felt -----------------------------------------------------------------------

Verdict is_felt(EffectTrial& trial) {
    const int count = frames_of(trial);
    const auto with = felt(trial, *trial.loop(), 0, count);
    const auto without = felt(trial, *trial.loop_without(), 0, count);
    int felt_in = 0;
    double most_n = 0.0;
    for (std::size_t i = 0; i < with.size(); ++i) {
        const double difference_n = glm::distance(with[i].force, without[i].force);
        felt_in += difference_n > 1e-6 ? 1 : 0;
        most_n = std::max(most_n, difference_n);
    }
    if (felt_in == 0)
        return fail("it is felt nowhere on the way; give a --scene and a --path of a probe that "
                    "comes to where it is");
    return pass(fmt::format("felt in {} of {} frames, {:.3g} N at most", felt_in, count, most_n));
}

Verdict gain_zero(EffectTrial& trial) {
    const auto loop = trial.loop();
    loop->set_gain(trial.number(), 0.0);
    const auto off = felt(trial, *loop, 0, frames_of(trial));
    const auto without = felt(trial, *trial.loop_without(), 0, frames_of(trial));
    for (std::size_t i = 0; i < off.size(); ++i)
        if (!same(off[i].force, without[i].force))
            return fail(fmt::format("switched off, it is felt in frame {}; what is switched off is "
                                    "not asked, so it changes something of others",
                                    i));
    return pass("switched off, the forces are those of the scene without it, to the bit");
}

// ---- what no hand may feel ----------------------------------------------------------------------

/// Throws where a force is none that may be sent.
void require_limits(const FrameReport& report, const Vec3& last_n, const SceneDescription& scene) {
    constexpr double kRounding = 1.0 + 1e-9;
    const double step_n = scene.limits.slew_n_per_s / scene.loop.rate_hz;
    if (!is_finite(report.force) || !is_finite(report.proxy))
        throw fail(fmt::format("force or proxy of frame {} is not finite", report.frame));
    if (glm::length(report.force) > scene.limits.force_n * kRounding)
        throw fail(fmt::format("{:.6g} N in frame {} are over the limit", glm::length(report.force),
                               report.frame));
    if (glm::distance(report.force, last_n) > step_n * kRounding)
        throw fail(fmt::format("the force jumps by {:.6g} N in frame {}",
                               glm::distance(report.force, last_n), report.frame));
}

Verdict gains(EffectTrial& trial) {
    const auto loop = trial.loop();
    std::mt19937_64 random = random_numbers(1);
    Vec3 last_n{0.0};
    for (int frame = 0; frame < frames_of(trial); ++frame) {
        if (frame % 70 == 69) {
            const double draw = std::uniform_real_distribution<double>(-3.0, 10.0)(random);
            loop->set_gain(trial.number(), std::max(0.0, draw));
        }
        const FrameReport report =
            loop->frame(at(trial.way()[static_cast<std::size_t>(frame)], frame));
        require_limits(report, last_n, trial.scene()->description());
        last_n = report.force;
    }
    return pass(
        "switched on and off and up to ten times as strong, forces stay within their limits");
}

Verdict odd_probes(EffectTrial& trial) {
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    constexpr double kInf = std::numeric_limits<double>::infinity();
    const auto loop = trial.loop();
    std::mt19937_64 random = random_numbers(2);
    Vec3 last_n{0.0};
    const std::vector<Vec3>& way = trial.way();
    for (int frame = 0; frame < frames_of(trial); ++frame) {
        DeviceState state = at(way[static_cast<std::size_t>(frame)], frame);
        switch (random() % 40) {
        case 0:
            state.position.y = kNan;
            break;
        case 1:
            state.position.x = -kInf;
            break;
        case 2:
            state.position = Vec3(1e3, 0.0, -1e3);
            break;
        case 3:
            state.position = Vec3(9e5, -1e5, 1.0);
            break;
        case 4: // a leap
            state.position = way[random() % way.size()];
            break;
        case 5:
            state.freshness = Freshness::stale;
            break;
        case 6:
            state.velocity = Vec3(kNan);
            break;
        default:
            break;
        }
        const FrameReport report = loop->frame(state);
        require_limits(report, last_n, trial.scene()->description());
        last_n = report.force;
    }
    return pass("leaps, silences and places that are none do no harm");
}

Verdict methods(EffectTrial& trial) {
    for (const SteppingMethod method : {SteppingMethod::single, SteppingMethod::paper,
                                        SteppingMethod::fixed, SteppingMethod::adaptive}) {
        LoopDescription description = trial.scene()->description().loop;
        description.method = method;
        // Which `paper` spends; less where the scene's frames are shorter.
        description.budget_us = std::min(100.0, 0.5e6 / description.rate_hz);
        const auto loop = trial.loop(description);
        Vec3 last_n{0.0};
        for (int frame = 0; frame < frames_of(trial) / 2; ++frame) {
            const FrameReport report =
                loop->frame(at(trial.way()[static_cast<std::size_t>(frame)], frame));
            require_limits(report, last_n, trial.scene()->description());
            last_n = report.force;
        }
    }
    return pass("each stepping method takes it");
}

Verdict converges(EffectTrial& trial) {
    const auto reports = felt(trial, *trial.loop(), 0, frames_of(trial));
    int capped = 0;
    double evaluations = 0.0;
    for (const FrameReport& report : reports) {
        capped += (report.flags & kEvaluationCap) != 0 ? 1 : 0;
        evaluations += report.evaluations;
    }
    const auto count = static_cast<double>(reports.size());
    const std::string seen =
        fmt::format("{:.3g} evaluations a frame, {} of {} frames end at the cap",
                    evaluations / count, capped, reports.size());
    if (capped > 0.05 * count)
        return warn(seen + "; let what it adds change less on the way of a frame (solved())");
    return pass(seen);
}

// ---- state ------------------------------------------------------------------------------------

Verdict new_trial(EffectTrial& trial) {
    // The force follows from the last trial's within the slew limit.
    const SceneDescription& scene = trial.scene()->description();
    const std::size_t settles =
        20 + static_cast<std::size_t>(std::min(
                 1e6, 2.0 * scene.limits.force_n * scene.loop.rate_hz / scene.limits.slew_n_per_s));
    const auto loop = trial.loop();
    felt(trial, *loop, 200, 700, 0); // ends in the midst of a contact that began in it
    const auto second = felt(trial, *loop, 0, 800, 1);
    const auto fresh = felt(trial, *trial.loop(), 0, 800, 1);
    if (settles >= second.size())
        return skip("the scene's slew_n_per_s is too low to compare forces; give a higher one");
    for (std::size_t i = 0; i < second.size(); ++i)
        if (!same(second[i].proxy, fresh[i].proxy) ||
            (i >= settles && !same(second[i].force, fresh[i].force)))
            return fail(fmt::format("a second trial is another one than a first in frame {}; let "
                                    "restart() forget the trial before",
                                    i));
    return pass("a second trial is as the first, to the bit");
}

Verdict save_restore(EffectTrial& trial) {
    const auto loop = trial.loop();
    felt(trial, *loop, 0, 700);
    const LoopState state = loop->save();
    const auto first = felt(trial, *loop, 700, 1300);
    loop->restore(state);
    const auto second = felt(trial, *loop, 700, 1300);
    if (const long frame = first_difference(first, second); frame >= 0)
        return fail(fmt::format("restored, it goes on in another way from frame {}; hand out by "
                                "save_state() all that it remembers, and take it back",
                                frame));
    return pass("restored, it goes on to the bit");
}

Verdict restore_other(EffectTrial& trial) {
    const auto loop = trial.loop();
    felt(trial, *loop, 0, 700);
    const LoopState state = loop->save();
    const auto first = felt(trial, *loop, 700, 1300);
    const auto other = trial.loop();
    felt(trial, *other, 0, 50);
    try {
        other->restore(state);
    } catch (const std::exception& error) {
        return fail(fmt::format(
            "the state of one cannot be given to another: {}; let it be a value", error.what()));
    }
    const auto second = felt(trial, *other, 700, 1300);
    if (const long frame = first_difference(first, second); frame >= 0)
        return fail(
            fmt::format("another one goes on in another way from frame {}; let the state be "
                        "a value, with nothing of the one that it came from",
                        frame));
    return pass("another one goes on from its state, to the bit");
}

// ---- hands ------------------------------------------------------------------------------------

Verdict rest(EffectTrial& trial) {
    constexpr int kHeld = 1500, kLooked = 200;
    if (!trial.is_part() && trial.make()->is_active())
        return skip("it says that it is active: it may move a still hand");
    for (const Vec3& place : some_places(trial, 6)) {
        const auto loop = trial.loop();
        for (int frame = 0; frame < 10; ++frame) // comes from 1 mm beside it
            loop->frame(at(place + Vec3(1e-4 * (10 - frame), 0.0, 0.0), frame));
        FrameReport last;
        for (int frame = 10; frame < kHeld; ++frame) {
            const FrameReport report = loop->frame(at(place, frame));
            if (frame > kHeld - kLooked &&
                !(same(report.force, last.force) && same(report.proxy, last.proxy)))
                return fail(fmt::format(
                    "held at ({:.4g}, {:.4g}, {:.4g}) m the force still moves by "
                    "{:.3g} N after {} frames; let is_active() say so, or let it rest",
                    place.x, place.y, place.z, glm::distance(report.force, last.force), frame));
            last = report;
        }
    }
    return pass("a held hand feels a force that stays, to the bit");
}

/// A hand that yields as in honey: what pushes it without an end is no spring.
Verdict unasked(EffectTrial& trial) {
    if (trial.is_part()) return skip("the kind is a part of a surface, which pushes no one");
    constexpr double kHoney_n_s_per_m = 10.0, kSmall_n = 0.2;
    constexpr int kFrames = 2500, kLooked = 500;
    const LoneEffect lone = trial.make();
    double longest_n = 0.0, said_n = 0.0;
    for (const Vec3& begin : some_places(trial, 6)) {
        // What the scene's others push with is theirs.
        const auto loop = trial.loop(), without = trial.loop_without();
        Vec3 hand = begin, proxy = begin;
        lone->restart(begin);
        for (int frame = 0; frame < kFrames; ++frame) {
            FrameContext context;
            context.probe = hand;
            context.start = proxy;
            PrimitiveSet asked;
            lone->begin(context);
            lone->gather(proxy, asked);
            const FrameReport report = loop->frame(at(hand, frame));
            proxy = report.proxy;
            lone->solved(proxy);
            lone->commit({proxy, report.surfaces_felt});
            const Vec3 others = without->frame(at(hand, frame)).force;
            hand += kPeriod_s / kHoney_n_s_per_m * report.force;
            if (frame < kFrames - kLooked) continue;
            longest_n = std::max(longest_n, glm::length(report.force) - glm::length(others));
            said_n = std::max(said_n, lone->unasked_force_n());
        }
    }
    if (longest_n > said_n + kSmall_n)
        return fail(
            fmt::format("it pushes a hand that yields with {:.3g} N after 2 s, and "
                        "unasked_force_n() says {:.3g} N; say it, else a device with motors "
                        "waits for ever",
                        longest_n, said_n));
    return pass(
        fmt::format("{:.3g} N after 2 s on a hand that yields, {:.3g} N said", longest_n, said_n));
}

/// A hand that goes round a circle once in `round` frames, as far as forces let it. Its device
/// measures exactly and makes each force at once: all the work that the hand gets is the loop's.
SimulatedHand circling_hand(const Vec3& centre, int round, int frames) {
    constexpr double kRadius_m = 0.006;
    const Vec3 out = glm::length(centre) > 0.0 ? glm::normalize(centre) : Vec3(1.0, 0.0, 0.0);
    const Vec3 side = glm::normalize(glm::cross(out, Vec3(0.3, 0.5, 0.8)));
    std::vector<HandIntent> intents;
    intents.reserve(static_cast<std::size_t>(frames));
    for (int frame = 0; frame < frames; ++frame) {
        const double angle = 2.0 * M_PI * frame / round;
        intents.push_back({kPeriod_s * frame,
                           centre + kRadius_m * (std::cos(angle) * out + std::sin(angle) * side)});
    }
    HandSettings settings;
    settings.arm.tremor_m = 0.0; // each round is as the one before
    settings.mechanism.step_m = 0.0;
    settings.mechanism.bandwidth_hz = 1e5;
    settings.transport = {0.0, 0.0, 0.0};
    return {settings, std::move(intents)};
}

/// Energy that a hand gets which goes round and round, beyond what a sampled spring gives, J.
struct Given {
    double work_j = 0.0;
    double sampled_j = 0.0; ///< at most, by a spring that is sampled
    double beyond_j() const { return work_j - sampled_j; }
};

constexpr int kRound = 1000, kRounds = 4;

/// A spring of k that is sampled gives at most k/2 |dx|^2 in each frame, as its force stays while
/// the hand goes on.
Given given_round(HapticLoop& loop, const Vec3& centre, double stiffness) {
    SimulatedHand hand = circling_hand(centre, kRound, kRound * kRounds);
    double work_j = 0.0, sampled_j = 0.0, stored_j = 0.0;
    Vec3 last{0.0}, last_n{0.0};
    DeviceState state;
    for (int frame = 0; frame < kRound * kRounds; ++frame) {
        hand.read(state);
        if (frame == kRound) { // the first round is to forget the beginning
            work_j = sampled_j = 0.0;
            stored_j = 0.5 * glm::dot(last_n, last_n) / stiffness;
        }
        const Vec3 step = state.position - last;
        work_j += glm::dot(last_n, step);
        sampled_j += 0.5 * stiffness * glm::dot(step, step);
        last = state.position;
        last_n = loop.frame(state).force;
        hand.write(last_n);
    }
    return {work_j, sampled_j + stored_j};
}

/// The work on a simulated hand that goes round and round.
Verdict passivity(EffectTrial& trial) {
    if (!trial.is_part()) {
        const LoneEffect effect = trial.make();
        if (effect->is_active() || effect->unasked_force_n() > 0.0)
            return skip("it says that it moves or pushes a hand by itself");
    }
    const double stiffness = trial.scene()->description().coupling.stiffness_n_per_m;
    double worst_j = -std::numeric_limits<double>::infinity();
    for (const Vec3& centre : some_places(trial, 5)) {
        const Given given = given_round(*trial.loop(), centre, stiffness);
        worst_j = std::max(worst_j, given.beyond_j());
        if (given.beyond_j() <= 0.0) continue;
        if (given_round(*trial.loop_without(), centre, stiffness).beyond_j() > 0.0)
            return skip("the scene gives energy without it, too; take one that gives none");
        return fail(
            fmt::format("it gives {:.3g} J to a hand that goes {} times round "
                        "({:.3g}, {:.3g}, {:.3g}) m, and a sampled spring {:.3g} J at most; "
                        "take energy out, or let is_active() say so",
                        given.work_j, kRounds - 1, centre.x, centre.y, centre.z, given.sampled_j));
    }
    return pass(fmt::format("no more work on a hand that goes round than a sampled spring's "
                            "({:.3g} J less at least)",
                            -worst_j));
}

constexpr std::array<EffectCheck, 12> kLoop{{
    {"felt", "make", "it is felt on the way", is_felt},
    {"gain_zero", "felt", "switched off, it is not felt", gain_zero},
    {"gains", "felt", "whatever its gain, forces stay within their limits", gains},
    {"odd_probes", "far", "leaps, silences and no numbers do no harm", odd_probes},
    {"methods", "felt", "each stepping method takes it", methods},
    {"converges", "felt", "a frame finds its balance", converges},
    {"new_trial", "restart", "a second trial is as the first", new_trial},
    {"save_restore", "restart", "a restored loop goes on to the bit", save_restore},
    {"restore_other", "save_restore", "so does another loop with that state", restore_other},
    {"rest", "gather_keeps", "a held hand feels a force that stays", rest},
    {"unasked", "promises", "it says how it pushes by itself", unasked},
    {"passivity", "unasked", "it gives no energy to a hand", passivity},
}};

} // namespace

std::span<const EffectCheck> effect_loop_checks() { return kLoop; }

} // namespace palpate::command
