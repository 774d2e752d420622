// SPDX-License-Identifier: Apache-2.0
// Effects of a scene, kind by kind.
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/contact_choice.h>
#include <palpate/engine/internal/effect_kinds.h>
#include <palpate/engine/internal/field_check.h>
#include <palpate/engine/scene_file.h>

namespace palpate::internal {
namespace {

/// The volume that an effect samples: there, and of the kind that it needs as far as that is known
/// before it is read.
void check_field_volume(const FieldCheck& check, const SceneDescription& scene,
                        const EffectDescription& effect) {
    check.name("volume", effect.volume, scene.volumes, "volumes");
    const VolumeDescription& volume = scene.volumes.at(effect.volume);
    if (traits_of(effect.kind).need == FieldNeed::scalar) {
        check_scalars(check, "volume", scene, effect.volume);
    } else if (!volume.analytic.empty() && !is_of_vectors(volume)) {
        check.fail("volume", fmt::format("= \"{}\" is a formula of scalars", effect.volume),
                   "name a volume of vectors, or analytic = \"helix\"");
    }
}

/// A strength that is a function of a volume's value, of what need not have one.
void check_strength_by_place(const FieldCheck& check, const SceneDescription& scene,
                             const EffectDescription& effect, const Range& range) {
    if (effect.volume.empty()) return;
    check_field_volume(check, scene, effect);
    Range finite = range;
    finite.or_infinite = false;
    check.function("strength", effect.strength, finite);
}

void check_surface_name(const FieldCheck& check, const SceneDescription& scene,
                        const EffectDescription& effect) {
    check.name("surface", effect.surface, scene.surfaces, "surfaces");
}

void check_friction(const FieldCheck& check, const EffectDescription& effect) {
    const FrictionCoefficients& friction = effect.friction;
    check.number("friction.static_mu", friction.static_mu, kCoefficient);
    check.number("friction.dynamic_mu", friction.dynamic_mu, kCoefficient);
    if (friction.dynamic_mu > friction.static_mu)
        check.fail(
            "friction.dynamic_mu",
            fmt::format("= {} is above static_mu = {}", friction.dynamic_mu, friction.static_mu),
            "give at most as much friction while sliding as at rest");
    if (friction.stick_slip != (effect.kind == EffectKind::stick_slip))
        check.fail("friction.stick_slip", "and kind say different things",
                   "set it where the kind is stick_slip, and only there");
}

void check_viscosity(const FieldCheck& check, const SceneDescription& scene,
                     const EffectDescription& effect) {
    check.function("strength", effect.strength, kDamping);
    if (!effect.volume.empty() && !effect.surface.empty())
        check.fail("surface", "and volume exclude each other", "keep one of them");
    if (!effect.volume.empty()) return check_field_volume(check, scene, effect);
    if (effect.strength.count > 1)
        check.fail("strength", "is a function, and no volume says of what",
                   "name the volume, or give one number of N s/m");
    if (effect.surface.empty()) return;
    check_surface_name(check, scene, effect);
    if (scene.surfaces.at(effect.surface).volume.empty())
        check.fail("surface",
                   fmt::format("= \"{}\" is a mesh alone, which has no inside to be viscous",
                               effect.surface),
                   "name a surface of a volume");
}

void check_magnet(const FieldCheck& check, const SceneDescription& scene,
                  const EffectDescription& effect) {
    check_surface_name(check, scene, effect);
    check.number("magnet.strength_n", effect.magnet.strength_n, kStrengthN);
    check.number("magnet.capture_m", effect.magnet.capture_m, scaled(kMagnetCaptureMm, 1e-3));
    check_strength_by_place(check, scene, effect, kStrengthN);
}

void check_texture(const FieldCheck& check, const SceneDescription& scene,
                   const EffectDescription& effect) {
    check_surface_name(check, scene, effect);
    const TextureSettings& texture = effect.texture;
    const Range height_m = scaled(kHeightMm, 1e-3);
    if (!effect.volume.empty()) {
        check_field_volume(check, scene, effect);
        return check.function("texture.height_over_value", texture.height_over_value, height_m);
    }
    if (texture.height_over_value.count > 0)
        check.fail("texture.height_over_value", "is a function, and no volume says of what",
                   "name the volume, or give height_m");
    check.choice("texture.pattern", texture.pattern, TexturePattern::grating);
    check.number("texture.wavelength_m", texture.wavelength_m, scaled(kWavelengthMm, 1e-3));
    check.number("texture.height_m", texture.height_m, height_m);
    if (texture.height_m > SurfaceTexture::kHighestOfWave * texture.wavelength_m)
        check.fail("texture.height_m",
                   fmt::format("= {} is above wavelength_m / (2 pi)", texture.height_m),
                   "lower the height, or take a longer wavelength");
    check.direction("texture.direction", texture.direction);
}

void check_curve(const FieldCheck& check, const EffectDescription& effect) {
    const std::size_t count = effect.points_m.size();
    if (count < 1 || count > Polyline::kMostPoints)
        check.fail("points_m", fmt::format("has {} points", count),
                   fmt::format("give 1 to {} of them", Polyline::kMostPoints));
    for (std::size_t i = 0; i < count; ++i)
        check.triple(fmt::format("points_m[{}]", i), effect.points_m[i], scaled(kPlaceMm, 1e-3));
    check.choice("ends", effect.ends, PolylineEnds::endless);
    if (count == 1 && effect.ends == PolylineEnds::open) return; // a point
    try {
        const Polyline curve(effect.points_m, effect.ends);
    } catch (const std::invalid_argument& error) {
        check.fail("points_m", "make no curve", error.what());
    }
}

void check_guide(const FieldCheck& check, const SceneDescription& scene,
                 const EffectDescription& effect) {
    check.number("guide_settings.strength_n", effect.guide_settings.strength_n, kHoldingN);
    check.number("guide_settings.capture_m", effect.guide_settings.capture_m, kPositiveOrInfinite);
    check_strength_by_place(check, scene, effect, kHoldingN);
    check_curve(check, effect);
}

void check_workspace(const FieldCheck& check, const SceneDescription& scene,
                     const EffectDescription& effect) {
    check.number("guide_settings.strength_n", effect.guide_settings.strength_n, kHoldingN);
    check_strength_by_place(check, scene, effect, kHoldingN);
    const Range place_m = scaled(kPlaceMm, 1e-3);
    if (effect.radius_m == 0.0 && effect.box_m.empty())
        check.fail("radius_m", "= 0, and box_m is empty", "give a radius_m above 0, or a box_m");
    if (effect.radius_m != 0.0) {
        check.number("radius_m", effect.radius_m, scaled(kRadiusMm, 1e-3));
        return check.triple("center_m", effect.center_m, place_m);
    }
    check.triple("box_m.lower", effect.box_m.lower, place_m);
    check.triple("box_m.upper", effect.box_m.upper, place_m);
    const Vec3 extent = effect.box_m.extent();
    if (!(extent.x > 0.0 && extent.y > 0.0 && extent.z > 0.0))
        check.fail("box_m", "has no volume", "give two opposite corners");
}

void check_vibration(const FieldCheck& check, const SceneDescription& scene,
                     const EffectDescription& effect) {
    const ContactVibrationSettings& v = effect.vibration;
    if (!effect.surface.empty()) check_surface_name(check, scene, effect);
    check.number("vibration.amplitude_n_s_per_m", v.amplitude_n_s_per_m, kVibrationAmplitude);
    check.number("vibration.frequency_hz", v.frequency_hz, kVibrationHz);
    check.number("vibration.decay_s", v.decay_s, scaled(kVibrationDecayMs, 1e-3));
    check.number("vibration.most_n", v.most_n, kVibrationMostN);
}

} // namespace

void check_effect(const FieldCheck& check, const SceneDescription& scene,
                  const EffectDescription& effect) {
    check.choice("kind", effect.kind, EffectKind::texture);
    switch (effect.kind) {
    case EffectKind::surface:
        return check_surface_name(check, scene, effect);
    case EffectKind::friction:
    case EffectKind::stick_slip:
        check_surface_name(check, scene, effect);
        return check_friction(check, effect);
    case EffectKind::magnet:
        return check_magnet(check, scene, effect);
    case EffectKind::constant_force:
        return check.triple(
            "force_n", Vec3{effect.force_n[0], effect.force_n[1], effect.force_n[2]}, kAxisForceN);
    case EffectKind::gravity_compensation:
        check.number("mass_kg", effect.mass_kg, kHandleKg);
        return check.direction("down", effect.down);
    case EffectKind::viscosity:
        return check_viscosity(check, scene, effect);
    case EffectKind::vector_follow:
    case EffectKind::fibre_follow:
        check.choice("guide", effect.guide, FollowGuide::streamline);
        [[fallthrough]];
    case EffectKind::gradient_surface:
    case EffectKind::gradient_force:
    case EffectKind::vector_force:
    case EffectKind::front_shape:
    case EffectKind::vortex:
        check_field_volume(check, scene, effect);
        return check.function("strength", effect.strength,
                              traits_of(effect.kind).may_be_hard ? kHoldingN : kStrengthN);
    case EffectKind::guide:
        return check_guide(check, scene, effect);
    case EffectKind::workspace:
        return check_workspace(check, scene, effect);
    case EffectKind::vibration:
        return check_vibration(check, scene, effect);
    case EffectKind::texture:
        return check_texture(check, scene, effect);
    }
}

} // namespace palpate::internal
