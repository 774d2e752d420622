// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/loop/haptic_loop.h>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <palpate/engine/scene/scene_file.h>

#include "tests/support/scripted_clock.h"

namespace palpate {
namespace {

std::shared_ptr<const Scene> ball(const std::string& more = "") {
    return std::make_shared<const Scene>(parse_scene(
        "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n[surface.s]\nvolume = \"v\"\n"
        "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n" +
            more,
        "ball.toml"));
}

DeviceState at(double x, double y, double z, std::uint32_t trial = 0) {
    DeviceState state;
    state.position = {x, y, z};
    state.trial = trial;
    return state;
}

TEST(HapticLoop, PushesBackWithStiffnessTimesDepth) {
    test::ScriptedClock clock;
    HapticLoop loop(ball("[limits]\nslew_n_per_s = 1e6\n"), clock);
    loop.frame(at(0, 0, 0.06));
    const FrameReport report = loop.frame(at(0, 0, 0.048));
    EXPECT_NEAR(report.force.z, 1.0, 1e-9);
    EXPECT_EQ(report.contacts, 1u);
    EXPECT_EQ(report.surface_queries, 0u);
}

TEST(HapticLoop, AProbeThatIsNoNumberHoldsTheProxyAndFadesTheForce) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    test::ScriptedClock clock;
    HapticLoop loop(ball(), clock);
    loop.frame(at(0, 0, 0.06));
    FrameReport report;
    for (int i = 0; i < 10; ++i)
        report = loop.frame(at(0, 0, 0.045));
    const Vec3 held = report.proxy;
    const double force = glm::length(report.force);
    EXPECT_NEAR(force, 2.5, 1e-6);
    for (const DeviceState& bad :
         {at(nan, 0, 0), at(0, INFINITY, 0), at(0, 0, -1e300), at(nan, nan, nan)}) {
        report = loop.frame(bad);
        EXPECT_EQ(report.proxy, held);
        EXPECT_TRUE(report.flags & kProbeNotFinite);
        EXPECT_LE(glm::length(report.force), force);
    }
    EXPECT_EQ(report.force, Vec3(0.0));
    report = loop.frame(at(0, 0, 0.045));
    EXPECT_FALSE(report.flags & kProbeNotFinite);
    EXPECT_NEAR(glm::length(report.proxy - held), 0.0, 1e-9) << "the next frame is normal";
}

// Seen where a path of the frame before was taken for that of a frame whose probe was infinite: who
// looks at every chord looked at it twice.
TEST(HapticLoop, AFrameThatDoesNotMoveTheProxyHasNeitherPathNorSteps) {
    test::ScriptedClock clock;
    HapticLoop loop(ball(), clock);
    loop.frame(at(0, 0, 0.06));
    DeviceState stale = at(0, 0, 0.045);
    stale.freshness = Freshness::stale;
    for (const DeviceState& silent : {at(NAN, 0, 0), at(0, INFINITY, 0), at(0, 0, -1e300), stale}) {
        loop.frame(at(0, 0, 0.045));
        EXPECT_FALSE(loop.path().empty());
        EXPECT_FALSE(loop.steps_left().empty());
        const FrameReport report = loop.frame(silent);
        EXPECT_EQ(report.evaluations, 0u);
        EXPECT_TRUE(loop.path().empty());
        EXPECT_TRUE(loop.steps_left().empty());
    }
}

TEST(HapticLoop, BeginningWithNoNumberWaitsForOne) {
    test::ScriptedClock clock;
    HapticLoop loop(ball(), clock);
    EXPECT_TRUE(loop.frame(at(NAN, 0, 0)).flags & kProbeNotFinite);
    EXPECT_EQ(loop.frame(at(0, 0, 0.06)).proxy, Vec3(0, 0, 0.06));
}

TEST(HapticLoop, ANewTrialSetsTheProxyToTheProbe) {
    test::ScriptedClock clock;
    HapticLoop loop(ball(), clock);
    loop.frame(at(0, 0, 0.06));
    loop.frame(at(0, 0, 0.045));
    EXPECT_EQ(loop.frame(at(0, 0.07, 0, 1)).proxy, Vec3(0, 0.07, 0));
    EXPECT_TRUE(loop.frame(at(0, 0.01, 0, 2)).flags & kInsideAtStart);
}

TEST(HapticLoop, AnEmptySceneFollowsTheProbeAndQueriesNothing) {
    test::ScriptedClock clock;
    HapticLoop loop(std::make_shared<const Scene>(parse_scene("", "empty.toml")), clock);
    loop.frame(at(0, 0, 0));
    const FrameReport report = loop.frame(at(0.01, 0.02, 0.03));
    EXPECT_EQ(report.proxy, Vec3(0.01, 0.02, 0.03));
    EXPECT_EQ(report.field_samples + report.surface_queries + report.root_queries, 0u);
    EXPECT_EQ(report.force, Vec3(0.0));
}

TEST(HapticLoop, SeveralLoopsShareAScene) {
    const auto scene = ball();
    test::ScriptedClock clock;
    HapticLoop one(scene, clock);
    HapticLoop two(scene, clock);
    for (int i = 0; i < 100; ++i) {
        const DeviceState state = at(0.001 * i - 0.05, 0, 0.049);
        one.frame(state);
        if (i % 2 == 0) two.frame(at(0, 0.049, 0.001 * i));
    }
    test::ScriptedClock other;
    HapticLoop alone(scene, other);
    for (int i = 0; i < 100; ++i)
        alone.frame(at(0.001 * i - 0.05, 0, 0.049));
    const DeviceState last = at(0.05, 0, 0.049);
    EXPECT_EQ(one.frame(last).proxy, alone.frame(last).proxy) << "the other loop changed nothing";
}

TEST(HapticLoop, DampingResistsApproach) {
    test::ScriptedClock clock;
    HapticLoop loop(ball("[coupling]\ndamping_n_s_per_m = 2.0\n"), clock);
    loop.frame(at(0, 0, 0.06));
    DeviceState state = at(0, 0, 0.06);
    state.velocity = {0, 0, -0.1};
    EXPECT_NEAR(loop.frame(state).force.z, 0.2, 1e-12)
        << "k_d times the velocity of a probe whose proxy stands";
}

// The way of a proxy that was held, or that begins anew, is none of one period: as a velocity it
// pulled at a hand in free space.
TEST(HapticLoop, DampingHasNoVelocityWhereThereIsAGap) {
    const auto scene = ball("[coupling]\ndamping_n_s_per_m = 2.0\n");
    test::ScriptedClock clock;
    HapticLoop loop(scene, clock);
    DeviceState state = at(0, 0, 0.06);
    state.velocity = {0, 0, 0.1};
    EXPECT_EQ(loop.frame(state).force, Vec3{0.0}) << "a trial begins";
    DeviceState late = state;
    late.freshness = Freshness::stale;
    for (const DeviceState& gap : {late, at(NAN, 0, 0)}) {
        for (int i = 0; i < 100; ++i)
            loop.frame(gap);
        state.position.z += 0.01;
        EXPECT_EQ(loop.frame(state).force, Vec3{0.0}) << "after silence";
        state.position.z += 1e-4; // 0.1 m/s: both go alike, and then the probe goes faster
        EXPECT_NEAR(loop.frame(state).force.z, 0.0, 1e-9);
        state.velocity.z = 0.2;
        state.position.z += 1e-4;
        EXPECT_NEAR(loop.frame(state).force.z, -0.2, 1e-9);
        state.velocity.z = 0.1;
    }
    ++state.trial;
    state.position = {0.08, 0, 0};
    EXPECT_EQ(loop.frame(state).force, Vec3{0.0}) << "another trial begins";
}

} // namespace
} // namespace palpate
