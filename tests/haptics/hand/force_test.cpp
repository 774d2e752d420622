// SPDX-License-Identifier: Apache-2.0
#include <limits>

#include <gtest/gtest.h>

#include <palpate/haptics/hand/virtual_coupling.h>
#include <palpate/haptics/stepping/step_time_estimator.h>
#include <palpate/volume/transfer_function.h>

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
