// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <palpate/engine/scene/internal/effect_room.h>
#include <palpate/engine/scene/internal/scene_tables.h>

/// Keys that several kinds of effects have: read, checked and described in one place. All [setup];
/// what reads throws as TomlTable, what checks as FieldCheck.
namespace palpate::internal {

// Descriptions of keys.
inline constexpr SceneKey kSurfaceKey{
    "surface", "", {}, "required", "The surface, or several, as [\"a\", \"b\"]: one effect each."};
inline constexpr SceneKey kScalarsKey{
    "volume", "", {}, "required", "The volume of scalars that is sampled."};
inline constexpr SceneKey kVectorsKey{
    "volume", "", {}, "required", "The volume of vectors that is sampled."};
inline constexpr SceneKey kPlaceVolumeKey{"volume",
                                          "",
                                          {},
                                          "none",
                                          "The volume of scalars whose value the strength depends "
                                          "on, as strength_n = [[value, N], ...]."};

inline constexpr SceneKey kMovesWithKey{"moves_with",
                                        "",
                                        {},
                                        "none: it stands still",
                                        "A surface with moves = true: the effect, with its volume "
                                        "and points, goes along with the surface's body."};

/// The surface under the key `moves_with`; empty where there is no such key.
std::string read_moves_with(const EffectTable& from);
/// That it is a surface that moves, and of an effect that can go along.
void check_moves_with(const EffectCheck& check);

/// The volume under the key `volume`: of the kind that is needed, as far as that is known before it
/// is read.
std::string read_effect_volume(const EffectTable& from, FieldNeed need);
/// What an effect has to say of its strength, damping or height: over its volume, where it has one.
TransferFunction read_effect_function(const EffectTable& from, std::string_view key,
                                      const Range& range, std::string_view unit);
/// Refuses a function under the key where there is no volume: it would be of nothing.
void require_volume(const EffectTable& from, std::string_view key, std::string_view unit);

/// strength_n of what need not have a volume.
struct StrengthByPlace {
    double strength_n = 0.0;   ///< with a volume the greatest of `strength`
    std::string volume;        ///< empty: the same everywhere
    TransferFunction strength; ///< with a volume: over its value
};
StrengthByPlace read_strength_by_place(const EffectTable& from, const Range& range,
                                       double fallback);

/// [[x, y, z], ...] in mm under a key that must exist; m.
std::vector<Vec3> read_points(const TomlTable& table, std::string_view key, std::size_t fewest,
                              std::size_t most);
/// The material of a surface; empty where it has none.
MaterialDescription material_of(const SceneDescription& scene, const std::string& surface);

// What all kinds have in common that are a strength over a volume's value: members `volume` and
// `strength`, key strength_n.

template <class Settings, const Range& kRange>
Settings read_over_volume(const EffectTable& from) {
    Settings effect;
    effect.volume = read_effect_volume(from, Settings::room.traits.need);
    effect.strength = read_effect_function(from, "strength_n", kRange, "N");
    return effect;
}

template <class Settings, const Range& kRange>
void check_over_volume(const EffectCheck& check, const Settings& effect) {
    check_field_volume(check, Settings::room.traits.need, effect.volume);
    check.fields.function("strength", effect.strength, kRange);
}

inline constexpr const char* kNoStrength = "strength_n is 0 everywhere: it cannot be felt";

template <class Settings>
SampledField field_of_volume(const Settings& effect) {
    return {Settings::room.traits.need, effect.volume, ""};
}

template <class Settings>
std::string order_over_volume(const Settings& effect) {
    return order_text(effect.volume, effect.strength);
}

void check_surface_name(const EffectCheck& check, const std::string& surface);
/// That the volume is there, and of the kind that is needed as far as that is known before it is
/// read.
void check_field_volume(const EffectCheck& check, FieldNeed need, const std::string& volume);
/// Nothing where there is no volume.
void check_strength_by_place(const EffectCheck& check, const std::string& volume,
                             const TransferFunction& strength, const Range& range);

} // namespace palpate::internal
