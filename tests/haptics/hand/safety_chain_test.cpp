// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/hand/safety_chain.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace palpate {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kForce = 5.0; // N, the default limit
constexpr double kSlew = 2.0;  // N per frame of 1 ms
// Lengths of a few N, scaled and added: a few roundings of 1e-16 each.
constexpr double kRounding = 1.0 + 1e-14;
// A fade's last step may be as much longer, so that rounding leaves no further one.
constexpr double kFadesOut = 1.0 + 1e-8;

SafetySettings motors() {
    SafetySettings settings;
    settings.feedback = ForceFeedback::motors;
    return settings;
}

struct Sent {
    Vec3 force;
    std::uint32_t flags;
};

Sent send(SafetyChain& chain, const Vec3& wanted, const Vec3& probe = Vec3{0.0},
          const Vec3& velocity = Vec3{0.0}) {
    std::uint32_t flags = 0;
    const Vec3 force = chain.send(wanted, probe, velocity, flags);
    return {force, flags};
}

/// A chain that has waited and ramped in.
SafetyChain engaged(const SafetySettings& settings = motors()) {
    SafetyChain chain(settings);
    for (int i = 0; i < 300; ++i)
        send(chain, Vec3{0.0});
    return chain;
}

TEST(SafetyChainWithoutMotors, NeverExceedsLimitOrSlew) {
    SafetyChain chain({});
    Vec3 before{0.0};
    const Vec3 wishes[] = {{100, 0, 0},  {-100, 3, 0},      {0, 0, 0},         {1, 1, 1},
                           {kNan, 0, 0}, {kInfinite, 1, 0}, {1e300, 1e300, 0}, {0, -9, 2}};
    for (int i = 0; i < 400; ++i) {
        const Vec3 sent = send(chain, wishes[i % 8]).force;
        ASSERT_TRUE(is_finite(sent));
        ASSERT_LE(glm::length(sent), kForce);
        ASSERT_LE(glm::length(sent - before), kSlew * kRounding);
        before = sent;
    }
}

TEST(SafetyChainWithoutMotors, GoesToZeroSmoothlyOnAForceThatIsNoNumber) {
    SafetyChain chain({});
    for (int i = 0; i < 3; ++i)
        send(chain, {5, 0, 0});
    EXPECT_DOUBLE_EQ(chain.sent().x, 5.0);
    const Sent first = send(chain, {kNan, kNan, kNan});
    EXPECT_DOUBLE_EQ(first.force.x, 3.0);
    EXPECT_TRUE(first.flags & kForceNotFinite);
    EXPECT_TRUE(first.flags & kForceSlewed);
    send(chain, {kNan, 0, 0});
    EXPECT_DOUBLE_EQ(send(chain, {kNan, 0, 0}).force.x, 0.0);
}

TEST(SafetyChainWithoutMotors, LeavesAllowedForcesAlone) {
    SafetyChain chain({});
    const Sent sent = send(chain, {1.0, 0.5, -1.0}, Vec3{9.0}, Vec3{1e3});
    EXPECT_EQ(sent.force, Vec3(1.0, 0.5, -1.0)) << "from the first frame, whatever moves";
    EXPECT_EQ(sent.flags, 0u);
}

TEST(SafetyChain, SendsNothingBeforeLittleWasWantedForAWhile) {
    SafetyChain chain(motors());
    for (int i = 0; i < 1000; ++i) {
        const Sent sent = send(chain, {0, 0, 0.3});
        ASSERT_EQ(sent.force, Vec3(0.0));
        ASSERT_EQ(sent.flags, kWaitsForSmallForce);
    }
    for (int i = 0; i < 9; ++i)
        ASSERT_EQ(send(chain, {0, 0, 0.1}).force, Vec3(0.0));
    send(chain, {0, 0, 0.3}); // and from the beginning
    int frames = 0;
    while (send(chain, {0, 0, 0.1}).force == Vec3(0.0))
        ASSERT_LT(++frames, 12);
    EXPECT_GE(frames, 9);
}

