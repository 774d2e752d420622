// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <palpate/volume/scalar_field.h>

/// Fields given by a formula: the truth that grids, meshes and contacts are measured against. Values in metres, > 0 in the
/// material, free where < 0; around the scene's origin. Each constructor function throws std::invalid_argument on a parameter
/// that is not finite or not positive (angles: out of range).                              [setup]
namespace palpate {

/// |x| - radius: free inside the sphere.
std::unique_ptr<ScalarField> make_sphere_cavity(double radius_m);

/// radius - |x|: free outside the sphere.
std::unique_ptr<ScalarField> make_solid_sphere(double radius_m);

/// |x| - (radius + amplitude * s(u)), u = x/|x|, s = sin(w u_x) sin(w u_y) sin(w u_z), w = 2 pi radius / wavelength. Not a distance.
std::unique_ptr<ScalarField> make_bumpy_cavity(double radius_m, double amplitude_m, double wavelength_m);

/// thickness/2 - |z|: a plate across z around z = 0.
std::unique_ptr<ScalarField> make_slab(double thickness_m);

/// A wedge-shaped body of opening `angle_deg` in (0,180) around +z below its edge, the y axis: the smaller of the distances
/// into its two faces; its complement is a concave corner when the angle exceeds 180: range (0, 360) without 180.
std::unique_ptr<ScalarField> make_wedge(double angle_deg);

/// tube - distance to the circle of `radius` around z: a ring; 0 < tube < radius.
std::unique_ptr<ScalarField> make_torus(double radius_m, double tube_m);

}  // namespace palpate
