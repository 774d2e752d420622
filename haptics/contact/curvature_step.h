// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/haptics/contact/surface_contact.h>

namespace palpate {

/// The step from `proxy` that takes the surfaces' curvature into account: the solver's step is
/// exact for planes, and overshoots along a surface by 1 + depth * curvature. [loop]
///   delta = delta_N + Q [Q^T (I + B + C) Q]^-1 Q^T (delta_0 - B delta_N + C delta_T)
///   B = sum_i (lambda_i / k) hess D_i,  C = sum over what slips (sigma / |r|) (Pi - t t^T)
/// composition.md 2.2, with delta_0 the solver's step, N the span of what holds (normals of planes,
/// directions across lines, all of them at points), Q its complement and delta_N, delta_T the
/// step's parts in either; C is how the pull of a line or point turns that slips, at the way r =
/// |r| t from it, Pi its directions. Without planes, the solver's step. For one
/// plane that is contact.md's tangent Newton; its normal part then follows the exact slope, since
/// the continuous normal may be 20 degrees off it. `contacts` are the first of `primitives`, plane
/// by plane. `stiffness` is the coupling's with the springs, N/m. `damping` in (0,1] shortens the
/// tangential part.
Vec3 curvature_step(const PrimitiveSet& primitives, const ContactSet& contacts,
                    const ProxySolution& solution, const Vec3& proxy, double stiffness,
                    double damping) noexcept;

/// The same with soft surfaces, whose forces are among the primitives': `tissue` is by how much
/// these fall with the step, as a share of `stiffness`: a part of B, also where there are no planes
/// (docs/palpation.md).
Vec3 curvature_step(const PrimitiveSet& primitives, const ContactSet& contacts,
                    const ProxySolution& solution, const Vec3& proxy, double stiffness,
                    double damping, const Mat3& tissue) noexcept;

} // namespace palpate
