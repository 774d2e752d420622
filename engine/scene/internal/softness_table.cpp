// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <palpate/engine/scene/internal/scene_tables.h>
#include <palpate/engine/scene/tissues.h>

namespace palpate::internal {
namespace {

/// [[mm, N], ...], from 0 mm and 0 N.
Softness read_pairs(const TomlTable& table) {
    constexpr std::string_view key = "stiffness_mm_n";
    const std::string expected =
        fmt::format("[[mm, N], ...] of 1 to {} pairs", Softness::kCapacity);
    const toml::array& pairs = table.array(key, expected);
    if (pairs.empty() || pairs.size() > Softness::kCapacity)
        table.fail(table.line_of(key),
                   fmt::format("{} {} has {} pairs", key, table.where(), pairs.size()),
                   "give " + expected);
    Softness softness;
    Softness::Knot before;
    for (const toml::node& pair : pairs) {
        const std::string label = fmt::format("{}[{}]", key, softness.count);
        const toml::array* numbers = pair.as_array();
        if (numbers == nullptr || numbers->size() != 2)
            table.fail(line_of(pair), fmt::format("{} {} is not a pair", label, table.where()),
                       "give [mm, N]");
        const Softness::Knot knot{1e-3 * table.number_in((*numbers)[0], label + "[0]", kPressMm),
                                  table.number_in((*numbers)[1], label + "[1]", kPressN)};
        if (!(knot.press_m - before.press_m >= Softness::kLeastRise_m))
            table.fail(
                line_of(pair),
                fmt::format("{}[0] = {} {} is not above the depth before it, {}, by 1 nm or more",
                            label, 1e3 * knot.press_m, table.where(), 1e3 * before.press_m),
                "give depths in mm that rise");
        if (knot.force_n < before.force_n)
            table.fail(line_of(pair),
                       fmt::format("{}[1] = {} {} is below the force before it, {}", label,
                                   knot.force_n, table.where(), before.force_n),
                       "give forces in N that do not fall");
        softness.knots[softness.count++] = before = knot;
    }
    if (!(before.force_n > 0.0))
        table.fail(table.line_of(key), fmt::format("{} {} is 0 N everywhere", key, table.where()),
                   "give a force above 0, or no effect `surface`");
    return softness;
}

} // namespace

void read_beneath(const TomlTable& table, SurfaceDescription& surface) {
    if (table.has("contact_radius_mm"))
        surface.contact_radius_mm = table.number("contact_radius_mm", kContactRadiusMm, 0.0);
    if (!table.has("beneath")) return;
    const int line = table.line_of("beneath");
    const toml::table* lumps = table.node("beneath").as_table();
    if (lumps == nullptr || lumps->empty())
        table.fail(line, fmt::format("beneath {} names no labels", table.where()),
                   "give labels and ratios of moduli, as beneath = { Nodule = 10.0 }");
    if (surface.labels.empty())
        table.fail(line,
                   fmt::format("beneath {} is of labels, and the surface is not made of any",
                               table.where()),
                   "give label = [...] of all that it wraps, the lumps, too");
    if (surface.softness.none())
        table.fail(line,
                   fmt::format("beneath {} is felt through what is soft, and the surface is hard",
                               table.where()),
                   "say how soft it is, as stiffness_n_per_mm = 0.2");
    for (const auto& [label, ratio] : *lumps)
        surface.beneath[std::string(label.str())] =
            table.number_in(ratio, fmt::format("beneath.{}", label.str()), kModulusRatio);
}

Softness read_softness(const TomlTable& table, const Softness& fallback) {
    Softness softness = fallback;
    std::string_view said;
    for (const std::string_view key : {kSoftnessKeys[0], kSoftnessKeys[1], kSoftnessKeys[2]}) {
        if (!table.has(key)) continue;
        if (!said.empty())
            table.fail(table.line_of(key),
                       fmt::format("{} {} does not go with {}", key, table.where(), said),
                       "say in one way how soft it is");
        said = key;
    }
    if (table.has("youngs_kpa"))
        table.require("contact_radius_mm",
                      "say how wide the contact is, as contact_radius_mm = 4 for a fingertip");
    else if (table.has("contact_radius_mm") && !table.has("beneath"))
        table.fail(table.line_of("contact_radius_mm"),
                   fmt::format("contact_radius_mm {} is for youngs_kpa or beneath", table.where()),
                   "give one of these, too, or remove it");
    if (said == "stiffness_n_per_mm") {
        const double n_per_mm = table.number(said, kStiffnessNPerMm, 0.0);
        softness = std::isinf(n_per_mm) ? Softness{} : Softness::linear(1e3 * n_per_mm);
    } else if (said == "stiffness_mm_n") {
        softness = read_pairs(table);
    } else if (said == "youngs_kpa") {
        softness = softness_of_modulus(table.number(said, kYoungsKpa, 0.0),
                                       table.number("contact_radius_mm", kContactRadiusMm, 0.0));
    }
    softness.damping = softness.none() ? 0.0 : fallback.damping;
    if (!table.has("press_damping_n_s_per_m")) return softness;
    if (softness.none())
        table.fail(table.line_of("press_damping_n_s_per_m"),
                   fmt::format("press_damping_n_s_per_m {} is of what is soft", table.where()),
                   "give stiffness_n_per_mm, too, or remove it");
    softness.damping = table.number("press_damping_n_s_per_m", kPressDamping, 0.0);
    return softness;
}

} // namespace palpate::internal
