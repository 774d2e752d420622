// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/contact/softness.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace palpate {
namespace {

constexpr double kK = 500.0; // N/m
// Relative, of sums and quotients of a few numbers.
constexpr double kRounding = 1e-13;

Softness table(const std::vector<Softness::Knot>& knots) {
    Softness softness;
    std::copy(knots.begin(), knots.end(), softness.knots.begin());
    softness.count = knots.size();
    return softness;
}

Softness random_table(std::mt19937& random, double steepest) {
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    Softness softness;
    Softness::Knot knot;
    softness.count = 1 + random() % Softness::kCapacity;
    for (std::size_t i = 0; i < softness.count; ++i) {
        const double way_m = 1e-4 + 3e-3 * unit(random);
        const double slope = random() % 4 == 0 ? 0.0 : steepest * unit(random);
        knot = {knot.press_m + way_m, knot.force_n + slope * way_m};
        softness.knots[i] = knot;
    }
    softness.knots[softness.count - 1].force_n += 1e-3; // not 0 everywhere
    return softness;
}

/// The hand's law as the page defines it, and nothing else: the sum of what its pieces give, no
/// piece steeper than the coupling.
double force_by_sum(const Softness& softness, double k, double press_m) {
    double left_m = press_m, force_n = 0.0;
    Softness::Knot before;
    for (std::size_t i = 0; i < softness.count; ++i) {
        const Softness::Knot& knot = softness.knots[i];
        const double rise_n = knot.force_n - before.force_n;
        const double slope = std::min(k, rise_n / (knot.press_m - before.press_m));
        const bool last = i + 1 == softness.count;
        const double piece_m = slope < k ? knot.press_m - before.press_m : rise_n / k;
        const double way_m = last ? left_m : std::min(left_m, piece_m);
        force_n += slope * way_m;
        left_m -= way_m;
        before = knot;
    }
    return force_n;
}

/// The greatest root of a function that rises, within [low, high], to the last bits.
template <class Function>
double root_of(const Function& function, double low, double high) {
    for (int i = 0; i < 200; ++i) {
        const double middle = 0.5 * (low + high);
        (function(middle) < 0.0 ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

TEST(Softness, OneStiffnessIsTheForceOverThePress) {
    for (const double stiffness : {5.0, 135.0, 200.0, 490.0}) {
        const PressLaw law(Softness::linear(stiffness), kK);
        ASSERT_FALSE(law.is_hard());
        for (const double press_m : {0.0, 1e-6, 1e-3, 2e-2, 3.0}) {
            EXPECT_DOUBLE_EQ(law.force_n(press_m), stiffness * press_m);
            EXPECT_DOUBLE_EQ(law.slope(press_m), stiffness);
        }
        EXPECT_DOUBLE_EQ(law.press_m(1.5), 1.5 / stiffness);
        EXPECT_DOUBLE_EQ(law.strength_of_hard_n(1.5), kK * 1.5 / stiffness);
    }
}

TEST(Softness, WhatIsNotSofterThanTheCouplingIsHard) {
    for (const double stiffness : {kK, 600.0, 1e5})
        EXPECT_TRUE(PressLaw(Softness::linear(stiffness), kK).is_hard());
    EXPECT_TRUE(PressLaw({}, kK).is_hard());
    EXPECT_TRUE(PressLaw(table({{1e-3, 0.6}, {2e-3, 1.2}}), kK).is_hard());
    EXPECT_FALSE(PressLaw(table({{1e-3, 0.6}, {2e-3, 1.0}}), kK).is_hard()); // 400 N/m behind 1 mm
    EXPECT_EQ(PressLaw({}, kK).strength_of_hard_n(2.0), 2.0);
}

TEST(Softness, ATableIsLinearBetweenItsKnotsAndGoesOn) {
    const PressLaw law(table({{4e-3, 0.2}, {8e-3, 1.0}, {12e-3, 2.8}}), kK);
    EXPECT_DOUBLE_EQ(law.force_n(2e-3), 0.1);
    EXPECT_DOUBLE_EQ(law.force_n(4e-3), 0.2);
    EXPECT_NEAR(law.force_n(6e-3), 0.6, 1e-15);
    EXPECT_NEAR(law.force_n(10e-3), 1.9, 1e-15);
    EXPECT_NEAR(law.force_n(16e-3), 4.6, 1e-15);
}

TEST(Softness, RandomTablesAreTheSumOfTheirPieces) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    int soft = 0;
    for (int trial = 0; trial < 2000; ++trial) {
        const Softness softness = random_table(random, trial % 2 == 0 ? 450.0 : 1500.0);
        const PressLaw law(softness, kK);
        if (law.is_hard()) continue;
        ++soft;
        double before_n = 0.0, before_m = 0.0;
        for (int i = 1; i <= 40; ++i) {
            const double press_m = before_m + 2e-3 * unit(random);
            const double force_n = law.force_n(press_m);
            EXPECT_NEAR(force_n, force_by_sum(softness, kK, press_m), kRounding * (1.0 + force_n))
                << trial;
            const double slope = law.slope(press_m);
            EXPECT_GE(slope, 0.0);
            EXPECT_LE(slope, kK * (1 + kRounding));
            // The bound of the page: never more than today's hard wall asks of the loop.
            const double rounding_n = kRounding * (1.0 + force_n);
            EXPECT_GE(force_n, before_n - rounding_n);
            EXPECT_LE(force_n - before_n, kK * (press_m - before_m) + rounding_n);
            before_n = force_n;
            before_m = press_m;
        }
    }
    EXPECT_GT(soft, 1500);
}

TEST(Softness, ThePressOfAForceIsTheLeastThatPressesSo) {
    std::mt19937 random(12);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (int trial = 0; trial < 500; ++trial) {
        const PressLaw law(random_table(random, 450.0), kK);
        const double force_n = 1e-3 + unit(random);
        const double press_m = law.press_m(force_n);
        if (std::isinf(press_m)) {
            EXPECT_LT(law.force_n(1e6), force_n); // a last piece that is flat
            continue;
        }
        EXPECT_NEAR(law.force_n(press_m), force_n, kRounding * (1.0 + kK * press_m));
        EXPECT_LT(law.force_n(press_m - 1e-9), force_n);
    }
}

TEST(Softness, ADamperIsTheImplicitStepOfTissueBehindTheCoupling) {
    std::mt19937 random(13);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    constexpr double kPeriod = 1e-3;
    int pressed = 0, left = 0;
    for (int trial = 0; trial < 5000; ++trial) {
        const Softness softness = random_table(random, 450.0);
        const PressLaw law(softness, kK);
        const double press_m = 2e-2 * unit(random), before_m = 2e-2 * unit(random);
        const double damping = 20.0 * unit(random);
        const PressLaw::Balance balance = law.damped(press_m, before_m, damping, kPeriod);
        EXPECT_GE(balance.force_n, 0.0);
        // F_t(d) by its definition: the hand's law in series with the coupling, solved for delta.
        const auto tissue_n = [&](double tissue_m) {
            const double delta_m = root_of(
                [&](double delta) { return delta - law.force_n(delta) / kK - tissue_m; }, 0.0, 1e3);
            return law.force_n(delta_m);
        };
        const double viscous_n = damping / kPeriod * (balance.tissue_m - before_m);
        const double rest_n = tissue_n(balance.tissue_m) + viscous_n - balance.force_n;
        EXPECT_NEAR(rest_n, 0.0, 1e-9) << trial; // of forces up to 400 N
        if (balance.force_n > 0.0) {
            ++pressed;
            EXPECT_NEAR(balance.force_n, kK * (press_m - balance.tissue_m), 1e-12);
        } else {
            ++left;
            EXPECT_GE(balance.tissue_m, press_m - 1e-12); // the tip has left what comes back
        }
    }
    EXPECT_GT(pressed, 1000);
    EXPECT_GT(left, 500);
}

TEST(Softness, WithoutADamperTheDampedStepIsTheLaw) {
    std::mt19937 random(14);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (int trial = 0; trial < 2000; ++trial) {
        const PressLaw law(random_table(random, 450.0), kK);
        const double press_m = 2e-2 * unit(random);
        EXPECT_NEAR(law.damped(press_m, unit(random), 0.0, 1e-3).force_n, law.force_n(press_m),
                    1e-12);
    }
}

TEST(Softness, WhatIsNoLawIsRefusedByName) {
    const auto why = [](const Softness& softness) -> std::string {
        try {
            softness.check("surfaces[\"liver\"].softness");
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return {};
    };
    EXPECT_EQ(why({}), "");
    EXPECT_EQ(why(table({{1e-3, 0.0}, {2e-3, 0.5}, {3e-3, 0.5}})), "");
    EXPECT_NE(why(table({{1e-3, 0.0}})).find("no knot has a force above 0"), std::string::npos);
    EXPECT_NE(why(table({{2e-3, 0.1}, {2e-3, 0.2}})).find("knot 2: press_m"), std::string::npos);
    EXPECT_NE(why(table({{1e-18, 1.0}})).find("knot 1: press_m"), std::string::npos);
    EXPECT_NE(why(table({{1e-3, 0.3}, {2e-3, 0.2}})).find("knot 2: force_n"), std::string::npos);
    EXPECT_NE(why(Softness::linear(std::numeric_limits<double>::infinity())).find("force_n = inf"),
              std::string::npos);
    EXPECT_NE(why(Softness::linear(std::nan(""))).find("force_n"), std::string::npos);
    Softness damped = Softness::linear(100.0);
    damped.damping = -1.0;
    EXPECT_NE(why(damped).find("damping = -1"), std::string::npos);
}

// A piece as stiff as the coupling is 0.2 mm wide here, and the next one a nanometre: rounding must
// not take its width.
TEST(PressLaw, KnotsThatLieCloseTogetherHaveASlope) {
    const Softness steep = table({{1e-9, 0.1}, {2e-9, 0.2}, {2e-3, 0.3}});
    steep.check("softness");
    const PressLaw law(steep, kK);
    ASSERT_FALSE(law.is_hard());
    for (int i = 0; i <= 100; ++i) {
        EXPECT_TRUE(std::isfinite(law.force_n(2e-5 * i))) << i;
        EXPECT_LE(law.slope(2e-5 * i), kK * (1.0 + kRounding)) << i;
    }
    EXPECT_NEAR(law.force_n(0.2 / kK), 0.2, kRounding);
}

// Trapezoids of a law of straight pieces err only where a piece ends within one.
TEST(PressLaw, ItsEnergyIsTheIntegralOfItsForce) {
    SCOPED_TRACE("seed 21");
    std::mt19937 random(21);
    for (int n = 0; n < 50; ++n) {
        const PressLaw law(random_table(random, 900.0), kK);
        constexpr double step = 1e-5;
        double sum_j = 0.0;
        for (int i = 0; i < 3000; ++i) {
            sum_j += 0.5 * step * (law.force_n(step * i) + law.force_n(step * (i + 1)));
            const double bound_j = Softness::kCapacity * kK * step * step;
            ASSERT_NEAR(law.energy_j(step * (i + 1)), sum_j, bound_j);
        }
    }
    EXPECT_DOUBLE_EQ(PressLaw(Softness{}, kK).energy_j(2e-3), 0.5 * kK * 4e-6);
}

TEST(PressLaw, ScaledItIsTheSameLawTimesTheRatioAsFarAsTheCouplingLetsIt) {
    SCOPED_TRACE("seed 22");
    std::mt19937 random(22);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    int capped = 0;
    for (int n = 0; n < 300; ++n) {
        const PressLaw law(random_table(random, 600.0), kK);
        if (law.is_hard()) continue;
        const double ratio = 0.3 + 1.5 * unit(random);
        const double took = law.ratio_within(ratio);
        const PressLaw scaled = law.scaled(took);
        EXPECT_LE(took, ratio);
        capped += took < ratio ? 1 : 0;
        double steepest = 0.0;
        for (int i = 1; i < 400; ++i) {
            const double press_m = 1e-4 * i;
            EXPECT_NEAR(scaled.force_n(press_m), took * law.force_n(press_m),
                        kRounding * (1.0 + law.force_n(press_m)));
            EXPECT_LE(scaled.slope(press_m), kK * (1.0 + kRounding));
            steepest = std::max(steepest, scaled.slope(press_m));
            // Coupling and tissue are still in series: a damper of nothing changes nothing.
            EXPECT_NEAR(scaled.damped(press_m, 0.0, 0.0, 1e-3).force_n, scaled.force_n(press_m),
                        1e-9);
        }
        if (took < ratio) {
            EXPECT_NEAR(steepest, kK, 1e-6 * kK);
        }
    }
    EXPECT_GT(capped, 20);
}

TEST(PressLaw, AnIndentationIsTheTissuesForceTheOtherWayRound) {
    const PressLaw law(table({{3e-3, 0.3}, {4e-3, 2.0}, {9e-3, 3.0}}), kK);
    for (int i = 1; i <= 40; ++i) {
        const double force_n = 0.1 * i;
        EXPECT_NEAR(law.tissue(law.indentation_m(force_n)).force_n, force_n, 1e-9) << force_n;
    }
    EXPECT_TRUE(std::isinf(PressLaw(table({{3e-3, 0.3}, {6e-3, 0.3}}), kK).indentation_m(0.4)));
}

} // namespace
} // namespace palpate
