// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include <palpate/engine/scene/scene_description.h>

namespace palpate {

/// A tissue whose modulus has been measured, as `material = "liver"` takes it.
struct Tissue {
    std::string_view name;   ///< of the material
    double youngs_kpa = 0.0; ///< mean of healthy people, by shear waves, kPa
    std::string_view source; ///< the paper
};

/// All of them, by name (docs/palpation.md).                                             [any]
std::span<const Tissue> tissues() noexcept;

/// The material of a tissue, soft as its modulus is to a contact of 4 mm; nothing where there is
/// no such tissue. [setup]
std::optional<MaterialDescription> tissue_material(std::string_view name);

/// How soft a deep layer of modulus E, kPa, that keeps its volume (nu = 1/2) is to a round, flat
/// and stiff contact of radius a, mm:  K = 2 a E / (1 - nu^2). For SurfaceDescription::softness;
/// validate() refuses what is made of numbers that are not above 0, or not finite. [any]
Softness softness_of_modulus(double youngs_kpa, double contact_radius_mm) noexcept;

} // namespace palpate
