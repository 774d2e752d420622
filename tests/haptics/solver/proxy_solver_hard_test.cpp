// SPDX-License-Identifier: Apache-2.0
// Hard cases of the solver that the random families reach only now and then: sixteen primitives in
// one place, hard planes that contradict each other, all strengths that a number can be.
#include <palpate/haptics/solver/proxy_solver.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <gtest/gtest.h>

#include "tests/support/proxy_reference.h"

namespace palpate {
namespace {

constexpr double kStiffness = 500.0; // N/m
constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Strengths of coincident primitives add, so n are one of n times the strength.
TEST(ProxySolverHard, AFullSetOfCoincidentPrimitivesIsOne) {
    constexpr double kMany = PrimitiveSet::kCapacity;
    const Vec3 anchor{0.001, -0.002, 0.0005}, axis = glm::normalize(Vec3{1.0, 2.0, -0.5});
    for (const double strength : {0.01, 0.25, kInfinite}) { // slips, holds, hard
        for (const Vec3& probe : {Vec3{0.004, 0.003, -0.006}, anchor, anchor - 0.005 * axis}) {
            PrimitiveSet planes, lines, points, one_plane, one_line, one_point;
            for (std::size_t i = 0; i < PrimitiveSet::kCapacity; ++i) {
                planes.add({anchor, axis, strength});
                lines.add_line({anchor, axis, strength});
                points.add_point({anchor, strength});
            }
            one_plane.add({anchor, axis, kMany * strength});
            one_line.add_line({anchor, axis, kMany * strength});
            one_point.add_point({anchor, kMany * strength});
            for (const auto& [many, one] :
                 {std::pair(planes, one_plane), std::pair(lines, one_line),
                  std::pair(points, one_point)}) {
                const ProxySolution solution = solve_proxy(many, probe, kStiffness);
                EXPECT_EQ(solution.status, SolveStatus::exact);
                // The tolerance of an exact solution: 1e-12 of the scale, a centimetre.
                EXPECT_LE(glm::length(solution.proxy - solve_proxy(one, probe, kStiffness).proxy),
                          1e-14);
            }
        }
    }
}

// Found by fuzzing. Two strong planes leave no room between them and are saturated. At the weak
// plane each step ended at the one end of the range in which it holds, 1.2 um wide, and the next
// step at the other end: the proxy went along it by 1 um a step, 64 passes were 4 mm too few.
TEST(ProxySolverHard, AWeakPlaneBesideTwoThatContradictEachOtherIsFollowed) {
    const Vec3 slant = Vec3{1.0, 1.0, 1.0} / std::sqrt(3.0);
    PrimitiveSet set;
    set.add({Vec3{0.0}, -slant, 640.0});
    set.add({{0.0, 0.0, 0.02}, slant, 640.0});
    set.add({Vec3{0.0}, {0.0, 0.0, -1.0}, 6.0});
    set.add({Vec3{0.0}, glm::normalize(Vec3{0.274, 0.922, 0.274}), 6.0});
    set.add_point({Vec3{0.0}, 0.0}); // of no strength: it only chooses the solver for all kinds
    for (int i = 0; i < 10; ++i)
        set.add_force({2.0, 0.0, 0.0});
    const Vec3 probe{-0.02, -0.016, 0.001};
    const ProxySolution solution = solve_proxy(set, probe, kStiffness);
    EXPECT_EQ(solution.status, SolveStatus::exact);
    EXPECT_LE(solution.passes, kLoopPasses);
    const test::ExactProblem exact(set, probe, kStiffness);
    // An exact solution's: 1e-12 of the scale, and what its coordinates round by.
    EXPECT_LE(exact.worth(solution).residual_m, 2e-12L * exact.scale());
}

// Two hard planes that leave no room between them are each as hard as the other: the proxy is
// halfway, whichever came first, and for probes of a whole centimetre. An error of 1e-12 of the
// scale in multipliers of 64 scales.
TEST(ProxySolverHard, HardPlanesThatContradictEachOtherMeetHalfway) {
    for (const double tilt : {0.0, 1e-16, 1e-12, 1e-8, 1e-4}) {
        const Vec3 up{0, 0, 1}, down = glm::normalize(Vec3{tilt, 0, -1});
        const PlanePrimitive low{{0, 0, 0.001}, up, kInfinite},
            high{{0, 0, -0.001}, down, kInfinite};
        PrimitiveSet first, second;
        first.add(low);
        first.add(high);
        second.add(high);
        second.add(low);
        for (const double z : {-0.005, 0.0, 0.002, 0.005}) {
            const Vec3 probe{0.0, 0.001, z};
            const ProxySolution solution = solve_proxy(first, probe, kStiffness);
            const ProxySolution other = solve_proxy(second, probe, kStiffness);
            ASSERT_TRUE(is_finite(solution.proxy));
            EXPECT_EQ(solution.status, SolveStatus::exact);
            EXPECT_LE(glm::length(solution.proxy - other.proxy), 1e-12) << tilt << " " << z;
            EXPECT_LE(std::abs(solution.proxy.z), 0.001 + 1e-12);
            const test::ExactProblem exact(first, probe, kStiffness);
            EXPECT_LE(exact.worth(solution).residual_m, 1e-12L * exact.scale());
        }
    }
}

// Seen by libFuzzer: beside a line that has no part in it, planes held by the scale of the planes
// alone, though a hard strength is one of the whole problem's scale. A line that leans by a hair is
// solved in another way, and has to be answered alike.
TEST(ProxySolverHard, ContradictingPlanesHoldByTheScaleOfTheWholeProblem) {
    constexpr double kFurthest_m = 0.01;
    for (const double tilt : {0.0, 1e-13, 1e-10}) {
        SCOPED_TRACE(tilt);
        PrimitiveSet set; // seen from the probe in the origin
        set.add({{0, 0, 0.001}, {0, 0, 1}, kInfinite});
        set.add({{0, 0, -0.001}, {0, 0, -1}, kInfinite});
        set.add_line({{kFurthest_m, 0, 0}, glm::normalize(Vec3{tilt, 0, 1}), kInfinite});
        const ProxySolution solution = solve_proxy(set, Vec3{0.0}, kStiffness, 1000);
        EXPECT_EQ(solution.status, SolveStatus::exact);
        const test::ExactProblem exact(set, Vec3{0.0}, kStiffness);
        EXPECT_LE(exact.worth(solution).residual_m, 1e-12L * exact.scale());
        for (const PlaneOutcome& plane : solution.planes) // 64 K scales, to that residual
            EXPECT_NEAR(plane.multiplier_n, 64.0 * kStiffness * kFurthest_m,
                        1e-12 * kStiffness * kFurthest_m);
        EXPECT_LE(glm::length(solution.proxy - Vec3{kFurthest_m, 0, 0}),
                  (tilt + 1e-12) * kFurthest_m)
            << "the line's foot";
    }
}

// Seen with three meshes in one place (a random scene, less what is not needed): two planes there
// lean against each other by their last bits, and rounding changes which of them wants to move, for
// ever. It was 501 steps of 11 looks, whatever the frame had left; the solution is exact long
// since.
TEST(ProxySolverHard, PlanesThatContradictEachOtherTakeNoMoreThanTheCap) {
    constexpr int kToEndAStep = 16;
    const Vec3 corner{0.0023382703922481501, -0.0013427387752832001, -0.0009};
    PrimitiveSet set;
    set.add({{0.00234, -0.00134, -0.0009}, {0.9342, -0.35682, 0}, kInfinite});
    set.add({{0.00234, -0.00134, -0.0009}, {0.9342, -0.35682209, 0}, kInfinite});
    set.add({corner, {0.93417235896271578, -0.3568220897730896, 0}, kInfinite});
    set.add({corner, {0.93417235896271578, -0.3568220897730896, 0}, kInfinite});
    set.add({{0.001, -0.001, -0.0006}, {0, 0, 1}, kInfinite});
    set.add({{0.0004022570094196, -0.0008076341071573, -0.003},
             {0.70710678118654746, 0.70710678118654746, -0.0},
             kInfinite});
    set.add({{-0.0010187691213569699, -0.0039252924914279386, -0.003662999295955253},
             {1, 0, 0},
             kInfinite});
    set.add({{0.001, -0.002, -0.001}, {-0.61453540051509314, 0.78554, 0.0726422001817}, kInfinite});
    set.add({{0.0018, -0.0007, -0.0007}, {-0.98037020133633002, 0.0961, -0.17216}, kInfinite});
    set.add(
        {{0.0018, -0.0007, -0.0007}, {-1, 0.096099186338112999, -0.17216043307595821}, kInfinite});
    set.add({{0.002, -0.0009, -0.0007},
             {-0.955371860011765, 0.24313966961723671, -0.16777},
             kInfinite});
    const auto planes = static_cast<int>(set.count());
    const ProxySolution at_length = solve_proxy(set, Vec3{0.0}, kStiffness, 1000);
    EXPECT_GT(at_length.work, 400 * planes) << "hard enough";
    const test::ExactProblem exact(set, Vec3{0.0}, kStiffness);
    for (const int cap : {1, kLoopPasses}) {
        const ProxySolution solution = solve_proxy(set, Vec3{0.0}, kStiffness, cap);
        EXPECT_LE(solution.work, (cap + kToEndAStep + 1) * planes); // and one look before the first
        EXPECT_EQ(solution.status, SolveStatus::capped);
        EXPECT_LE(exact.worth(solution).residual_m, 1e-12L * exact.scale());
    }
}

// From nothing to everything: not one strength may bring a number that is none.
TEST(ProxySolverHard, EveryStrengthIsAnswered) {
    const double least = std::numeric_limits<double>::denorm_min();
    const double most = std::numeric_limits<double>::max();
    for (const double strength : {0.0, least, 1e-300, 1e-9, 1.0, 1e9, 1e300, most, kInfinite}) {
        SCOPED_TRACE(strength);
        for (const Vec3& probe : {Vec3{0.0}, Vec3{-0.003, 0.0, 0.0}, Vec3{0.002, -0.001, 0.004}}) {
            PrimitiveSet set; // the probe may be on all of them at once
            set.add({Vec3{0.0}, {1, 0, 0}, strength});
            set.add({Vec3{0.0}, {0, 0, 0}, strength});
            set.add_line({Vec3{0.0}, {0, 1, 0}, strength});
            set.add_point({Vec3{0.0}, strength});
            const ProxySolution solution = solve_proxy(set, probe, kStiffness);
            ASSERT_TRUE(is_finite(solution.proxy));
            ASSERT_TRUE(std::isfinite(solution.residual_m));
            EXPECT_EQ(solution.status, SolveStatus::exact);
            EXPECT_LE(glm::length(solution.proxy - probe), glm::length(probe) * (1.0 + 1e-12))
                << "what it holds is at the origin, and nothing leads past it";
            if (strength <= 1e-300) {
                EXPECT_LE(glm::length(solution.proxy - probe), 1e-17);
            }
            if (strength >= 1e9) {
                EXPECT_LE(glm::length(solution.proxy), 1e-14);
            }
        }
    }
}

// Seen with a guide whose strength had faded to 4e-308 N, where frames know no smaller numbers:
// over the stiffness that is no length any more, and the solution was no number. As nothing made it
// go on, the proxy stayed where it was for ever.
TEST(ProxySolverHard, AStrengthTooSmallToBeALengthHoldsNothing) {
    const double least = std::numeric_limits<double>::denorm_min();
    ASSERT_EQ(least / kStiffness, 0.0);
    const Vec3 probe{0.002, -0.001, 0.004};
    PrimitiveSet wall;
    wall.add({{0, 0, 0.005}, {0, 0, 1}, kInfinite});
    const Vec3 held = solve_proxy(wall, probe, kStiffness).proxy;
    const auto expect_held = [&](const PrimitiveSet& set) {
        const ProxySolution solution = solve_proxy(set, probe, kStiffness);
        ASSERT_TRUE(is_finite(solution.proxy));
        EXPECT_EQ(solution.status, SolveStatus::exact);
        // 1e-12 of the scale, two centimetres.
        EXPECT_LE(glm::length(solution.proxy - held), 2e-14);
    };
    PrimitiveSet point = wall, line = wall, plane = wall;
    point.add_point({{0.02, 0, 0}, least});
    line.add_line({{0.02, 0, 0}, {0, 1, 0}, least});
    plane.add({{0.02, 0, 0}, {1, 0, 0}, least});
    expect_held(point);
    expect_held(line);
    expect_held(plane);
    plane.add_point({{0.02, 0, 0}, 1e-3}); // a plane among tethers
    ASSERT_TRUE(is_finite(solve_proxy(plane, probe, kStiffness).proxy));
}

} // namespace
} // namespace palpate
