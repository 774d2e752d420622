// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <palpate/volume/scalar_field.h>

/// Fields given by a formula: the truth that grids, meshes and contacts are measured against.
/// Values in metres, > 0 in the material, free where < 0; around the scene's origin. Gradient and
/// slope are one and exact; where there is none (the centre of a sphere, the circle and the axis of
/// a torus, within 1e-12 m) both and the Hessian are 0. Finite for finite points. Each constructor
/// function throws std::invalid_argument on a parameter that is not finite or not positive (angles:
/// out of range).                              [setup]
namespace palpate {

/// |x| - radius: free inside the sphere.
std::unique_ptr<ScalarField> make_sphere_cavity(double radius_m);

/// radius - |x|: free outside the sphere.
std::unique_ptr<ScalarField> make_solid_sphere(double radius_m);

/// |x| - (radius + amplitude * s(u)), u = x/|x|, s = sin(w u_x) sin(w u_y) sin(w u_z), w = 2 pi
/// radius / wavelength. Not a distance. amplitude < radius. first_root() proves what it passes by a
/// bound of the second derivative; where its evaluations run out (a segment of many wavelengths
/// that grazes the bumps), it returns the start of what is not proven.
std::unique_ptr<ScalarField> make_bumpy_cavity(double radius_m, double amplitude_m,
                                               double wavelength_m);

/// thickness/2 - |z|: a plate across z around z = 0.
std::unique_ptr<ScalarField> make_slab(double thickness_m);

/// A body of opening `angle_deg` in (0, 360) without 180, its edge the y axis: it occupies the
/// directions within angle/2 of -z, free space is the rest. The value is the smaller of the
/// distances into its two faces below 180 degrees, the larger above, where free space is a notch;
/// in the plane x = 0 the gradient is that of the face at x > 0.
std::unique_ptr<ScalarField> make_wedge(double angle_deg);

/// tube - distance to the circle of `radius` around z: a ring; 0 < tube < radius.
std::unique_ptr<ScalarField> make_torus(double radius_m, double tube_m);

} // namespace palpate
