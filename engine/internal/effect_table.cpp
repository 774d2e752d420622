// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/internal/scene_tables.h>

#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/contact_choice.h>
#include <palpate/engine/internal/csv_rows.h>
#include <palpate/engine/internal/effect_kinds.h>
#include <palpate/engine/scene_file.h>

namespace palpate::internal {
namespace {

// Spelled in the order of the enumerations.
constexpr auto kEffectNames = [] {
    std::array<std::string_view, kEffectTraits.size()> names;
    for (std::size_t i = 0; i < names.size(); ++i)
        names[i] = kEffectTraits[i].name;
    return names;
}();
constexpr std::array<std::string_view, 3> kGuideNames{"tangent", "midpoint", "streamline"};
constexpr std::array<std::string_view, 3> kEndsNames{"open", "closed", "endless"};
constexpr std::array<std::string_view, 2> kPatternNames{"bumps", "grating"};

/// [[x, y, z], ...] in mm; m.
std::vector<Vec3> read_points(const TomlTable& table, std::string_view key, std::size_t fewest,
                              std::size_t most) {
    const std::string expected = fmt::format(
        "points [[x, y, z], ...] in mm, scene frame (LPS), {} to {} of them", fewest, most);
    table.require(key, "give " + expected);
    const toml::array& rows = table.array(key, expected);
    const auto refuse = [&](const std::string& what) {
        table.fail(table.line_of(key), fmt::format("{} {} {}", key, table.where(), what),
                   "give " + expected);
    };
    if (rows.size() < fewest || rows.size() > most)
        refuse(fmt::format("has {} points", rows.size()));
    std::vector<Vec3> points;
    for (const toml::node& row : rows) {
        const toml::array* numbers = row.as_array();
        if (numbers == nullptr || numbers->size() != 3)
            refuse("has a point of other than three numbers");
        Vec3 point;
        for (int i = 0; i < 3; ++i)
            point[i] =
                1e-3 * table.number_in((*numbers)[static_cast<std::size_t>(i)], key, kPlaceMm);
        points.push_back(point);
    }
    return points;
}

/// A CSV file of points under the key `file`; m, scene frame.
std::vector<Vec3> read_points_file(const std::filesystem::path& file, std::size_t most) {
    CsvRows rows(file, "x_m,y_m,z_m");
    std::vector<Vec3> points;
    for (std::array<double, 3> numbers; rows.next(numbers);) {
        for (const double number : numbers)
            if (!kPlaceMm.contains(1e3 * number))
                rows.fail(fmt::format("{} is not a place in a scene", number),
                          "give metres, scene frame (LPS), finite");
        if (points.size() == most)
            rows.fail(fmt::format("more than {} points", most), "give fewer, farther apart");
        points.emplace_back(numbers[0], numbers[1], numbers[2]);
    }
    if (points.empty()) rows.fail("no rows after the header", "give a row per point");
    return points;
}

/// The volume that an effect samples: of the kind that it needs, as far as that is known before it
/// is read.
std::string read_effect_volume(const TomlTable& table, const SceneDescription& scene,
                               const EffectTraits& traits) {
    const std::string volume = name_in(table, "volume", scene.volumes, "volumes");
    const std::string& formula = scene.volumes.at(volume).analytic;
    const bool needs_vectors = traits.need != FieldNeed::scalar;
    if (!formula.empty() && needs_vectors != (formula == "helix"))
        table.fail(table.line_of("volume"),
                   fmt::format("volume \"{}\" {} is a formula of {}", volume, table.where(),
                               needs_vectors ? "scalars" : "vectors"),
                   needs_vectors ? "name a volume of vectors, or analytic = \"helix\""
                                 : "name a volume of scalars");
    refuse_labels(table, "volume", scene, volume);
    return volume;
}

/// Empty where the surface has none.
MaterialDescription material_of(const SceneDescription& scene, const std::string& surface) {
    const std::string& material = scene.surfaces.at(surface).material;
    return material.empty() ? MaterialDescription{} : scene.materials.at(material);
}

/// What an effect has to say of its strength, damping or height: over its volume, where it has one.
TransferFunction read_effect_function(const TomlTable& table, std::string_view key,
                                      const Range& range, std::string_view unit) {
    table.require(key, fmt::format("give a number of {0} or [[value, {0}], ...]", unit));
    return read_function(table, key, range, unit);
}

/// A function without a volume is of nothing.
void require_volume(const TomlTable& table, std::string_view key, std::string_view unit) {
    if (table.has("volume") || !table.node(key).is_array()) return;
    table.fail(table.line_of(key),
               fmt::format("{} {} is a function, and no volume says of what", key, table.where()),
               fmt::format("name the volume with volume = \"...\", or give a number of {}", unit));
}

/// Over a volume, in a surface, or the same everywhere.
void read_viscosity(const TomlTable& table, const SceneDescription& scene,
                    EffectDescription& effect) {
    constexpr std::string_view key = "damping_n_s_per_m";
    if (table.has("volume") && table.has("surface"))
        table.fail(table.line_of("surface"),
                   fmt::format("volume and surface {} exclude each other", table.where()),
                   "keep one of them");
    if (table.has("volume"))
        effect.volume = read_effect_volume(table, scene, traits_of(effect.kind));
    if (effect.surface.empty()) {
        effect.strength = read_effect_function(table, key, kDamping, "N s/m");
        require_volume(table, key, "N s/m");
        return;
    }
    const SurfaceDescription& surface = scene.surfaces.at(effect.surface);
    if (surface.volume.empty())
        table.fail(
            table.line_of("surface"),
            fmt::format("surface \"{}\" {} is a mesh alone, which has no inside to be viscous",
                        effect.surface, table.where()),
            "name a surface of a volume");
    const std::optional<double> of_material = material_of(scene, effect.surface).damping_n_s_per_m;
    if (!of_material)
        table.require(
            key, surface.material.empty()
                     ? "give it in N s/m, or give the surface a material that has it"
                     : fmt::format("give it in N s/m, here or in [material.{}]", surface.material));
    effect.strength =
        TransferFunction::constant(table.number(key, kDamping, of_material.value_or(0.0)));
}

/// The contact that feels a surface must be one that a texture is felt with.
void check_textured(const TomlTable& table, const SceneDescription& scene,
                    const std::string& surface) {
    const ContactKind contact =
        choose_contact(scene, scene.surfaces.at(surface), Extraction::possible).kind;
    if (feels_texture(contact)) return;
    table.fail(table.line_of("surface"),
               fmt::format("surface \"{}\" {} is felt with contact \"{}\", which has no texture",
                           surface, table.where(), name(contact)),
               "give the surface a volume, and contact = \"volume\" or \"guarded\"");
}

/// A pattern, or a height over the value of a volume.
void read_texture(const TomlTable& table, const SceneDescription& scene,
                  EffectDescription& effect) {
    check_textured(table, scene, effect.surface);
    TextureSettings& texture = effect.texture;
    if (table.has("volume")) {
        for (const std::string_view key : {"pattern", "wavelength_mm", "direction"})
            if (table.has(key))
                table.fail(table.line_of(key),
                           fmt::format("{} {} is of a pattern, and height_mm a function of the "
                                       "volume's value",
                                       key, table.where()),
                           fmt::format("remove {}, or volume", key));
        effect.volume = read_effect_volume(table, scene, traits_of(effect.kind));
        texture.height_over_value = read_effect_function(table, "height_mm", kHeightMm, "mm");
        for (std::size_t i = 0; i < texture.height_over_value.count; ++i)
            texture.height_over_value.nodes[i].strength_n *= 1e-3; // m
        return;
    }
    const TextureWaves waves = read_texture_waves(table, "wavelength_mm", "height_mm",
                                                  material_of(scene, effect.surface).texture);
    if (!waves.height_m)
        table.require("height_mm", "give the height of the crests, as height_mm = 0.1, or give the "
                                   "surface a material with texture_height_mm");
    if (!waves.wavelength_m)
        table.require("wavelength_mm", "give the distance of the crests, as wavelength_mm = 2, or "
                                       "give the surface a material with texture_wavelength_mm");
    texture.height_m = *waves.height_m;
    texture.wavelength_m = *waves.wavelength_m;
    if (table.has("pattern"))
        texture.pattern = static_cast<TexturePattern>(table.choice("pattern", kPatternNames));
    if (texture.pattern != TexturePattern::grating) {
        if (table.has("direction"))
            table.fail(table.line_of("direction"),
                       fmt::format("direction {} is of a grating", table.where()),
                       "remove it, or give pattern = \"grating\"");
        return;
    }
    texture.direction = read_triple(table, "direction", ", across the grooves", kFiniteRange);
    if (!(glm::length(texture.direction) > 0.0))
        table.fail(table.line_of("direction"),
                   fmt::format("direction {} has no length", table.where()),
                   "give the direction across the grooves, as direction = [1, 0, 0]");
}

/// strength_n of what need not have a volume: a number or, with one, a function of its value.
/// Returns the number, or the greatest of the function.
double read_strength_by_place(const TomlTable& table, const SceneDescription& scene,
                              EffectDescription& effect, const Range& range, double fallback) {
    if (!table.has("strength_n") || !table.node("strength_n").is_array()) {
        if (table.has("volume"))
            table.fail(table.line_of("volume"),
                       fmt::format("volume {} is for a strength_n that is a function of its value",
                                   table.where()),
                       "give strength_n = [[value, N], ...], or remove volume");
        return table.number("strength_n", range, fallback);
    }
    require_volume(table, "strength_n", "N");
    effect.volume = read_effect_volume(table, scene, traits_of(effect.kind));
    effect.strength = read_function(table, "strength_n", range, "N");
    return effect.strength.strongest();
}

/// Refuses points of which no polyline can be made.
void check_polyline(const TomlTable& table, const EffectDescription& effect) {
    if (effect.points_m.size() == 1) return;
    try {
        const Polyline curve(effect.points_m, effect.ends);
    } catch (const std::invalid_argument& error) {
        const std::string_view key = effect.points_file.empty() ? "points_mm" : "file";
        table.fail(table.line_of(key), fmt::format("{} {}: {}", key, table.where(), error.what()),
                   "give different points");
    }
}

void read_guide(const TomlTable& table, const SceneDescription& scene, EffectDescription& effect) {
    if (table.has("file") && table.has("points_mm"))
        table.fail(table.line_of("file"),
                   fmt::format("file and points_mm {} exclude each other", table.where()),
                   "keep one of them");
    if (table.has("file")) {
        effect.points_file = existing_file(table, "file", scene.file);
        effect.points_m = read_points_file(effect.points_file, Polyline::kMostPoints);
    } else {
        table.require("points_mm", "give points [[x, y, z], ...] in mm, scene frame (LPS), or name "
                                   "a CSV file of them with file = \"...\"");
        effect.points_m = read_points(table, "points_mm", 1, Polyline::kMostPoints);
    }
    table.require("strength_n", "give the force in N above which the guide lets the proxy slip");
    effect.guide_settings.strength_n = read_strength_by_place(table, scene, effect, kHoldingN, 0.0);
    effect.guide_settings.capture_m =
        1e-3 * table.number("capture_mm", kPositiveOrInfinite, kInfinity);
    if (table.has("ends"))
        effect.ends = static_cast<PolylineEnds>(table.choice("ends", kEndsNames));
    const std::size_t needed = effect.ends == PolylineEnds::closed ? 3 : 2;
    if (table.has("ends") && effect.points_m.size() < needed)
        table.fail(table.line_of("ends"),
                   fmt::format("ends = \"{}\" {} needs {} points", table.text("ends"),
                               table.where(), needed),
                   "give more points, or leave ends out");
    check_polyline(table, effect);
}

void read_workspace(const TomlTable& table, const SceneDescription& scene,
                    EffectDescription& effect) {
    effect.guide_settings.strength_n =
        read_strength_by_place(table, scene, effect, kHoldingN, kInfinity);
    constexpr std::string_view remedy = "give radius_mm with center_mm, or box_mm with two corners";
    for (const std::string_view of_ball : {"radius_mm", "center_mm"})
        if (table.has("box_mm") && table.has(of_ball))
            table.fail(table.line_of(of_ball),
                       fmt::format("{} and box_mm {} exclude each other: a workspace is either a "
                                   "ball or a box",
                                   of_ball, table.where()),
                       remedy);
    if (!table.has("radius_mm") && !table.has("box_mm"))
        table.fail(table.line(),
                   fmt::format("a workspace {} is either a ball or a box", table.where()), remedy);
    if (table.has("radius_mm")) {
        effect.radius_m = 1e-3 * table.number("radius_mm", kRadiusMm, 0.0);
        effect.center_m = 1e-3 * read_triple(table, "center_mm", " in mm", kPlaceMm);
        return;
    }
    for (const Vec3& corner : read_points(table, "box_mm", 2, 2))
        effect.box_m.add(corner);
    const Vec3 extent = effect.box_m.extent();
    if (!(extent.x > 0.0 && extent.y > 0.0 && extent.z > 0.0))
        table.fail(table.line_of("box_mm"), fmt::format("box_mm {} has no volume", table.where()),
                   "give two opposite corners");
}

void read_vibration(const TomlTable& table, EffectDescription& effect) {
    ContactVibrationSettings& v = effect.vibration;
    v.amplitude_n_s_per_m =
        table.number("amplitude_n_s_per_m", kVibrationAmplitude, v.amplitude_n_s_per_m);
    v.frequency_hz = table.number("frequency_hz", kVibrationHz, v.frequency_hz);
    v.decay_s = 1e-3 * table.number("decay_ms", kVibrationDecayMs, 1e3 * v.decay_s);
    v.most_n = table.number("most_n", kVibrationMostN, v.most_n);
}

/// surface = "a" or ["a", "b"]: one effect for each; one without where there is no such key.
std::vector<std::string> surfaces_of(const TomlTable& table, const SceneDescription& scene,
                                     const EffectTraits& traits) {
    if (!table.has("surface") && !traits.of_surface) return {""};
    if (!table.has("surface") || !table.node("surface").is_array())
        return {name_in(table, "surface", scene.surfaces, "surfaces")};
    constexpr std::string_view expected = "a name or names of surfaces, as [\"a\", \"b\"]";
    std::vector<std::string> names;
    for (const toml::node& node : table.array("surface", expected)) {
        const std::optional<std::string> name = node.value_exact<std::string>();
        if (!name) table.fail_type(node, "surface", expected);
        if (!scene.surfaces.contains(*name))
            table.fail(table.line_of("surface"),
                       fmt::format("surface \"{}\" {} does not exist", *name, table.where()),
                       remedy_for_name(*name, names_of(scene.surfaces), "surfaces"));
        names.push_back(*name);
    }
    if (names.empty())
        table.fail(table.line_of("surface"), fmt::format("surface {} names none", table.where()),
                   fmt::format("give {}", expected));
    return names;
}

/// Where an effect's keys and the rest of its table say what it is.
void read_kind(const TomlTable& table, const SceneDescription& scene, EffectDescription& effect) {
    const EffectTraits& traits = traits_of(effect.kind);
    switch (effect.kind) {
    case EffectKind::surface:
        break;
    case EffectKind::friction:
    case EffectKind::stick_slip:
        effect.friction = read_friction(table, material_of(scene, effect.surface));
        effect.friction.stick_slip = effect.kind == EffectKind::stick_slip;
        break;
    case EffectKind::magnet:
        table.require("strength_n", "give the force in N that it takes to pull the proxy off");
        effect.magnet.strength_n = read_strength_by_place(table, scene, effect, kStrengthN, 0.0);
        effect.magnet.capture_m = 1e-3 * table.number("capture_mm", kMagnetCaptureMm, 1.0);
        break;
    case EffectKind::constant_force: {
        const Vec3 force = read_triple(table, "force_n", " in N", kAxisForceN);
        effect.force_n = {force.x, force.y, force.z};
        break;
    }
    case EffectKind::gravity_compensation: {
        table.require("mass_kg", "give the mass of the device's handle in kg");
        effect.mass_kg = table.number("mass_kg", kHandleKg, 0.0);
        effect.down = read_triple(table, "down", ", the direction of gravity", kFiniteRange);
        if (!(glm::length(effect.down) > 0.0))
            table.fail(table.line_of("down"),
                       fmt::format("down {} has no direction", table.where()),
                       "give the direction of gravity, as down = [0, 0, -1]");
        break;
    }
    case EffectKind::viscosity:
        read_viscosity(table, scene, effect);
        break;
    case EffectKind::vector_follow:
    case EffectKind::fibre_follow:
        if (table.has("guide"))
            effect.guide = static_cast<FollowGuide>(table.choice("guide", kGuideNames));
        effect.volume = read_effect_volume(table, scene, traits);
        effect.strength = read_effect_function(table, "strength_n", kHoldingN, "N");
        break;
    case EffectKind::gradient_surface:
    case EffectKind::gradient_force:
    case EffectKind::vector_force:
    case EffectKind::front_shape:
    case EffectKind::vortex:
        effect.volume = read_effect_volume(table, scene, traits);
        effect.strength = read_effect_function(table, "strength_n",
                                               traits.may_be_hard ? kHoldingN : kStrengthN, "N");
        break;
    case EffectKind::guide:
        read_guide(table, scene, effect);
        break;
    case EffectKind::workspace:
        read_workspace(table, scene, effect);
        break;
    case EffectKind::vibration:
        read_vibration(table, effect);
        break;
    case EffectKind::texture:
        read_texture(table, scene, effect);
        break;
    }
}

} // namespace

Vec3 read_triple(const TomlTable& table, std::string_view key, std::string_view unit,
                 const Range& range) {
    const std::string expected = fmt::format("three numbers [x, y, z]{}, scene frame (LPS)", unit);
    table.require(key, "give " + expected);
    const toml::array& numbers = table.array(key, expected);
    if (numbers.size() != 3)
        table.fail(table.line_of(key),
                   fmt::format("{} {} has {} elements", key, table.where(), numbers.size()),
                   "give " + expected);
    Vec3 triple;
    for (int i = 0; i < 3; ++i)
        triple[i] = table.number_in(numbers[static_cast<std::size_t>(i)],
                                    fmt::format("{}[{}]", key, i), range);
    return triple;
}

std::vector<EffectDescription> read_effect_table(const TomlTable& table,
                                                 const SceneDescription& scene) {
    table.require("type", fmt::format("give one of {}", joined(kEffectNames)));
    EffectDescription effect;
    effect.line = table.line();
    effect.kind = static_cast<EffectKind>(table.choice("type", kEffectNames));
    const EffectTraits& traits = traits_of(effect.kind);
    std::vector<std::string_view> keys{"type"};
    for (const std::string_view key : traits.keys)
        if (!key.empty()) keys.push_back(key);
    table.allow_only(keys, fmt::format("with type = \"{}\"", traits.name));

    std::vector<EffectDescription> effects;
    for (const std::string& surface : surfaces_of(table, scene, traits)) {
        effect.surface = surface;
        read_kind(table, scene, effect);
        effects.push_back(effect);
    }
    return effects;
}

} // namespace palpate::internal
