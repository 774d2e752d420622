// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/geometry/vec.h>

namespace palpate::internal {

/// A symmetric tensor's largest eigenvalue, the next one, both in its own unit, and the unit
/// eigenvector of the largest; either sign of it.
struct PrincipalAxis {
    Vec3 axis{0.0};
    double largest = 0.0;
    double second = 0.0;
};

/// Eigenvectors by a fixed number of Jacobi rotations; `tensor` is symmetric and finite.  [loop]
PrincipalAxis principal_axis(const Mat3& tensor) noexcept;

/// Fractional anisotropy, sqrt(3/2) |deviator| / |tensor|, clamped to [0, 1]: 0 alike in all
/// directions, 1 along one alone; 0 for the zero tensor.                                  [loop]
double anisotropy(const Mat3& tensor) noexcept;

} // namespace palpate::internal
