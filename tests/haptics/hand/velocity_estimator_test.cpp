// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/hand/velocity_estimator.h>

#include <cmath>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace palpate {
namespace {

constexpr double kStep = 30e-6;  // m
constexpr double kPeriod = 1e-3; // s
constexpr double kWindow = 0.05; // s: the default

Vec3 rounded(const Vec3& p) {
    return {kStep * std::round(p.x / kStep), kStep * std::round(p.y / kStep),
            kStep * std::round(p.z / kStep)};
}

/// The same by trying every pair of a window and a slope that a pair of samples bounds.
double brute_force(const std::vector<std::pair<double, double>>& samples, double step,
                   double longest) {
    const auto [t0, y0] = samples.back();
    double best = 0.0;
    for (std::size_t window = 1; window < samples.size(); ++window) {
        double low = -INFINITY, high = INFINITY, slope = 0.0;
        for (std::size_t back = 1; back <= window; ++back) {
            const auto [t, y] = samples[samples.size() - 1 - back];
            if (t0 - t > longest) return best;
            low = std::max(low, (y0 - y - step) * (1.0 / (t0 - t)));
            high = std::min(high, (y0 - y + step) * (1.0 / (t0 - t)));
            slope = (y0 - y) * (1.0 / (t0 - t));
        }
        if (low > high) return best;
        best = low <= 0.0 && high >= 0.0 ? 0.0 : std::clamp(slope, low, high);
    }
    return best;
}

// Truth and estimate explain the oldest sample within a step, so they are 2 step / W apart at most.
TEST(VelocityEstimator, AtConstantVelocityTheErrorIsTwoStepsPerWindow) {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (int trial = 0; trial < 200; ++trial) {
        const double x = uniform(random), y = uniform(random), z = uniform(random);
        const Vec3 velocity =
            std::pow(10.0, -3.0 + 3.0 * std::abs(uniform(random))) * Vec3{x, y, z};
        const Vec3 start{uniform(random), 0.1, 0.2};
        VelocityEstimator estimator({kStep, kWindow});
        for (int i = 0; i < 200; ++i) {
            const double time = kPeriod * i;
            estimator.update(time, rounded(start + time * velocity));
            const double window = std::min(time, kWindow);
            if (i == 0) continue;
            // Ages of exactly longest_s may be rounded out of the window: one period less.
            const double bound = 2.0 * kStep / std::max(kPeriod, window - kPeriod);
            for (int axis = 0; axis < 3; ++axis)
                ASSERT_LE(std::abs(estimator.velocity()[axis] - velocity[axis]),
                          bound * (1.0 + 1e-6)) // its slack
                    << trial << " " << i;
        }
    }
}

TEST(VelocityEstimator, ExactPositionsGiveTheExactVelocity) {
    VelocityEstimator estimator({});
    for (int i = 0; i < 100; ++i)
        estimator.update(kPeriod * i, {0.2 * kPeriod * i, 0, 0});
    EXPECT_NEAR(estimator.velocity().x, 0.2, 1e-12); // 1e-16 m of rounding in 1 ms
}

TEST(VelocityEstimator, AHandleHeldBetweenTwoStepsRests) {
    std::mt19937_64 random(2);
    VelocityEstimator estimator({kStep, kWindow});
    for (int i = 0; i < 2000; ++i) {
        const double toggled = kStep * static_cast<double>(random() % 2);
        ASSERT_EQ(estimator.update(kPeriod * i, {toggled, 0.05 + toggled, 0}), Vec3(0.0));
    }
}

// A stop is known after as many frames as the steps of the movement need to be told from rest.
TEST(VelocityEstimator, AStopIsFollowedWithinTheFramesThatTellIt) {
    constexpr double kSpeed = 0.2; // m/s: 200 um a frame
    VelocityEstimator estimator({kStep, kWindow});
    int frame = 0;
    for (; frame < 100; ++frame)
        estimator.update(kPeriod * frame, rounded({kSpeed * kPeriod * frame, 0, 0}));
    EXPECT_NEAR(estimator.velocity().x, kSpeed, 2.0 * kStep / (kWindow - kPeriod));
    const Vec3 stopped = rounded({kSpeed * kPeriod * frame, 0, 0});
    estimator.update(kPeriod * frame++, stopped);
    EXPECT_GT(estimator.velocity().x, 0.5 * kSpeed);
    for (int i = 0; i < 2; ++i)
        estimator.update(kPeriod * frame++, stopped);
    EXPECT_EQ(estimator.velocity().x, 0.0);
}

TEST(VelocityEstimator, AStartIsFollowedInTheFrameThatTellsIt) {
    VelocityEstimator estimator({kStep, kWindow});
    int frame = 0;
    for (; frame < 100; ++frame)
        estimator.update(kPeriod * frame, {0, 0, 0});
    // 0.2 m/s: the first sample is more than a step away from where it rested.
    estimator.update(kPeriod * frame, {200e-6, 0, 0});
    EXPECT_GT(estimator.velocity().x, (200e-6 - kStep) / kPeriod * (1.0 - 1e-9));
}

TEST(VelocityEstimator, IsItsBruteForceTwin) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    for (int trial = 0; trial < 100; ++trial) {
        VelocityEstimator estimator({kStep, kWindow});
        std::vector<std::pair<double, double>> samples;
        double time = 0.0, position = 0.0, speed = 0.0;
        for (int i = 0; i < 60; ++i) {
            time += kPeriod * (0.2 + 1.6 * uniform(random)); // irregular
            speed += 0.05 * (uniform(random) - 0.5);
            position += kPeriod * speed;
            const double y = kStep * std::round(position / kStep);
            samples.emplace_back(time, y);
            ASSERT_EQ(estimator.update(time, {y, 0, -y}).x,
                      brute_force(samples, kStep * (1.0 + 1e-6), kWindow));
            ASSERT_EQ(estimator.velocity().z, -estimator.velocity().x);
        }
    }
}

