// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/stepping/stepping.h>

#include <gtest/gtest.h>

#include "tests/support/scripted_clock.h"

namespace palpate {
namespace {

constexpr int kWork = 1000;

SteppingSettings settings_of(SteppingMethod method) {
    SteppingSettings settings;
    settings.method = method;
    return settings;
}

/// After so many evaluations of a frame that has spent nothing else.
FrameBudget after(std::uint32_t evaluations) { return {evaluations, kWork, 0, 0}; }

TEST(Stepping, SingleMakesTheWholeMovementAtOnce) {
    test::ScriptedClock clock;
    Stepping stepping(settings_of(SteppingMethod::single), clock);
    EXPECT_EQ(stepping.count_steps_left({1e-3, false}, after(1)), 0u);
    EXPECT_EQ(stepping.share({0, 0, 0}, {1, 0, 0}), Vec3(1, 0, 0));
    EXPECT_FALSE(stepping.goes_on(after(1)));
    EXPECT_FALSE(stepping.is_unfinished()) << "nothing was sought";
}

// Eq. (9): with three steps left a quarter of the way is made.
TEST(Stepping, FixedCountsDownAndSharesTheRest) {
    SteppingSettings settings = settings_of(SteppingMethod::fixed);
    settings.sub_steps = 4;
    test::ScriptedClock clock;
    Stepping stepping(settings, clock);
    for (std::uint32_t made = 1; made <= 4; ++made) {
        EXPECT_EQ(stepping.count_steps_left({1e-3, false}, after(made)), 4u - made);
        EXPECT_EQ(stepping.share({0, 0, 0}, {1, 0, 0}), Vec3(1.0 / (5 - made), 0, 0));
        EXPECT_EQ(stepping.goes_on(after(made)), made < 4);
    }
    EXPECT_EQ(stepping.count_steps_left({1e-3, false}, after(5)), 0u) << "a frame begun anew";
}

TEST(Stepping, PaperReplaysWithoutTheClock) {
    test::ScriptedClock clock(10.0);
    Stepping stepping(settings_of(SteppingMethod::paper), clock);
    const std::uint32_t recorded[] = {7, 3, 0};
    stepping.begin_frame(recorded);
    for (std::uint32_t made = 1; made <= 3; ++made)
        EXPECT_EQ(stepping.count_steps_left({1e-3, false}, after(made)), recorded[made - 1]);
    EXPECT_EQ(stepping.count_steps_left({1e-3, false}, after(4)), 0u) << "there are no more";
    EXPECT_EQ(stepping.estimate_us(),
              Stepping(settings_of(SteppingMethod::paper), clock).estimate_us())
        << "nothing was learnt";
}

TEST(Stepping, AdaptiveGoesOnUntilItConvergesOrMayNotAnyMore) {
    SteppingSettings settings = settings_of(SteppingMethod::adaptive);
    settings.evaluation_cap = 3;
    test::ScriptedClock clock;
    Stepping stepping(settings, clock);
    stepping.begin_approach();
    EXPECT_EQ(stepping.count_steps_left({1e-3, false}, after(1)), 2u);
    EXPECT_TRUE(stepping.goes_on(after(1)));
    EXPECT_EQ(stepping.count_steps_left({0.5 * settings.tolerance_m, true}, after(2)), 1u)
        << "of facets nothing is expected: the next one may be another";
    EXPECT_EQ(stepping.count_steps_left({0.5 * settings.tolerance_m, false}, after(2)), 0u);
    EXPECT_TRUE(stepping.has_converged());
    EXPECT_FALSE(stepping.goes_on(after(2)));
    stepping.cut_short();
    EXPECT_TRUE(stepping.goes_on(after(2))) << "the step that was to be the last was none";
    EXPECT_FALSE(stepping.goes_on(after(3)));
    EXPECT_TRUE(stepping.goes_on({3, kWork, 0, 1})) << "an edge of a surface is not of the cap";
    EXPECT_FALSE(stepping.goes_on({2, 0, 0, 0})) << "no work left";
    EXPECT_TRUE(stepping.is_unfinished());
}

TEST(Stepping, AdaptiveDampsStepsWhileTheResidualDoesNotFall) {
    test::ScriptedClock clock;
    Stepping stepping(settings_of(SteppingMethod::adaptive), clock);
    stepping.begin_approach();
    for (const double damping : {1.0, 0.5, 0.25, 0.125, 0.0625, 0.0625}) {
        stepping.count_steps_left({1e-3, false}, after(1));
        EXPECT_EQ(stepping.damp(), damping);
    }
    stepping.count_steps_left({0.5e-3, false}, after(1));
    EXPECT_EQ(stepping.damp(), 0.125) << "it falls again";
    stepping.begin_approach();
    stepping.count_steps_left({1e-3, false}, after(1));
    EXPECT_EQ(stepping.damp(), 1.0);
}

} // namespace
} // namespace palpate
