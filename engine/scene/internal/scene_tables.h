// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/engine/scene/internal/scene_ranges.h>
#include <palpate/engine/scene/internal/toml_reader.h>
#include <palpate/engine/scene/scene_description.h>
#include <palpate/haptics/effects/coulomb_friction.h>

/// Parts of a scene file that are read table by table.
namespace palpate::internal {

/// The value of a key that must be the name of something in `map`; `noun` in the plural.
template <class Map>
std::string name_in(const TomlTable& table, std::string_view key, const Map& map,
                    std::string_view noun) {
    table.require(key, std::string(noun) + ": " + (map.empty() ? "none" : joined(names_of(map))));
    std::string name = table.text(key);
    if (!map.contains(name))
        table.fail(table.line_of(key),
                   std::string(key) + " \"" + name + "\" " + table.where() + " does not exist",
                   remedy_for_name(name, names_of(map), noun));
    return name;
}

/// An existing file or folder, relative to the scene's folder.
std::filesystem::path existing_file(const TomlTable& table, std::string_view key,
                                    const std::filesystem::path& scene_file);

/// Three numbers under a key that must exist; `unit` as messages say it: " in mm".
Vec3 read_triple(const TomlTable& table, std::string_view key, std::string_view unit,
                 const Range& range);

/// Under a key: a number within the range or [[value, UNIT], ...] of finite ones; infinite where
/// there is none.
TransferFunction read_function(const TomlTable& table, std::string_view key, const Range& range,
                               std::string_view unit);

/// Refuses the volume that a key names where its values are names of labels: what depends on a
/// value is interpolated, and between two labels are others.
void refuse_labels(const TomlTable& table, std::string_view key, const SceneDescription& scene,
                   const std::string& volume);

/// [volume.NAME]; `data`: what the program has in memory for it, or null.
VolumeDescription read_volume_table(const TomlTable& table, const std::filesystem::path& scene_file,
                                    const VolumeDescription* data);

/// Coefficients under the keys `static` and `dynamic`, each the material's where it is missing, and
/// `dynamic` else as `static`.
FrictionCoefficients read_friction(const TomlTable& table, const MaterialDescription& material);

/// Wavelength and height of a texture under two keys, in mm; what is missing is as in `fallback`.
/// Refuses flanks that are too steep.
TextureWaves read_texture_waves(const TomlTable& table, std::string_view wavelength_key,
                                std::string_view height_key, const TextureWaves& fallback);

/// Keys by which a material or a surface says how soft it is.
inline constexpr std::array<std::string_view, 5> kSoftnessKeys{
    "stiffness_n_per_mm", "stiffness_mm_n", "youngs_kpa", "contact_radius_mm",
    "press_damping_n_s_per_m"};
/// What they say; without them `fallback`.
Softness read_softness(const TomlTable& table, const Softness& fallback);

/// beneath = { Nodule = 10.0 } and the contact_radius_mm of it, of a surface whose softness and
/// labels have been read.
void read_beneath(const TomlTable& table, SurfaceDescription& surface);

/// yield = "holds" or "opens"; the key must exist.
Yielding read_yielding(const TomlTable& table);

/// [material.NAME]
MaterialDescription read_material_table(const TomlTable& table);

/// [surface.NAME]; the scene has its volumes and materials already. `mesh`: what the program has in
/// memory for it, or null.
SurfaceDescription read_surface_table(const TomlTable& table, const SceneDescription& scene,
                                      const std::shared_ptr<const TriangleMesh>* mesh);

/// [[effect]]; the scene has its volumes, materials and surfaces already. One for each surface that
/// it names.
std::vector<EffectDescription> read_effect_table(const TomlTable& table,
                                                 const SceneDescription& scene);

/// [device]; the scene has its surfaces already.
DeviceDescription read_device_table(const TomlTable& table, const SceneDescription& scene);

/// All [[device]], hands with names; the same of the scene.
std::vector<DeviceDescription> read_hand_tables(const std::vector<TomlTable>& tables,
                                                const SceneDescription& scene);

} // namespace palpate::internal