TEST(VelocityEstimator, StaleAndUnusableSamplesChangeNothing) {
    VelocityEstimator estimator({kStep, kWindow});
    for (int i = 0; i < 50; ++i)
        estimator.update(kPeriod * i, {1e-4 * i, 0, 0});
    const Vec3 before = estimator.velocity();
    EXPECT_GT(before.x, 0.09);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(estimator.update(kPeriod * 49, {1, 1, 1}), before); // no newer
    EXPECT_EQ(estimator.update(0.0, {1, 1, 1}), before);
    EXPECT_EQ(estimator.update(kPeriod * 50, {nan, 0, 0}), before);
    EXPECT_EQ(estimator.update(nan, {0, 0, 0}), before);
    EXPECT_EQ(estimator.update(kPeriod * 50, {INFINITY, 0, 0}), before);
    estimator.update(kPeriod * 50, {1e-4 * 50, 0, 0});
    EXPECT_NEAR(estimator.velocity().x, 0.1, 2.0 * kStep / (kWindow - kPeriod));
}

// A time of the far future, once; or a clock that begins anew: neither is rest for ever.
TEST(VelocityEstimator, AfterAClockThatWasSetBackItGoesOn) {
    for (const double wrong_s : {1e9, 600.0}) {
        VelocityEstimator estimator({kStep, kWindow});
        estimator.update(wrong_s, {0, 0, 0});
        for (int i = 0; i < 100; ++i)
            estimator.update(kPeriod * i, {1e-4 * i, 0, 0});
        EXPECT_NEAR(estimator.velocity().x, 0.1, 2.0 * kStep / (kWindow - kPeriod)) << wrong_s;
    }
}

