// SPDX-License-Identifier: Apache-2.0
// Checks of `palpate validate effect`: the library, and the effect without a loop.
#include <palpate/engine/command/effect_trial.h>

#include <array>
#include <cmath>

#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

namespace palpate::command {
namespace {

constexpr std::size_t kFrames = 600;

// ---- the library ------------------------------------------------------------------------------

const EffectLibrary& entry_of(EffectTrial& trial) {
    return effect_entry(load_effect_file(trial.subject()), trial.subject());
}

Verdict file(EffectTrial& trial) {
    if (trial.is_own()) return pass("a kind of Palpate's own");
    load_effect_file(trial.subject());
    return pass("the library loads, and all that it needs is there");
}

Verdict entry(EffectTrial& trial) {
    if (!trial.is_own()) entry_of(trial);
    return pass("it says what effect it has");
}

Verdict version(EffectTrial& trial) {
    if (!trial.is_own()) check_effect_version(entry_of(trial), trial.subject());
    return pass(fmt::format("Palpate {}, compiler {}", kVersion, __VERSION__));
}

Verdict layout(EffectTrial& trial) {
    if (!trial.is_own()) check_effect_layout(entry_of(trial), trial.subject());
    return pass(fmt::format("{}: an Effect of {} bytes, a FrameContext of {}, a PrimitiveSet of {}",
                            trial.is_own() ? trial.subject() : entry_of(trial).name, sizeof(Effect),
                            sizeof(FrameContext), sizeof(PrimitiveSet)));
}

Verdict make(EffectTrial& trial) {
    for (int i = 0; i < 3; ++i)
        trial.loop();
    return pass("loops are made with it");
}

constexpr std::array<EffectCheck, 5> kLibrary{{
    {"file", nullptr, "the library loads", file},
    {"entry", "file", "it says what effect it has", entry},
    {"version", "entry", "it was compiled for this Palpate by the same compiler", version},
    {"layout", "version", "its classes are laid out as Palpate's are", layout},
    {"make", "layout", "it makes an effect", make},
}};

// ---- the effect without a loop ----------------------------------------------------------------

/// Restarts an effect where frames begin, and leads it through them.
std::vector<std::vector<std::uint64_t>> led(EffectTrial& trial, Effect& effect,
                                            const std::vector<HandFrame>& frames) {
    std::vector<std::vector<std::uint64_t>> bits;
    bits.reserve(3 * frames.size());
    effect.restart(frames.front().context.start);
    for (const HandFrame& frame : frames)
        for (const Asked& asked : trial.lead(effect, frame))
            bits.push_back(asked.bits());
    return bits;
}

/// The first frame, of three evaluations each, that differs; -1: none.
long first_difference(const std::vector<std::vector<std::uint64_t>>& a,
                      const std::vector<std::vector<std::uint64_t>>& b) {
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
        if (a[i] != b[i]) return static_cast<long>(i / 3);
    return a.size() == b.size() ? -1 : 0;
}

Verdict promises(EffectTrial& trial) {
    const LoneEffect effect = trial.make();
    const std::vector<HandFrame> frames = trial.hand_frames(kFrames);
    std::uint64_t last_queries = 0;
    effect->restart(frames.front().context.start);
    for (const HandFrame& frame : frames) {
        trial.lead(*effect.effect, frame);
        const double push_n = effect->unasked_force_n();
        if (!(push_n >= 0.0 && std::isfinite(push_n)))
            return fail(fmt::format("unasked_force_n() is {} N; finite, and not below 0", push_n));
        if (effect->most_primitives() > PrimitiveSet::kCapacity)
            return fail(fmt::format("most_primitives() is {}, and an evaluation has room for {}",
                                    effect->most_primitives(), PrimitiveSet::kCapacity));
        const QueryCount counted = effect->queries();
        const std::uint64_t queries =
            counted.field_samples + counted.surface_queries + counted.roots;
        if (queries < last_queries)
            return fail("queries() counts backwards; count what was asked since it was made");
        last_queries = queries;
    }
    return pass(fmt::format("{:.3g} N unasked, {} active, {} primitives at most",
                            effect->unasked_force_n(), effect->is_active() ? "is" : "not",
                            effect->most_primitives()));
}

/// Leads it through frames and looks at each evaluation.
template <class Look>
void look_at_all(EffectTrial& trial, const std::vector<HandFrame>& frames, Look look) {
    const LoneEffect effect = trial.make();
    effect->restart(frames.front().context.start);
    for (std::size_t i = 0; i < frames.size(); ++i)
        for (const Asked& asked : trial.lead(*effect.effect, frames[i]))
            look(asked, i, effect->most_primitives());
}

void require_finite(const Asked& asked, const std::string& where) {
    if (!asked.primitives.all_finite() || !is_finite(asked.device_force_n))
        throw fail(fmt::format("what it adds is not finite, or a strength below 0, {}; such a "
                               "primitive counts as nothing: leave it out yourself",
                               where));
}

Verdict finite(EffectTrial& trial) {
    look_at_all(trial, trial.hand_frames(kFrames), [](const Asked& asked, std::size_t frame, auto) {
        require_finite(asked, fmt::format("in frame {}", frame));
    });
    return pass(fmt::format("all that it adds in {} frames is finite", kFrames));
}

Verdict unit_vectors(EffectTrial& trial) {
    constexpr double kRounding = 1e-6;
    look_at_all(trial, trial.hand_frames(kFrames), [](const Asked& asked, std::size_t frame, auto) {
        const auto look = [&](const Vec3& direction, const char* what) {
            const double length = glm::length(direction);
            if (!(std::abs(length - 1.0) <= kRounding))
                throw fail(fmt::format("{} of length {:.6g} in frame {}; normalize it", what,
                                       length, frame));
        };
        for (const PlanePrimitive& plane : asked.primitives.planes())
            look(plane.normal, "a plane's normal");
        for (const LinePrimitive& line : asked.primitives.lines())
            look(line.axis, "a line's axis");
    });
    return pass("normals and axes have length 1");
}

Verdict room(EffectTrial& trial) {
    std::size_t most = 0;
    look_at_all(trial, trial.hand_frames(kFrames),
                [&](const Asked& asked, std::size_t frame, std::size_t said) {
                    most = std::max(most, asked.primitives.count());
                    if (asked.primitives.count() > said || asked.primitives.overflowed())
                        throw fail(fmt::format("{} planes, lines and points in frame {}, and "
                                               "most_primitives() says {}; say the most",
                                               asked.primitives.count(), frame, said));
                });
    return pass(fmt::format("{} planes, lines and points at most", most));
}

std::vector<HandFrame> still_at(const std::vector<Vec3>& places, double period_s) {
    std::vector<HandFrame> frames;
    frames.reserve(3 * places.size());
    for (const Vec3& place : places)
        for (int i = 0; i < 3; ++i) {
            HandFrame frame;
            frame.context.probe = frame.context.start = place;
            frame.context.period_s = period_s;
            frame.places = {place, place, place};
            frames.push_back(frame);
        }
    return frames;
}

Verdict far(EffectTrial& trial) {
    const std::vector<Vec3> places{{0.0, 0.0, 0.0},  {1e-300, 0.0, 0.0}, {1.0, -1.0, 1.0},
                                   {1e3, 1e3, -1e3}, {0.0, -1e6, 0.0},   {5e5, 5e5, 5e5}};
    look_at_all(trial, still_at(places, 1e-3), [&](const Asked& asked, std::size_t frame, auto) {
        const Vec3& place = places[frame / 3];
        require_finite(asked, fmt::format("at ({:.3g}, {:.3g}, {:.3g}) m, where a probe may be",
                                          place.x, place.y, place.z));
    });
    return pass("finite at the origin and up to 1000 km from it");
}

Verdict rates(EffectTrial& trial) {
    for (const double period_s : {1.0 / 20000.0, 1.0 / 50.0}) {
        std::vector<HandFrame> frames = trial.hand_frames(kFrames / 3);
        for (HandFrame& frame : frames)
            frame.context.period_s = period_s;
        look_at_all(trial, frames, [&](const Asked& asked, std::size_t frame, auto) {
            require_finite(asked, fmt::format("at {:.6g} Hz in frame {}", 1.0 / period_s, frame));
        });
    }
    return pass("finite at 50 Hz and at 20 kHz");
}

/// A hash of what is asked, by a process that has done nothing else.
std::uint64_t hash_in_fresh_process(EffectTrial& trial) {
    std::array<int, 2> pipe{};
    if (::pipe(pipe.data()) != 0) throw fail("no pipe can be made; close other programs");
    const pid_t child = fork();
    if (child == 0) {
        std::uint64_t hash = 1469598103934665603U; // FNV-1a
        const LoneEffect effect = trial.make();
        for (const auto& bits : led(trial, *effect.effect, trial.hand_frames(kFrames)))
            for (const std::uint64_t number : bits)
                hash = (hash ^ number) * 1099511628211U;
        const bool is_said = write(pipe[1], &hash, sizeof hash) == sizeof hash;
        _exit(is_said ? 0 : 1);
    }
    close(pipe[1]); // else the end of a child that says nothing would not be seen
    std::uint64_t hash = 0;
    const bool is_heard = child > 0 && read(pipe[0], &hash, sizeof hash) == sizeof hash;
    close(pipe[0]);
    if (child < 0) throw fail("no process can be begun; close other programs");
    waitpid(child, nullptr, 0);
    if (!is_heard) throw fail("a process with it ends early; run this check in a debugger");
    return hash;
}

Verdict same_bits(EffectTrial& trial) {
    trial.make();
    const std::uint64_t first = hash_in_fresh_process(trial);
    for (int i = 0; i < 3; ++i)
        if (hash_in_fresh_process(trial) != first)
            return fail("the same way gives other bits in another run; take no clock, no address "
                        "and no random number but from a seed");
    return pass("four runs of the same way give the same bits");
}

Verdict independent(EffectTrial& trial) {
    const std::vector<HandFrame> frames = trial.hand_frames(kFrames);
    const LoneEffect one = trial.make();
    const auto alone = led(trial, *one.effect, frames);
    const LoneEffect other = trial.make();
    const LoneEffect again = trial.make();
    std::vector<std::vector<std::uint64_t>> together;
    together.reserve(alone.size());
    again->restart(frames.front().context.start);
    other->restart(frames.back().context.start);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        trial.lead(*other.effect, frames[frames.size() - 1 - i]);
        for (const Asked& asked : trial.lead(*again.effect, frames[i]))
            together.push_back(asked.bits());
    }
    if (const long frame = first_difference(alone, together); frame >= 0)
        return fail(fmt::format("beside another one it asks for something else in frame {}; keep "
                                "nothing in static variables",
                                frame));
    return pass("two of them do not know of each other");
}

Verdict restart(EffectTrial& trial) {
    const std::vector<HandFrame> frames = trial.hand_frames(kFrames);
    const LoneEffect effect = trial.make();
    const auto first = led(trial, *effect.effect, frames);
    const auto second = led(trial, *effect.effect, frames);
    if (const long frame = first_difference(first, second); frame >= 0)
        return fail(fmt::format("after restart() it asks for something else in frame {}; let a "
                                "trial begin with all as it was when it was made",
                                frame));
    return pass("after restart() it begins anew, to the bit");
}

/// A frame of more evaluations, with the same beginning and end, leaves the same behind.
Verdict gather_keeps(EffectTrial& trial) {
    const std::vector<HandFrame> frames = trial.hand_frames(kFrames);
    const LoneEffect one = trial.make();
    const auto usual = led(trial, *one.effect, frames);
    const LoneEffect other = trial.make();
    other->restart(frames.front().context.start);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        HandFrame longer = frames[i];
        longer.places.insert(longer.places.begin(), 3, longer.places.front());
        const std::vector<Asked> asked = trial.lead(*other.effect, longer);
        if (asked.front().bits() != usual[3 * i])
            return fail(fmt::format("more evaluations in the frames before change frame {}; let "
                                    "gather() change nothing that begin() does not reset",
                                    i));
    }
    return pass("how often it is asked changes nothing that lasts");
}

constexpr std::array<EffectCheck, 10> kAlone{{
    {"promises", "make", "what it says of itself is in range", promises},
    {"finite", "make", "all that it adds is finite", finite},
    {"unit_vectors", "finite", "normals and axes have length 1", unit_vectors},
    {"room", "finite", "it adds no more than it says", room},
    {"far", "finite", "finite wherever the probe may be", far},
    {"rates", "finite", "finite at every rate", rates},
    {"same_bits", "finite", "the same way gives the same bits", same_bits},
    {"independent", "same_bits", "two of them do not know of each other", independent},
    {"restart", "independent", "a new trial begins anew", restart},
    {"gather_keeps", "restart", "gather() leaves nothing behind", gather_keeps},
}};

} // namespace

std::span<const EffectCheck> effect_library_checks() { return kLibrary; }
std::span<const EffectCheck> effect_alone_checks() { return kAlone; }

} // namespace palpate::command
