// SPDX-License-Identifier: Apache-2.0
// Layers of tissue with a damper: what they come to, and what they hold as their gain falls.
#include <palpate/haptics/contact/softness.h>

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/support/soft_layers.h"

namespace palpate {
namespace {

using test::ball;
using test::ContactLoop;
using test::force;
using test::precise_layers;
using test::soft;
using test::surfaces;

constexpr double kK = ContactLoop::kStiffness;

/// A damped layer at a gain g holds no more than its strength, however fast it is pressed.
void expect_no_more_than_strength(double stiffness, double damping,
                                  const SteppingSettings& settings) {
    constexpr double kGain = 0.1, kLeft_n = 5.0 * kGain / (1.0 - kGain); // Gain::strength_n
    const Vec3 above{61e-3, 0, 0};
    for (const double step_m : {0.1e-3, 0.3e-3}) {
        SurfaceFinish skin;
        skin.softness = Softness::linear(stiffness);
        skin.softness.damping = damping;
        ContactLoop loop(settings, surfaces(ball(20e-3), ball(60e-3)), {}, 0.0, {{}, skin});
        loop.start(above);
        loop.subdivision().gain(1, SurfacePart::strength).set(kGain);
        for (int i = 0; i < 60; ++i)
            loop.move(above);
        for (double depth_m = 0.0; depth_m < 20e-3; depth_m += step_m) {
            const Vec3 probe{60e-3 - depth_m, 0, 0};
            EXPECT_FALSE(loop.move(probe).flags & kEvaluationCap) << damping << ' ' << depth_m;
            EXPECT_LE(force(loop, probe).x, kLeft_n + 1e-3) << damping << ' ' << depth_m;
            EXPECT_GE(force(loop, probe).x, std::min(kLeft_n, stiffness * depth_m) - 1e-3);
        }
    }
}

void expect_no_step_where_it_is_switched_off(double stiffness, double damping,
                                             const SteppingSettings& settings) {
    SurfaceFinish skin;
    skin.softness = Softness::linear(stiffness);
    skin.softness.damping = damping;
    ContactLoop loop(settings, surfaces(ball(20e-3), ball(60e-3)), {}, 0.0, {{}, skin});
    loop.start({61e-3, 0, 0});
    const Vec3 probe{40.5e-3, 0, 0};
    for (int i = 0; i < 2000; ++i)
        loop.move(probe);
    double before_n = force(loop, probe).x;
    ASSERT_NEAR(before_n, stiffness * 19.5e-3, 1e-3);
    loop.subdivision().gain(1, SurfacePart::strength).set(0.0);
    for (int i = 0; i < 60; ++i) {
        EXPECT_FALSE(loop.move(probe).flags & kEvaluationCap) << damping << ' ' << i;
        EXPECT_LE(before_n - force(loop, probe).x, 0.08 * 5.0 + 1e-6) << damping << ' ' << i;
        before_n = force(loop, probe).x;
    }
    EXPECT_NEAR(before_n, 0.0, 1e-6);
}

// Each step of a damped layer is short, the shorter the higher the rate: that is no rest.
TEST(SoftLayers, WithADamperItCreepsToTheLaw) {
    constexpr double kSkin = 200.0;
    for (const double period_s : {1e-3, 50e-6})
        for (const double depth_m : {1e-3, 5e-3}) {
            SurfaceFinish skin = soft(kSkin, 80.0);
            ContactLoop loop({}, surfaces(ball(30e-3), ball(60e-3)), {}, 0.0, {{}, skin});
            loop.start({61e-3, 0, 0});
            const Vec3 probe{60e-3 - depth_m, 0, 0};
            for (int i = 0; i < static_cast<int>(2.0 / period_s); ++i)
                loop.move(probe, period_s);
            EXPECT_NEAR(force(loop, probe).x, kSkin * depth_m, 2.0 * kK * 0.1e-6)
                << period_s << ' ' << depth_m;
        }
}

TEST(SoftLayers, ADampedOneHoldsNoMoreThanItsStrength) {
    for (const double stiffness : {50.0, 100.0})
        for (const double damping : {2.0, 10.0, 20.0})
            for (const SteppingSettings& settings : {SteppingSettings{}, precise_layers()})
                expect_no_more_than_strength(stiffness, damping, settings);
}

TEST(SoftLayers, ADampedOneIsSwitchedOffWithoutAStep) {
    for (const double stiffness : {50.0, 100.0})
        for (const double damping : {0.5, 2.0, 10.0})
            for (const SteppingSettings& settings : {SteppingSettings{}, precise_layers()})
                expect_no_step_where_it_is_switched_off(stiffness, damping, settings);
}

// The front goes on by the gain in the frame's first evaluation alone; the rest of the frame must
// know of it.
TEST(SoftLayers, ADampedOneWhoseGainFallsUnderAHandThatMovesFadesWithoutAStep) {
    for (const double damping : {2.0, 10.0, 40.0})
        for (const double speed_m : {0.0, 0.05e-3, 0.2e-3})
            for (const double gain : {0.0, 0.1, 0.5})
                for (const SteppingSettings& settings : {SteppingSettings{}, precise_layers()}) {
                    ContactLoop loop(settings, surfaces(ball(20e-3), ball(60e-3)), {}, 0.0,
                                     {{}, soft(100.0, damping)});
                    loop.start({61e-3, 0, 0});
                    Vec3 probe{45e-3, 0, 0};
                    for (int i = 0; i < 2000; ++i)
                        loop.move(probe);
                    const double pressed_n = force(loop, probe).x;
                    ASSERT_GT(pressed_n, 1.0);
                    const double most_n =
                        std::min(pressed_n, gain < 1.0 ? 5.0 * gain / (1.0 - gain) : pressed_n);
                    loop.subdivision().gain(1, SurfacePart::strength).set(gain);
                    double least_n = pressed_n;
                    for (int i = 0; i < 60; ++i) {
                        probe.y += speed_m; // along the surface
                        loop.move(probe);
                        const double now_n = glm::length(force(loop, probe));
                        // 8 % of the limit: what a gain may take in a frame of its ramp.
                        EXPECT_LE(least_n - now_n, 0.08 * 5.0 + 1e-3)
                            << damping << ' ' << speed_m << ' ' << gain << ' ' << i;
                        least_n = now_n;
                    }
                    // A hand that moves along a ball comes out of it, and a damper follows later.
                    if (speed_m > 0.0) continue;
                    EXPECT_GE(least_n, most_n - 1e-2) << damping << ' ' << gain;
                }
}

// Bone holds the tip, so the tissue over it is not pressed on: its strength is none of its force.
TEST(SoftLayers, OverBoneADampedOneAtALowGainPressesByItsLaw) {
    constexpr double kSkin = 50.0, kGain = 0.2, kThick_m = 2e-3;
    ContactLoop loop(precise_layers(), surfaces(ball(50e-3), ball(50e-3 + kThick_m)), {}, 0.0,
                     {{}, soft(kSkin, 2.0)});
    loop.start({53e-3, 0, 0});
    loop.subdivision().gain(1, SurfacePart::strength).set(kGain);
    for (int i = 0; i < 60; ++i)
        loop.move({53e-3, 0, 0});
    const Vec3 probe{45e-3, 0, 0};
    for (int i = 0; i < 1000; ++i)
        loop.move(probe);
    TouchList touches;
    loop.subdivision().find_touches(touches);
    const PressLaw law(Softness::linear(kSkin), kK);
    int found = 0;
    for (const Touch& touch : touches) {
        if (touch.surface != 1) continue;
        EXPECT_NEAR(glm::length(touch.force), law.tissue(kThick_m).force_n, 1e-4);
        ++found;
    }
    EXPECT_EQ(found, 1);
}

// It had no force for ever: what was asked for at rest was taken from the tissue's first push.
TEST(SoftLayers, ATissueThatComesBackReachesAHeldTip) {
    SurfaceFinish skin = soft(100.0);
    skin.softness.damping = 20.0;
    ContactLoop loop({}, surfaces(ball(40e-3), ball(60e-3)), {}, 0.0, {{}, skin});
    loop.start({61e-3, 0, 0});
    for (int i = 0; i < 400; ++i)
        loop.move({60e-3 - std::min(8e-3, 1e-4 * i), 0, 0});
    const Vec3 held{57e-3, 0, 0};
    for (int i = 0; i < 3000; ++i)
        loop.move(held);
    EXPECT_NEAR(force(loop, held).x, 0.3, 1e-3);
}

} // namespace
} // namespace palpate