TEST(SafetyChain, RampsInOverAQuarterOfASecond) {
    SafetyChain chain(motors());
    while (send(chain, {0.1, 0, 0}).flags & kWaitsForSmallForce) {
    }
    double before = chain.sent().x;
    for (int i = 2; i <= 250; ++i) {
        const Sent sent = send(chain, {4, 0, 0});
        ASSERT_NEAR(sent.force.x, 4.0 * i / 250.0, 4.0 * 250 * 1e-15);
        ASSERT_GT(sent.force.x, before);
        ASSERT_TRUE(sent.flags & kRampsIn);
        before = sent.force.x;
    }
    EXPECT_DOUBLE_EQ(send(chain, {4, 0, 0}).force.x, 4.0);
    send(chain, {4, 0, 0}); // 250 roundings of the ramp's share may leave one more frame
    EXPECT_EQ(send(chain, {4, 0, 0}).flags, 0u);
}

TEST(SafetyChain, FadesWithinItsTimeAndWaitsAgain) {
    SafetySettings settings = motors();
    settings.slew_n_per_s = 100.0; // slower than the fade may be
    SafetyChain chain = engaged(settings);
    for (int i = 0; i < 100; ++i)
        send(chain, {5, 0, 0});
    ASSERT_DOUBLE_EQ(chain.sent().x, 5.0);
    std::uint32_t flags = 0;
    for (int i = 0; i < 4; ++i)
        chain.fade(flags);
    EXPECT_EQ(chain.sent(), Vec3(0.0)) << "4 ms, as fade_s says";
    EXPECT_EQ(send(chain, {5, 0, 0}).flags, kWaitsForSmallForce);
    EXPECT_EQ(chain.sent(), Vec3(0.0));
}

TEST(SafetyChain, FadesAtTheSlewLimitWhereThatIsSooner) {
    SafetyChain chain = engaged();
    for (int i = 0; i < 5; ++i)
        send(chain, {0, 3, 4});
    std::uint32_t flags = 0;
    EXPECT_NEAR(glm::length(chain.fade(flags)), 3.0, 1e-14);
    EXPECT_NEAR(glm::length(chain.fade(flags)), 1.0, 1e-14);
    EXPECT_EQ(chain.fade(flags), Vec3(0.0));
}

TEST(SafetyChain, AForceThatIsNoNumberIsAFault) {
    for (const Vec3& bad : {Vec3{kNan, 0, 0}, Vec3{0, kInfinite, 0}, Vec3{-kInfinite, kNan, 1}}) {
        SafetyChain chain = engaged();
        send(chain, {1, 0, 0});
        const Sent sent = send(chain, bad);
        EXPECT_EQ(sent.force, Vec3(0.0));
        EXPECT_EQ(sent.flags, kForceNotFinite);
        EXPECT_TRUE(send(chain, {1, 0, 0}).flags & kWaitsForSmallForce);
    }
}

TEST(SafetyChain, AProbeThatJumpsOrRacesIsAFault) {
    for (const Vec3& far : {Vec3{0.0101, 0, 0}, Vec3{0, 1e300, 0}, Vec3{0, 0, -1}}) {
        SafetyChain chain = engaged();
        EXPECT_EQ(send(chain, {1, 0, 0}, {0.0099, 0, 0}).flags, 0u) << "9.9 m/s";
        EXPECT_TRUE(send(chain, {1, 0, 0}, Vec3{0.0099, 0, 0} + far).flags & kProbeJumped);
        EXPECT_EQ(chain.sent(), Vec3(0.0));
    }
    SafetyChain first(motors());
    EXPECT_TRUE(send(first, {0.1, 0, 0}, {kNan, 0, 0}).flags & kProbeJumped) << "from nowhere, too";
    for (const double speed : {10.1, 1e300, kInfinite, kNan}) {
        SafetyChain chain = engaged();
        EXPECT_TRUE(send(chain, {1, 0, 0}, Vec3{0.0}, {0, speed, 0}).flags & kProbeJumped);
    }
}

