// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/info/phantom.h>

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

/// Distance into the wall, mm, > 0 in bone.
double wall(const Vec3& p) {
    const double r = glm::length(p);
    if (r < 1e-9) return -20.0;
    const Vec3 u = p / r;
    const double bumps =
        1.2 * std::sin(9.0 * u.x) * std::sin(8.0 * u.y + 1.0) * std::sin(7.0 * u.z + 2.0);
    const double thickness = 2.2 + 1.6 * u.x; // 0.6 to 3.8 mm: thinner than a voxel on one side
    const double shell = thickness - std::abs(r - 30.0 - bumps);
    const double groove = std::abs(u.z - 0.35 * u.y) * 30.0 - 1.2;
    return std::min(shell, std::max(groove, 29.0 - r));
}

} // namespace

VoxelVolume make_phantom() {
    VoxelVolume volume;
    volume.size = {80, 80, 52};
    volume.source_type = "float32";
    const Vec3 spacing_mm{0.9, 0.9, 1.4};
    const Vec3 corner_mm{-35.55, -35.55, -35.7};
    for (int axis = 0; axis < 3; ++axis)
        volume.index_to_scene.linear[axis][axis] = 1e-3 * spacing_mm[axis];
    volume.index_to_scene.offset = 1e-3 * corner_mm;
    volume.values.resize(volume.voxels());
    for (int k = 0; k < volume.size[2]; ++k)
        for (int j = 0; j < volume.size[1]; ++j)
            for (int i = 0; i < volume.size[0]; ++i) {
                const double depth = wall(corner_mm + Vec3{i, j, k} * spacing_mm);
                volume.values[volume.index(i, j, k)] =
                    static_cast<float>(1000.0 * std::erf(depth / 1.1));
            }
    return volume;
}

} // namespace palpate
