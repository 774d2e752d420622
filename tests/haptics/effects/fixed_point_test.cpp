// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <palpate/geometry/vec.h>
#include <palpate/haptics/effects/internal/fixed_point.h>

namespace palpate {
namespace {

using Finder = internal::FixedPoint<4>;

double distance(const Finder::Values& a, const Finder::Values& b) {
    double squares = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i)
        squares += (a[i] - b[i]) * (a[i] - b[i]);
    return std::sqrt(squares);
}

// n differences span a map of n numbers: n + 1 rounds, where repeating it would leave up to 0.9^4
// of the way. 1e-9: rounding times the square of the worst condition that the draw meets.
TEST(FixedPoint, AContractionOfThreeIsThereAfterFourRounds) {
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> entry(-1.0, 1.0);
    for (int k = 0; k < 1000; ++k) {
        Mat3 linear;
        Vec3 fixed;
        double squares = 0.0;
        for (int i = 0; i < 3; ++i) {
            fixed[i] = entry(random);
            for (int j = 0; j < 3; ++j)
                squares += std::pow(linear[j][i] = entry(random), 2);
        }
        linear *= 0.9 / std::sqrt(squares);
        Finder finder;
        Finder::Values x(3, 0.0);
        for (int round = 0; round < 4; ++round) {
            const Vec3 to = fixed + linear * (Vec3{x[0], x[1], x[2]} - fixed);
            x = finder.next(x, {to.x, to.y, to.z});
        }
        EXPECT_LE(distance(x, {fixed.x, fixed.y, fixed.z}), 1e-9) << "case " << k;
    }
}

TEST(FixedPoint, AMapThatLeadsAwayIsFollowedBack) {
    for (const double slope : {-30.0, -1.5, 1.5, 30.0}) {
        Finder finder;
        Finder::Values x{0.0};
        for (int round = 0; round < 3; ++round)
            x = finder.next(x, {2.0 + slope * (x[0] - 2.0)});
        EXPECT_NEAR(x[0], 2.0, 1e-12) << slope;
    }
}

// |x| turns a contracting map into another one at 0: at most two differences lead astray.
TEST(FixedPoint, GetsOverAKink) {
    for (const double start : {-3.0, -0.1, 0.2, 5.0}) {
        Finder finder;
        Finder::Values x{start};
        for (int round = 0; round < 12; ++round)
            x = finder.next(x, {x[0] < 0.0 ? 0.3 - 0.9 * x[0] : 0.3 - 1.4 * x[0]});
        EXPECT_NEAR(x[0], 0.3 / 2.4, 1e-12) << start;
    }
}

TEST(FixedPoint, StaysWhereItIs) {
    Finder finder;
    const Finder::Values x{1.0, 2.0};
    for (int round = 0; round < 5; ++round)
        EXPECT_EQ(finder.next(x, x), x);
}

} // namespace
} // namespace palpate
