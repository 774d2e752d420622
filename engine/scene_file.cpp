// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene_file.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <system_error>

#include <fmt/format.h>

#include <palpate/engine/internal/text_file.h>
#include <palpate/engine/internal/toml_reader.h>

namespace palpate {
namespace {

using internal::joined;
using internal::kAnyFinite;
using internal::kInfinity;
using internal::Range;
using internal::remedy_for_name;
using internal::TomlTable;
using Names = std::vector<std::string_view>;

// Spelled in the order of the enumerations.
constexpr std::array<std::string_view, 2> kContactNames{"volume", "direct"};
constexpr std::array<std::string_view, 4> kMethodNames{"single", "paper", "fixed", "adaptive"};
constexpr std::array<std::string_view, 3> kEffectNames{"surface", "gradient_surface",
                                                       "constant_force"};
constexpr std::array<std::string_view, 2> kDeviceNames{"path", "orbit"};
constexpr std::array<std::string_view, 2> kIsoNames{"keep_position", "as_given"};

// What the file format knows beyond this version.
constexpr std::array<std::string_view, 2> kOtherContacts{"mesh", "guarded"};
constexpr std::array<std::string_view, 14> kOtherEffects{
    "friction",     "stick_slip",   "texture",       "vibration", "gradient_force",
    "viscosity",    "vector_force", "vector_follow", "vortex",    "front_shape",
    "fibre_follow", "magnet",       "guide",         "workspace"};
constexpr std::array<std::string_view, 2> kOtherDevices{"recording", "hand"};
constexpr std::array<std::string_view, 1> kOtherFormulas{"helix"};

constexpr Range kStrength{0.0, kInfinity}; // N; infinite: never yields
constexpr Range kFiniteFromZero{0.0, kInfinity, Range::Ends::high_open};
constexpr double kLongestMm =
    1.0e6; // of a formula: 1 km, far beyond any anatomy and far within double

/// A formula with the keys that it takes, all of them required.
struct Formula {
    std::string_view name;
    std::array<std::string_view, 3> keys;
    std::size_t key_count;
};
constexpr std::array<Formula, 6> kFormulas{{
    {"sphere_cavity", {"radius_mm"}, 1},
    {"solid_sphere", {"radius_mm"}, 1},
    {"bumpy_cavity", {"radius_mm", "amplitude_mm", "wavelength_mm"}, 3},
    {"slab", {"thickness_mm"}, 1},
    {"wedge", {"angle_deg"}, 1},
    {"torus", {"radius_mm", "tube_mm"}, 2},
}};

template <class Map>
Names names_of(const Map& map) {
    Names names;
    for (const auto& [name, value] : map)
        names.push_back(name);
    return names;
}

/// The value of a key that must be the name of something in `map`; `noun` in the plural.
template <class Map>
std::string name_in(const TomlTable& table, std::string_view key, const Map& map,
                    std::string_view noun) {
    table.require(key, fmt::format("{}: {}", noun, map.empty() ? "none" : joined(names_of(map))));
    const std::string name = table.text(key);
    if (!map.contains(name))
        table.fail(table.line_of(key),
                   fmt::format("{} \"{}\" {} does not exist", key, name, table.where()),
                   remedy_for_name(name, names_of(map), noun));
    return name;
}

/// An existing file, relative to the scene's folder.
std::filesystem::path existing_file(const TomlTable& table, std::string_view key,
                                    const std::filesystem::path& scene_file) {
    const std::string text = table.text(key);
    const std::filesystem::path file = (scene_file.parent_path() / text).lexically_normal();
    std::error_code ignored;
    if (!std::filesystem::exists(file, ignored))
        table.fail(table.line_of(key),
                   fmt::format("{} = \"{}\" {} does not exist", key, text, table.where()),
                   fmt::format("put it at {} or correct the path", file.string()));
    return file;
}

// Volumes.

double formula_parameter(const TomlTable& table, std::string_view key) {
    constexpr Range length_mm{0.0, kLongestMm, Range::Ends::low_open};
    constexpr Range angle_deg{0.0, 360.0, Range::Ends::open};
    const double value = table.number(key, key == "angle_deg" ? angle_deg : length_mm, 0.0);
    if (key == "angle_deg" && value == 180.0)
        table.fail(table.line_of(key), fmt::format("{} = 180 {} has no edge", key, table.where()),
                   "give an angle in (0, 180) or (180, 360)");
    return value;
}

void read_formula(const TomlTable& table, VolumeDescription& volume) {
    Names names;
    for (const Formula& formula : kFormulas)
        names.push_back(formula.name);
    const Formula& formula = kFormulas[table.choice("analytic", names, kOtherFormulas)];
    const std::span<const std::string_view> parameters(formula.keys.data(), formula.key_count);

    volume.analytic = formula.name;
    Names keys(parameters.begin(), parameters.end());
    const std::string takes = fmt::format("analytic = \"{}\" takes {}", formula.name, joined(keys));
    keys.push_back("analytic");
    table.allow_only(keys, fmt::format("with analytic = \"{}\"", formula.name));
    for (const std::string_view key : parameters) {
        table.require(key, takes);
        volume.parameters[std::string(key)] = formula_parameter(table, key);
    }
    if (volume.analytic == "torus" &&
        volume.parameters.at("tube_mm") >= volume.parameters.at("radius_mm"))
        table.fail(table.line_of("tube_mm"),
                   fmt::format("tube_mm = {} {} is out of range", volume.parameters.at("tube_mm"),
                               table.where()),
                   fmt::format("give a number in (0, {}), below radius_mm",
                               volume.parameters.at("radius_mm")));
}

VolumeDescription read_volume_table(const TomlTable& table,
                                    const std::filesystem::path& scene_file) {
    VolumeDescription volume;
    volume.line = table.line();
    table.refuse_not_in_version("labels", "take a surface by iso_value from a scalar volume");
    if (table.has("file") && table.has("analytic"))
        table.fail(table.line_of("file"),
                   fmt::format("file and analytic {} exclude each other", table.where()),
                   "keep one of them");
    if (table.has("analytic")) {
        read_formula(table, volume);
        return volume;
    }
    constexpr std::array<std::string_view, 2> keys{"file", "analytic"};
    constexpr std::array<std::string_view, 1> file_keys{"file"};
    if (table.has("file"))
        table.allow_only(file_keys, "with file");
    else
        table.allow_only(keys);
    table.require("file", "name a volume file, or a formula with analytic = \"...\"");
    volume.file = existing_file(table, "file", scene_file);
    return volume;
}

// Strengths.

/// [[value, N], ...] under a key.
TransferFunction read_transfer_function(const TomlTable& table, std::string_view key) {
    const std::string expected =
        fmt::format("a number or [[value, N], ...] of 1 to {} pairs", TransferFunction::kCapacity);
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
                       fmt::format("{} {} is not a pair", label, table.where()), "give [value, N]");
        TransferFunction::Node node;
        node.value = table.number_in((*numbers)[0], label + "[0]", kAnyFinite);
        node.strength_n = table.number_in((*numbers)[1], label + "[1]", kFiniteFromZero);
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

TransferFunction read_strength(const TomlTable& table, std::string_view key) {
    if (!table.has(key)) return TransferFunction::constant(kInfinity);
    if (table.node(key).is_array()) return read_transfer_function(table, key);
    return TransferFunction::constant(table.number(key, kStrength, kInfinity));
}

// Surfaces.

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
        if (!volume_mm3 || !kFiniteFromZero.contains(*volume_mm3)) return std::nullopt;
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
    if (surface.smooth_voxels > 0.0) refuse("smooth_voxels");
    if (surface.keep.kind != ComponentPolicy::Kind::all) refuse("keep");
}

SurfaceDescription read_surface(const TomlTable& table, const SceneDescription& scene) {
    constexpr std::array<std::string_view, 9> keys{
        "volume",  "iso_value",  "smooth_voxels", "iso_after_smoothing", "keep",
        "contact", "strength_n", "facet_size_mm", "facet_distance_mm"};
    for (const std::string_view key : {"mesh", "mesh_unit", "mesh_frame"})
        table.refuse_not_in_version(key, "take the surface from a volume: volume and iso_value");
    table.refuse_not_in_version("label", "take the surface from a scalar volume by iso_value");
    table.allow_only(keys);

    SurfaceDescription surface;
    surface.line = table.line();
    surface.volume = name_in(table, "volume", scene.volumes, "volumes");
    const bool analytic = !scene.volumes.at(surface.volume).analytic.empty();
    if (!analytic) table.require("iso_value", "give the level of the surface in the volume's unit");
    surface.iso_value = table.number("iso_value", kAnyFinite, 0.0);
    surface.smooth_voxels = table.number("smooth_voxels", {0.0, 5.0}, surface.smooth_voxels);
    if (table.has("iso_after_smoothing"))
        surface.iso_after_smoothing = static_cast<SurfaceDescription::IsoAfterSmoothing>(
            table.choice("iso_after_smoothing", kIsoNames));
    surface.keep = read_keep(table);
    if (analytic) refuse_filters(table, surface);
    if (table.has("contact"))
        surface.contact =
            static_cast<ContactKind>(table.choice("contact", kContactNames, kOtherContacts));
    // The proxy touches the surface on its level: a function of the value is its value there.
    surface.strength_n = read_strength(table, "strength_n")(surface.iso_value);
    surface.facet_size_mm =
        table.number("facet_size_mm", {0.0, 50.0, Range::Ends::low_open}, surface.facet_size_mm);
    surface.facet_distance_mm = table.number(
        "facet_distance_mm", {0.0, 10.0, Range::Ends::low_open}, surface.facet_distance_mm);
    return surface;
}

// Effects.

std::array<double, 3> read_force(const TomlTable& table) {
    constexpr Range component_n{-1.0e3, 1.0e3}; // as far as limits.force_n goes
    constexpr std::string_view expected = "three numbers [x, y, z] in N, scene frame (LPS)";
    table.require("force_n", fmt::format("give {}", expected));
    const toml::array& numbers = table.array("force_n", expected);
    if (numbers.size() != 3)
        table.fail(table.line_of("force_n"),
                   fmt::format("force_n {} has {} elements", table.where(), numbers.size()),
                   fmt::format("give {}", expected));
    std::array<double, 3> force{};
    for (std::size_t i = 0; i < force.size(); ++i)
        force[i] = table.number_in(numbers[i], fmt::format("force_n[{}]", i), component_n);
    return force;
}

EffectDescription read_effect(const TomlTable& table, const SceneDescription& scene) {
    constexpr std::array<std::string_view, 2> surface_keys{"type", "surface"};
    constexpr std::array<std::string_view, 3> gradient_keys{"type", "volume", "strength_n"};
    constexpr std::array<std::string_view, 2> force_keys{"type", "force_n"};
    table.require("type", fmt::format("give one of {}", joined(kEffectNames)));

    EffectDescription effect;
    effect.line = table.line();
    effect.kind = static_cast<EffectKind>(table.choice("type", kEffectNames, kOtherEffects));
    const std::string context = fmt::format("with type = \"{}\"", name(effect.kind));
    switch (effect.kind) {
    case EffectKind::surface:
        table.allow_only(surface_keys, context);
        effect.surface = name_in(table, "surface", scene.surfaces, "surfaces");
        break;
    case EffectKind::gradient_surface:
        table.allow_only(gradient_keys, context);
        effect.volume = name_in(table, "volume", scene.volumes, "volumes");
        table.require("strength_n", "give a number of N or [[value, N], ...]");
        effect.strength = read_strength(table, "strength_n");
        break;
    case EffectKind::constant_force:
        table.allow_only(force_keys, context);
        effect.force_n = read_force(table);
        break;
    }
    return effect;
}

// Coupling, limits, loop.

CouplingDescription read_coupling(const TomlTable& table) {
    constexpr std::array<std::string_view, 2> keys{"stiffness_n_per_m", "damping_n_s_per_m"};
    table.allow_only(keys);
    CouplingDescription coupling;
    coupling.stiffness_n_per_m = table.number(
        "stiffness_n_per_m", {0.0, 1e5, Range::Ends::low_open}, coupling.stiffness_n_per_m);
    coupling.damping_n_s_per_m =
        table.number("damping_n_s_per_m", {0.0, 1e3}, coupling.damping_n_s_per_m);
    return coupling;
}

LimitsDescription read_limits(const TomlTable& table) {
    constexpr std::array<std::string_view, 2> keys{"force_n", "slew_n_per_s"};
    table.allow_only(keys);
    LimitsDescription limits;
    limits.force_n = table.number("force_n", {0.0, 1e3, Range::Ends::low_open}, limits.force_n);
    limits.slew_n_per_s =
        table.number("slew_n_per_s", {0.0, 1e7, Range::Ends::low_open}, limits.slew_n_per_s);
    return limits;
}

LoopDescription read_loop(const TomlTable& table) {
    constexpr std::array<std::string_view, 6> keys{"rate_hz",   "budget_us",    "method",
                                                   "sub_steps", "tolerance_um", "evaluation_cap"};
    table.allow_only(keys);
    LoopDescription loop;
    loop.rate_hz = table.number("rate_hz", {50.0, 20000.0}, loop.rate_hz);
    const double period_us = 1.0e6 / loop.rate_hz; // rate_hz >= 50
    // The default leaves a tenth of the period to everything else, at any rate.
    loop.budget_us = table.number("budget_us", {0.0, period_us, Range::Ends::low_open},
                                  std::min(loop.budget_us, 0.9 * period_us));
    if (table.has("method"))
        loop.method = static_cast<SteppingMethod>(table.choice("method", kMethodNames));
    loop.sub_steps = table.integer("sub_steps", 1, 4096, loop.sub_steps);
    loop.tolerance_um =
        table.number("tolerance_um", {0.0, 1000.0, Range::Ends::low_open}, loop.tolerance_um);
    loop.evaluation_cap = table.integer("evaluation_cap", 1, 256, loop.evaluation_cap);
    return loop;
}

// Device.

/// The surface an orbit goes around: the named one, or the only one.
std::string orbit_surface(const TomlTable& table, const SceneDescription& scene) {
    if (table.has("surface") || scene.surfaces.size() != 1)
        return name_in(table, "surface", scene.surfaces, "surfaces");
    return scene.surfaces.begin()->first;
}

void read_orbit(const TomlTable& table, const SceneDescription& scene, DeviceDescription& device) {
    constexpr std::array<std::string_view, 7> keys{
        "type", "surface", "speed_m_per_s", "depth_min_mm", "depth_max_mm", "duration_s", "turns"};
    constexpr double deepest_mm = 50.0;
    table.allow_only(keys, "with type = \"orbit\"");
    device.kind = DeviceDescription::Kind::orbit;
    device.surface = orbit_surface(table, scene);
    device.speed_m_per_s =
        table.number("speed_m_per_s", {0.0, 100.0, Range::Ends::low_open}, device.speed_m_per_s);
    device.depth_min_mm = table.number("depth_min_mm", {0.0, deepest_mm}, device.depth_min_mm);
    // Without a depth_max_mm a deeper depth_min_mm takes it along.
    device.depth_max_mm = table.number("depth_max_mm", {device.depth_min_mm, deepest_mm},
                                       std::max(device.depth_min_mm, device.depth_max_mm));
    device.duration_s =
        table.number("duration_s", {0.0, 3600.0, Range::Ends::low_open}, device.duration_s);
    device.turns = table.integer("turns", 1, 500, device.turns);
}

DeviceDescription read_device(const TomlTable& table, const SceneDescription& scene) {
    DeviceDescription device;
    device.line = table.line();
    table.require("type", fmt::format("give one of {}", joined(kDeviceNames)));
    const std::string type = table.text("type");
    if (type.starts_with("hid:"))
        table.fail(
            table.line_of("type"),
            fmt::format("type = \"{}\" {} is not in this version of palpate", type, table.where()),
            fmt::format("it has {}", joined(kDeviceNames)));
    if (kDeviceNames[table.choice("type", kDeviceNames, kOtherDevices)] == "orbit") {
        read_orbit(table, scene, device);
        return device;
    }
    constexpr std::array<std::string_view, 2> keys{"type", "file"};
    table.allow_only(keys, "with type = \"path\"");
    table.require("file", "name a CSV file with the columns t_s,x_m,y_m,z_m");
    device.kind = DeviceDescription::Kind::path;
    device.file = existing_file(table, "file", scene.file);
    return device;
}

} // namespace