// A wall that is answered 40 ms late: a hand that swings in it would be pushed along in each
// stroke.
TEST(SafetyChain, WhatGivesEnergyBecomesSofterAndComesBackSlowly) {
    SafetyChain chain = engaged();
    std::uint32_t flags = 0;
    const auto late = [](int i) { return Vec3{4.0 * std::sin(0.1 * (i + 15)), 0, 0}; };
    for (int i = 0; i < 2000; ++i) {
        const Vec3 probe{4e-3 * std::sin(0.1 * i), 0, 0};
        chain.send(late(i), probe, {0.4 * std::cos(0.1 * i), 0, 0}, flags);
    }
    EXPECT_TRUE(flags & kEnergyBounded);
    EXPECT_TRUE(flags & kSoftened);
    const double softened = send(chain, {2, 0, 0}, {4e-3 * std::sin(200.0), 0, 0}).force.x / 2.0;
    EXPECT_LT(softened, 0.5);
    double before = softened;
    for (int i = 0; i < 12000; ++i) { // at rest
        const Sent sent = send(chain, {2, 0, 0}, {4e-3 * std::sin(200.0), 0, 0});
        const double share = sent.force.x / 2.0;
        // 5 s from none to the whole: 2e-4 a frame, after the first that the slew limit shortens.
        ASSERT_LE(share, before + 2e-4 * (1.0 + 1e-9)) << i;
        ASSERT_GE(share, before) << i;
        before = share;
    }
    EXPECT_DOUBLE_EQ(before, 1.0);
}

/// Wanted forces of every size and kind, one after the other without any connection.
Vec3 any_force(std::mt19937_64& random) {
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const double x = uniform(random), y = uniform(random), z = uniform(random);
    const Vec3 direction{x, y, z};
    switch (random() % 64) {
    case 0:
        return {kNan, y, z};
    case 1:
        return {x, -kInfinite, z};
    case 2:
        return 1e300 * direction;
    case 3:
        return 1e-300 * direction;
    case 4:
        return 100.0 * direction;
    case 5:
        return Vec3{0.0};
    default:
        return 5.0 * direction;
    }
}

TEST(SafetyChain, AMillionFramesOfAnythingAreFiniteAndWithinTheLimits) {
    std::mt19937_64 random(4);
    SafetySettings settings = motors();
    settings.small_force_n = 1.5; // or little would ever be sent
    settings.calm_s = 2e-3;
    settings.ramp_s = 5e-3;
    settings.passivity.damping_n_s_per_m = 0.5;
    settings.passivity.delay_s = 1.5e-3;
    SafetyChain chain(settings);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    Vec3 before{0.0}, probe{0.0};
    std::uint32_t seen = 0;
    long sent_frames = 0;
    for (int frame = 0; frame < 1000000; ++frame) {
        std::uint32_t flags = 0;
        Vec3 sent{0.0};
        const double x = uniform(random), y = uniform(random), z = uniform(random);
        const Vec3 velocity = 0.4 * Vec3{x, y, z};
        probe += 1e-3 * velocity;
        if (random() % 500 == 0) probe = Vec3{0.0};
        if (random() % 300 == 0)
            sent = chain.fade(flags);
        else if (frame % 100 < 10) // calm enough to engage
            sent = chain.send(0.5 * Vec3{x, y, z}, probe, velocity, flags);
        else
            sent = chain.send(any_force(random), probe, velocity, flags);
        ASSERT_TRUE(is_finite(sent)) << frame;
        ASSERT_LE(glm::length(sent), kForce) << frame;
        ASSERT_LE(glm::length(sent - before), kSlew * kRounding) << frame;
        before = sent;
        seen |= flags;
        sent_frames += sent != Vec3{0.0};
    }
    EXPECT_GT(sent_frames, 100000);
    for (const FrameFlag flag : {kForceClamped, kForceSlewed, kForceNotFinite, kProbeJumped,
                                 kWaitsForSmallForce, kRampsIn, kEnergyBounded})
        EXPECT_TRUE(seen & flag) << flag;
}

/// Energy that was given beyond what was put in, J, of one engagement after the other: the worst
/// one. The probe moves as `velocity` says, which may be anything within `fastest`.
template <class Velocity>
double worst_given(const SafetySettings& settings, Velocity&& velocity, long& engagements) {
    std::mt19937_64 random(5);
    SafetyChain chain(settings);
    Vec3 probe{0.0}, moved{0.0};
    double given = 0.0, worst = 0.0;
    bool engaged = false;
    for (int frame = 0; frame < 300000; ++frame) {
        std::uint32_t flags = 0;
        const Vec3 wanted = any_force(random);
        const Vec3 sent = chain.send(frame % 100 < 4 ? Vec3{0.0} : wanted, probe, moved, flags);
        const bool waits = flags & kWaitsForSmallForce;
        if (waits && sent == Vec3{0.0}) {
            engagements += engaged;
            engaged = false;
            given = 0.0;
        } else {
            engaged = true;
        }
        moved = velocity(random, sent, moved);
        probe += settings.period_s * moved;
        given += settings.period_s * glm::dot(sent, moved);
        worst = std::max(worst, given);
    }
    return worst;
}

