// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/internal/polynomial_root.h>

#include <cmath>
#include <utility>

namespace palpate::internal {
namespace {

constexpr double kResolution = 0x1p-50; // in t, 8.9e-16: the rounding of a t near 1, times eight
constexpr int kMaxIterations = 128;     // Newton needs about 6, bisection to kResolution 50

template <int Degree>
Polynomial<Degree - 1> derivative(const Polynomial<Degree>& p) noexcept {
    Polynomial<Degree - 1> d;
    for (std::size_t i = 0; i < Degree; ++i)
        d[i] = static_cast<double>(i + 1) * p[i + 1];
    return d;
}

/// Where an increasing piece with p(a) < 0 <= p(b) crosses zero: the end of the last bracket where
/// p < 0. Newton steps inside the bracket, bisection where they leave it or make it shrink too
/// slowly.
template <int Degree>
double lower_side(const Polynomial<Degree>& p, double a, double b) noexcept {
    const Polynomial<Degree - 1> slope = derivative<Degree>(p);
    const double p_a = evaluate<Degree>(p, a);
    double t = a - p_a * (b - a) / (evaluate<Degree>(p, b) - p_a); // the divisor is > 0
    double nudge = 0.5 * kResolution;
    for (int i = 0; i < kMaxIterations && b - a > kResolution; ++i) {
        const bool bisect = i % 4 == 3 || !(t > a && t < b);
        if (bisect) t = 0.5 * (a + b);
        const double p_t = evaluate<Degree>(p, t);
        (p_t < 0.0 ? a : b) = t;
        const double slope_t = evaluate<Degree - 1>(slope, t);
        double step = 0.0;
        if (slope_t >
            std::abs(p_t)) // a longer step leaves [0,1] anyway; no division by nearly nothing
            step = -p_t / slope_t;
        else
            step = 0.5 * (a + b) - t;
        // Newton comes from one side only; stepping beyond the root pulls the other end of the
        // bracket in.
        if (std::abs(step) < nudge) {
            step = p_t < 0.0 ? nudge : -nudge;
            nudge *= 4.0;
        }
        t += step;
    }
    return a;
}

/// Roots of a quadratic in the open interval (0,1), ascending.
int roots_inside(const Polynomial<2>& p, std::array<double, 3>& roots) noexcept {
    const double discriminant = p[1] * p[1] - 4.0 * p[2] * p[0];
    if (discriminant < 0.0) return 0;
    const double q =
        -0.5 * (p[1] + std::copysign(std::sqrt(discriminant), p[1])); // no cancellation
    int count = 0;
    // A quotient lies in (0,1) when numerator and divisor have one sign and the divisor is the
    // longer: never 0.
    const auto add = [&](double numerator, double divisor) {
        if (std::abs(numerator) < std::abs(divisor) && numerator != 0.0 &&
            std::signbit(numerator) == std::signbit(divisor))
            roots[static_cast<std::size_t>(count++)] = numerator / divisor;
    };
    add(p[0], q);
    add(q, p[2]);
    if (count == 2 && roots[0] > roots[1]) std::swap(roots[0], roots[1]);
    return count;
}

/// Roots of a cubic in (0,1), ascending: its stationary points cut [0,1] into monotone pieces.
/// Roots without a change of sign are left out: as stationary points of a quartic they cut nothing.
int roots_inside(const Polynomial<3>& p, std::array<double, 3>& roots) noexcept {
    std::array<double, 3> cuts{};
    const int cut_count = roots_inside(derivative<3>(p), cuts);
    int count = 0;
    double a = 0.0;
    double p_a = p[0];
    for (int i = 0; i <= cut_count; ++i) {
        const double b = i < cut_count ? cuts[static_cast<std::size_t>(i)] : 1.0;
        const double p_b = evaluate<3>(p, b);
        if (p_a < 0.0 && p_b >= 0.0)
            roots[static_cast<std::size_t>(count++)] = lower_side<3>(p, a, b);
        else if (p_a > 0.0 && p_b <= 0.0)
            roots[static_cast<std::size_t>(count++)] =
                lower_side<3>({-p[0], -p[1], -p[2], -p[3]}, a, b);
        a = b;
        p_a = p_b;
    }
    return count;
}

} // namespace

template <int Degree>
std::optional<double> first_reach(const Polynomial<Degree>& p, double level) noexcept {
    Polynomial<Degree> q = p;
    q[0] -= level;
    if (q[0] >= 0.0) return 0.0;
    std::array<double, 3> cuts{};
    const int cut_count = roots_inside(derivative<Degree>(q), cuts);
    double a = 0.0;
    for (int i = 0; i <= cut_count; ++i) {
        const double b = i < cut_count ? cuts[static_cast<std::size_t>(i)] : 1.0;
        if (evaluate<Degree>(q, b) >= 0.0) return lower_side<Degree>(q, a, b);
        a = b;
    }
    return std::nullopt;
}

template std::optional<double> first_reach<3>(const Polynomial<3>&, double) noexcept;
template std::optional<double> first_reach<4>(const Polynomial<4>&, double) noexcept;

} // namespace palpate::internal
