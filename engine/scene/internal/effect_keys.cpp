// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/internal/effect_keys.h>

#include <fmt/format.h>

namespace palpate::internal {

std::string read_moves_with(const EffectTable& from) {
    if (!from.table.has("moves_with")) return {};
    return name_in(from.table, "moves_with", from.scene.surfaces, "surfaces");
}

void check_moves_with(const EffectCheck& check) {
    const EffectDescription& effect = check.scene.effects[check.effect];
    const std::string& body = effect.moves_with;
    if (body.empty()) return;
    const std::string what = fmt::format("= \"{}\"", body);
    if (!can_move(effect))
        check.fields.fail("moves_with", fmt::format("{} is of no use to {}", what, name(effect)),
                          surface_of(effect).empty()
                              ? "leave it out: it is felt wherever the proxy is, or stands still"
                              : "leave it out: what is of a surface moves with that");
    if (!surface_of(effect).empty())
        check.fields.fail("moves_with",
                          fmt::format("{} stands beside surface = \"{}\", with which it moves",
                                      what, surface_of(effect)),
                          "leave it out");
    check.fields.name("moves_with", body, check.scene.surfaces, "surfaces");
    if (!check.scene.surfaces.at(body).moves)
        check.fields.fail("moves_with", what + " is a surface that stands still",
                          "give that surface moves = true, or leave moves_with out");
}

std::string read_effect_volume(const EffectTable& from, FieldNeed need) {
    const TomlTable& table = from.table;
    std::string volume = name_in(table, "volume", from.scene.volumes, "volumes");
    const std::string& formula = from.scene.volumes.at(volume).analytic;
    const bool needs_vectors = need != FieldNeed::scalar;
    if (!formula.empty() && needs_vectors != (formula == "helix"))
        table.fail(table.line_of("volume"),
                   fmt::format("volume \"{}\" {} is a formula of {}", volume, table.where(),
                               needs_vectors ? "scalars" : "vectors"),
                   needs_vectors ? "name a volume of vectors, or analytic = \"helix\""
                                 : "name a volume of scalars");
    refuse_labels(table, "volume", from.scene, volume);
    return volume;
}

TransferFunction read_effect_function(const EffectTable& from, std::string_view key,
                                      const Range& range, std::string_view unit) {
    from.table.require(key, fmt::format("give a number of {0} or [[value, {0}], ...]", unit));
    return read_function(from.table, key, range, unit);
}

void require_volume(const EffectTable& from, std::string_view key, std::string_view unit) {
    const TomlTable& table = from.table;
    if (table.has("volume") || !table.node(key).is_array()) return;
    table.fail(table.line_of(key),
               fmt::format("{} {} is a function, and no volume says of what", key, table.where()),
               fmt::format("name the volume with volume = \"...\", or give a number of {}", unit));
}

StrengthByPlace read_strength_by_place(const EffectTable& from, const Range& range,
                                       double fallback) {
    const TomlTable& table = from.table;
    if (!table.has("strength_n") || !table.node("strength_n").is_array()) {
        if (table.has("volume"))
            table.fail(table.line_of("volume"),
                       fmt::format("volume {} is for a strength_n that is a function of its value",
                                   table.where()),
                       "give strength_n = [[value, N], ...], or remove volume");
        return {table.number("strength_n", range, fallback), "", {}};
    }
    require_volume(from, "strength_n", "N");
    StrengthByPlace read;
    read.volume = read_effect_volume(from, FieldNeed::scalar);
    read.strength = read_function(table, "strength_n", range, "N");
    read.strength_n = read.strength.strongest();
    return read;
}

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

MaterialDescription material_of(const SceneDescription& scene, const std::string& surface) {
    const std::string& material = scene.surfaces.at(surface).material;
    return material.empty() ? MaterialDescription{} : scene.materials.at(material);
}

void check_surface_name(const EffectCheck& check, const std::string& surface) {
    check.fields.name("surface", surface, check.scene.surfaces, "surfaces");
}

void check_field_volume(const EffectCheck& check, FieldNeed need, const std::string& volume) {
    check.fields.name("volume", volume, check.scene.volumes, "volumes");
    const VolumeDescription& description = check.scene.volumes.at(volume);
    if (need == FieldNeed::scalar) {
        check_scalars(check.fields, "volume", check.scene, volume);
    } else if (is_of_scalars(description)) {
        check.fields.fail("volume",
                          fmt::format("= \"{}\" is {}", volume, kind_in_words(description)),
                          "name a volume of vectors, or analytic = \"helix\"");
    } else if (need == FieldNeed::vector && description.vector_volume &&
               description.vector_volume->kind == VectorVolume::Kind::symmetric_tensor) {
        check.fields.fail(
            "volume", fmt::format("= \"{}\" is of tensors, whose directions have no sign", volume),
            "take fibre_follow, or give vectors");
    }
}

void check_strength_by_place(const EffectCheck& check, const std::string& volume,
                             const TransferFunction& strength, const Range& range) {
    if (volume.empty()) return;
    check_field_volume(check, FieldNeed::scalar, volume);
    Range finite = range;
    finite.or_infinite = false;
    check.fields.function("strength", strength, finite);
}

} // namespace palpate::internal
