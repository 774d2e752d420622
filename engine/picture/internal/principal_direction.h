// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include <palpate/geometry/vec.h>

namespace palpate::internal {

/// A symmetric tensor: xx, xy, xz, yy, yz, zz.
using SymmetricTensor = std::array<double, 6>;

/// Unit eigenvector of the largest eigenvalue; either sign. Zero for a tensor that is not finite;
/// any of them where several are largest.                                                 [any]
Vec3 principal_direction(const SymmetricTensor& tensor) noexcept;

/// sqrt(tr(t t)): the length of a tensor, its own unit.                                   [any]
double frobenius_norm(const SymmetricTensor& tensor) noexcept;

/// Fractional anisotropy: sqrt(3/2) |deviator| / |tensor|; 0 for the zero tensor, at most 1 where
/// no eigenvalue is negative, clamped to that.                                            [any]
double fractional_anisotropy(const SymmetricTensor& tensor) noexcept;

} // namespace palpate::internal
