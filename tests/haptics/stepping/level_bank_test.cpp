// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/stepping/level_bank.h>

#include <cmath>

#include <gtest/gtest.h>

#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/contact_loop.h"

namespace palpate {
namespace {

constexpr double kStiffness = test::ContactLoop::kStiffness;

constexpr Vec3 kUp{0, 0, 1};

TEST(LevelBank, GivesBackWhatDriftTookUnderTheSamePull) {
    LevelBank bank;
    EXPECT_EQ(bank.lift(0.0, kUp, 2e-3 * kUp, kStiffness), 0.0);
    bank.end(1.997e-3 * kUp); // sank by 3 um with the probe held
    EXPECT_NEAR(bank.lift(3e-6, kUp, 1.997e-3 * kUp, kStiffness), 3e-6, 1e-17);
    EXPECT_NEAR(bank.energy_j(), 0.5 * kStiffness * (2e-3 * 2e-3 - 1.997e-3 * 1.997e-3), 1e-17);
}

TEST(LevelBank, LiftsLessWhereTheHandPressesHarderThanWhenItSank) {
    LevelBank bank;
    bank.lift(0.0, kUp, 1e-3 * kUp, kStiffness);
    bank.end(0.996e-3 * kUp);
    const double lifted = bank.lift(4e-6, kUp, 2e-3 * kUp, kStiffness);
    EXPECT_NEAR(lifted, 2e-6, 0.01e-6); // at twice the force, half the way
    bank.end((2e-3 + lifted) * kUp);
    EXPECT_NEAR(bank.lift(4e-6 - lifted, kUp, (2e-3 + lifted) * kUp, kStiffness), 0.0, 1e-15);
}

TEST(LevelBank, LetsAProxyGoThatTheHandItselfLifts) {
    LevelBank bank;
    // the probe is 1 mm in front of it: to rise by 2 mm takes nothing
    EXPECT_EQ(bank.lift(0.0, kUp, -1e-3 * kUp, kStiffness), 2e-3);
}

// A cycle of sinking under a light pull and being lifted under a strong one would be a motor.
TEST(LevelBank, WhatSankUnderALightPullIsNotLiftedForMoreUnderAStrongOne) {
    constexpr double kRadius = 20e-3;
    SteppingSettings settings;
    settings.method = SteppingMethod::single;             // one plane for all of a frame: it drifts
    for (const double angle : {0.01, 0.02, 0.03, 0.04}) { // 0.2 to 0.8 mm in a frame
        test::ContactLoop loop(settings, test::one_surface(make_sphere_cavity(kRadius)));
        loop.start({kRadius - 1e-3, 0, 0});
        loop.move({kRadius + 0.2e-3, 0, 0}); // to the wall
        loop.move({kRadius + 0.2e-3, 0, 0});
        const Vec3 light = (kRadius + 0.2e-3) * Vec3{std::cos(angle), std::sin(angle), 0.0};
        loop.move(light);
        const Vec3 direction = glm::normalize(loop.proxy());
        const double before = glm::length(loop.proxy());
        const double sunk = before - kRadius;
        const double ahead = glm::dot(light, direction) - before;
        ASSERT_GT(sunk, 0.4 * kRadius * angle * angle); // about L^2 / 2R
        const double taken = kStiffness * sunk * (ahead + 0.5 * sunk);

        // straight behind the proxy, fifteen times as deep
        loop.move((kRadius + 3e-3) * direction);
        const double lifted = before - glm::length(loop.proxy());
        const double given = kStiffness * lifted * (kRadius + 3e-3 - before + 0.5 * lifted);
        EXPECT_NEAR(given, taken, 1e-9 * taken);
        ASSERT_GT(kStiffness * sunk * 3e-3, 5.0 * taken); // what the whole depth would have cost
    }
}

} // namespace
} // namespace palpate
