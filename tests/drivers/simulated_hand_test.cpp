// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/simulated_hand.h>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace palpate {
namespace {

/// No tremor, no friction, no delays, exact: what formulas are about.
HandSettings plain() {
    HandSettings settings;
    settings.arm.tremor_m = 0.0;
    settings.arm.reaction_s = 0.0;
    settings.mechanism.friction_n = 0.0;
    settings.mechanism.step_m = 0.0;
    settings.mechanism.bandwidth_hz = 1e5;
    settings.transport = {0.0, 0.0, 0.0};
    return settings;
}

HandSettings let_go(HandSettings settings) {
    settings.grip = {0.0, 0.0, 0.0};
    return settings;
}

Vec3 run(SimulatedHand& hand, int frames, const Vec3& force) {
    DeviceState state;
    for (int i = 0; i < frames; ++i) {
        hand.read(state);
        hand.write(force);
    }
    return state.position;
}

// The slowest mode decays with b/(2 m) = 6.6/s and more: after 4 s less than 1e-11 is left.
TEST(SimulatedHand, AFreeArmSettlesWhereItIntends) {
    SimulatedHand hand(plain(), {{0.0, {0, 0, 0}}, {0.1, {0.01, -0.02, 0.03}}});
    const Vec3 there = run(hand, 4000, Vec3{0.0});
    EXPECT_LE(glm::distance(there, {0.01, -0.02, 0.03}), 1e-11);
}

// Springs in series: the arm's gives F/k_arm, the grip's F/k_grip more at the handle.
TEST(SimulatedHand, AConstantForceShiftsItByItsSprings) {
    const HandSettings settings = plain();
    SimulatedHand hand(settings, {{0.0, {0, 0, 0}}});
    const Vec3 force{1.0, -0.5, 0.0};
    const Vec3 handle = run(hand, 4000, force);
    EXPECT_LE(glm::distance(hand.truth().hand, force / settings.arm.stiffness_n_per_m), 1e-12);
    EXPECT_LE(glm::distance(handle, force * (1.0 / settings.arm.stiffness_n_per_m +
                                             1.0 / settings.grip.stiffness_n_per_m)),
              1e-12);
}

TEST(SimulatedHand, SeedsAndSettingsGiveTheSameBits) {
    const auto end = [](std::uint64_t seed) {
        HandSettings settings;
        settings.seed = seed;
        SimulatedHand hand(settings, {{0.0, {0, 0, 0}}, {0.1, {0.01, 0, 0}}});
        run(hand, 500, {0.3, 0.2, 0.1});
        return hand.truth().handle;
    };
    EXPECT_EQ(end(1), end(1));
    EXPECT_NE(end(1), end(2));
}

// A force, not at rest: what is read is what was there a delay ago, to the bit.
TEST(SimulatedHand, APositionIsAsOldAsTheDelaySays) {
    for (const double delay : {0.0, 0.5e-3, 1e-3, 2.44e-3, 20e-3}) {
        HandSettings settings = let_go(plain());
        HandSettings late = settings;
        late.transport.read_delay_s = delay;
        // At 50 kHz a frame is a step of 20 us, and the delay a number of frames.
        settings.rate_hz = late.rate_hz = 20000.0;
        SimulatedHand now(settings, {{0.0, {0, 0, 0}}});
        SimulatedHand then(late, {{0.0, {0, 0, 0}}});
        // Of the delay the nearest step counts: 50 us in three of 16.7.
        const double step = 1.0 / 20000.0 / 3.0;
        const auto steps = static_cast<int>(std::lround(delay / step));
        std::vector<Vec3> positions;
        for (int frame = 0; frame < 600; ++frame) {
            DeviceState state, old;
            ASSERT_TRUE(now.read(state) && then.read(old));
            now.write({1, 0.5, 0});
            then.write({1, 0.5, 0});
            positions.push_back(state.position);
            if (steps % 3 == 0)
                ASSERT_EQ(old.position,
                          positions[static_cast<std::size_t>(std::max(0, frame - steps / 3))])
                    << delay << " " << frame;
            else
                ASSERT_LE(old.position.x,
                          positions[static_cast<std::size_t>(std::max(0, frame - steps / 3))].x);
        }
        EXPECT_DOUBLE_EQ(then.properties().delay_s, delay);
    }
}

TEST(SimulatedHand, AForceIsAtWorkAfterTheDelayToTheStep) {
    for (const double delay : {0.0, 1e-3, 1.5e-3, 3e-3}) {
        HandSettings settings = let_go(plain());
        settings.transport.write_delay_s = delay;
        settings.rate_hz = 20000.0;
        SimulatedHand hand(settings, {{0.0, {0, 0, 0}}});
        DeviceState state;
        int frame = 0;
        for (; frame < 200 && state.position.x == 0.0; ++frame) {
            ASSERT_TRUE(hand.read(state));
            hand.write({1, 0, 0});
        }
        // Written in frame 0, at work from `delay`, and seen in the frame after the one that
        // begins then.
        EXPECT_EQ(frame - 1, static_cast<int>(std::lround(delay * 20000.0)) + 1) << delay;
    }
}

TEST(SimulatedHand, PositionsAreWholeStepsAndTheNearest) {
    HandSettings settings;
    settings.mechanism.step_m = 60e-6;
    settings.transport = {0.0, 0.0, 0.0};
    SimulatedHand hand(settings, {{0.0, {0, 0, 0}}, {0.5, {0.01, 0.003, -0.02}}});
    for (int i = 0; i < 1000; ++i) {
        DeviceState state;
        ASSERT_TRUE(hand.read(state));
        for (int axis = 0; axis < 3; ++axis) {
            const double steps = state.position[axis] / 60e-6;
            ASSERT_NEAR(steps, std::round(steps), 1e-9);
            ASSERT_LE(std::abs(state.position[axis] - hand.truth().handle[axis]), 30e-6 + 1e-15);
        }
        ASSERT_EQ(state.velocity, Vec3(0.0)) << "it knows none";
    }
}

TEST(SimulatedHand, AmplifiersSaturateAndLag) {
    HandSettings settings = plain();
    settings.mechanism.force_n = 3.0;
    settings.mechanism.bandwidth_hz = 100.0;
    SimulatedHand hand(settings, {{0.0, {0, 0, 0}}});
    DeviceState state;
    hand.read(state);
    hand.write({0, 1e300, 0});
    hand.write({0, 30, 0});
    hand.read(state);
    // A millisecond of a first order with 100 Hz, exactly as 50 shares of it.
    EXPECT_NEAR(hand.truth().motor_force.y, 3.0 * (1.0 - std::exp(-0.2 * M_PI)), 1e-12);
    hand.write({NAN, 0, 0}); // changes nothing
    for (int i = 0; i < 100; ++i)
        hand.read(state);
    EXPECT_NEAR(hand.truth().motor_force.y, 3.0, 1e-12);
    hand.stop();
    EXPECT_EQ(hand.truth().motor_force, Vec3(0.0));
}

// Its rms of 100 um in each axis over 30 s; three sines between 8 and 12 Hz beat, and at the
// handle's weight the free arm has 0.08 kg more to move: within a third.
TEST(SimulatedHand, TremorIsAsLargeAsSet) {
    HandSettings settings;
    settings.mechanism = {1e-3, 0.0, 0.0, 0.0, 8.0, 500.0};
    SimulatedHand hand(settings, {{0.0, {0, 0, 0}}});
    Vec3 squares{0.0};
    DeviceState state;
    for (int i = 0; i < 32000; ++i) {
        hand.read(state);
        const Vec3 p = hand.truth().hand;
        if (i >= 2000) squares += p * p / 30000.0;
    }
    for (int axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(std::sqrt(squares[axis]), 100e-6, 10e-6);
}

TEST(SimulatedHand, AnIntentReachesTheArmAfterItsReaction) {
    HandSettings settings = plain();
    settings.arm.reaction_s = 0.15;
    SimulatedHand hand(settings, {{0.0, {0, 0, 0}}, {0.1, {0, 0, 0}}, {0.1, {0.01, 0, 0}}});
    DeviceState state;
    for (int i = 0; i <= 250; ++i) {
        hand.read(state);
        ASSERT_EQ(hand.truth().hand.x, 0.0) << i;
    }
    hand.read(state);
    hand.read(state);
    EXPECT_GT(hand.truth().hand.x, 0.0);
}

TEST(SimulatedHand, EndsWithItsDuration) {
    HandSettings settings;
    settings.duration_s = 0.1;
    SimulatedHand hand(settings, {{0.0, {0, 0, 0}}});
    DeviceState state;
    int frames = 0;
    while (hand.read(state))
        ++frames;
    EXPECT_EQ(frames, 100);
}

TEST(SimulatedHand, SettingsOutOfRangeAreNamed) {
    const auto message = [](HandSettings settings, std::vector<HandIntent> intents) {
        try {
            SimulatedHand hand(settings, std::move(intents));
        } catch (const std::invalid_argument& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    HandSettings settings;
    settings.arm.mass_kg = -1.0;
    EXPECT_NE(message(settings, {{0.0, Vec3{0.0}}}).find("arm mass_kg is -1"), std::string::npos);
    settings = {};
    settings.transport.jitter_s = NAN;
    EXPECT_NE(message(settings, {{0.0, Vec3{0.0}}}).find("jitter_s"), std::string::npos);
    EXPECT_NE(message({}, {}).find("at least one"), std::string::npos);
    EXPECT_NE(message({}, {{1.0, Vec3{0.0}}, {0.5, Vec3{0.0}}}).find("in order"),
              std::string::npos);
}

/// Damping of which the loop below is left with none: where oscillations neither grow nor decay.
struct Loop {
    double m, b, period;
    double q() const { return (1.0 - std::exp(-b * period / m)) * m / b; }
    /// A mass with a damper behind a spring that is held over each period: x' = x + q v + p f,
    /// v' = a v + r f, f = -k x. The product of the poles, a + k (r q - a p), is 1 at k_max.
    double most_stiffness() const {
        const double a = std::exp(-b * period / m);
        const double p = (period - q()) / b;
        const double r = (1.0 - a) / b;
        return (1.0 - a) / (r * q() - a * p);
    }
};

/// Growth of the swing of a released device on a spring without any safety: its amplitude in the
/// last second over that in the second second.
double growth(double stiffness, double delay_s) {
    HandSettings settings = let_go(plain());
    settings.transport.write_delay_s = delay_s;
    SimulatedHand hand(settings, {{0.0, {1e-3, 0, 0}}});
    double early = 0.0, late = 0.0;
    for (int frame = 0; frame < 6000; ++frame) {
        DeviceState state;
        hand.read(state);
        // Linear: what grows beyond the amplifiers would no longer.
        const double x = state.position.x;
        hand.write({-stiffness * x, 0, 0});
        if (frame >= 1000 && frame < 2000) early = std::max(early, std::abs(x));
        if (frame >= 5000) late = std::max(late, std::abs(x));
        if (std::abs(stiffness * x) > 8.0) return INFINITY;
    }
    return late / early;
}

// The known bound, k > 2 b / T (Colgate & Schenkel 1997), in its exact form for this device: 1 % to
// either side decides. 2 b / T itself is off by b T / 3 m, 0.1 %, and by the amplifiers' bandwidth
// of 1e5 Hz, a delay of 1.6 us: 0.3 % of T/2.
TEST(SimulatedHand, AVirtualWallIsStableUpToTheKnownBoundAndNoFurther) {
    const MechanismSettings mechanism;
    const Loop loop{mechanism.mass_kg, mechanism.damping_n_s_per_m, 1e-3};
    const double most = loop.most_stiffness();
    EXPECT_NEAR(most, 2.0 * mechanism.damping_n_s_per_m / 1e-3, 0.005 * most);
    EXPECT_LT(growth(0.98 * most, 0.0), 1.0);
    EXPECT_GT(growth(1.02 * most, 0.0), 1.0);
}

// With a delay the bound is b / (T/2 + delay) (Gil et al. 2009), to the first order of the delay.
TEST(SimulatedHand, ADelayedWallIsStableUpToTheKnownBoundAndNoFurther) {
    for (const double delay_s : {0.5e-3, 1e-3, 3e-3}) {
        const double most = MechanismSettings{}.damping_n_s_per_m / (0.5e-3 + delay_s);
        EXPECT_LT(growth(0.97 * most, delay_s), 1.0) << delay_s;
        EXPECT_GT(growth(1.03 * most, delay_s), 1.0) << delay_s;
    }
}

} // namespace
} // namespace palpate