SafetySettings soon_engaged() {
    SafetySettings settings = motors();
    settings.calm_s = 1e-3;
    settings.ramp_s = 1e-2;
    return settings;
}

/// Bank and reserve may be used up; then at most one frame passes before it is known, and the force
/// falls from its longest by the slew limit each frame.
double most_given(const SafetySettings& settings, double fastest_m_per_s) {
    double way_m_n = settings.force_n; // of the frame that exceeds the reserve
    for (double force = settings.force_n; force > 0.0;
         force -= settings.slew_n_per_s * settings.period_s)
        way_m_n += force;
    return settings.passivity.bank_j + settings.passivity.reserve_j +
           way_m_n * settings.period_s * fastest_m_per_s;
}

// Nothing is known of the next movement: it is drawn anew in every frame.
TEST(SafetyChain, TheHandGetsNoMoreThanBankAndReserveHoweverItMoves) {
    constexpr double kFastest = 1.0; // m/s
    const SafetySettings settings = soon_engaged();
    long engagements = 0;
    const double worst = worst_given(
        settings,
        [](std::mt19937_64& random, const Vec3&, const Vec3&) {
            std::uniform_real_distribution<double> uniform(-1.0, 1.0);
            const double x = uniform(random), y = uniform(random), z = uniform(random);
            return kFastest / std::sqrt(3.0) * Vec3{x, y, z};
        },
        engagements);
    EXPECT_LE(worst, most_given(settings, kFastest));
    EXPECT_GT(worst, settings.passivity.bank_j) << "it was about something";
    EXPECT_GT(engagements, 10);
}

// The worst there is: in each frame it moves as the force says.
TEST(SafetyChain, NorIfItAlwaysGivesWay) {
    constexpr double kFastest = 1.0; // m/s
    const SafetySettings settings = soon_engaged();
    long engagements = 0;
    const double worst = worst_given(
        settings,
        [](std::mt19937_64&, const Vec3& sent, const Vec3&) {
            const double length = glm::length(sent);
            return length > 0.0 ? sent * (kFastest / length) : Vec3{0.0};
        },
        engagements);
    EXPECT_LE(worst, most_given(settings, kFastest));
    EXPECT_GT(worst, settings.passivity.bank_j);
    EXPECT_GT(engagements, 10);
}

// A hand of mass, which the controller can foresee: a wall that pushes twice as hard on the way
// out. The uncontrolled one gives energy in each stroke.
TEST(SafetyChain, AWallThatPushesHarderOnTheWayOutGivesNoMoreThanTheBank) {
    const auto given = [](SafetyChain chain) {
        double sum = 0.0, worst = 0.0;
        const auto probe = [](int i) { return Vec3{0, 0, 2e-3 * std::sin(0.02 * i)}; };
        for (int i = 0; i < 20000; ++i) {
            const Vec3 now = probe(i);
            const Vec3 velocity{0, 0, 0.04 * std::cos(0.02 * i)}; // d/dt of it
            const double k = velocity.z > 0.0 ? 1000.0 : 500.0;
            const Vec3 wanted{0, 0, std::max(0.0, -k * now.z)};
            std::uint32_t flags = 0;
            const Vec3 sent = chain.send(wanted, now, velocity, flags);
            sum += glm::dot(sent, probe(i + 1) - now);
            worst = std::max(worst, sum);
        }
        return worst;
    };
    const SafetyChain chain = engaged();
    // 64 strokes of 2 mm: the spring of 1000 N/m gives 2 mJ, that of 500 takes 1.
    EXPECT_NEAR(given(SafetyChain({})), 64 * 1e-3, 3e-3);
    // Of one frame the movement is foreseen up to v' T: 4e-2 x 0.02 x 1 ms x 2 N = 1.6 uJ.
    EXPECT_LE(given(chain), PassivitySettings{}.bank_j + 2e-6);
}

/// Any number a double can be, and those that a hand, a device or an effect gives most often.
double anything(std::mt19937_64& random) {
    switch (std::uniform_int_distribution<int>(0, 11)(random)) {
    case 0:
        return kNan;
    case 1:
        return kInfinite;
    case 2:
        return -kInfinite;
    case 3:
        return std::bit_cast<double>(random()); // any bits
    case 4:
        return 0.0;
    default:
        return std::uniform_real_distribution<double>(-8.0, 8.0)(random);
    }
}

