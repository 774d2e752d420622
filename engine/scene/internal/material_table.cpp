// SPDX-License-Identifier: Apache-2.0
#include <array>

#include <fmt/format.h>

#include <palpate/engine/scene/internal/scene_tables.h>
#include <palpate/haptics/contact/surface_texture.h>

namespace palpate::internal {
namespace {

/// A length in mm, where there is one; m.
std::optional<double> read_length(const TomlTable& table, std::string_view key, const Range& range,
                                  const std::optional<double>& fallback) {
    return table.has(key) ? 1e-3 * table.number(key, range, 0.0) : fallback;
}

} // namespace

FrictionCoefficients read_friction(const TomlTable& table, const MaterialDescription& material) {
    if (!material.static_mu)
        table.require("static", "give the coefficient at rest, as static = 0.3");
    FrictionCoefficients friction;
    friction.static_mu = table.number("static", kCoefficient, material.static_mu.value_or(0.0));
    friction.dynamic_mu =
        table.number("dynamic", kCoefficient, material.dynamic_mu.value_or(friction.static_mu));
    const std::string of_material = " of the surface's material";
    if (friction.dynamic_mu > friction.static_mu)
        table.fail(table.line_of(table.has("dynamic") ? "dynamic" : "static"),
                   fmt::format("dynamic = {}{} is above static = {}{}", friction.dynamic_mu,
                               table.has("dynamic") ? " " + table.where() : of_material,
                               friction.static_mu, table.has("static") ? "" : of_material),
                   "give at most as much friction while sliding as at rest");
    return friction;
}

TextureWaves read_texture_waves(const TomlTable& table, std::string_view wavelength_key,
                                std::string_view height_key, const TextureWaves& fallback) {
    const TextureWaves waves{
        read_length(table, wavelength_key, kWavelengthMm, fallback.wavelength_m),
        read_length(table, height_key, kHeightMm, fallback.height_m)};
    if (!waves.wavelength_m || !waves.height_m) return waves;
    const double highest_m = SurfaceTexture::kHighestOfWave * *waves.wavelength_m;
    if (*waves.height_m > highest_m)
        table.fail(table.line_of(table.has(height_key) ? height_key : wavelength_key),
                   fmt::format("{} = {} {} is above {} / (2 pi) = {:.4g}", height_key,
                               1e3 * *waves.height_m, table.where(), wavelength_key,
                               1e3 * highest_m),
                   "lower the height, or take a longer wavelength: flanks would be too steep to be "
                   "felt as heights");
    return waves;
}

MaterialDescription read_material_table(const TomlTable& table) {
    constexpr std::array<std::string_view, 12> keys{"strength_n",
                                                    "yield",
                                                    "static",
                                                    "dynamic",
                                                    "damping_n_s_per_m",
                                                    "texture_wavelength_mm",
                                                    "texture_height_mm",
                                                    kSoftnessKeys[0],
                                                    kSoftnessKeys[1],
                                                    kSoftnessKeys[2],
                                                    kSoftnessKeys[3],
                                                    kSoftnessKeys[4]};
    table.allow_only(keys);
    MaterialDescription material;
    material.strength = read_function(table, "strength_n", kHoldingN, "N");
    material.strength_line = table.line_of("strength_n");
    if (table.has("yield")) material.yielding = read_yielding(table);
    material.softness = read_softness(table, {});
    if (table.has("contact_radius_mm"))
        material.contact_radius_mm = table.number("contact_radius_mm", kContactRadiusMm, 0.0);
    if (table.has("static") || table.has("dynamic")) {
        const FrictionCoefficients friction = read_friction(table, {});
        material.static_mu = friction.static_mu;
        if (table.has("dynamic")) material.dynamic_mu = friction.dynamic_mu;
    }
    if (table.has("damping_n_s_per_m"))
        material.damping_n_s_per_m = table.number("damping_n_s_per_m", kDamping, 0.0);
    material.texture = read_texture_waves(table, "texture_wavelength_mm", "texture_height_mm", {});
    return material;
}

} // namespace palpate::internal
