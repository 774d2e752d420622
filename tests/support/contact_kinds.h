// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>

#include <palpate/haptics/contact/guarded_contact.h>
#include <palpate/volume/fields/analytic_fields.h>
#include <palpate/volume/fields/grid_field.h>

#include "tests/support/mesh_fuzz.h"
#include "tests/support/test_meshes.h"
#include "tests/support/test_volumes.h"

/// One body, felt with every contact that has a certificate.
namespace palpate::test {

enum class Kind { formula, volume, mesh, guarded };

inline std::string name_of(Kind kind) {
    return kind == Kind::formula  ? "formula"
           : kind == Kind::volume ? "volume"
           : kind == Kind::mesh   ? "mesh"
                                  : "guarded";
}

/// The distance into a solid, sampled on voxels of `spacing_m` over a cube about the origin.
template <class Distance>
std::shared_ptr<const ScalarField> voxels_of(const Distance& inside_m, double half_m,
                                             double spacing_m) {
    const int n = 2 * static_cast<int>(half_m / spacing_m) + 1;
    AffineTransform frame;
    frame.linear = spacing_m * Mat3(1.0);
    frame.offset = Vec3(-0.5 * (n - 1) * spacing_m);
    return std::make_shared<GridField>(sampled({n, n, n}, frame, inside_m), -1.0F);
}

/// A ball's voxels and its mesh, made once: a test has many contacts with each.
inline std::shared_ptr<const ScalarField> ball_voxels(double radius_m) {
    static std::map<double, std::shared_ptr<const ScalarField>> made;
    std::shared_ptr<const ScalarField>& voxels = made[radius_m];
    if (!voxels)
        voxels = voxels_of([&](const Vec3& p) { return radius_m - glm::length(p); },
                           radius_m + 4e-3, 0.5e-3);
    return voxels;
}
inline std::shared_ptr<const CertifiedMesh> ball_mesh(double radius_m, int levels) {
    static std::map<std::pair<double, int>, std::shared_ptr<const CertifiedMesh>> made;
    std::shared_ptr<const CertifiedMesh>& mesh = made[{radius_m, levels}];
    if (!mesh) mesh = certified(icosphere(radius_m, levels));
    return mesh;
}

/// What a ball's radius is made of: 327 680 triangles are within 0.9 um of 60 mm, voxels of 0.5 mm
/// within 1.3.
inline std::unique_ptr<SurfaceContact> ball(Kind kind, double radius_m, double strength_n,
                                            Yielding yielding, int mesh_levels = 7) {
    LevelSettings level;
    level.strength_n = strength_n;
    level.yielding = yielding;
    MeshContactSettings settings{strength_n};
    settings.yielding = yielding;
    switch (kind) {
    case Kind::formula:
        return std::make_unique<VolumeContact>(make_solid_sphere(radius_m), level);
    case Kind::volume:
        return std::make_unique<VolumeContact>(ball_voxels(radius_m), level);
    case Kind::mesh:
        return std::make_unique<MeshContact>(ball_mesh(radius_m, mesh_levels), settings);
    case Kind::guarded:
        break;
    }
    return std::make_unique<GuardedContact>(ball_voxels(radius_m), level,
                                            ball_mesh(radius_m, mesh_levels), 1e-3);
}

} // namespace palpate::test
