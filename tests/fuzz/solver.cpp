// SPDX-License-Identifier: Apache-2.0
// Planes, lines, points and forces, any that there are. The oracle is the optimality of the
// solution (its KKT conditions), judged in long double by proxy and multipliers alone.
#include <algorithm>
#include <cmath>
#include <limits>

#include <palpate/haptics/solver/proxy_solver.h>

#include "tests/fuzz/target.h"
#include "tests/support/proxy_reference.h"

using namespace palpate;

namespace {

constexpr double kStiffness = 500.0; // N/m
constexpr int kUncapped = 1000;      // passes
constexpr int kMostPrimitives = 40;  // more than the set has room for

constexpr double kFarthest_m = 1e3;
constexpr double kRoundings = 2.0 * std::numeric_limits<double>::epsilon();

/// Coordinates of up to 33 mm, or now and then any double.
Vec3 place(test::Input& input) {
    const double x = input.length(), y = input.length(), z = input.length();
    return {x, y, z};
}

bool is_near(const Vec3& place) { return is_finite(place) && glm::length(place) < kFarthest_m; }

/// A unit vector: the set asks for no less.
Vec3 direction(test::Input& input) {
    const Vec3 any{input.take<std::int8_t>(), input.take<std::int8_t>(), input.take<std::int8_t>()};
    const double length = glm::length(any);
    return length > 0.0 ? any / length : Vec3{0.0, 0.0, 1.0};
}

double strength(test::Input& input) {
    const unsigned kind = input.choice(8);
    if (kind == 0) return 0.0;
    if (kind < 3) return std::numeric_limits<double>::infinity();
    return std::ldexp(1.0 + input.choice(200), static_cast<int>(input.choice(16)) - 12); // N
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    test::Input input(data, size);
    PrimitiveSet set;
    const Vec3 probe = place(input);
    bool are_near = is_near(probe);
    Vec3 anchor{0.0}, axis{0.0, 0.0, 1.0}; // those of the one before: exact ties
    for (int i = 0; i < kMostPrimitives && !input.is_empty(); ++i) {
        const unsigned kind = input.choice(64);
        if (kind % 4 != 0) anchor = place(input);
        if (kind % 8 < 5) axis = direction(input);
        are_near = are_near && is_near(anchor);
        const double s = strength(input);
        switch (kind / 16) {
        case 0:
            set.add({anchor, kind % 3 == 0 ? -axis : axis, s});
            break;
        case 1:
            set.add_line({anchor, axis, s});
            break;
        case 2:
            set.add_point({anchor, s});
            break;
        default:
            set.add_force(1e2 * anchor);
        }
    }
    for (const int cap : {1, kLoopPasses, kUncapped}) {
        const ProxySolution solution = solve_proxy(set, probe, kStiffness, cap);
        if (!are_near) continue; // it ends: the loop looks at the rest
        test::must(is_finite(solution.proxy), "a proxy that is not finite");
        const test::ExactProblem exact(set, probe, kStiffness);
        // The proxy's coordinates are doubles: far from the origin they round by more than the
        // rest.
        const test::Exact rounding_m = kRoundings * test::Exact3(solution.proxy).length();
        const test::Exact residual =
            std::max<test::Exact>(0, exact.worth(solution).residual_m - rounding_m) / exact.scale();
        const bool says_exact = solution.status == SolveStatus::exact;
        test::must(!says_exact || residual <= 1e-11L, "not exact, and does not say so");
        test::must(cap < kUncapped || residual <= 1e-6L, "far from optimal");
        ++test::taken;
    }
    return 0;
}
