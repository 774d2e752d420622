// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/effects/streamline.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "tests/support/formula_fields.h"

namespace palpate {
namespace {

using test::FormulaVectorField;

constexpr double kRadius = 0.02; // m
constexpr double kRise = 0.005;  // m per radian

Vec3 on_helix(double angle) {
    return {kRadius * std::cos(angle), kRadius * std::sin(angle), kRise * angle};
}

Vec3 along_helix(double angle) {
    return glm::normalize(Vec3{-kRadius * std::sin(angle), kRadius * std::cos(angle), kRise});
}

/// The brute-force twin: the angle nearest to 0 at which the pull towards a point vanishes, by
/// small steps along the exact helix and then halves.
double foot_angle(const Vec3& point) {
    const auto pull = [&](double angle) {
        return glm::dot(along_helix(angle), point - on_helix(angle));
    };
    const double step = std::copysign(1e-4, pull(0.0));
    double low = 0.0;
    while (pull(low + step) * step > 0.0)
        low += step;
    double high = low + step;
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (pull(middle) * step > 0.0 ? low : high) = middle;
    }
    return low;
}

TEST(Streamline, NearestIsTheFirstFootOnTheHelix) {
    const auto field = make_helix(kRadius, 2.0 * std::numbers::pi * kRise);
    const auto sampler = field->make_sampler();
    std::mt19937 random(21);
    std::uniform_real_distribution<double> one(-1.0, 1.0);
    struct Case {
        Streamline::Order order;
        double reach_m; // how far the points are
        double error_m;
    };
    // The diagonal of the reach, and a step's own ninth of it, make h at most twice the reach. A
    // step h of the cubic errs by h^4 / 384 times the fourth derivative, 1.1e5 / m^3, and
    // Runge-Kutta by less; midpoints by h^3 / 6 times the third, 2.3e3 / m^2.
    const auto cubic = [](double h) { return std::pow(h, 4) / 384.0 * 1.2e5; };
    const auto parabola = [](double h) { return std::pow(h, 3) / 6.0 * 2.4e3; };
    for (const Case& c : {Case{Streamline::Order::runge_kutta, 2e-4, cubic(4e-4)},
                          Case{Streamline::Order::runge_kutta, 2e-3, cubic(4e-3)},
                          Case{Streamline::Order::midpoint, 2e-4, parabola(4e-4)},
                          Case{Streamline::Order::midpoint, 2e-3, parabola(4e-3)}}) {
        Streamline streamline(*sampler, 0.5 * field->feature_size_m(), c.order);
        for (int n = 0; n < 200; ++n) {
            streamline.start(on_helix(0.0), (n % 2 ? 1.0 : -1.0) * along_helix(0.0));
            // Several points in a row, to either side: what is known is used again.
            for (int again = 0; again < 4; ++again) {
                const Vec3 point =
                    on_helix(0.0) + c.reach_m * Vec3{one(random), one(random), one(random)};
                const StreamlinePoint found = streamline.nearest(point);
                const double angle = foot_angle(point);
                EXPECT_LE(glm::length(found.position - on_helix(angle)), c.error_m + 1e-15);
                EXPECT_FALSE(found.cut);
                const double pull = glm::dot(found.tangent, point - found.position);
                EXPECT_LE(std::abs(pull), 4e-16) << "rounding of a foot";
            }
        }
    }
}

TEST(Streamline, WaysAreMeasuredFromTheOriginToEitherSide) {
    const auto field = make_helix(kRadius, 2.0 * std::numbers::pi * kRise);
    const auto sampler = field->make_sampler();
    Streamline streamline(*sampler, 0.5e-3, Streamline::Order::runge_kutta);
    streamline.start(on_helix(0.4), along_helix(0.4));
    const double per_angle = std::hypot(kRadius, kRise); // m
    for (double angle : {0.01, 0.2, 0.05, -0.3, -0.1}) {
        const StreamlinePoint found = streamline.at(angle * per_angle);
        // Steps of half a millimetre: 0.02 nm each in position (see above), 4 / h times it in
        // direction, twelve of them.
        EXPECT_LE(glm::length(found.position - on_helix(0.4 + angle)), 12 * 2e-11);
        const double sense = angle < 0.0 ? -1.0 : 1.0;
        EXPECT_LE(glm::length(found.tangent - sense * along_helix(0.4 + angle)), 12 * 2e-7);
        EXPECT_NEAR(found.way_m, angle * per_angle, 1e-17);
        // The foot of a point of the streamline is that point, at the same way.
        EXPECT_NEAR(streamline.nearest(found.position).way_m, found.way_m, 1e-10);
    }
}

TEST(Streamline, TheOriginsOwnFootIsTheOriginAndCostsNothing) {
    const auto field = make_helix(kRadius, 2.0 * std::numbers::pi * kRise);
    const auto sampler = field->make_sampler();
    Streamline streamline(*sampler, 0.005, Streamline::Order::runge_kutta);
    streamline.start(on_helix(0.4), along_helix(0.4));
    EXPECT_EQ(streamline.nearest(on_helix(0.4)).position, on_helix(0.4));
    EXPECT_EQ(sampler->samples(), 0u);
}

TEST(Streamline, EndsAfterItsLastStepAndWhereDataEnd) {
    const FormulaVectorField straight([](const Vec3& p) {
        return VectorSample{{0, 0, 3}, Mat3(0.0), p.z < 0.0101};
    });
    const auto sampler = straight.make_sampler();
    Streamline fine(*sampler, 1e-4, Streamline::Order::runge_kutta);
    fine.start(Vec3(0.0), {0, 0, 1});
    const StreamlinePoint cut = fine.nearest({0.001, 0, 1.0});
    EXPECT_TRUE(cut.cut);
    EXPECT_NEAR(cut.position.z, Streamline::kMostSteps * 1e-4, 1e-17);

    Streamline coarse(*sampler, 1e-3, Streamline::Order::runge_kutta);
    coarse.start(Vec3(0.0), {0, 0, 1});
    const StreamlinePoint end = coarse.nearest({0.001, 0, 1.0});
    EXPECT_FALSE(end.cut);
    EXPECT_NEAR(end.position.z, 0.010, 1e-17) << "the last step with data";
}

TEST(Streamline, SignsOfTheVectorsDoNotMatter) {
    // A direction that flips from one hundredth of a millimetre to the next.
    const FormulaVectorField flipping([](const Vec3& p) {
        const double sign = static_cast<int>(std::floor(p.x * 1e5)) % 2 == 0 ? 1.0 : -1.0;
        return VectorSample{sign * Vec3{-p.y, p.x, 0.0}, Mat3(0.0), true};
    });
    const FormulaVectorField steady([](const Vec3& p) {
        return VectorSample{Vec3{-p.y, p.x, 0.0}, Mat3(0.0), true};
    });
    const auto flipping_sampler = flipping.make_sampler();
    const auto steady_sampler = steady.make_sampler();
    Streamline a(*flipping_sampler, 0.005, Streamline::Order::runge_kutta);
    Streamline b(*steady_sampler, 0.005, Streamline::Order::runge_kutta);
    a.start({0.02, 0, 0}, {0, 1, 0});
    b.start({0.02, 0, 0}, {0, 1, 0});
    for (double angle : {0.01, 0.3, 0.9, -0.2, -1.0}) {
        const Vec3 point = 0.021 * Vec3{std::cos(angle), std::sin(angle), 0.0};
        EXPECT_EQ(a.nearest(point).position, b.nearest(point).position) << angle;
    }
}

} // namespace
} // namespace palpate
