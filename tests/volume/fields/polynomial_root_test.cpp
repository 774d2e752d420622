// SPDX-License-Identifier: Apache-2.0
#include <volume/fields/internal/polynomial_root.h>

#include <algorithm>
#include <cfenv>
#include <cmath>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace palpate {
namespace {

/// Sum of |c_i|: a polynomial's values on [0,1] are rounded in proportion to it.
template <int Degree>
double size_of(const internal::Polynomial<Degree>& p) {
    double size = 0.0;
    for (const double c : p)
        size += std::abs(c);
    return size;
}

/// Checks a result against 2000 samples and against its own definition.
template <int Degree>
void expect_first(const internal::Polynomial<Degree>& p, double level) {
    const std::optional<double> root = internal::first_reach<Degree>(p, level);
    // Horner on [0,1] errs by at most 2 Degree roundings of 1.1e-16 of the sum of |c_i|.
    const double rounding = 4.0 * Degree * 1.2e-16 * (size_of<Degree>(p) + std::abs(level));
    const double end = root.value_or(1.0);
    constexpr int kSamples = 2000;
    for (int n = 0; n <= kSamples; ++n)
        ASSERT_LT(internal::evaluate<Degree>(p, end * n / kSamples),
                  level + (p[0] < level ? rounding : 1e300));
    if (!root) return;
    ASSERT_GE(*root, 0.0);
    ASSERT_LE(*root, 1.0);
    if (p[0] >= level) {
        ASSERT_EQ(*root, 0.0);
        return;
    }
    // Within 1e-15 of the root, on a slope of at most Degree times the sum of |c_i|.
    ASSERT_NEAR(internal::evaluate<Degree>(p, *root), level,
                rounding + 2e-15 * Degree * size_of<Degree>(p));
}

template <int Degree>
void fuzz(std::uint64_t seed, int cases) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> place(-0.5, 1.5);
    std::normal_distribution<double> normal;
    int reached = 0;
    std::feclearexcept(FE_ALL_EXCEPT);
    for (int n = 0; n < cases; ++n) {
        internal::Polynomial<Degree> p{};
        if (n % 2 == 0) { // coefficients at random, some of them zero or tiny
            for (double& c : p)
                c = normal(random) * std::pow(10.0, (random() % 3 == 0) * -8.0) *
                    (random() % 8 != 0);
        } else { // roots at random near [0,1], some of them double: -s (t-r_1) (t-r_2) ...
            p[0] = normal(random);
            double last = 0.0;
            for (int degree = 1; degree <= Degree; ++degree) {
                const double r = random() % 4 == 0 ? last : place(random);
                last = r;
                for (int i = degree; i > 0; --i)
                    p[static_cast<std::size_t>(i)] =
                        p[static_cast<std::size_t>(i - 1)] - r * p[static_cast<std::size_t>(i)];
                p[0] *= -r;
            }
        }
        const double level = random() % 2 == 0 ? 0.0 : p[0] + std::abs(normal(random)) * 0.3;
        expect_first<Degree>(p, level);
        reached += internal::first_reach<Degree>(p, level).value_or(0.0) > 0.0;
        if (testing::Test::HasFatalFailure()) FAIL() << "case " << n;
    }
    EXPECT_GT(reached, cases / 10);
    EXPECT_FALSE(std::fetestexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW)); // loops trap them
}

TEST(PolynomialRoot, CubicIsFirstAgainstDenseSampling) { fuzz<3>(11, 100'000); }

TEST(PolynomialRoot, QuarticIsFirstAgainstDenseSampling) { fuzz<4>(12, 100'000); }

TEST(PolynomialRoot, TakesTheFirstOfThree) {
    // (t - 0.2) (t - 0.5) (t - 0.8): from below, above between 0.2 and 0.5
    const std::optional<double> root = internal::first_reach<3>({-0.08, 0.66, -1.5, 1.0}, 0.0);
    ASSERT_TRUE(root);
    EXPECT_NEAR(*root, 0.2, 1e-14); // coefficients are rounded to 1e-16, the slope there is 0.18
    EXPECT_LT(internal::evaluate<3>({-0.08, 0.66, -1.5, 1.0}, *root), 0.0);
}

TEST(PolynomialRoot, FindsABumpFarNarrowerThanTheInterval) {
    // -(t - 1/2)^2 + h: above zero only within 1e-7 of the middle
    const double h = 1e-14;
    const std::optional<double> root =
        internal::first_reach<4>({h - 0.25, 1.0, -1.0, 0.0, 0.0}, 0.0);
    ASSERT_TRUE(root);
    EXPECT_NEAR(*root, 0.5 - 1e-7,
                1e-9); // h is rounded to 3e-17 in the coefficient: 0.3 % of h, 1.5e-10 in t
}

TEST(PolynomialRoot, IsZeroWhereItStartsAtTheLevelAndNothingWhereItStaysBelow) {
    EXPECT_EQ(internal::first_reach<3>({1.0, -1.0, 0.0, 0.0}, 1.0), std::optional<double>(0.0));
    EXPECT_EQ(internal::first_reach<3>({1.0, -1.0, 0.0, 0.0}, 0.5), std::optional<double>(0.0));
    EXPECT_EQ(internal::first_reach<3>({0.0, 0.0, 0.0, 0.0}, 1e-300), std::nullopt);
    EXPECT_EQ(internal::first_reach<3>({0.0, 1.0, 0.0, 0.0}, 1.0 + 1e-15), std::nullopt);
}

TEST(PolynomialRoot, ReachesALevelAtTheVeryEnd) {
    const std::optional<double> root = internal::first_reach<3>({0.0, 1.0, 0.0, 0.0}, 1.0);
    ASSERT_TRUE(root);
    EXPECT_LT(*root, 1.0);
    EXPECT_NEAR(*root, 1.0, 1e-15);
}

TEST(PolynomialRoot, StaysOnTheLowerSideOfAnInflectionAtTheLevel) {
    // (t - 1/2)^3: the slope vanishes at the root, Newton alone creeps
    const std::optional<double> root = internal::first_reach<3>({-0.125, 0.75, -1.5, 1.0}, 0.0);
    ASSERT_TRUE(root);
    EXPECT_LE(*root, 0.5 + 1e-5);
    EXPECT_NEAR(*root, 0.5, 1e-5); // the cube root of the rounding, 1e-16
}

} // namespace
} // namespace palpate
