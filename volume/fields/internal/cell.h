// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include <palpate/geometry/vec.h>
#include <palpate/volume/fields/internal/polynomial_root.h>

namespace palpate::internal {

/// Index of a cell: of its lowest corner.
struct CellIndex {
    int i = 0;
    int j = 0;
    int k = 0;

    bool operator==(const CellIndex&) const = default;
};

/// Values at the corners of a cell, i fastest: corner a + 2 b + 4 c is node (i + a, j + b, k + c).
using Corners = std::array<float, 8>;

/// Value and central differences by i, j, k: what is interpolated together.
struct alignas(32) Quad {
    std::array<double, 4> v{};
};

/// Component by component: a difference, and a + t difference. Cells interpolate along one axis
/// after the other.
inline Quad operator-(const Quad& b, const Quad& a) noexcept {
    Quad r;
    for (std::size_t n = 0; n < 4; ++n)
        r.v[n] = b.v[n] - a.v[n];
    return r;
}
inline Quad along(const Quad& a, double t, const Quad& difference) noexcept {
    Quad r;
    for (std::size_t n = 0; n < 4; ++n)
        r.v[n] = a.v[n] + t * difference.v[n];
    return r;
}

/// A cell ready for sampling: at its corners the value and the node's central differences, per
/// index step.
struct Cell {
    std::array<Quad, 8> corner;
};

/// Trilinear interpolation of a cell and its exact derivative by index, at x in [0,1]^3.
struct CellSample {
    Quad at;                ///< value, gradient of interpolated central differences
    std::array<Quad, 3> by; ///< derivative of `at` by i, j, k
};

/// Value at x of the trilinear interpolant; operation by operation what interpolate() does: the
/// same bits.      [loop]
inline double interpolate_value(const Corners& v, const Vec3& x) noexcept {
    const auto between = [](double a, double b, double t) { return a + t * (b - a); };
    const double low = between(between(v[0], v[1], x.x), between(v[2], v[3], x.x), x.y);
    const double high = between(between(v[4], v[5], x.x), between(v[6], v[7], x.x), x.y);
    return between(low, high, x.z);
}

/// Everything sample() needs, per index step.                                           [loop]
inline CellSample interpolate(const Cell& cell, const Vec3& x) noexcept {
    const auto& c = cell.corner;
    std::array<Quad, 4> by_i, at_i; // on the four edges along i
    for (std::size_t e = 0; e < 4; ++e) {
        by_i[e] = c[2 * e + 1] - c[2 * e];
        at_i[e] = along(c[2 * e], x.x, by_i[e]);
    }
    const Quad by_j_low = at_i[1] - at_i[0];
    const Quad by_j_high = at_i[3] - at_i[2];
    const Quad low = along(at_i[0], x.y, by_j_low);
    const Quad high = along(at_i[2], x.y, by_j_high);
    const Quad by_i_low = along(by_i[0], x.y, by_i[1] - by_i[0]);
    const Quad by_i_high = along(by_i[2], x.y, by_i[3] - by_i[2]);
    CellSample s;
    s.by[2] = high - low;
    s.at = along(low, x.z, s.by[2]);
    s.by[0] = along(by_i_low, x.z, by_i_high - by_i_low);
    s.by[1] = along(by_j_low, x.z, by_j_high - by_j_low);
    return s;
}

/// The trilinear interpolant on the line x + s d, a cubic in s.                         [loop]
inline Polynomial<3> on_line(const Corners& corners, const Vec3& x, const Vec3& d) noexcept {
    std::array<double, 8> v; // differences of floats of like size are exact in double
    for (std::size_t n = 0; n < 8; ++n)
        v[n] = corners[n];
    // v = k0 + k_i x + k_j y + k_k z + k_ij x y + k_ik x z + k_jk y z + k_ijk x y z
    const double k_i = v[1] - v[0];
    const double k_j = v[2] - v[0];
    const double k_k = v[4] - v[0];
    const double k_ij = v[3] - v[2] - k_i;
    const double k_ik = v[5] - v[4] - k_i;
    const double k_jk = v[6] - v[4] - k_j;
    const double k_ijk = v[7] - v[6] - v[5] + v[4] - k_ij;
    const double by_i = k_i + k_ij * x.y + (k_ik + k_ijk * x.y) * x.z;
    const double by_j = k_j + k_ij * x.x + (k_jk + k_ijk * x.x) * x.z;
    const double by_k = k_k + k_ik * x.x + (k_jk + k_ijk * x.x) * x.y;
    const double d_ij = d.x * d.y;
    return {interpolate_value(corners, x), by_i * d.x + by_j * d.y + by_k * d.z,
            (k_ij + k_ijk * x.z) * d_ij + (k_ik + k_ijk * x.y) * (d.x * d.z) +
                (k_jk + k_ijk * x.x) * (d.y * d.z),
            k_ijk * (d_ij * d.z)};
}

} // namespace palpate::internal
