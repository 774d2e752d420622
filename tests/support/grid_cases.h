// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <tests/support/dense_reference.h>
#include <tests/support/test_volumes.h>

/// Grids to ask: every kind of frame, voxels at random.
namespace palpate::test {

constexpr float kBackground = -1000.0F; ///< U, of grids of noise

struct NamedFrame {
    std::string name;
    AffineTransform frame;
};

/// What must not be confused: anisotropic, oblique and left-handed, sheared.
inline std::vector<NamedFrame> all_frames() {
    AffineTransform straight;
    straight.linear = Mat3(0.957e-3, 0.0, 0.0, 0.0, 0.957e-3, 0.0, 0.0, 0.0, 1.5e-3);
    straight.offset = {-0.12, -0.13, 0.05};
    return {{"straight", straight},
            {"oblique, left-handed", oblique_frame({0.7e-3, 0.9e-3, 1.6e-3}, {0.05, -0.2, 0.1})},
            {"sheared", sheared_frame(1e-3)}};
}

/// Voxels at random in [-900, 900) U: neighbours have nothing in common.
inline VoxelVolume noise(const std::array<int, 3>& size, const AffineTransform& frame,
                         std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> value(-900.0, 900.0);
    return sampled(size, frame, [&](const Vec3&) { return value(random); });
}

/// A random scene point whose index coordinates lie in [-1, n): where there are data.
inline Vec3 point_with_data(std::mt19937_64& random, const VoxelVolume& volume) {
    const Vec3 n(volume.size[0], volume.size[1], volume.size[2]);
    return volume.index_to_scene.point(random_point(random, {Vec3(-0.9999), n - 1e-4}));
}

/// Index coordinates below 300 are rounded to a few 1e-14; times differences of 2000 U between
/// nodes.
constexpr double kValueRounding = 1e-9;

} // namespace palpate::test
