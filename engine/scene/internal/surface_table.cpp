// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <charconv>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <system_error>

#include <fmt/format.h>

#include <palpate/engine/scene/contact_choice.h>
#include <palpate/engine/scene/internal/scene_tables.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/tissues.h>

namespace palpate::internal {
namespace {

using IsoAfterSmoothing = SurfaceDescription::IsoAfterSmoothing;

// Spelled in the order of the enumerations.
constexpr std::array<std::string_view, 4> kContactNames{"mesh", "volume", "guarded", "direct"};
constexpr std::array<std::string_view, 3> kIsoNames{"keep_position", "keep_volume", "as_given"};
constexpr std::array<std::string_view, 2> kYieldingNames{"holds", "opens"};
constexpr std::array<std::string_view, 2> kMeshFrameNames{"LPS", "RAS"};

/// Refuses each of these keys that is there; the remedy ends in removing it.
void refuse_keys(const TomlTable& table, std::span<const std::string_view> keys,
                 std::string_view what, std::string_view remedy) {
    for (const std::string_view key : keys)
        if (table.has(key))
            table.fail(table.line_of(key), fmt::format("{} {} {}", key, table.where(), what),
                       fmt::format("{}, or remove {}", remedy, key));
}

/// The name of a material of the scene, which has the tissues that its surfaces name.
std::string material_in(const TomlTable& table, const SceneDescription& scene) {
    std::string name = table.text("material");
    if (scene.materials.contains(name)) return name;
    Names valid = names_of(scene.materials);
    for (const Tissue& tissue : tissues())
        if (!scene.materials.contains(std::string(tissue.name))) valid.push_back(tissue.name);
    table.fail(table.line_of("material"),
               fmt::format("material \"{}\" {} does not exist", name, table.where()),
               remedy_for_name(name, valid, "materials and tissues"));
}

// Strengths.

/// [[value, UNIT], ...] under a key.
TransferFunction read_nodes(const TomlTable& table, std::string_view key, const Range& range,
                            std::string_view unit) {
    const std::string expected = fmt::format("a number or [[value, {}], ...] of 1 to {} pairs",
                                             unit, TransferFunction::kCapacity);
    const toml::array& pairs = table.array(key, expected);
    if (pairs.empty() || pairs.size() > TransferFunction::kCapacity)
        table.fail(table.line_of(key),
                   fmt::format("{} {} has {} nodes", key, table.where(), pairs.size()),
                   "give " + expected);
    TransferFunction function;
    for (const toml::node& pair : pairs) {
        const std::string label = fmt::format("{}[{}]", key, function.count);
        const toml::array* numbers = pair.as_array();
        if (numbers == nullptr || numbers->size() != 2)
            table.fail(internal::line_of(pair),
                       fmt::format("{} {} is not a pair", label, table.where()),
                       fmt::format("give [value, {}]", unit));
        TransferFunction::Node node;
        node.value = table.number_in((*numbers)[0], label + "[0]", kFiniteRange);
        node.strength_n = table.number_in((*numbers)[1], label + "[1]", range);
        if (function.count > 0 && node.value <= function.nodes[function.count - 1].value)
            table.fail(internal::line_of(pair),
                       fmt::format("{}[0] = {} {} is not above the value before it, {}", label,
                                   node.value, table.where(),
                                   function.nodes[function.count - 1].value),
                       "give strictly increasing values");
        function.nodes[function.count++] = node;
    }
    return function;
}

constexpr std::string_view kKeepRemedy = "give \"all\", \"largest\", a number of components >= 1, "
                                         "or a smallest volume in mm3 as \">50\"";

/// The whole text as a number; nothing when it is none.
template <class Number>
std::optional<Number> number_from(std::string_view text) {
    Number number{};
    const char* const text_end = text.data() + text.size();
    const auto [end, error] = std::from_chars(text.data(), text_end, number);
    return error == std::errc() && end == text_end ? std::optional(number) : std::nullopt;
}

/// Nothing when the text is no policy.
std::optional<ComponentPolicy> keep_from(std::string_view text) {
    using Kind = ComponentPolicy::Kind;
    ComponentPolicy keep;
    if (text == "all") return keep;
    if (text == "largest") {
        keep.kind = Kind::largest;
        return keep;
    }
    if (text.starts_with('>')) {
        const auto volume_mm3 = number_from<double>(text.substr(1));
        if (!volume_mm3 || !kNotNegative.contains(*volume_mm3)) return std::nullopt;
        keep.kind = Kind::volume;
        keep.volume_mm3 = *volume_mm3;
        return keep;
    }
    const auto count = number_from<std::size_t>(text);
    if (!count || *count < 1) return std::nullopt;
    keep.kind = Kind::count;
    keep.count = *count;
    return keep;
}

ComponentPolicy read_keep(const TomlTable& table) {
    if (!table.has("keep")) return {};
    const toml::node& node = table.node("keep");
    const bool integer = node.is_integer();
    if (!integer && !node.is_string())
        table.fail(table.line_of("keep"),
                   fmt::format("keep {} is neither text nor an integer", table.where()),
                   kKeepRemedy);
    const std::string text =
        integer ? std::to_string(node.as_integer()->get()) : node.as_string()->get();
    const std::optional<ComponentPolicy> keep = keep_from(text);
    // A number of components in quotes is a text that is not known.
    if (!keep || (keep->kind == ComponentPolicy::Kind::count) != integer)
        table.fail(table.line_of("keep"),
                   fmt::format("keep = {} {} is not allowed",
                               integer ? text : fmt::format("\"{}\"", text), table.where()),
                   kKeepRemedy);
    return *keep;
}

/// A formula is exact and in one piece: there is nothing to smooth and nothing to drop.
void refuse_filters(const TomlTable& table, const SurfaceDescription& surface) {
    const auto refuse = [&](std::string_view key) {
        table.fail(table.line_of(key),
                   fmt::format("{} {} does not go with the analytic volume \"{}\"", key,
                               table.where(), surface.volume),
                   fmt::format("remove {}", key));
    };
    if (smoothing_of(surface) > 0.0) refuse("smooth_voxels");
    if (surface.keep.kind != ComponentPolicy::Kind::all) refuse("keep");
    if (surface.region_mm) refuse("region_mm");
}

/// label = "Hippocampus_L", 37, or a list of such.
std::vector<std::string> read_labels(const TomlTable& table) {
    constexpr std::string_view expected = "a label's name or number, or a list of them";
    const auto one = [&](const toml::node& node) -> std::string {
        if (node.is_integer()) return std::to_string(node.as_integer()->get());
        if (!node.is_string() || node.as_string()->get().empty())
            table.fail_type(node, "label", expected);
        return node.as_string()->get();
    };
    const toml::node& node = table.node("label");
    if (!node.is_array()) return {one(node)};
    std::vector<std::string> labels;
    for (const toml::node& element : *node.as_array())
        labels.push_back(one(element));
    if (labels.empty())
        table.fail(table.line_of("label"), fmt::format("label {} is empty", table.where()),
                   fmt::format("give {}", expected));
    return labels;
}

/// region_mm = [[x, y, z], [x, y, z]], two opposite corners.
Box read_region(const TomlTable& table) {
    constexpr std::string_view expected =
        "two opposite corners [[x, y, z], [x, y, z]] in mm, scene frame (LPS)";
    const toml::array& corners = table.array("region_mm", expected);
    const auto refuse = [&](std::string_view what) {
        table.fail(table.line_of("region_mm"), fmt::format("region_mm {} {}", table.where(), what),
                   fmt::format("give {}", expected));
    };
    if (corners.size() != 2) refuse("is not a pair of corners");
    Box region;
    for (const toml::node& corner : corners) {
        const toml::array* numbers = corner.as_array();
        if (numbers == nullptr || numbers->size() != 3)
            refuse("has a corner of other than three numbers");
        Vec3 point;
        for (int axis = 0; axis < 3; ++axis)
            point[axis] = table.number_in((*numbers)[static_cast<std::size_t>(axis)], "region_mm",
                                          kFiniteRange);
        region.add(point);
    }
    const Vec3 extent = region.extent();
    if (!(extent.x > 0.0 && extent.y > 0.0 && extent.z > 0.0)) refuse("has no volume");
    return region;
}

/// What is taken from the volume: a level, or labels; and which part of it.
void read_source(const TomlTable& table, const SceneDescription& scene, bool analytic,
                 SurfaceDescription& surface) {
    if (table.has("label") && table.has("iso_value"))
        table.fail(table.line_of("label"),
                   fmt::format("label and iso_value {} exclude each other", table.where()),
                   "keep one of them");
    if (table.has("label")) {
        if (analytic)
            table.fail(table.line_of("label"),
                       fmt::format("label {} does not go with the analytic volume \"{}\"",
                                   table.where(), surface.volume),
                       "name a label volume, or take iso_value");
        surface.labels = read_labels(table);
    } else if (!is_exact(scene.volumes.at(surface.volume))) {
        table.require("iso_value", "give the level of the surface in the volume's unit, or the "
                                   "name of a label with label = \"...\"");
        if (!scene.volumes.at(surface.volume).labels.empty())
            table.fail(table.line_of("iso_value"),
                       fmt::format("iso_value {} is of the label volume \"{}\", whose values are "
                                   "names",
                                   table.where(), surface.volume),
                       "give label = \"...\", or remove labels from the volume");
    }
    surface.iso_value = table.number("iso_value", kFiniteRange, 0.0);
    if (table.has("region_mm")) surface.region_mm = read_region(table);
}

IsoAfterSmoothing read_iso_after_smoothing(const TomlTable& table,
                                           const SurfaceDescription& surface) {
    const auto chosen =
        static_cast<IsoAfterSmoothing>(table.choice("iso_after_smoothing", kIsoNames));
    if (chosen == IsoAfterSmoothing::keep_volume && surface.labels.empty())
        table.fail(
            table.line_of("iso_after_smoothing"),
            fmt::format("iso_after_smoothing = \"keep_volume\" {} is for labels", table.where()),
            "give \"keep_position\" or \"as_given\"");
    return chosen;
}

// Meshes and contact.

/// All are told: "cm" is near to both names, and means neither.
MeshUnit read_mesh_unit(const TomlTable& table) {
    const std::string unit = table.text("mesh_unit");
    if (unit == "mm") return MeshUnit::millimetre;
    if (unit == "m") return MeshUnit::metre;
    table.fail(table.line_of("mesh_unit"),
               fmt::format("unknown mesh_unit = \"{}\" {}", unit, table.where()),
               "known are \"mm\" and \"m\"; convert the mesh to one of them");
}

/// mesh = "bone.ply", and what it is to be read as; or a mesh in memory.
void read_mesh_source(const TomlTable& table, const SceneDescription& scene,
                      const std::shared_ptr<const TriangleMesh>* in_memory,
                      SurfaceDescription& surface) {
    if (in_memory != nullptr) {
        constexpr std::array<std::string_view, 3> of_file{"mesh", "mesh_unit", "mesh_frame"};
        refuse_keys(table, of_file, "is of a mesh file, and the mesh is in memory",
                    "leave the mesh in memory out");
        surface.triangle_mesh = *in_memory;
    } else if (!table.has("mesh")) {
        constexpr std::array<std::string_view, 2> of_mesh{"mesh_unit", "mesh_frame"};
        refuse_keys(table, of_mesh, "is of a mesh file, and there is none",
                    "name it with mesh = \"...\"");
        return;
    }
    constexpr std::array<std::string_view, 2> of_extraction{"facet_size_mm", "facet_distance_mm"};
    refuse_keys(table, of_extraction, "does not go with mesh, which is taken as it is",
                "leave mesh out");
    if (in_memory != nullptr) return;
    surface.mesh = existing_file(table, "mesh", scene.file);
    if (table.has("mesh_unit")) surface.mesh_file.unit = read_mesh_unit(table);
    if (table.has("mesh_frame"))
        surface.mesh_file.frame =
            table.choice("mesh_frame", kMeshFrameNames) == 0 ? MeshFrame::lps : MeshFrame::ras;
}

/// What is made of a volume before it is felt.
void read_volume_part(const TomlTable& table, const SceneDescription& scene,
                      SurfaceDescription& surface) {
    surface.volume = name_in(table, "volume", scene.volumes, "volumes");
    const std::string& formula = scene.volumes.at(surface.volume).analytic;
    const bool analytic = !formula.empty();
    if (formula == "helix")
        table.fail(
            table.line_of("volume"),
            fmt::format("volume \"{}\" {} is a formula of vectors", surface.volume, table.where()),
            "name a volume of scalars");
    read_source(table, scene, analytic, surface);
    if (table.has("smooth_voxels"))
        surface.smooth_voxels = table.number("smooth_voxels", kSmoothingVoxels, 0.0);
    if (table.has("iso_after_smoothing"))
        surface.iso_after_smoothing = read_iso_after_smoothing(table, surface);
    surface.keep = read_keep(table);
    if (analytic) refuse_filters(table, surface);
}

void refuse_volume_part(const TomlTable& table) {
    constexpr std::array<std::string_view, 6> of_volume{
        "iso_value", "label", "region_mm", "smooth_voxels", "iso_after_smoothing", "keep"};
    refuse_keys(table, of_volume, "is of a volume, and the surface is a mesh alone",
                "name the volume with volume = \"...\"");
}

/// Of the table, or of the material: a number, or a function of the value of strength_volume at the
/// proxy. Without one, a function is its value at the surface's own level: there the proxy is.
void read_surface_strength(const TomlTable& table, const SceneDescription& scene,
                           SurfaceDescription& surface) {
    TransferFunction strength = read_function(table, "strength_n", kHoldingN, "N");
    int line = table.line_of("strength_n");
    std::string where = table.where();
    if (!table.has("strength_n") && !surface.material.empty()) {
        const MaterialDescription& material = scene.materials.at(surface.material);
        strength = material.strength;
        line = material.strength_line;
        where = fmt::format("in [material.{}], used {},", surface.material, table.where());
    }
    const bool is_function = strength.count > 1;
    if (!table.has("strength_volume")) {
        if (is_function && (surface.volume.empty() || !surface.labels.empty()))
            table.fail(line,
                       fmt::format("strength_n {} is a function of a volume's value, and {}", where,
                                   surface.volume.empty() ? "the surface is a mesh alone"
                                                          : "a label has none"),
                       "name the volume with strength_volume = \"...\", or give a number of N");
        surface.strength_n = strength(surface.iso_value);
        return;
    }
    surface.strength_volume = name_in(table, "strength_volume", scene.volumes, "volumes");
    if (scene.volumes.at(surface.strength_volume).analytic == "helix")
        table.fail(table.line_of("strength_volume"),
                   fmt::format("strength_volume \"{}\" {} is a formula of vectors",
                               surface.strength_volume, table.where()),
                   "name a volume of scalars");
    refuse_labels(table, "strength_volume", scene, surface.strength_volume);
    if (!is_function)
        table.fail(table.line_of("strength_volume"),
                   fmt::format("strength_volume {} is for a strength_n that is a function of its "
                               "value",
                               table.where()),
                   "give strength_n = [[value, N], [value, N], ...], or remove strength_volume");
    for (std::size_t i = 0; i < strength.count; ++i)
        if (!(strength.nodes[i].strength_n > 0.0))
            table.fail(line,
                       fmt::format("strength_n {} is 0 N at the value {}, where there would be no "
                                   "surface",
                                   where, strength.nodes[i].value),
                       "give a strength above 0, as 0.001");
    surface.strength_over_value = strength;
    surface.strength_n = strength.strongest();
}

void read_contact(const TomlTable& table, const SceneDescription& scene,
                  SurfaceDescription& surface) {
    if (table.has("contact")) {
        surface.contact = static_cast<ContactKind>(table.choice("contact", kContactNames));
        if (const auto no = obstacle(scene, surface, *surface.contact))
            table.fail(table.line_of("contact"),
                       fmt::format("contact = \"{}\" {} {}", name(*surface.contact), table.where(),
                                   no->what),
                       no->remedy);
    }
    // Where the scene does not say, a build with CGAL decides: the leash is for all of them.
    const ContactKind kind = choose_contact(scene, surface, Extraction::possible).kind;
    constexpr std::array<std::string_view, 1> of_guard{"leash_mm"};
    constexpr std::array<std::string_view, 1> of_strength{"yield"};
    if (kind != ContactKind::guarded)
        refuse_keys(table, of_guard, fmt::format("does not go with contact \"{}\"", name(kind)),
                    "take contact = \"guarded\"");
    if (kind == ContactKind::direct)
        refuse_keys(table, of_strength, "does not go with contact \"direct\", which never yields",
                    "take another contact");
    if (table.has("leash_mm")) surface.leash_mm = table.number("leash_mm", kLeashMm, 0.0);
    if (table.has("yield")) surface.yielding = read_yielding(table);
}

} // namespace

Yielding read_yielding(const TomlTable& table) {
    return static_cast<Yielding>(table.choice("yield", kYieldingNames));
}

TransferFunction read_function(const TomlTable& table, std::string_view key, const Range& range,
                               std::string_view unit) {
    if (table.has(key) && table.node(key).is_array()) {
        Range finite = range;
        finite.or_infinite = false;
        return read_nodes(table, key, finite, unit);
    }
    return TransferFunction::constant(table.number(key, range, kInfinity));
}

void refuse_labels(const TomlTable& table, std::string_view key, const SceneDescription& scene,
                   const std::string& volume) {
    if (scene.volumes.at(volume).labels.empty()) return;
    table.fail(table.line_of(key),
               fmt::format("{} \"{}\" {} is a label volume, whose values are names and not to be "
                           "interpolated",
                           key, volume, table.where()),
               "make surfaces of its labels with label = \"...\" and a material each, or remove "
               "labels from the volume");
}

SurfaceDescription read_surface_table(const TomlTable& table, const SceneDescription& scene,
                                      const std::shared_ptr<const TriangleMesh>* mesh) {
    constexpr std::array<std::string_view, 25> keys{"material",
                                                    "volume",
                                                    "iso_value",
                                                    "label",
                                                    "region_mm",
                                                    "smooth_voxels",
                                                    "iso_after_smoothing",
                                                    "keep",
                                                    "mesh",
                                                    "mesh_unit",
                                                    "mesh_frame",
                                                    "contact",
                                                    "leash_mm",
                                                    "strength_n",
                                                    "strength_volume",
                                                    "yield",
                                                    "facet_size_mm",
                                                    "facet_distance_mm",
                                                    "moves",
                                                    "beneath",
                                                    kSoftnessKeys[0],
                                                    kSoftnessKeys[1],
                                                    kSoftnessKeys[2],
                                                    kSoftnessKeys[3],
                                                    kSoftnessKeys[4]};
    table.allow_only(keys);

    SurfaceDescription surface;
    surface.line = table.line();
    surface.moves = table.boolean("moves", false);
    if (table.has("material")) {
        surface.material = material_in(table, scene);
        surface.yielding = scene.materials.at(surface.material).yielding;
        surface.softness = scene.materials.at(surface.material).softness;
        surface.contact_radius_mm = scene.materials.at(surface.material)
                                        .contact_radius_mm.value_or(surface.contact_radius_mm);
    }
    surface.softness = read_softness(table, surface.softness);
    read_mesh_source(table, scene, mesh, surface);
    if (table.has("volume") || !has_mesh(surface))
        read_volume_part(table, scene, surface);
    else
        refuse_volume_part(table);
    read_beneath(table, surface);
    read_contact(table, scene, surface);
    read_surface_strength(table, scene, surface);
    if (table.has("facet_size_mm"))
        surface.facet_size_mm = table.number("facet_size_mm", kFacetSizeMm, 0.0);
    if (table.has("facet_distance_mm"))
        surface.facet_distance_mm = table.number("facet_distance_mm", kFacetDistanceMm, 0.0);
    return surface;
}

} // namespace palpate::internal

namespace palpate {

ComponentPolicy parse_keep(const std::string& text) {
    const std::optional<ComponentPolicy> keep = internal::keep_from(text);
    if (!keep)
        throw std::invalid_argument(
            fmt::format("keep = \"{}\" is not allowed; {}", text, internal::kKeepRemedy));
    return *keep;
}

std::string_view name(ContactKind kind) noexcept {
    return internal::kContactNames[static_cast<std::size_t>(kind)];
}

} // namespace palpate
