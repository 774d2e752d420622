// SPDX-License-Identifier: Apache-2.0
#include <limits>

#include <gtest/gtest.h>

#include <palpate/haptics/force_limiter.h>
#include <palpate/haptics/step_time_estimator.h>
#include <palpate/haptics/transfer_function.h>
#include <palpate/haptics/virtual_coupling.h>

namespace palpate {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

TEST(VirtualCoupling, IsSpringAndDamperOfEquationThree) {
    const Vec3 force =
        coupling_force({500.0, 2.0}, {0, 0, -0.002}, {0, 0, 0}, {0.1, 0, 0}, {0.05, 0, 0});
    EXPECT_DOUBLE_EQ(force.z, 1.0);
    EXPECT_DOUBLE_EQ(force.x, -0.1);
}

TEST(ForceLimiter, NeverExceedsLimitOrSlew) {
    ForceLimiter limiter({5.0, 2000.0, 1e-3});
    Vec3 before{0.0};
    const Vec3 wishes[] = {{100, 0, 0},  {-100, 3, 0},      {0, 0, 0},         {1, 1, 1},
                           {kNan, 0, 0}, {kInfinite, 1, 0}, {1e300, 1e300, 0}, {0, -9, 2}};
    for (int i = 0; i < 400; ++i) {
        std::uint32_t flags = 0;
        const Vec3 sent = limiter.limit(wishes[i % 8], flags);
        ASSERT_TRUE(is_finite(sent));
        ASSERT_LE(glm::length(sent), 5.0 * (1.0 + 1e-15));
        ASSERT_LE(glm::length(sent - before), 2.0 * (1.0 + 1e-15));
        before = sent;
    }
}

TEST(ForceLimiter, GoesToZeroSmoothlyOnAForceThatIsNoNumber) {
    ForceLimiter limiter({5.0, 2000.0, 1e-3});
    std::uint32_t flags = 0;
    for (int i = 0; i < 3; ++i)
        limiter.limit({5, 0, 0}, flags);
    EXPECT_DOUBLE_EQ(limiter.sent().x, 5.0);
    flags = 0;
    EXPECT_DOUBLE_EQ(limiter.limit({kNan, kNan, kNan}, flags).x, 3.0);
    EXPECT_TRUE(flags & kForceNotFinite);
    EXPECT_TRUE(flags & kForceSlewed);
    limiter.limit({kNan, 0, 0}, flags);
    EXPECT_DOUBLE_EQ(limiter.limit({kNan, 0, 0}, flags).x, 0.0);
}

TEST(ForceLimiter, LeavesAllowedForcesAlone) {
    ForceLimiter limiter({5.0, 2000.0, 1e-3});
    std::uint32_t flags = 0;
    EXPECT_EQ(limiter.limit({1.0, 0.5, -1.0}, flags), Vec3(1.0, 0.5, -1.0));
    EXPECT_EQ(flags, 0u);
}

TEST(TransferFunction, IsLinearBetweenNodesAndConstantOutside) {
    TransferFunction f;
    f.nodes[0] = {100.0, 0.0};
    f.nodes[1] = {200.0, 2.0};
    f.nodes[2] = {300.0, 1.0};
    f.count = 3;
    EXPECT_DOUBLE_EQ(f(0.0), 0.0);
    EXPECT_DOUBLE_EQ(f(150.0), 1.0);
    EXPECT_DOUBLE_EQ(f(200.0), 2.0);
    EXPECT_DOUBLE_EQ(f(250.0), 1.5);
    EXPECT_DOUBLE_EQ(f(1e9), 1.0);
    EXPECT_DOUBLE_EQ(f(kNan), 0.0);
    EXPECT_FALSE(f.is_zero());
    EXPECT_TRUE(TransferFunction{}.is_zero());
    EXPECT_EQ(TransferFunction::constant(kInfinite)(-5.0), kInfinite);
}

// numerics 4: eq. (10) is a sign filter that settles around the quantile that steps exceed 51 % of
// the time, in steps of 5 %.
TEST(StepTimeEstimator, FollowsTheMiddleOfStepTimes) {
    StepTimeEstimator estimator(900.0);
    EXPECT_DOUBLE_EQ(estimator.estimate_us(), 18.0);
    for (int i = 0; i < 1000; ++i)
        estimator.observe(i % 2 == 0 ? 3.0 : 5.0);
    EXPECT_GE(estimator.estimate_us(), 3.0 * 0.95);
    EXPECT_LE(estimator.estimate_us(), 5.0 * 1.05);
    estimator.observe(1e6); // an interrupt moves it by 5 % and no more
    EXPECT_LE(estimator.estimate_us(), 5.0 * 1.05 * 1.05);
}

TEST(StepTimeEstimator, StaysBetweenItsBounds) {
    StepTimeEstimator estimator(900.0);
    for (int i = 0; i < 10000; ++i)
        estimator.observe(0.0);
    EXPECT_DOUBLE_EQ(estimator.estimate_us(), StepTimeEstimator::kLowest_us);
    for (int i = 0; i < 10000; ++i)
        estimator.observe(1e9);
    EXPECT_DOUBLE_EQ(estimator.estimate_us(), 450.0);
}

} // namespace
} // namespace palpate
