// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include <palpate/haptics/contact/surface_texture.h>
#include <palpate/haptics/contact/volume_contact.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/contact_loop.h"
#include "tests/support/dense_reference.h"

/// Textures with their heights by definition, and contacts that have them.
namespace palpate::test {

inline TextureSettings grating(double wavelength_m, double height_m,
                               const Vec3& direction = {1, 0, 0}) {
    TextureSettings texture;
    texture.pattern = TexturePattern::grating;
    texture.wavelength_m = wavelength_m;
    texture.height_m = height_m;
    texture.direction = direction;
    return texture;
}

inline TextureSettings bumps(double wavelength_m, double height_m) {
    TextureSettings texture;
    texture.wavelength_m = wavelength_m;
    texture.height_m = height_m;
    return texture;
}

/// Heights over the distance into a ball of 20 mm: a cone around its centre, 0.2 mm high.
inline TextureSettings cone() {
    TextureSettings texture;
    texture.field = make_solid_sphere(20e-3);
    texture.height_over_value.count = 2;
    texture.height_over_value.nodes[0] = {0.0, 0.0};
    texture.height_over_value.nodes[1] = {20e-3, 0.2e-3};
    return texture;
}

/// By its definition, from nothing of the library.
inline double grating_height(const TextureSettings& g, double along_m) {
    return 0.5 * g.height_m * (1.0 - std::cos(2.0 * std::numbers::pi * along_m / g.wavelength_m));
}

inline double bumps_height(const TextureSettings& b, const Vec3& p) {
    return (grating_height(b, p.x) + grating_height(b, p.y) + grating_height(b, p.z)) / 3.0;
}

inline std::vector<std::unique_ptr<SurfaceContact>>
textured(std::shared_ptr<const ScalarField> field, const TextureSettings& texture,
         const LevelSettings& level = {}) {
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::make_unique<VolumeContact>(std::move(field), level, texture));
    return surfaces;
}

/// Until 0.01 nm are left.
inline SteppingSettings exactly() {
    SteppingSettings settings;
    settings.tolerance_m = 1e-11;
    return settings;
}

/// Each component within `most_m` of 0.
inline Vec3 random_offset(std::mt19937_64& random, double most_m) {
    std::uniform_real_distribution<double> share(-most_m, most_m);
    const double x = share(random), y = share(random), z = share(random);
    return {x, y, z};
}

} // namespace palpate::test
