// SPDX-License-Identifier: Apache-2.0
// Volumes, materials and surfaces of a scene.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <palpate/engine/scene/contact_choice.h>
#include <palpate/engine/scene/internal/field_check.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/haptics/contact/surface_texture.h>

namespace palpate::internal {
namespace {

void check_formula(const FieldCheck& check, const VolumeDescription& volume) {
    const auto found =
        std::find_if(kFormulas.begin(), kFormulas.end(),
                     [&](const Formula& formula) { return formula.name == volume.analytic; });
    if (found == kFormulas.end()) {
        Names names;
        for (const Formula& formula : kFormulas)
            names.push_back(formula.name);
        check.fail("analytic", fmt::format("= \"{}\" does not exist", volume.analytic),
                   remedy_for_name(volume.analytic, names, "formulas"));
    }
    const Names keys(found->keys.begin(), found->keys.begin() + found->key_count);
    const std::string takes = fmt::format("analytic = \"{}\" takes {}", found->name, joined(keys));
    for (const auto& [key, value] : volume.parameters)
        if (std::find(keys.begin(), keys.end(), key) == keys.end())
            check.fail(fmt::format("parameters[\"{}\"]", key), "is not known", takes);
    for (const std::string_view key : keys) {
        const std::string field = fmt::format("parameters[\"{}\"]", key);
        const auto value = volume.parameters.find(std::string(key));
        if (value == volume.parameters.end()) check.fail(field, "is missing", takes);
        check.number(field, value->second, parameter_range(key));
        if (key == "angle_deg" && value->second == 180.0)
            check.fail(field, "= 180 has no edge", "give an angle in (0, 180) or (180, 360)");
    }
    if (volume.analytic == "torus" &&
        volume.parameters.at("tube_mm") >= volume.parameters.at("radius_mm"))
        check.fail("parameters[\"tube_mm\"]",
                   fmt::format("= {} is out of range", volume.parameters.at("tube_mm")),
                   fmt::format("give a number in (0, {}), below radius_mm",
                               volume.parameters.at("radius_mm")));
}

void check_friction_of(const FieldCheck& check, const MaterialDescription& material) {
    if (material.static_mu) check.number("static_mu", *material.static_mu, kCoefficient);
    if (material.dynamic_mu) check.number("dynamic_mu", *material.dynamic_mu, kCoefficient);
    if (material.dynamic_mu && *material.dynamic_mu > material.static_mu.value_or(0.0))
        check.fail("dynamic_mu", fmt::format("= {} is above static_mu", *material.dynamic_mu),
                   "give at most as much friction while sliding as at rest");
}

/// What is made of a volume before it is felt.
void check_volume_part(const FieldCheck& check, const SceneDescription& scene,
                       const SurfaceDescription& surface) {
    check.name("volume", surface.volume, scene.volumes, "volumes");
    const VolumeDescription& volume = scene.volumes.at(surface.volume);
    if (is_of_vectors(volume))
        check.fail("volume", fmt::format("= \"{}\" is {}", surface.volume, kind_in_words(volume)),
                   "name a volume of scalars");
    if (surface.labels.empty() && is_of_labels(volume))
        check.fail(
            "iso_value",
            fmt::format("is of the label volume \"{}\", whose values are names", surface.volume),
            volume.label_volume ? "give labels" : "give labels, or remove labels from the volume");
    if (!surface.labels.empty() && volume.voxels)
        check.fail("labels", fmt::format("is of the voxels of volume \"{}\"", surface.volume),
                   "give the volume's data as label_volume, or an iso_value instead of labels");
    if (iso_rule_of(surface) == SurfaceDescription::IsoAfterSmoothing::keep_volume &&
        surface.labels.empty())
        check.fail("iso_after_smoothing", "= keep_volume is for labels",
                   "give keep_position or as_given");
    if (!is_exact(volume)) return;
    // A formula is exact and in one piece: there is nothing to smooth and nothing to drop.
    const auto refuse = [&](std::string_view field) {
        check.fail(field,
                   fmt::format("does not go with the {} volume \"{}\"",
                               volume.scalar_field ? "scalar_field of" : "analytic",
                               surface.volume),
                   fmt::format("leave {} as it is by default", field));
    };
    if (!surface.labels.empty()) refuse("labels");
    if (smoothing_of(surface) > 0.0) refuse("smooth_voxels");
    if (surface.keep.kind != ComponentPolicy::Kind::all) refuse("keep");
    if (surface.region_mm) refuse("region_mm");
}

/// What a volume is made into before it is felt says nothing of a mesh alone.
void refuse_volume_part(const FieldCheck& check, const SurfaceDescription& surface) {
    const auto refuse = [&](std::string_view field) {
        check.fail(field, "is of a volume, and the surface is a mesh alone",
                   fmt::format("give volume, or leave {} as it is by default", field));
    };
    if (!surface.labels.empty()) refuse("labels");
    if (surface.iso_value != 0.0) refuse("iso_value");
    if (surface.region_mm) refuse("region_mm");
    if (surface.smooth_voxels) refuse("smooth_voxels");
    if (surface.iso_after_smoothing) refuse("iso_after_smoothing");
    if (surface.keep.kind != ComponentPolicy::Kind::all) refuse("keep");
}

void check_region(const FieldCheck& check, const Box& region) {
    check.triple("region_mm.lower", region.lower, kFiniteRange);
    check.triple("region_mm.upper", region.upper, kFiniteRange);
    const Vec3 extent = region.extent();
    if (!(extent.x > 0.0 && extent.y > 0.0 && extent.z > 0.0))
        check.fail("region_mm", "has no volume", "give two opposite corners");
}

void check_softness(const FieldCheck& check, const Softness& softness) {
    softness.check(check.path("softness"));
    check.number("softness.damping", softness.damping, kPressDamping);
    for (std::size_t i = 0; i < softness.count; ++i) {
        const std::string knot = fmt::format("softness.knots[{}].", i);
        check.number(knot + "press_m", softness.knots[i].press_m, scaled(kPressMm, 1e-3));
        check.number(knot + "force_n", softness.knots[i].force_n, kPressN);
    }
}

/// Whether a surface is made of nothing but what lies beneath another one.
bool is_of_lumps_alone(const SurfaceDescription& surface, const SurfaceDescription& above) {
    return std::all_of(surface.labels.begin(), surface.labels.end(),
                       [&](const std::string& label) { return above.beneath.contains(label); });
}

void check_beneath(const FieldCheck& check, const SceneDescription& scene,
                   const SurfaceDescription& surface) {
    check.number("contact_radius_mm", surface.contact_radius_mm, kContactRadiusMm);
    if (surface.beneath.empty()) return;
    if (surface.labels.empty())
        check.fail("beneath", "is of labels, and the surface is not made of any",
                   "make it of labels: of all that it wraps, the lumps, too");
    if (surface.softness.none())
        check.fail("beneath", "is felt through what is soft, and the surface is hard",
                   "say how soft it is, as stiffness_n_per_mm = 0.2");
    if (std::isfinite(surface.strength_n) || !surface.strength_volume.empty())
        check.fail("beneath", "does not go with a strength_n",
                   "leave one of both out, or let a table of stiffness_mm_n end flat");
    if (surface.moves)
        check.fail("beneath", "does not go with a surface that moves", "leave one of both out");
    if (is_of_lumps_alone(surface, surface))
        check.fail("beneath", "has all labels of the surface, and none is the tissue around them",
                   "leave out the label that the lumps lie in: its stiffness is the surface's");
    for (const auto& [label, ratio] : surface.beneath) {
        check.number(fmt::format("beneath[\"{}\"]", label), ratio, kModulusRatio);
        for (const auto& [name, other] : scene.surfaces)
            if (!other.softness.none() && other.volume == surface.volume &&
                is_of_lumps_alone(other, surface) &&
                std::find(other.labels.begin(), other.labels.end(), label) != other.labels.end())
                check.fail(
                    fmt::format("beneath[\"{}\"]", label),
                    fmt::format("is soft surface \"{}\" as well: it would count twice", name),
                    "let it be beneath, or a surface of its own");
    }
}

void check_strength(const FieldCheck& check, const SceneDescription& scene,
                    const SurfaceDescription& surface) {
    check.number("strength_n", surface.strength_n, kHoldingN);
    if (surface.strength_volume.empty()) return;
    check.name("strength_volume", surface.strength_volume, scene.volumes, "volumes");
    check_scalars(check, "strength_volume", scene, surface.strength_volume);
    Range range = kHoldingN;
    range.or_infinite = false;
    range.ends = Range::Ends::low_open; // at 0 N there would be no surface
    check.function("strength_over_value", surface.strength_over_value, range);
}

} // namespace

void check_scalars(const FieldCheck& check, std::string_view field, const SceneDescription& scene,
                   const std::string& volume) {
    const VolumeDescription& description = scene.volumes.at(volume);
    if (is_of_vectors(description))
        check.fail(field, fmt::format("= \"{}\" is {}", volume, kind_in_words(description)),
                   "name a volume of scalars");
    if (is_of_labels(description))
        check.fail(field,
                   fmt::format("= \"{}\" is a label volume, whose values are names and not to be "
                               "interpolated",
                               volume),
                   description.label_volume
                       ? "make surfaces of its labels and give each a material"
                       : "make surfaces of its labels and give each a material, or remove labels "
                         "from the volume");
}

void check_volume(const FieldCheck& check, const VolumeDescription& volume) {
    check.choice("selection.slices", volume.selection.slices, VolumeSelection::Slices::repair);
    check.choice("selection.nifti_transform", volume.selection.nifti_transform,
                 VolumeSelection::NiftiTransform::qform);
    check_volume_source(check, volume);
    if (!volume.analytic.empty()) check_formula(check, volume);
}

void check_material(const FieldCheck& check, const MaterialDescription& material) {
    check.function("strength", material.strength, kHoldingN);
    check.choice("yielding", material.yielding, Yielding::opens);
    check_softness(check, material.softness);
    if (material.contact_radius_mm)
        check.number("contact_radius_mm", *material.contact_radius_mm, kContactRadiusMm);
    check_friction_of(check, material);
    if (material.damping_n_s_per_m)
        check.number("damping_n_s_per_m", *material.damping_n_s_per_m, kDamping);
    const TextureWaves& waves = material.texture;
    if (waves.wavelength_m)
        check.number("texture.wavelength_m", *waves.wavelength_m, scaled(kWavelengthMm, 1e-3));
    if (waves.height_m) check.number("texture.height_m", *waves.height_m, scaled(kHeightMm, 1e-3));
    if (waves.height_m && waves.wavelength_m &&
        *waves.height_m > SurfaceTexture::kHighestOfWave * *waves.wavelength_m)
        check.fail("texture.height_m",
                   fmt::format("= {} is above wavelength_m / (2 pi)", *waves.height_m),
                   "lower the height, or take a longer wavelength");
}

void check_surface(const FieldCheck& check, const SceneDescription& scene,
                   const SurfaceDescription& surface) {
    if (!surface.material.empty())
        check.name("material", surface.material, scene.materials, "materials");
    check.number("iso_value", surface.iso_value, kFiniteRange);
    check.number("smooth_voxels", smoothing_of(surface), kSmoothingVoxels);
    check.choice("iso_after_smoothing", iso_rule_of(surface),
                 SurfaceDescription::IsoAfterSmoothing::as_given);
    check.choice("keep.kind", surface.keep.kind, ComponentPolicy::Kind::volume);
    if (surface.keep.kind == ComponentPolicy::Kind::count && surface.keep.count < 1)
        check.fail("keep.count", "= 0 keeps nothing", "give 1 or more");
    if (surface.keep.kind == ComponentPolicy::Kind::volume)
        check.number("keep.volume_mm3", surface.keep.volume_mm3, kNotNegative);
    check.choice("yielding", surface.yielding, Yielding::opens);
    check.choice("mesh_file.frame", surface.mesh_file.frame, MeshFrame::ras);
    check.choice("mesh_file.unit", surface.mesh_file.unit, MeshUnit::metre);
    if (surface.region_mm) check_region(check, *surface.region_mm);
    if (surface.leash_mm) check.number("leash_mm", *surface.leash_mm, kLeashMm);
    if (surface.facet_size_mm) check.number("facet_size_mm", *surface.facet_size_mm, kFacetSizeMm);
    if (surface.facet_distance_mm)
        check.number("facet_distance_mm", *surface.facet_distance_mm, kFacetDistanceMm);

    check_mesh_source(check, surface);
    if (surface.volume.empty())
        refuse_volume_part(check, surface);
    else
        check_volume_part(check, scene, surface);
    if (surface.contact) {
        check.choice("contact", *surface.contact, ContactKind::direct);
        if (const auto no = obstacle(scene, surface, *surface.contact))
            check.fail("contact", fmt::format("= {} {}", name(*surface.contact), no->what),
                       no->remedy);
    }
    check_strength(check, scene, surface);
    check_softness(check, surface.softness);
    check_beneath(check, scene, surface);
}

} // namespace palpate::internal
