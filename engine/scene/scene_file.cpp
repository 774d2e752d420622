// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/scene_file.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/scene/internal/scene_tables.h>
#include <palpate/engine/scene/tissues.h>
#include <palpate/engine/scene/validation.h>
#include <palpate/engine/text/text_file.h>

namespace palpate {
namespace {

using internal::TomlTable;

// Spelled in the order of the enumerations.
constexpr std::array<std::string_view, 4> kMethodNames{"single", "paper", "fixed", "adaptive"};

// Coupling, limits, loop.

CouplingDescription read_coupling(const TomlTable& table) {
    constexpr std::array<std::string_view, 2> keys{"stiffness_n_per_m", "damping_n_s_per_m"};
    table.allow_only(keys);
    CouplingDescription coupling;
    coupling.stiffness_n_per_m =
        table.number("stiffness_n_per_m", internal::kCouplingStiffness, coupling.stiffness_n_per_m);
    coupling.damping_n_s_per_m =
        table.number("damping_n_s_per_m", internal::kCouplingDamping, coupling.damping_n_s_per_m);
    return coupling;
}

LimitsDescription read_limits(const TomlTable& table) {
    constexpr std::array<std::string_view, 2> keys{"force_n", "slew_n_per_s"};
    table.allow_only(keys);
    LimitsDescription limits;
    limits.force_n = table.number("force_n", internal::kForceLimitN, limits.force_n);
    limits.slew_n_per_s = table.number("slew_n_per_s", internal::kSlewLimit, limits.slew_n_per_s);
    return limits;
}

LoopDescription read_loop(const TomlTable& table) {
    constexpr std::array<std::string_view, 6> keys{"rate_hz",   "budget_us",    "method",
                                                   "sub_steps", "tolerance_um", "evaluation_cap"};
    table.allow_only(keys);
    LoopDescription loop;
    loop.rate_hz = table.number("rate_hz", internal::kRateHz, loop.rate_hz);
    if (table.has("budget_us"))
        loop.budget_us = table.number("budget_us", internal::budget_range_us(loop.rate_hz), 0.0);
    if (table.has("method"))
        loop.method = static_cast<SteppingMethod>(table.choice("method", kMethodNames));
    loop.sub_steps = table.integer("sub_steps", internal::kSubSteps.low, internal::kSubSteps.high,
                                   loop.sub_steps);
    loop.tolerance_um = table.number("tolerance_um", internal::kToleranceUm, loop.tolerance_um);
    loop.evaluation_cap = table.integer("evaluation_cap", internal::kEvaluationCap.low,
                                        internal::kEvaluationCap.high, loop.evaluation_cap);
    return loop;
}

/// Gives the scene the tissue that a surface names as its material, if the file has no such table.
void add_tissue(const TomlTable& surface, SceneDescription& scene) {
    if (!surface.has("material")) return;
    const std::string name = surface.text("material");
    if (scene.materials.contains(name)) return;
    if (const auto material = tissue_material(name)) scene.materials[name] = *material;
}

// Data in memory.

/// Null where there is none of that name.
template <class Data>
const Data* found(const std::map<std::string, Data>& data, const std::string& name) {
    const auto at = data.find(name);
    return at == data.end() ? nullptr : &at->second;
}

template <class Data, class Description>
void require_tables(const std::string& shown, std::string_view kind, const Data& data,
                    const std::map<std::string, Description>& tables) {
    for (const auto& [name, ignored] : data)
        if (!tables.contains(name))
            throw std::runtime_error(
                fmt::format("{}: data in memory is for [{} \"{}\"], which the scene does not have; "
                            "add [{}.{}]",
                            shown, kind, name, kind, name));
}

} // namespace

std::string_view name(SteppingMethod method) noexcept {
    return kMethodNames[static_cast<std::size_t>(method)];
}

SceneDescription parse_scene(std::string_view text, const std::filesystem::path& file,
                             const SceneData& data) {
    constexpr std::array<std::string_view, 8> keys{"volume",   "material", "surface", "effect",
                                                   "coupling", "limits",   "loop",    "device"};
    const std::string shown = file.empty() ? "scene" : file.string();
    const toml::table document = internal::parse_toml(text, shown);
    const TomlTable top(document, shown, "at the top of the scene", 1);
    top.allow_only(keys);

    SceneDescription scene;
    scene.file = file;
    scene.text = text;
    for (const auto& [name, table] : top.named_tables("volume"))
        scene.volumes[name] = internal::read_volume_table(table, file, found(data.volumes, name));
    for (const auto& [name, table] : top.named_tables("material"))
        scene.materials[name] = internal::read_material_table(table);
    for (const auto& [name, table] : top.named_tables("surface"))
        add_tissue(table, scene);
    for (const auto& [name, table] : top.named_tables("surface"))
        scene.surfaces[name] = internal::read_surface_table(table, scene, found(data.meshes, name));
    for (const TomlTable& table : top.table_list("effect"))
        for (const EffectDescription& effect : internal::read_effect_table(table, scene))
            scene.effects.push_back(effect);
    require_tables(shown, "volume", data.volumes, scene.volumes);
    require_tables(shown, "surface", data.meshes, scene.surfaces);
    if (top.has("coupling")) scene.coupling = read_coupling(top.table("coupling"));
    if (top.has("limits")) scene.limits = read_limits(top.table("limits"));
    if (top.has("loop")) scene.loop = read_loop(top.table("loop"));
    if (top.has("device") && top.node("device").is_array())
        scene.hands = internal::read_hand_tables(top.table_list("device"), scene);
    else if (top.has("device"))
        scene.device = internal::read_device_table(top.table("device"), scene);
    try {
        validate(scene);
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(error.what());
    }
    return scene;
}

SceneDescription parse_scene(std::string_view text, const std::filesystem::path& file) {
    return parse_scene(text, file, {});
}

SceneDescription read_scene(const std::filesystem::path& file) {
    return parse_scene(read_text_file(file, "a scene file (TOML)"), file);
}

} // namespace palpate