// Somebody who never sets the time of a state, or to no number: the velocity was 0 for ever, and
// whatever bounds energy by it was off.
TEST(VelocityEstimator, AClockThatWasNeverSetIsReplacedByThePeriod) {
    for (const double never_set : {0.0, std::numeric_limits<double>::quiet_NaN()}) {
        VelocityEstimator estimator({.step_m = kStep, .period_s = 2.0 * kPeriod});
        const Vec3 velocity{0.2, -0.1, 0.05}; // m/s
        for (int i = 0; i < 200; ++i) {
            const Vec3 found = estimator.update(never_set, rounded(2.0 * kPeriod * i * velocity));
            ASSERT_LT(glm::length(found), 1.05 * glm::length(velocity) + kStep / kPeriod) << i;
            // The window of 50 ms, by changes of a position that is rounded; then the next window.
            if (i > 60) {
                EXPECT_LT(glm::length(found - velocity), 2.0 * std::sqrt(3.0) * kStep / 0.046) << i;
            }
        }
        // At rest, and then on from where it is.
        const Vec3 place = rounded(200 * 2.0 * kPeriod * velocity);
        for (int i = 0; i < 60; ++i)
            estimator.update(never_set, place);
        EXPECT_EQ(estimator.velocity(), Vec3(0.0));
        // The clock runs after all: no velocity is made of one time of each clock.
        EXPECT_EQ(estimator.update(7.0, place + velocity * kPeriod), Vec3(0.0));
        const Vec3 next = estimator.update(7.0 + kPeriod, place + 2.0 * kPeriod * velocity);
        EXPECT_LT(glm::length(next - velocity), std::sqrt(3.0) * kStep / kPeriod);
    }
}

// A device that stamps each state with whole milliseconds, read more often than that.
TEST(VelocityEstimator, AClockThatStandsForAMomentIsStillTheDevices) {
    VelocityEstimator coarse({kStep, kWindow}), fine({kStep, kWindow});
    for (int i = 0; i < 4000; ++i) {
        const double time = 0.02 * (i / 20);
        const Vec3 place{1e-4 * i, 0.0, 0.0};
        const Vec3 found = coarse.update(time, place);
        if (i % 20 == 0) fine.update(time, place);
        ASSERT_TRUE(i % 20 > VelocityEstimator::kMostRepeats || found == fine.velocity()) << i;
    }
}

TEST(VelocityEstimator, ADeviceThatSaysNothingNewRests) {
    VelocityEstimator estimator({kStep, kWindow});
    for (int i = 0; i < 50; ++i)
        estimator.update(kPeriod * i, {1e-4 * i, 0, 0});
    for (int i = 0; i < VelocityEstimator::kMostRepeats; ++i)
        EXPECT_GT(estimator.update(kPeriod * 49, {49e-4, 0, 0}).x, 0.09);
    EXPECT_EQ(estimator.update(kPeriod * 49, {49e-4, 0, 0}), Vec3(0.0));
    EXPECT_GT(estimator.update(kPeriod * 60, {60e-4, 0, 0}).x, 0.09) << "and moves again";
}

TEST(VelocityEstimator, IsFiniteForEveryFiniteInput) {
    VelocityEstimator estimator({kStep, kWindow});
    for (int i = 0; i < 100; ++i)
        ASSERT_TRUE(is_finite(
            estimator.update(5e-324 + kPeriod * i, {i % 2 == 0 ? 1e308 : -1e308, 1e308, 0})));
}

TEST(VelocityEstimator, AfterAGapOrARestartItBeginsAnew) {
    VelocityEstimator estimator({kStep, kWindow});
    for (int i = 0; i < 50; ++i)
        estimator.update(kPeriod * i, {1e-4 * i, 0, 0});
    EXPECT_EQ(estimator.update(1.0, {0.5, 0, 0}), Vec3(0.0)) << "nothing is young enough";
    estimator.restart();
    EXPECT_EQ(estimator.velocity(), Vec3(0.0));
    EXPECT_EQ(estimator.update(0.0, {0, 0, 0}), Vec3(0.0)) << "time may begin again";
    EXPECT_NEAR(estimator.update(kPeriod, {1e-4, 0, 0}).x, 0.1, kStep / kPeriod);
}

} // namespace
} // namespace palpate
