// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/internal/hand_mechanics.h>

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace palpate {
namespace {

using internal::HandLedger;
using internal::HandMechanics;

constexpr double kStep_s = 20e-6;

Vec3 motor(double t) {
    return {2.0 * std::sin(300.0 * t), 1.0, t > 0.5 ? -3.0 : 3.0 * std::sin(20.0 * t)};
}
Vec3 tremor(double t) { return {0.1 * std::sin(63.0 * t), 0.1 * std::cos(50.0 * t), 0}; }
Vec3 intent(double t) { return {t < 0.3 ? 0.02 * t : 0.006, 0, -0.01 * t}; }

struct Balance {
    double missing_j = 0.0; ///< in - out - what is in it
    double moved_j = 0.0;   ///< in and out together: the scale
    double travel_m = 0.0;  ///< of the grip's stretch, per axis, summed
    double largest_stretch_m = 0.0;
};

Balance balance_of(const HandSettings& settings) {
    HandMechanics hand(settings, Vec3{0.0});
    Balance result;
    double t = 0.0;
    Vec3 stretch{0.0};
    for (int i = 0; i < 50000; ++i, t += kStep_s) {
        hand.step(kStep_s, motor(t), tremor(t), intent(t));
        const Vec3 now = hand.handle() - hand.hand();
        const Vec3 change = glm::abs(now - stretch);
        result.travel_m += change.x + change.y + change.z;
        result.largest_stretch_m =
            std::max(result.largest_stretch_m, std::max(change.x, std::max(change.y, change.z)));
        stretch = now;
        const HandLedger& l = hand.ledger();
        const double missing = l.motors + l.muscles - l.viscous - l.friction - hand.energy_j();
        result.missing_j = std::max(result.missing_j, std::abs(missing));
        result.moved_j = std::abs(l.motors) + std::abs(l.muscles) + l.viscous + l.friction;
    }
    return result;
}

// The midpoint rule keeps the balance of springs and dampers exactly: what is left is the rounding
// of 50000 sums.
TEST(HandMechanics, WithoutFrictionEnergyIsKeptToRounding) {
    HandSettings settings;
    settings.mechanism.friction_n = 0.0;
    const Balance balance = balance_of(settings);
    EXPECT_GT(balance.moved_j, 0.01);
    EXPECT_LE(balance.missing_j, 50000 * 1e-16 * balance.moved_j);
}

// Friction changes the way by up to dt^2 f/m / 2 behind the back of the grip's force, which is
// taken at the middle of the way without it: dt^2 k f / (4 m) for each metre that the grip is
// stretched.
TEST(HandMechanics, FrictionIsOffByNoMoreThanItsImpulseOnTheGrip) {
    HandSettings settings;
    settings.mechanism.friction_n = 0.3;
    const Balance balance = balance_of(settings);
    const double per_metre = kStep_s * kStep_s * settings.grip.stiffness_n_per_m * 0.3 /
                             (4.0 * settings.mechanism.mass_kg);
    EXPECT_LE(balance.missing_j, per_metre * balance.travel_m + 50000 * 1e-16 * balance.moved_j);
    EXPECT_GT(balance.travel_m, 1e-3);
}

// A side of the play that is met or left within a step is noticed at its end: half k of the way in
// that step, squared. It is met at most as often as the way needs to cross the play, and left
// again.
TEST(HandMechanics, PlayIsOffByAStepsWayAtEachSide) {
    HandSettings settings;
    settings.mechanism.friction_n = 0.0;
    settings.grip.backlash_m = 50e-6;
    const Balance balance = balance_of(settings);
    const double per_step =
        settings.grip.stiffness_n_per_m * balance.largest_stretch_m * balance.largest_stretch_m;
    EXPECT_LE(balance.missing_j, per_step * 50000);
    EXPECT_LE(balance.missing_j, 0.01 * balance.moved_j);
}

TEST(HandMechanics, SticksUntilTheMotorsExceedFriction) {
    HandSettings settings;
    settings.mechanism.friction_n = 0.3;
    settings.grip = {0.0, 0.0, 0.0}; // let go
    HandMechanics hand(settings, Vec3{0.0});
    for (int i = 0; i < 5000; ++i)
        hand.step(kStep_s, {0.2, 0.2, 0.0}, Vec3{0.0}, Vec3{0.0}); // 0.283 N
    EXPECT_EQ(hand.handle(), Vec3(0.0)) << "not one bit";
    hand.step(kStep_s, {0.25, 0.25, 0.0}, Vec3{0.0}, Vec3{0.0});
    EXPECT_GT(hand.handle().x, 0.0);
}

// A free mass with damping: v = F/b (1 - exp(-b t/m)). The midpoint rule's own error is
// (b dt/m)^2/12 of it.
TEST(HandMechanics, AReleasedDeviceIsAMassWithADamper) {
    HandSettings settings;
    settings.mechanism.friction_n = 0.0;
    settings.grip = {0.0, 0.0, 0.0};
    const double b = settings.mechanism.damping_n_s_per_m;
    const double m = settings.mechanism.mass_kg;
    HandMechanics hand(settings, Vec3{0.0});
    for (int i = 0; i < 10000; ++i)
        hand.step(kStep_s, {1.0, 0, 0}, Vec3{0.0}, Vec3{0.0});
    const double expected = 1.0 / b * (1.0 - std::exp(-b * 0.2 / m));
    EXPECT_NEAR(hand.handle_velocity().x, expected, 1e-6);
}

} // namespace
} // namespace palpate
