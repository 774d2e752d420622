// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/scene_in_words.h>

#include <cmath>
#include <sstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/baking/in_words.h>
#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_place.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/scene/soft_surfaces.h>
#include <palpate/engine/text/internal/json_text.h>

namespace palpate {
namespace {

/// Those of the plan, and what a loop says of more surfaces than it tells apart.
std::vector<std::string> warnings_of(const Scene& scene) {
    std::vector<std::string> warnings = scene.plan().warnings;
    if (std::string line = felt_warning(scene); !line.empty()) warnings.push_back(std::move(line));
    return warnings;
}

std::string subject(const EffectDescription& effect) {
    return surface_of(effect).empty() ? volume_of(effect) : surface_of(effect);
}

/// Every line two columns further in.
std::string indented(const std::string& lines) {
    std::string text;
    std::istringstream input(lines);
    for (std::string line; std::getline(input, line);)
        text += "  " + line + "\n";
    return text;
}

/// Where the coupling lets less of what lies beneath be felt; empty where it lets all.
std::string cut_in_words(const SceneDescription& scene, const SceneSurface& surface) {
    const BakedStiffness& beneath = surface.baked.stiffness;
    if (!beneath.map) return {};
    const Softness& softness = scene.surfaces.at(surface.name).softness;
    const PressLaw law(softness, scene.coupling.stiffness_n_per_m);
    if (law.is_hard()) return "    nothing of it is felt, as the surface is hard\n";
    const double felt = law.ratio_within(beneath.stiffest);
    if (felt >= beneath.stiffest) return {};
    return fmt::format("    the coupling lets {:+.1f} % of it be felt; {}\n", 100.0 * (felt - 1.0),
                       stiffer_coupling_in_words(softness.steepest() * beneath.stiffest));
}

std::string in_words(const SceneDescription& scene, const SceneSurface& surface) {
    std::string words;
    if (surface.baked.field) words += baked_in_words(surface.baked) + cut_in_words(scene, surface);
    if (surface.mesh.scene) words += mesh_in_words(surface.mesh);
    if (surface.contact == ContactKind::guarded)
        words += fmt::format("leash: the proxy gets no farther than {:.3g} mm from the mesh's\n",
                             1e3 * surface.leash_m);
    return words;
}

/// How soft a surface is felt; null where its scene says nothing of it. Of a law of which no piece
/// is softer than the coupling, is_felt is false.
nlohmann::json softness_as_json(const Scene& scene, const SceneSurface& surface) {
    const SceneDescription& of = scene.description();
    const SurfaceDescription& description = of.surfaces.at(surface.name);
    const Softness& softness = description.softness;
    if (softness.none()) return {};
    const double k = of.coupling.stiffness_n_per_m;
    const PressLaw law(softness, k);
    nlohmann::json points = nlohmann::json::array();
    for (std::size_t i = 0; i < softness.count && softness.count > 1; ++i)
        points.push_back({1e3 * softness.knots[i].press_m, softness.knots[i].force_n});
    const double slope = law.slope(0.0);
    const double limit_n = std::min(of.limits.force_n, description.strength_n);
    const double press_m = law.press_m(limit_n);
    return {{"is_felt", !law.is_hard()},
            {"is_alone", is_soft_and_alone(scene)},
            {"stiffness_n_per_mm", 1e-3 * slope},
            {"tissue_n_per_mm",
             slope < k ? nlohmann::json(1e-3 / (1.0 / slope - 1.0 / k)) : nlohmann::json()},
            {"coupling_n_per_mm", 1e-3 * k},
            {"points_mm_n", points},
            {"press_damping_n_s_per_m", softness.damping},
            {"most_n", limit_n},
            {"most_mm", std::isfinite(press_m) ? nlohmann::json(1e3 * press_m) : nlohmann::json()}};
}

/// What lies beneath a surface, as it is felt; null where its scene names nothing.
nlohmann::json beneath_as_json(const Scene& scene, const SceneSurface& surface) {
    const SurfaceDescription& description = scene.description().surfaces.at(surface.name);
    if (description.beneath.empty()) return {};
    const BakedStiffness& stiffness = surface.baked.stiffness;
    const Vec3 at_mm = 1e3 * stiffness.steepest_at;
    return {{"ratios", description.beneath},
            {"contact_radius_mm", 1e3 * stiffness.contact_radius_m},
            {"asked_contact_radius_mm", 1e3 * stiffness.asked_radius_m},
            {"stiffest", stiffness.stiffest},
            {"softest", stiffness.softest},
            {"steepest_percent_per_mm", 0.1 * stiffness.steepest_per_m},
            {"steepest_at_mm", {at_mm.x, at_mm.y, at_mm.z}}};
}

/// Whether a device is in a frame of its own, which the scene places.
bool is_placed(const DeviceDescription& device) {
    using Kind = DeviceDescription::Kind;
    return device.kind == Kind::hand || device.kind == Kind::hid || device.kind == Kind::plugin ||
           device.kind == Kind::inverse3;
}

std::string placement_of(const DeviceDescription& device) {
    return is_placed(device) ? DevicePlacement(device.placement).in_words()
                             : "in the scene's own frame";
}

nlohmann::json hands_as_json(const SceneDescription& scene) {
    nlohmann::json hands = nlohmann::json::array();
    for (const DeviceDescription& hand : scene.hands)
        hands.push_back(
            {{"name", hand.name}, {"type", device_type(hand)}, {"placement", placement_of(hand)}});
    return hands;
}

/// A line for each of several hands.
std::string hands_in_words(const SceneDescription& scene) {
    std::string text;
    for (const DeviceDescription& hand : scene.hands)
        text += fmt::format("hand {}: {}, {}\n", hand.name, device_type(hand), placement_of(hand));
    if (scene.hands.size() > 1)
        text += "Each hand feels the scene with a loop of its own; the tools do not feel each "
                "other.\n";
    return text;
}

} // namespace

std::string device_type(const DeviceDescription& device) {
    using Kind = DeviceDescription::Kind;
    switch (device.kind) {
    case Kind::none:
        return "none";
    case Kind::path:
        return "path";
    case Kind::orbit:
        return "orbit";
    case Kind::tour:
        return "tour";
    case Kind::recording:
        return "recording";
    case Kind::hand:
        return "hand";
    case Kind::hid:
        return "hid:" + device.address;
    case Kind::inverse3:
        return "inverse3" + device.address;
    case Kind::igtl:
        return "igtl:" + device.address;
    case Kind::plugin:
        break;
    }
    return "plugin:" + device.address;
}

std::string scene_as_json(const Scene& scene, std::span<const double> prices) {
    nlohmann::json effects = nlohmann::json::array();
    for (const PlannedEffect& planned : scene.plan().effects) {
        const EffectDescription& effect = scene.description().effects[planned.effect];
        effects.push_back(
            {{"type", name(effect)},
             {"of", subject(effect)},
             {"on", planned.on},
             {"reason", planned.reason},
             {"contact", planned.contact},
             {"per_evaluation",
              {{"field_samples", planned.samples},
               {"roots", planned.roots},
               {"surface_queries", planned.rays}}},
             {"per_frame", {{"field_samples", planned.start_samples}}},
             {"sharing", planned.sharing},
             {"needs", {{"mesh", planned.needs_mesh}, {"hessian", planned.needs_hessian}}},
             {"price_us", prices[planned.effect]}});
    }
    nlohmann::json surfaces = nlohmann::json::array();
    for (const SceneSurface& surface : scene.surfaces())
        surfaces.push_back(
            {{"name", surface.name},
             {"contact", name(surface.contact)},
             {"softness", softness_as_json(scene, surface)},
             {"beneath", beneath_as_json(scene, surface)},
             {"baked", surface.baked.grid ? nlohmann::json::parse(baked_as_json(surface.baked))
                                          : nlohmann::json()},
             {"mesh", surface.mesh.scene ? nlohmann::json::parse(mesh_as_json(surface.mesh))
                                         : nlohmann::json()}});
    nlohmann::json document = {{"scene", scene.description().file.string()},
                               {"method", name(scene.description().loop.method)},
                               {"effects", effects},
                               {"surfaces", surfaces},
                               {"left_out", scene.plan().left_out},
                               {"uncertified", scene.plan().uncertified},
                               {"warnings", warnings_of(scene)}};
    if (!scene.description().hands.empty()) document["hands"] = hands_as_json(scene.description());
    return internal::json_text(document);
}

std::string scene_in_words(const Scene& scene, std::span<const double> prices) {
    std::string text = fmt::format("{}: method {}\n", place_of_scene(scene.description()),
                                   name(scene.description().loop.method));
    text +=
        fmt::format("{:<3}{:<18}{:<14}{:<5}{:<9}{:>8}{:>9}{:>7}{:>6}{:>11}  {}\n", "", "effect",
                    "of", "", "contact", "samples", "at start", "roots", "rays", "us alone", "why");
    for (const PlannedEffect& planned : scene.plan().effects) {
        const EffectDescription& effect = scene.description().effects[planned.effect];
        text += fmt::format("{:<3}{:<18}{:<14}{:<5}{:<9}{:>8}{:>9}{:>7}{:>6}{:>11.3f}  {}\n",
                            planned.effect + 1, name(effect), subject(effect),
                            planned.on ? "on" : "off", planned.contact, planned.samples,
                            planned.start_samples, planned.roots, planned.rays,
                            prices[planned.effect], planned.reason);
        if (!planned.sharing.empty()) text += "   " + planned.sharing + "\n";
    }
    if (scene.plan().effects.empty())
        text += "no effects: a frame computes nothing but the free motion\n";
    for (const std::string& line : scene.plan().left_out)
        text += "left out: " + line + "\n";
    if (!scene.plan().uncertified.empty())
        text += fmt::format("{}not certified: {}\n",
                            scene.description().loop.method == SteppingMethod::adaptive
                                ? ""
                                : "with --method adaptive ",
                            scene.plan().uncertified);
    for (const std::string& line : warnings_of(scene))
        text += "warning: " + line + "\n";
    for (const SceneSurface& surface : scene.surfaces())
        text += fmt::format("surface {}:\n{}", surface.name,
                            indented(in_words(scene.description(), surface)));
    text += hands_in_words(scene.description());
    return text +
           "Samples, roots and rays are per evaluation, of which a sub-step has at least one; "
           "samples at start are per frame. us alone is an evaluation and its frame's start "
           "without any "
           "sharing, the median measured just now, on this machine; of friction, magnet and "
           "texture what they add to their surface.\n";
}

} // namespace palpate
