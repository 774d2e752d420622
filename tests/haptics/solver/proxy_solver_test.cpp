// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/solver/proxy_solver.h>

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace palpate {
namespace {

constexpr double kStiffness = 500.0; // N/m
constexpr double kInfinite = std::numeric_limits<double>::infinity();

PrimitiveSet planes(std::initializer_list<PlanePrimitive> list) {
    PrimitiveSet set;
    for (const PlanePrimitive& plane : list)
        set.add(plane);
    return set;
}

/// The function that eq. (5) minimises, in J; hard planes cost nothing where they hold and are left
/// out. Lines and points are to be finite.
double energy(const PrimitiveSet& set, const Vec3& probe, const Vec3& x) {
    double e = 0.5 * kStiffness * squared_length(x - probe) - glm::dot(set.force(), x);
    for (const PlanePrimitive& plane : set.planes())
        if (std::isfinite(plane.strength_n))
            e += plane.strength_n * std::max(0.0, -glm::dot(plane.normal, x - plane.anchor));
    for (const LinePrimitive& line : set.lines()) {
        const Vec3 way = x - line.anchor;
        e += line.strength_n * glm::length(way - glm::dot(line.axis, way) * line.axis);
    }
    for (const PointPrimitive& point : set.points())
        e += point.strength_n * glm::length(x - point.anchor);
    return e;
}

struct Random {
    std::mt19937_64 engine;
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform{0.0, 1.0};
    explicit Random(unsigned seed) : engine(seed) {}
    double gauss() { return normal(engine); }
    double share() { return uniform(engine); }
    Vec3 vector(double scale) { return scale * Vec3{gauss(), gauss(), gauss()}; }
    Vec3 direction() { return glm::normalize(vector(1.0)); }
};

TEST(ProxySolver, WithoutPrimitivesTheProxyIsTheProbe) {
    const Vec3 probe{0.01, -0.02, 0.03};
    EXPECT_EQ(solve_proxy({}, probe, kStiffness).proxy, probe);
}

TEST(ProxySolver, AHardPlaneProjectsTheProbeOntoItself) {
    const auto solution =
        solve_proxy(planes({{{0, 0, 0}, {0, 0, 1}, kInfinite}}), {0.01, 0.02, -0.005}, kStiffness);
    EXPECT_NEAR(glm::length(solution.proxy - Vec3(0.01, 0.02, 0.0)), 0.0, 1e-17);
    EXPECT_NEAR(solution.planes[0].multiplier_n, kStiffness * 0.005, 1e-14);
    EXPECT_EQ(solution.planes[0].state, MultiplierState::active);
}

// Eq. (4) in its corrected form (numerics 1.3): the plane follows the probe at a distance of s/k.
TEST(ProxySolver, AYieldingPlaneLagsByStrengthOverStiffness) {
    const double strength = 1.0; // s/k = 2 mm
    const auto solution =
        solve_proxy(planes({{{0, 0, 0}, {0, 0, 1}, strength}}), {0, 0, -0.005}, kStiffness);
    EXPECT_NEAR(solution.proxy.z, -0.003, 1e-17);
    EXPECT_EQ(solution.planes[0].state, MultiplierState::saturated);
    EXPECT_DOUBLE_EQ(solution.planes[0].multiplier_n, strength);
}

TEST(ProxySolver, AForceShiftsTheProbeExactly) {
    PrimitiveSet set;
    set.add_force({0.5, 0, -1.0});
    const Vec3 probe{0.001, 0.002, 0.003};
    EXPECT_EQ(solve_proxy(set, probe, kStiffness).proxy, probe + Vec3(0.5, 0, -1.0) / kStiffness);
}

TEST(ProxySolver, OpposedPlanesLeaveProxyBetweenThem) {
    const auto gap =
        planes({{{0, 0, 0.001}, {0, 0, -1}, kInfinite}, {{0, 0, -0.001}, {0, 0, 1}, kInfinite}});
    for (double z : {-0.02, -0.0005, 0.0, 0.0007, 0.05}) {
        const auto solution = solve_proxy(gap, {0, 0, z}, kStiffness);
        EXPECT_NEAR(solution.proxy.z, std::clamp(z, -0.001, 0.001), 1e-15);
    }
}

TEST(ProxySolver, ThreeHardPlanesMeetInTheirCorner) {
    const auto corner = planes({{{0, 0, 0}, {1, 0, 0}, kInfinite},
                                {{0, 0, 0}, {0, 1, 0}, kInfinite},
                                {{0, 0, 0}, glm::normalize(Vec3(0.1, 0.2, 1)), kInfinite}});
    EXPECT_LT(glm::length(solve_proxy(corner, {-0.01, -0.02, -0.01}, kStiffness).proxy), 1e-16);
}

TEST(ProxySolver, UnusablePlanesAreIgnored) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto set = planes({{{0, 0, 0}, {0, 0, 0}, 1.0},
                             {{nan, 0, 0}, {0, 0, 1}, 1.0},
                             {{0, 0, 0}, {0, nan, 1}, 1.0},
                             {{0, 0, 0}, {0, 0, 1}, 0.0},
                             {{0, 0, 0}, {0, 0, 1}, nan}});
    const Vec3 probe{0, 0, -0.01};
    EXPECT_EQ(solve_proxy(set, probe, kStiffness).proxy, probe);
}

// Eq. (4) as corrected in docs/equations.md, for planes along an orthonormal frame through the
// proxy: u points into the surface, free below it and yielding above s / k.
TEST(ProxySolver, PlanesAlongAFrameAreTheYieldingFrame) {
    Random random(3);
    for (int i = 0; i < 2000; ++i) {
        const Vec3 proxy = random.vector(0.01);
        const Vec3 probe = random.vector(0.01);
        const Vec3 u0 = random.direction();
        const Vec3 u1 = glm::normalize(glm::cross(u0, random.direction()));
        PrimitiveSet set;
        Vec3 expected = proxy;
        for (const Vec3& u : {u0, u1, glm::cross(u0, u1)}) {
            const double strength = 5.0 * random.share();
            set.add({proxy, -u, strength});
            const double d = glm::dot(u, probe - proxy);
            expected += u * (std::min(0.0, d) + std::max(0.0, d - strength / kStiffness));
        }
        // Three axes, each with a few roundings of 0.05 m.
        EXPECT_LE(glm::length(solve_proxy(set, probe, kStiffness).proxy - expected), 1e-16);
    }
}

// Eq. (4) with both directions of an axis: x' = x + u sign(d) max(0, |d| - s/k), u across the line.
TEST(ProxySolver, ALineHoldsAndSlipsAsTheYieldingFrame) {
    Random random(4);
    int held = 0;
    for (int i = 0; i < 2000; ++i) {
        const LinePrimitive line{random.vector(0.01), random.direction(), 8.0 * random.share()};
        PrimitiveSet set;
        set.add_line(line);
        const Vec3 probe = random.vector(0.01);
        const auto solution = solve_proxy(set, probe, kStiffness);

        const Vec3 foot = line.anchor + glm::dot(line.axis, probe - line.anchor) * line.axis;
        const double d = glm::length(probe - foot);
        const double slip = std::max(0.0, d - line.strength_n / kStiffness);
        const Vec3 expected = foot + (probe - foot) * (slip / d);
        EXPECT_LE(glm::length(solution.proxy - expected), 1e-16);
        EXPECT_EQ(solution.lines[0].state, slip > 0 ? TetherState::slipping : TetherState::held);
        // The forces balance: rounding of 500 N/m times 0.05 m.
        const Vec3 spring = kStiffness * (probe - solution.proxy);
        EXPECT_LE(glm::length(solution.lines[0].force_n + spring), 1e-14);
        held += solution.lines[0].state == TetherState::held ? 1 : 0;
    }
    EXPECT_GT(held, 200);
    EXPECT_LT(held, 1800);
}

TEST(ProxySolver, APointHoldsUntilItsStrength) {
    PrimitiveSet set;
    set.add_point({{0.001, 0.002, 0.003}, 1.0}); // s/k = 2 mm
    const Vec3 towards = glm::normalize(Vec3(1, 2, -2));
    const auto held = solve_proxy(set, set.points()[0].anchor + 0.0019 * towards, kStiffness);
    EXPECT_EQ(held.proxy, set.points()[0].anchor);
    EXPECT_EQ(held.points[0].state, TetherState::held);
    EXPECT_NEAR(glm::length(held.points[0].force_n), 0.95, 1e-14);
    const auto slipping = solve_proxy(set, set.points()[0].anchor + 0.005 * towards, kStiffness);
    EXPECT_LE(glm::length(slipping.proxy - (set.points()[0].anchor + 0.003 * towards)), 1e-17);
    EXPECT_EQ(slipping.points[0].state, TetherState::slipping);
    EXPECT_NEAR(glm::length(slipping.points[0].force_n), 1.0, 1e-14);
}

// Coulomb friction at one contact: a hard plane, and a line along its normal through the point of
// contact with the strength mu lambda. The tangential lag is mu lambda / k.
TEST(ProxySolver, AFrictionLineLagsBehindTheProbeOnAPlane) {
    const double mu = 0.4;
    const double depth = 0.003;
    PrimitiveSet set = planes({{{0, 0, 0}, {0, 0, 1}, kInfinite}});
    set.add_line({{0, 0, 0}, {0, 0, 1}, mu * kStiffness * depth});
    const auto sticking = solve_proxy(set, {0.0011, 0, -depth}, kStiffness);
    EXPECT_LE(glm::length(sticking.proxy), 1e-17);
    EXPECT_EQ(sticking.lines[0].state, TetherState::held);
    const auto sliding = solve_proxy(set, {0.003, 0.004, -depth}, kStiffness);
    const double way = 0.005 - mu * depth;
    EXPECT_LE(glm::length(sliding.proxy - way * Vec3(0.6, 0.8, 0)), 1e-17);
    EXPECT_EQ(sliding.lines[0].state, TetherState::slipping);
    EXPECT_EQ(sliding.planes[0].state, MultiplierState::active);
    EXPECT_NEAR(sliding.planes[0].multiplier_n, kStiffness * depth, 1e-14);
}

// Where two planes compete, the least |sum of forces| of eq. (5), read with each P_i either on or
// off, is elsewhere: at x = 0. Read as a set at its jump, P_1 balances exactly, further on.
TEST(ProxySolver, ForcesBalanceThoughTheirJumpsAreNotMinimal) {
    const double angle = 147.8 * std::acos(-1.0) / 180.0;
    const double s1 = 1.948;
    const double s2 = 0.664;
    const Vec3 n2{std::sin(angle), 0, std::cos(angle)};
    const Vec3 probe{-0.821, 0, -0.328};
    const auto solution =
        solve_proxy(planes({{{0, 0, 0}, {0, 0, 1}, s1}, {{0, 0, 0}, n2, s2}}), probe, 1.0);
    EXPECT_LE(glm::length(solution.proxy - Vec3(probe.x + s2 * n2.x, 0, 0)), 1e-15);
    EXPECT_EQ(solution.planes[0].state, MultiplierState::active);
    EXPECT_EQ(solution.planes[1].state, MultiplierState::saturated);
    EXPECT_LT(solution.planes[0].multiplier_n, s1);
    const auto force = [&](double share_1, const Vec3& x) {
        return glm::length(share_1 * s1 * Vec3(0, 0, 1) + s2 * n2 - (x - probe));
    };
    EXPECT_LE(force(solution.planes[0].multiplier_n / s1, solution.proxy), 1e-15);
    EXPECT_GT(std::min(force(0.0, solution.proxy), force(1.0, solution.proxy)), 0.88);
}

TEST(ProxySolver, OfAMixOnlyTheUsableIsFelt) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const LinePrimitive line{{0.001, 0, 0}, {0, 0, 1}, 1.0};
    PrimitiveSet alone;
    alone.add_line(line);
    PrimitiveSet set = planes({{{0, 0, 0}, {0, 0, 0}, 1.0}});
    set.add_line({{nan, 0, 0}, {0, 0, 1}, 1.0});
    set.add_line({{0, 0, 0}, {0, 0, 0}, 1.0});
    set.add_line(line);
    set.add_point({{0, nan, 0}, 1.0});
    set.add_point({{0, 0, 0}, 0.0});
    const Vec3 probe{0.004, 0.004, 0.001};
    const auto solution = solve_proxy(set, probe, kStiffness);
    EXPECT_LE(glm::length(solution.proxy - solve_proxy(alone, probe, kStiffness).proxy), 1e-17);
    EXPECT_EQ(solution.lines[0].state, TetherState::released);
    EXPECT_EQ(solution.lines[2].state, TetherState::slipping);
    EXPECT_EQ(solution.points[1].state, TetherState::released);
    EXPECT_EQ(solution.lines[1].force_n, Vec3(0.0));
}