/// Whether `now` may follow `before`: within the limit, and no further than the slew limit allows;
/// on its way to zero after a fault, with motors, than the fade.
testing::AssertionResult may_follow(const Vec3& now, const Vec3& before,
                                    const SafetySettings& settings) {
    if (!is_finite(now)) return testing::AssertionFailure() << "not finite";
    if (glm::length(now) > settings.force_n)
        return testing::AssertionFailure() << glm::length(now) << " N is beyond the limit";
    const double change = glm::length(now - before);
    const double rounding_n = (kRounding - 1.0) * settings.force_n; // of the forces' last digits
    const double slew = settings.slew_n_per_s * settings.period_s;
    if (change <= slew + rounding_n) return testing::AssertionSuccess();
    const double fade = settings.period_s * settings.force_n / settings.fade_s;
    const bool fades = settings.feedback == ForceFeedback::motors && change <= fade * kFadesOut &&
                       glm::length(now) + change <= glm::length(before) * kRounding;
    return fades ? testing::AssertionSuccess()
                 : testing::AssertionFailure() << "a step of " << change << " N";
}

TEST(SafetyChain, WhateverComesInWhatLeavesIsFiniteLimitedAndSlewed) {
    std::mt19937_64 random(20);
    const auto draw = [&](double low, double high) {
        return low * std::pow(high / low, std::uniform_real_distribution<double>(0.0, 1.0)(random));
    };
    for (int run = 0; run < 400; ++run) {
        SafetySettings settings;
        settings.feedback = run % 4 == 0 ? ForceFeedback::none : ForceFeedback::motors;
        settings.force_n = draw(1e-3, 1e3);
        settings.slew_n_per_s = draw(1e-3, 1e7);
        settings.period_s = draw(5e-5, 2e-2);
        settings.soften_s = settings.period_s * draw(1.01, 100.0);
        settings.calm_s = draw(1e-6, 1e-3);
        settings.ramp_s = draw(1e-6, 0.1);
        settings.fade_s = draw(1e-4, 1.0);
        settings.passivity.stiffness_n_per_m = draw(1e-300, 1e5);
        settings.passivity.damping_n_s_per_m = draw(1e-6, 1e3);
        settings.passivity.delay_s = draw(1e-6, 1.0);
        SafetyChain chain(settings);
        const bool wild = run % 2 == 0; // else what a chain that has waited sends on
        Vec3 before{0.0};
        for (int frame = 0; frame < 500; ++frame) {
            const bool odd = wild && std::uniform_int_distribution<int>(0, 20)(random) == 0;
            const auto number = [&] { return odd ? anything(random) : draw(1e-3, 8.0) - 1.0; };
            const double calm = frame < 100 ? 0.0 : 1.0; // at first it waits for little
            const Vec3 wanted = odd ? Vec3{number(), number(), number()}
                                    : calm * Vec3{number(), number(), number()};
            const Vec3 probe = odd ? Vec3{number(), number(), number()} : Vec3{1e-6 * frame};
            const Vec3 velocity = odd ? Vec3{number(), number(), number()} : Vec3{1e-3};
            if (odd) chain.expect(anything(random), frame % 2 == 0);
            std::uint32_t flags = 0;
            const Vec3 now = odd && frame % 3 == 0 ? chain.fade(flags)
                                                   : chain.send(wanted, probe, velocity, flags);
            ASSERT_TRUE(may_follow(now, before, settings)) << run << " " << frame;
            ASSERT_EQ(now, chain.sent());
            before = now;
        }
    }
}

// What pushes by itself is little; what it grows by, with a gain, as well.
TEST(SafetyChain, WaitsForNoLessThanWhatEffectsPush) {
    SafetyChain chain(motors());
    for (int i = 0; i < 100; ++i)
        ASSERT_TRUE(send(chain, {0, 0, 0.5}).flags & kWaitsForSmallForce);
    chain.expect(0.5, false);
    for (int i = 0; i < 12; ++i)
        send(chain, {0, 0, 0.5});
    EXPECT_GT(chain.sent().z, 0.0);
    SafetyChain weak(motors());
    weak.expect(kNan, false);
    for (int i = 0; i < 100; ++i)
        ASSERT_TRUE(send(weak, {0, 0, 0.5}).flags & kWaitsForSmallForce) << "no number is nothing";
}

} // namespace
} // namespace palpate
