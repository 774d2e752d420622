// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/internal/scene_tables.h>

#include <algorithm>
#include <optional>

#include <fmt/format.h>

#include <palpate/engine/scene/internal/effect_keys.h>
#include <palpate/engine/scene/internal/effect_questions.h>

namespace palpate::internal {
namespace {

/// surface = "a" or ["a", "b"]: one effect for each; one without where there is no such key.
std::vector<std::string> surfaces_of(const TomlTable& table, const SceneDescription& scene,
                                     const EffectTraits& traits) {
    if (!table.has("surface") && !traits.part) return {""};
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
        if (std::find(names.begin(), names.end(), *name) != names.end())
            table.fail(table.line_of("surface"),
                       fmt::format("surface {} names \"{}\" twice", table.where(), *name),
                       "name each surface once");
        names.push_back(*name);
    }
    if (names.empty())
        table.fail(table.line_of("surface"), fmt::format("surface {} names none", table.where()),
                   fmt::format("give {}", expected));
    return names;
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
    std::vector<std::string_view> names;
    for (const EffectTraits* traits : all_traits())
        names.push_back(traits->name);
    table.require("type", fmt::format("give one of {}", joined(names)));
    const std::size_t kind = table.choice("type", names);
    const EffectTraits& traits = *all_traits()[kind];
    std::vector<std::string_view> keys{"type"};
    for (const SceneKey& key : traits.keys)
        keys.push_back(key.name);
    table.allow_only(keys, fmt::format("with type = \"{}\"", traits.name));

    std::vector<EffectDescription> effects;
    for (const std::string& surface : surfaces_of(table, scene, traits)) {
        const EffectTable from{table, scene, surface};
        effects.emplace_back().settings = read_settings(kind, from);
        effects.back().line = table.line();
        effects.back().moves_with = read_moves_with(from);
    }
    return effects;
}

} // namespace palpate::internal