PrimitiveSet finite_mix(Random& random) {
    PrimitiveSet set;
    for (int k = 0; k < 3; ++k)
        set.add({random.vector(0.01), random.direction(), 3.0 * random.share()});
    for (int k = 0; k < 2; ++k)
        set.add_line({random.vector(0.01), random.direction(), 3.0 * random.share()});
    set.add_point({random.vector(0.01), 3.0 * random.share()});
    return set;
}

// The residual is the solver's own word; this is not: no neighbour has less energy. The minimum is
// quadratic, so a step of 1 um may gain at most rounding of the energy, 1e-15 of about 0.1 J.
TEST(ProxySolver, NoNeighbourHasLessEnergy) {
    Random random(7);
    for (int i = 0; i < 5000; ++i) {
        const PrimitiveSet set = finite_mix(random);
        const Vec3 probe = random.vector(0.01);
        const auto solution = solve_proxy(set, probe, kStiffness);
        const double least = energy(set, probe, solution.proxy);
        for (int k = 0; k < 20; ++k)
            ASSERT_GE(energy(set, probe, solution.proxy + random.vector(1e-6)), least - 1e-15);
    }
}

// Firmly non-expansive in the probe (numerics 1.1): a force can never change by more than k times
// the hand's movement. Finite strengths: the cap of hard ones moves with the probe.
TEST(ProxySolver, IsNotExpansive) {
    Random random(11);
    for (int i = 0; i < 20000; ++i) {
        const PrimitiveSet set = finite_mix(random);
        const Vec3 a = random.vector(0.01);
        const Vec3 b = a + random.vector(0.002);
        const double moved = glm::length(solve_proxy(set, a, kStiffness).proxy -
                                         solve_proxy(set, b, kStiffness).proxy);
        ASSERT_LE(moved, glm::length(b - a) * (1.0 + 1e-12) + 1e-15);
    }
}

TEST(ProxySolver, MorePrimitivesThanFitAreRemembered) {
    PrimitiveSet set;
    for (std::size_t i = 0; i < PrimitiveSet::kCapacity; i += 2) {
        set.add({{0, 0, 0}, {0, 0, 1}, 1.0});
        set.add_line({{0, 0, 0}, {0, 0, 1}, 1.0});
    }
    EXPECT_FALSE(set.overflowed());
    set.add_point({{0, 0, 0}, 1.0});
    EXPECT_TRUE(set.overflowed());
    EXPECT_EQ(set.points().size(), 0u);
}

} // namespace
} // namespace palpate
