// SPDX-License-Identifier: Apache-2.0
// Two million seeded sets of primitives, judged in long double by the solution's proxy and forces
// alone. Sanitised and unoptimised builds do a fortieth; PALPATE_FUZZ=5 makes it ten million.
#include <palpate/haptics/solver/proxy_solver.h>

#include <cstdlib>
#include <cstring>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/primitive_cases.h"
#include "tests/support/proxy_reference.h"

namespace palpate {
namespace {

using test::CaseFamily;
using test::CaseKinds;
using test::Draw;
using test::draw_case;
using test::Exact;
using test::Exact3;
using test::ExactProblem;
using test::PrimitiveCase;

constexpr double kStiffness = 500.0; // N/m
constexpr int kUncapped = 1000;      // passes

long cases(long optimised) {
#if defined(PALPATE_SANITIZED) || !defined(__OPTIMIZE__)
    const long count = optimised / 40;
#else
    const long count = optimised;
#endif
    const char* factor = std::getenv("PALPATE_FUZZ");
    return factor ? count * std::max(1L, std::strtol(factor, nullptr, 10)) : count;
}

class ProxySolverRandom : public testing::TestWithParam<CaseFamily> {
protected:
    Draw draw_{2026 + static_cast<std::uint64_t>(GetParam())};
};

std::string name_of(const testing::TestParamInfo<CaseFamily>& family) {
    const char* names[] = {"Random", "Degenerate", "NearParallel", "Mixed", "Lattice"};
    return names[static_cast<int>(family.param)];
}

INSTANTIATE_TEST_SUITE_P(Family, ProxySolverRandom, testing::ValuesIn(test::kCaseFamilies),
                         name_of);

// Planes and forces are a quadratic problem with bounds, solved to rounding: 1e-12 of the scale is
// ten times what the hardest of a million left.
TEST_P(ProxySolverRandom, PlanesAreAlwaysSolvedExactly) {
    const long count = cases(200000);
    for (long i = 0; i < count; ++i) {
        const PrimitiveCase c = draw_case(draw_, GetParam(), CaseKinds::planes);
        const ProxySolution solution = solve_proxy(c.primitives, c.probe, kStiffness);
        const ExactProblem exact(c.primitives, c.probe, kStiffness);
        ASSERT_LE(exact.worth(solution).residual_m, 1e-12L * exact.scale()) << "case " << i;
    }
}

// Lines and points bring square roots, whose direction near zero double knows only as well as the
// offset: a few cases in which lines nearly coincide stop at rounding of that. None may be off by
// more than 1e-6 of the scale, and the solver says of each itself.
TEST_P(ProxySolverRandom, AnyMixIsSolvedExactlyOrSaysSo) {
    const bool ordinary = GetParam() == CaseFamily::random || GetParam() == CaseFamily::mixed;
    const long count = cases(200000);
    long inexact = 0;
    for (long i = 0; i < count; ++i) {
        const PrimitiveCase c = draw_case(draw_, GetParam(), CaseKinds::all);
        const ProxySolution solution = solve_proxy(c.primitives, c.probe, kStiffness, kUncapped);
        const ExactProblem exact(c.primitives, c.probe, kStiffness);
        const Exact residual = exact.worth(solution).residual_m / exact.scale();
        ASSERT_LE(residual, 1e-6L) << "case " << i;
        if (residual <= 1e-12L) continue;
        ++inexact;
        // Its own residual differs by rounding of the coordinates it reports.
        EXPECT_TRUE(solution.status == SolveStatus::capped || residual <= 1.001e-12L)
            << "case " << i;
    }
    EXPECT_LE(inexact, static_cast<long>((ordinary ? 1e-4 : 5e-3) * count));
}

// A sub-step's cap leaves one case in a hundred, at most, and that with a bound that holds: the
// exact solution, which has an error of its own, is within it.
TEST_P(ProxySolverRandom, WhatIsCutShortIsWithinItsErrorBound) {
    const long count = cases(20000);
    long capped = 0;
    for (long i = 0; i < count; ++i) {
        const PrimitiveCase c = draw_case(draw_, GetParam(), CaseKinds::all);
        const ProxySolution exact = solve_proxy(c.primitives, c.probe, kStiffness, kUncapped);
        for (int cap : {1, 4, 8, 16, kLoopPasses}) {
            const ProxySolution solution = solve_proxy(c.primitives, c.probe, kStiffness, cap);
            ASSERT_TRUE(is_finite(solution.proxy));
            ASSERT_LE(solution.passes, cap + 16);
            ASSERT_LE(glm::length(solution.proxy - exact.proxy),
                      solution.error_bound_m + exact.error_bound_m + 1e-15)
                << "case " << i << ", " << cap << " passes";
            if (cap == kLoopPasses && solution.status == SolveStatus::capped) ++capped;
        }
    }
    EXPECT_LE(capped, count / 100);
}

// Another method altogether, minimising over one multiplier after the other. Where it converges to
// 10 attometres, both agree to rounding of multipliers up to 64 scales; where a multiplier is at
// its bound and its offset zero at once, positions are known to the root of that.
TEST_P(ProxySolverRandom, AgreesWithASlowSolverInLongDouble) {
    const long count = cases(4000);
    long compared = 0;
    long apart = 0;
    for (long i = 0; i < count; ++i) {
        const PrimitiveCase c = draw_case(draw_, GetParam(), CaseKinds::all, 6);
        const ExactProblem exact(c.primitives, c.probe, kStiffness);
        const ExactProblem::Swept swept = exact.sweep(1e-17L, 300);
        if (swept.worth.residual_m > 1e-17L) continue;
        ++compared;
        const ProxySolution solution = solve_proxy(c.primitives, c.probe, kStiffness, kUncapped);
        const Exact distance = (Exact3(solution.proxy) - swept.proxy).length();
        ASSERT_LE(distance, 1e-9L * exact.scale()) << "case " << i;
        if (distance > 1e-12L * exact.scale()) ++apart;
    }
    EXPECT_GE(compared, count / 2);
    EXPECT_LE(apart, compared / 200);
}

// Recorded runs were made with these bits.
TEST(ProxySolver, PlanesAndForcesKeepTheirBits) {
    std::uint64_t hash = 14695981039346656037u; // FNV-1a
    const auto mix = [&hash](double value) {
        std::uint64_t bits = 0;
        std::memcpy(&bits, &value, sizeof bits);
        for (int i = 0; i < 8; ++i)
            hash = (hash ^ ((bits >> (8 * i)) & 0xff)) * 1099511628211u;
    };
    for (CaseFamily family : {CaseFamily::random, CaseFamily::degenerate, CaseFamily::lattice}) {
        Draw draw(1000 + static_cast<std::uint64_t>(family));
        for (int i = 0; i < 5000; ++i) {
            const PrimitiveCase c = draw_case(draw, family, CaseKinds::planes);
            const ProxySolution solution = solve_proxy(c.primitives, c.probe, kStiffness);
            for (int axis = 0; axis < 3; ++axis)
                mix(solution.proxy[axis]);
            for (std::size_t p = 0; p < 16; ++p)
                mix(p < solution.planes.size() ? solution.planes[p].multiplier_n : 0.0);
        }
    }
    EXPECT_EQ(hash, 0x4b1c5e36b8f9599eu);
}

} // namespace
} // namespace palpate