ComponentPolicy parse_keep(const std::string& text) {
    const std::optional<ComponentPolicy> keep = keep_from(text);
    if (!keep)
        throw std::invalid_argument(
            fmt::format("keep = \"{}\" is not allowed; {}", text, kKeepRemedy));
    return *keep;
}

std::string_view name(ContactKind kind) noexcept {
    return kContactNames[static_cast<std::size_t>(kind)];
}
std::string_view name(SteppingMethod method) noexcept {
    return kMethodNames[static_cast<std::size_t>(method)];
}
std::string_view name(EffectKind kind) noexcept {
    return kEffectNames[static_cast<std::size_t>(kind)];
}

SceneDescription parse_scene(std::string_view text, const std::filesystem::path& file) {
    constexpr std::array<std::string_view, 7> keys{"volume", "surface", "effect", "coupling",
                                                   "limits", "loop",    "device"};
    const std::string shown = file.empty() ? "scene" : file.string();
    const toml::table document = internal::parse_toml(text, shown);
    const TomlTable top(document, shown, "at the top of the scene", 1);
    top.allow_only(keys);

    SceneDescription scene;
    scene.file = file;
    scene.text = text;
    for (const auto& [name, table] : top.named_tables("volume"))
        scene.volumes[name] = read_volume_table(table, file);
    for (const auto& [name, table] : top.named_tables("surface"))
        scene.surfaces[name] = read_surface(table, scene);
    for (const TomlTable& table : top.table_list("effect"))
        scene.effects.push_back(read_effect(table, scene));
    if (top.has("coupling")) scene.coupling = read_coupling(top.table("coupling"));
    if (top.has("limits")) scene.limits = read_limits(top.table("limits"));
    if (top.has("loop")) scene.loop = read_loop(top.table("loop"));
    if (top.has("device")) scene.device = read_device(top.table("device"), scene);
    return scene;
}

SceneDescription read_scene(const std::filesystem::path& file) {
    return parse_scene(internal::read_text_file(file, "a scene file (TOML)"), file);
}

} // namespace palpate
