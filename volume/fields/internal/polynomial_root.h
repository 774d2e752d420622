// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

namespace palpate::internal {

/// Coefficients of c[0] + c[1] t + ... + c[Degree] t^Degree.
template <int Degree>
using Polynomial = std::array<double, Degree + 1>;

/// Value of the polynomial at t, by Horner's rule.                                      [loop]
template <int Degree>
double evaluate(const Polynomial<Degree>& p, double t) noexcept {
    double value = p[Degree];
    for (int i = Degree - 1; i >= 0; --i)
        value = value * t + p[static_cast<std::size_t>(i)];
    return value;
}

/// The first t in [0,1] at which p reaches `level` from below, for Degree 3 and 4; 0 when p(0) >=
/// level, nothing when p stays below. The returned t lies on the lower side, p(t) - level < 0 as
/// computed, within 1e-15 of the root. Coefficients must be finite. Bounded, no allocation, no
/// floating-point exception but underflow and inexact.        [loop]
template <int Degree>
std::optional<double> first_reach(const Polynomial<Degree>& p, double level) noexcept;

extern template std::optional<double> first_reach<3>(const Polynomial<3>&, double) noexcept;
extern template std::optional<double> first_reach<4>(const Polynomial<4>&, double) noexcept;

} // namespace palpate::internal
