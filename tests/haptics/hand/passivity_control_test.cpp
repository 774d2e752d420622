// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/hand/passivity_control.h>

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace palpate {
namespace {

constexpr double kPeriod = 1e-3;

// The account is the sum of what it books: exact to the rounding of a few terms of a mJ.
TEST(PassivityControl, TheAccountIsTheBankLessTheWorkOnTheHand) {
    PassivitySettings settings;
    settings.damping_n_s_per_m = 0.4;
    settings.active_w = 0.1;
    PassivityControl control(settings);
    const Vec3 wanted{2, 0, 0};
    control.observe({0, 0, 0}, Vec3{0.0}, wanted);
    control.sent({2, 0, 0});
    control.observe({1e-4, 5e-4, 0}, {0.1, 0, 0}, wanted);
    const double work = 2.0 * 1e-4;
    const double earned = kPeriod * (0.4 * 0.01 + 0.1);
    EXPECT_NEAR(control.account_j(), 2e-3 - work + earned, 1e-17);
    control.restart();
    EXPECT_EQ(control.account_j(), 2e-3);
}

// Pressing for a minute against friction puts in 60 J, of which a spring of 2 N at 500 N/m can
// give back 4 mJ.
TEST(PassivityControl, WhatWasPutInCountsOnlyAsFarAsTheSpringHoldsIt) {
    PassivityControl control({});
    for (int i = 0; i < 60000; ++i) {
        control.observe({-5e-4 * i, 0, 0}, {-0.5, 0, 0}, {2, 0, 0});
        control.sent({2, 0, 0});
    }
    EXPECT_DOUBLE_EQ(control.account_j(), 2e-3 + 2.0 * 2.0 / (2.0 * 500.0));
    // Beyond the limit of 5 N the spring's force is constant: 5 (8 - 2.5) / 500.
    control.observe({0, 0, 0}, {0, 0, 0}, {8, 0, 0});
    control.observe({10, 0, 0}, {0, 0, 0}, {8, 0, 0});
    PassivityControl fresh({});
    for (int i = 0; i < 100; ++i) {
        fresh.observe({-5e-3 * i, 0, 0}, {-0.5, 0, 0}, {8, 0, 0});
        fresh.sent({5, 0, 0});
    }
    EXPECT_NEAR(fresh.account_j(), 2e-3 + 0.055, 1e-15);
    // Of a coupling that is ramped in, its share.
    PassivityControl ramped({});
    for (int i = 0; i < 100; ++i) {
        ramped.observe({-5e-3 * i, 0, 0}, {-0.5, 0, 0}, {8, 0, 0}, 0.5);
        ramped.sent({2.5, 0, 0});
    }
    EXPECT_NEAR(ramped.account_j(), 2e-3 + 0.5 * 0.055, 1e-15);
}

// A hand that moves at constant speed against forces that come a delay later than they are sent:
// the account is the true work, whichever share of a frame the delay has.
TEST(PassivityControl, DelayedForcesMeetTheMovementThatTheyWorkOn) {
    for (const double delay_frames : {0.0, 1.0, 1.5, 2.25, 3.0, 30.0}) {
        PassivitySettings settings;
        settings.delay_s = delay_frames * kPeriod;
        PassivityControl control(settings);
        constexpr double kSpeed = -0.1; // m/s
        const auto sent_n = [](int frame) { return 1.0 + 0.5 * std::sin(0.1 * frame); };
        double put_in_j = 0.0;
        const auto whole = static_cast<int>(delay_frames);
        const double rest = delay_frames - whole;
        for (int frame = 0; frame < 200; ++frame) {
            control.observe({kSpeed * kPeriod * frame, 0, 0}, {kSpeed, 0, 0}, {1e3, 0, 0});
            control.sent({sent_n(frame), 0, 0});
            const auto at = [&](int k) { return k >= 0 ? sent_n(k) : 0.0; };
            if (frame > 0)
                put_in_j -= kSpeed * kPeriod *
                            ((1.0 - rest) * at(frame - 1 - whole) + rest * at(frame - 2 - whole));
        }
        EXPECT_NEAR(control.account_j() - settings.bank_j, put_in_j, 1e-15) << delay_frames;
    }
}

TEST(PassivityControl, WhatResistsIsLeftAlone) {
    PassivityControl control({});
    EXPECT_EQ(control.control({-5, 1, 0}, {1, 0, 0}), Vec3(-5, 1, 0));
    EXPECT_EQ(control.control({5, 0, 0}, Vec3{0.0}), Vec3(5, 0, 0)) << "and what does not move";
}

// 2 mJ in the bank, given over 5 ms: 0.4 W.
TEST(PassivityControl, WhatPushesAlongIsLimitedToTheAccountsPower) {
    PassivityControl control({});
    const Vec3 velocity{0.2, 0, 0};
    EXPECT_EQ(control.control({1.5, 2, 0}, velocity), Vec3(1.5, 2, 0)) << "0.3 W";
    const Vec3 kept = control.control({5, 2, 0}, velocity);
    EXPECT_NEAR(glm::dot(kept, velocity), 0.4, 1e-12);
    EXPECT_EQ(kept.y, 2.0) << "across the movement nothing is taken";
}

// At a constant velocity the bank suffices at every rate: a long frame spends no more than it has.
TEST(PassivityControl, AtAConstantVelocityTheReserveIsNotUsed) {
    for (const double rate_hz : {60.0, 100.0, 150.0, 1000.0}) {
        PassivitySettings settings;
        settings.period_s = 1.0 / rate_hz;
        PassivityControl control(settings);
        const Vec3 velocity{0.3, 0, 0}, wanted{3, 0, 0};
        for (int i = 0; i < 100; ++i) {
            control.observe(i / rate_hz * velocity, velocity, {0, 0, 0});
            EXPECT_GT(control.account_j(), -1e-12) << rate_hz << ' ' << i;
            control.sent(control.control(wanted, velocity));
        }
    }
}

// Two forces of 1 N that are under way will do 0.4 mJ before what is sent now is at work.
TEST(PassivityControl, WhatIsUnderWayIsSpent) {
    PassivitySettings settings;
    settings.delay_s = 2.0 * kPeriod;
    PassivityControl control(settings);
    control.observe({0, 0, 0}, Vec3{0.0}, {5, 0, 0});
    control.sent({1, 0, 0});
    control.sent({1, 0, 0});
    const Vec3 velocity{0.2, 0, 0};
    EXPECT_NEAR(glm::dot(control.control({5, 0, 0}, velocity), velocity), (2e-3 - 0.4e-3) / 5e-3,
                1e-12);
    const double against = glm::dot(control.control({-5, 0, 0}, -velocity), -velocity);
    EXPECT_NEAR(against, 2e-3 / 5e-3, 1e-12) << "what resists is not counted on";
}

TEST(PassivityControl, WhenItIsOverdrawnItBrakesNoHarderThanTheDeviceItself) {
    PassivitySettings settings;
    settings.damping_n_s_per_m = 0.5;
    PassivityControl control(settings);
    control.observe({0, 0, 0}, Vec3{0.0}, Vec3{0.0});
    control.sent({5, 0, 0});
    control.observe({1e-3, 0, 0}, Vec3{0.0}, Vec3{0.0}); // 5 mJ: 3 too much
    EXPECT_NEAR(control.account_j(), -3e-3, 1e-17);
    EXPECT_FALSE(control.exceeded());
    const Vec3 velocity{0.3, 0, 0};
    EXPECT_NEAR(control.control({2, 1, 0}, velocity).x, -0.5 * 0.3, 1e-15);
    EXPECT_EQ(control.control({-2, 1, 0}, velocity), Vec3(-2, 1, 0)) << "it resists already";
    control.sent({5, 0, 0});
    control.observe({3e-3, 0, 0}, Vec3{0.0}, Vec3{0.0}); // 10 mJ more
    EXPECT_TRUE(control.exceeded());
}

} // namespace
} // namespace palpate
