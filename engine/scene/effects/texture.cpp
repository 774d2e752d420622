// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/effects/texture.h>

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include <palpate/engine/scene/contact_choice.h>
#include <palpate/engine/scene/internal/contact_price.h>
#include <palpate/engine/scene/internal/effect_fields.h>
#include <palpate/engine/scene/internal/effect_keys.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/haptics/contact/surface_texture.h>

namespace palpate::internal::texture_effect {
namespace {

using effects::Texture;

constexpr std::array kKeys{
    kSurfaceKey,
    SceneKey{"pattern", "", {}, "bumps", "The pattern: \"bumps\" or \"grating\"."},
    SceneKey{"wavelength_mm", "mm", kWavelengthMm, "as the surface's material; else required",
             "The distance of a pattern's crests."},
    SceneKey{"height_mm", "mm", kHeightMm, "as the surface's material; else required",
             "The height of the crests, or with a volume a function of its value."},
    SceneKey{"direction", "", kFiniteRange, "required of a grating",
             "The direction [x, y, z] across a grating's grooves, scene frame (LPS)."},
    SceneKey{"volume", "", {}, "none", "The volume of scalars whose value the height is over."}};

// In the order of TexturePattern.
constexpr std::array<std::string_view, 2> kPatternNames{"bumps", "grating"};

/// The contact that feels a surface must be one that a texture is felt with.
void check_textured(const EffectTable& from) {
    const TomlTable& table = from.table;
    const ContactKind contact =
        choose_contact(from.scene, from.scene.surfaces.at(from.surface), Extraction::possible).kind;
    if (feels_texture(contact)) return;
    table.fail(table.line_of("surface"),
               fmt::format("surface \"{}\" {} is felt with contact \"{}\", which has no texture",
                           from.surface, table.where(), name(contact)),
               "give the surface a volume, and contact = \"volume\" or \"guarded\"");
}

/// A height over the value of a volume.
void read_heights(const EffectTable& from, Texture& effect) {
    const TomlTable& table = from.table;
    for (const std::string_view key : {"pattern", "wavelength_mm", "direction"})
        if (table.has(key))
            table.fail(table.line_of(key),
                       fmt::format("{} {} is of a pattern, and height_mm a function of the "
                                   "volume's value",
                                   key, table.where()),
                       fmt::format("remove {}, or volume", key));
    effect.volume = read_effect_volume(from, FieldNeed::scalar);
    effect.height_over_value = read_effect_function(from, "height_mm", kHeightMm, "mm");
    for (std::size_t i = 0; i < effect.height_over_value.count; ++i)
        effect.height_over_value.nodes[i].strength_n *= 1e-3; // m
}

void read_direction(const TomlTable& table, Texture& effect) {
    effect.direction = read_triple(table, "direction", ", across the grooves", kFiniteRange);
    if (!(glm::length(effect.direction) > 0.0))
        table.fail(table.line_of("direction"),
                   fmt::format("direction {} has no length", table.where()),
                   "give the direction across the grooves, as direction = [1, 0, 0]");
}

void read_pattern(const EffectTable& from, Texture& effect) {
    const TomlTable& table = from.table;
    const TextureWaves waves = read_texture_waves(table, "wavelength_mm", "height_mm",
                                                  material_of(from.scene, from.surface).texture);
    if (!waves.height_m)
        table.require("height_mm", "give the height of the crests, as height_mm = 0.1, or give the "
                                   "surface a material with texture_height_mm");
    if (!waves.wavelength_m)
        table.require("wavelength_mm", "give the distance of the crests, as wavelength_mm = 2, or "
                                       "give the surface a material with texture_wavelength_mm");
    effect.height_m = *waves.height_m;
    effect.wavelength_m = *waves.wavelength_m;
    if (table.has("pattern"))
        effect.pattern = static_cast<TexturePattern>(table.choice("pattern", kPatternNames));
    if (effect.pattern == TexturePattern::grating) return read_direction(table, effect);
    if (table.has("direction"))
        table.fail(table.line_of("direction"),
                   fmt::format("direction {} is of a grating", table.where()),
                   "remove it, or give pattern = \"grating\"");
}

Texture read(const EffectTable& from) {
    check_textured(from);
    Texture effect;
    effect.surface = from.surface;
    if (from.table.has("volume"))
        read_heights(from, effect);
    else
        read_pattern(from, effect);
    return effect;
}

void check(const EffectCheck& check, const Texture& effect) {
    const FieldCheck& fields = check.fields;
    check_surface_name(check, effect.surface);
    const Range height_m = scaled(kHeightMm, 1e-3);
    if (!effect.volume.empty()) {
        check_field_volume(check, FieldNeed::scalar, effect.volume);
        return fields.function("height_over_value", effect.height_over_value, height_m);
    }
    if (effect.height_over_value.count > 0)
        fields.fail("height_over_value", "is a function, and no volume says of what",
                    "name the volume, or give height_m");
    fields.choice("pattern", effect.pattern, TexturePattern::grating);
    fields.number("wavelength_m", effect.wavelength_m, scaled(kWavelengthMm, 1e-3));
    fields.number("height_m", effect.height_m, height_m);
    if (effect.height_m > SurfaceTexture::kHighestOfWave * effect.wavelength_m)
        fields.fail("height_m", fmt::format("= {} is above wavelength_m / (2 pi)", effect.height_m),
                    "lower the height, or take a longer wavelength");
    fields.direction("direction", effect.direction);
}

/// But for the field.
TextureSettings settings_of(const Texture& effect) {
    return {effect.pattern,   effect.height_m,          effect.wavelength_m,
            effect.direction, effect.height_over_value, nullptr};
}

EffectNeeds plan(const PlanContext& context, const Texture& effect) {
    constexpr const char* how = "heights in front of the surface's level, at its own sample";
    if (settings_of(effect).none()) return off("height_mm is 0: it cannot be felt");
    const SurfaceDescription& surface = context.scene.surfaces.at(effect.surface);
    const ContactKind contact = choose_contact(context.scene, surface, context.extraction).kind;
    if (!feels_texture(contact))
        return off(fmt::format("contact {} has no texture", name(contact)));
    if (context.has_earlier<Texture>(effect.surface))
        return off("the same surface has a texture already");
    return effect.volume.empty() ? on(how) : on_at_proxy(how, field_of_volume(effect));
}

/// SurfaceTexture refuses what is too high for the surface's field.
void shape(const Texture& effect, SceneSurface& surface, const EffectFields& fields) {
    surface.texture = settings_of(effect);
    if (!effect.volume.empty()) surface.texture.field = fields.scalars.at(effect.volume);
    SurfaceTexture(surface.texture, surface.baked.field->relief_limit_m());
}

/// As high as the field allows: a gain may raise it.
double in_front_m(const Texture&, const SceneSurface& surface) {
    return surface.baked.field->feature_size_m();
}

double price_us(const Texture&, const PricedSurface& priced) {
    return std::max(0.0, contact_price(priced, PricedWork::planes, {}) - bare_price(priced));
}

} // namespace
} // namespace palpate::internal::texture_effect

namespace palpate::effects {

constinit const internal::EffectRoom<Texture> Texture::room{
    .traits = {.name = "texture",
               .keys = internal::texture_effect::kKeys,
               .need = internal::FieldNeed::scalar,
               .part = SurfacePart::texture,
               .beside_soft = true},
    .read = internal::texture_effect::read,
    .check = internal::texture_effect::check,
    .plan = internal::texture_effect::plan,
    .on_surface = {.shape = internal::texture_effect::shape,
                   .in_front_m = internal::texture_effect::in_front_m,
                   .price_us = internal::texture_effect::price_us},
};

} // namespace palpate::effects
