// SPDX-License-Identifier: Apache-2.0
// Media whose gains move: springs that fade (GainRamp::gain, PrimitiveSet::add_spring).
#include <palpate/haptics/solver/gain.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/effects/viscosity.h>

#include "tests/support/contact_loop.h"

namespace palpate {
namespace {

using test::ContactLoop;

constexpr double kLimit = 5.0; // N: FrameContext's default
// A frame may lack a last step of a tolerance, 0.1 um, at each end: N.
constexpr double kTolerance_n = 2 * 500.0 * 1e-7;

// A hand that has just gone 5 mm, and is held: with 2.5 N at most, where the medium is dense.
TEST(EffectGain, AMediumIsSwitchedOffWithoutAStep) {
    for (const double period_s : {0.25e-3, 1e-3, 4e-3, 20e-3})
        for (const double damping_n_s_per_m : {50.0, 300.0, 1000.0}) {
            std::vector<std::unique_ptr<Effect>> effects;
            effects.push_back(std::make_unique<Viscosity>(damping_n_s_per_m));
            ContactLoop loop({}, {}, std::move(effects));
            loop.start({0, 0, 0});
            const Vec3 probe{5e-3, 0, 0};
            const auto frame = [&] { loop.move(probe, period_s); };
            const auto felt_n = [&] {
                return ContactLoop::kStiffness * (probe.x - loop.proxy().x);
            };
            frame();
            double before_n = felt_n();
            loop.subdivision().gain(0).set(0.0);
            const double step_n = 4.0 * kLimit * period_s / GainRamp::kSecondsPerUnit;
            for (double time_s = 0.0; time_s < 0.06; time_s += period_s) {
                frame();
                EXPECT_LE(before_n - felt_n(), step_n) << damping_n_s_per_m << " " << period_s;
                before_n = felt_n();
            }
            EXPECT_NEAR(before_n, 0.0, kTolerance_n);
        }
}

// Neither where the program moves the gain by itself, in steps that are reached at once, nor where
// several are switched off together.
TEST(EffectGain, MediaAreSwitchedOffWithoutAStepHoweverThatIsDone) {
    for (const int media : {1, 2, 3})
        for (const double own_step : {0.0, 0.01, 0.02}) { // 0: in one set()
            std::vector<std::unique_ptr<Effect>> effects;
            for (int i = 0; i < media; ++i)
                effects.push_back(std::make_unique<Viscosity>(1000.0));
            ContactLoop loop({}, {}, std::move(effects));
            loop.start({0, 0, 0});
            const Vec3 probe{5e-3, 0, 0};
            const auto felt_n = [&] {
                return ContactLoop::kStiffness * (probe.x - loop.proxy().x);
            };
            loop.move(probe);
            double before_n = felt_n();
            for (int i = 0; i < 150; ++i) {
                const double wanted = own_step > 0.0 ? std::max(0.0, 1.0 - own_step * i) : 0.0;
                for (int n = 0; n < media; ++n)
                    loop.subdivision().gain(static_cast<std::size_t>(n)).set(wanted);
                loop.move(probe);
                EXPECT_LE(before_n - felt_n(), 0.08 * kLimit + kTolerance_n)
                    << media << ' ' << own_step << ' ' << i;
                before_n = felt_n();
            }
            EXPECT_NEAR(before_n, 0.0, kTolerance_n);
        }
}

} // namespace
} // namespace palpate
