// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/proxy_solver.h>

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
/// out.
double energy(const PrimitiveSet& set, const Vec3& probe, const Vec3& x) {
    double e = 0.5 * kStiffness * squared_length(x - probe) - glm::dot(set.force(), x);
    for (const PlanePrimitive& plane : set.planes())
        if (std::isfinite(plane.strength_n))
            e += plane.strength_n * std::max(0.0, -glm::dot(plane.normal, x - plane.anchor));
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
    EXPECT_NEAR(solution.multiplier_n[0], kStiffness * 0.005, 1e-14);
    EXPECT_EQ(solution.state[0], MultiplierState::active);
}

// Eq. (4) in its corrected form (numerics 1.3): the plane follows the probe at a distance of s/k.
TEST(ProxySolver, AYieldingPlaneLagsByStrengthOverStiffness) {
    const double strength = 1.0; // s/k = 2 mm
    const auto solution =
        solve_proxy(planes({{{0, 0, 0}, {0, 0, 1}, strength}}), {0, 0, -0.005}, kStiffness);
    EXPECT_NEAR(solution.proxy.z, -0.003, 1e-17);
    EXPECT_EQ(solution.state[0], MultiplierState::saturated);
    EXPECT_DOUBLE_EQ(solution.multiplier_n[0], strength);
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

/// Families of numerics 1.5: random, near-parallel by 1e-16..1e-1 rad, coincident and antiparallel,
/// on an integer lattice.
PrimitiveSet random_planes(Random& random, int family) {
    PrimitiveSet set;
    const int count = 1 + static_cast<int>(16 * random.share()) % 16;
    const Vec3 common = random.direction();
    const Vec3 shared_anchor = random.vector(0.01);
    for (int i = 0; i < count; ++i) {
        PlanePrimitive plane;
        plane.normal = random.direction();
        plane.anchor = random.vector(0.01);
        if (family == 1) {
            const double angle = std::pow(10.0, -16.0 + 15.0 * random.share());
            plane.normal = glm::normalize((random.share() < 0.3 ? -common : common) +
                                          angle * random.direction());
        }
        if (family == 2) {
            const auto lattice = [&] { return std::floor(5.0 * random.share()) - 2.0; };
            plane.normal = {lattice(), lattice(), lattice()};
            plane.anchor = 0.01 * Vec3{lattice(), lattice(), lattice()};
        }
        if (random.share() < 0.2) plane.anchor = shared_anchor;
        const double kind = random.share();
        plane.strength_n = kind < 0.1 ? 0.0 : kind < 0.3 ? kInfinite : 5.0 * random.share();
        if (glm::length(plane.normal) > 0.0) plane.normal = glm::normalize(plane.normal);
        set.add(plane);
    }
    if (random.share() < 0.3) set.add_force(random.vector(1.0));
    return set;
}

// numerics 1.5: planes and forces are solved to 1e-13 of the scale in every case (measured
// worst 1.3e-14 there).
TEST(ProxySolver, MeetsItsOptimalityConditionsInEveryFamily) {
    for (int family = 0; family < 3; ++family) {
        const unsigned seed = 20260 + family;
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        double worst = 0.0;
        int capped = 0;
        for (int i = 0; i < 60000; ++i) {
            const PrimitiveSet set = random_planes(random, family);
            const Vec3 probe = random.vector(0.01);
            const auto solution = solve_proxy(set, probe, kStiffness);
            ASSERT_TRUE(is_finite(solution.proxy));
            double scale = 1e-3;
            const Vec3 target = probe + set.force() / kStiffness;
            for (const PlanePrimitive& plane : set.planes())
                scale = std::max(scale, glm::length(plane.anchor - target));
            worst = std::max(worst, solution.residual_m / scale);
            capped += solution.status == SolveStatus::capped ? 1 : 0;
        }
        EXPECT_EQ(capped, 0);
        EXPECT_LE(worst, 1e-13);
    }
}

// The residual is the solver's own word; this is not: no neighbour has less energy. The minimum is
// quadratic, so a step of 1 um may gain at most rounding of the energy, 1e-15 of about 0.1 J.
TEST(ProxySolver, NoNeighbourHasLessEnergy) {
    Random random(7);
    for (int i = 0; i < 5000; ++i) {
        PrimitiveSet set;
        for (int k = 0; k < 5; ++k)
            set.add({random.vector(0.01), random.direction(), 3.0 * random.share()});
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
        PrimitiveSet set;
        for (int k = 0; k < 6; ++k)
            set.add({random.vector(0.01), random.direction(), 5.0 * random.share()});
        const Vec3 a = random.vector(0.01);
        const Vec3 b = a + random.vector(0.002);
        const double moved = glm::length(solve_proxy(set, a, kStiffness).proxy -
                                         solve_proxy(set, b, kStiffness).proxy);
        ASSERT_LE(moved, glm::length(b - a) * (1.0 + 1e-12) + 1e-15);
    }
}

TEST(ProxySolver, MorePlanesThanFitAreRemembered) {
    PrimitiveSet set;
    for (std::size_t i = 0; i <= PrimitiveSet::kCapacity; ++i)
        set.add({{0, 0, 0}, {0, 0, 1}, 1.0});
    EXPECT_TRUE(set.overflowed());
    EXPECT_EQ(set.planes().size(), PrimitiveSet::kCapacity);
}

} // namespace
} // namespace palpate
