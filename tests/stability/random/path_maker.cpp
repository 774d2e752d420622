// SPDX-License-Identifier: Apache-2.0
#include "tests/stability/random/path_maker.h"

#include <cmath>
#include <limits>

#include "tests/stability/random/scene_changes.h"
#include "tests/stability/random/scene_maker.h"

namespace palpate::stability {
namespace {

using test::any_vector;
using test::between;
using test::chance;
using test::of_any_size;
using test::pick;
using test::Random;

/// A piece of a path from the last step on.
void add_piece(RandomCase& of, Random& random, int frames) {
    const auto hold = [&](const Vec3& probe) { of.steps.push_back({probe, false}); };
    const Vec3 from = of.steps.back().probe;
    const Vec3 towards = of.place + any_vector(random, 1.2 * of.size_m);
    switch (pick(random, 7)) {
    case 0: // held
        for (int i = 0; i < frames; ++i)
            hold(from);
        return;
    case 1: { // straight through the middle, to the other side
        const Vec3 to = 2.0 * of.place - from;
        for (int i = 1; i <= frames; ++i)
            hold(from + (static_cast<double>(i) / frames) * (to - from));
        return;
    }
    case 2: { // there and back, at any speed
        const double way = std::min(1.0, of_any_size(random, 1e-4, 1.0) * frames);
        for (int i = 1; i <= frames; ++i) {
            const double share = way * (1.0 - std::abs(2.0 * i / frames - 1.0));
            hold(from + share * (towards - from));
        }
        return;
    }
    case 3: { // a step, again and again
        const Vec3 step = any_vector(random, of.size_m * of_any_size(random, 1e-6, 0.05));
        for (int i = 1; i <= frames; ++i)
            hold(from + static_cast<double>(i) * step);
        return;
    }
    case 4: { // jitter about a place
        const double width = of.size_m * of_any_size(random, 1e-9, 0.1);
        for (int i = 0; i < frames; ++i)
            hold(from + any_vector(random, width));
        return;
    }
    case 5: // leaps
        for (int i = 0; i < frames; ++i)
            hold(of.place + any_vector(random, 1.5 * of.size_m));
        return;
    default: { // to a place near the middle, slowly, and deeper
        const Vec3 to = of.place + any_vector(random, 0.5 * of.size_m);
        for (int i = 1; i <= frames; ++i)
            hold(from + (static_cast<double>(i) / frames) * (to - from));
    }
    }
}

void spoil(RandomCase& of, Random& random) {
    const double odd[] = {std::numeric_limits<double>::quiet_NaN(),
                          std::numeric_limits<double>::infinity(), 1e7};
    for (int i = 1 + pick(random, 3); i > 0; --i) {
        const std::size_t at = 1 + random() % (of.steps.size() - 1);
        of.steps[at].probe[pick(random, 3)] = odd[random() % 3];
    }
}

void add_gains(RandomCase& of, Random& random, int frames) {
    for (const SceneTable& table : of.tables)
        for (int i = table.is_effect() && chance(random, 0.3) ? 1 + pick(random, 3) : 0; i > 0;
             --i) {
            CaseEvent event;
            event.frame = pick(random, frames);
            event.kind = CaseEvent::Kind::gain;
            event.table = table.id;
            event.gain = chance(random, 0.3) ? 0.0 : between(random, 0.0, 2.0);
            of.events.push_back(event);
        }
}

void add_poses(RandomCase& of, Random& random, int frames) {
    for (const SceneTable& table : of.tables) {
        if (table.value("moves").empty() || chance(random, 0.3)) continue;
        const bool by_formula = table.value("volume").starts_with("\"formula");
        RigidPose pose; // of a file's body: turned about the origin, far away too
        if (by_formula) pose.position = of.place;
        const double step_m = of.size_m * of_any_size(random, 1e-4, 0.1);
        const double turn =
            by_formula || of.place == Vec3(0.0) ? of_any_size(random, 1e-4, 0.3) : 0.0;
        for (int frame = pick(random, 20); frame < frames; frame += 1 + pick(random, 12)) {
            const bool leaps = chance(random, 0.02);
            pose.position += any_vector(random, leaps ? of.size_m : step_m);
            const Vec3 axis = any_vector(random, 0.5 * turn);
            pose.orientation =
                glm::normalize(pose.orientation * Quaternion(1.0, axis.x, axis.y, axis.z));
            CaseEvent event;
            event.frame = frame;
            event.kind = CaseEvent::Kind::pose;
            event.table = table.id;
            event.pose = pose;
            of.events.push_back(event);
        }
    }
}

} // namespace

namespace {

/// As many steps, from a place of their own on.
void add_steps(RandomCase& of, Random& random, int frames) {
    of.steps.push_back({of.place + any_vector(random, 1.3 * of.size_m), true});
    while (static_cast<int>(of.steps.size()) < frames)
        add_piece(of, random, 5 + pick(random, 60));
    of.steps.resize(static_cast<std::size_t>(frames));
    if (chance(random, 0.1)) spoil(of, random);
    if (chance(random, 0.2)) {
        CaseStep& step = of.steps[1 + random() % (of.steps.size() - 1)];
        step.begins_trial = true;
    }
}

/// Some cases have a second hand, which goes its own ways in the same scene. By draws of its own,
/// so that the first one's stay as they are.
void add_second_hand(RandomCase& of) {
    constexpr std::uint64_t kOwnDraws = 0x2a4d;
    test::Random random(of.seed ^ kOwnDraws << 32);
    if (!chance(random, 0.12)) return;
    RandomCase second;
    second.size_m = of.size_m;
    second.place = of.place;
    add_steps(second, random, static_cast<int>(of.steps.size()));
    of.second_steps = std::move(second.steps);
}

} // namespace

void make_path(RandomCase& of, Random& random, int frames) {
    add_steps(of, random, frames);
    if (chance(random, 0.3)) add_gains(of, random, frames);
    if (chance(random, 0.7)) add_poses(of, random, frames);
    if (chance(random, 0.4)) {
        CaseEvent detour;
        detour.frame = pick(random, frames);
        of.events.push_back(detour);
    }
    std::stable_sort(of.events.begin(), of.events.end(),
                     [](const CaseEvent& a, const CaseEvent& b) { return a.frame < b.frame; });
    if (!chance(random, 0.5)) return;
    if (!is_finite(of.steps.back().probe)) of.steps.back().probe = of.place;
    of.steps.resize(of.steps.size() + kHeldFrames, {of.steps.back().probe, false});
}

RandomCase make_case(std::uint64_t seed, int frames, const LabelVolume* atlas) {
    test::Random random(seed);
    RandomCase made = SceneMaker(random, atlas).make();
    made.seed = seed;
    soften(made);
    guard_a_sieve(made);
    join_labels(made);
    step_finely(made);
    make_path(made, random, frames);
    add_second_hand(made);
    return made;
}

} // namespace palpate::stability
