// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include <palpate/engine/scene/scene_description.h>

namespace palpate {

/// Reads a scene (TOML, strict). Relative file paths become relative to the scene file's folder.
/// [setup] Throws std::runtime_error "FILE:LINE: what is wrong; what to do" for a file that cannot
/// be read, TOML syntax, unknown keys (with the nearest valid name), wrong types, values out of
/// range, keys that exclude each other, names or files that do not exist. A surface's strength_n
/// given as [[value, N], ...] is its value at iso_value, where the proxy touches. Without budget_us
/// the budget is 900 us, or 0.9 periods where that is less; a surface of labels is smoothed by one
/// voxel and keeps its volume.
SceneDescription read_scene(const std::filesystem::path& file);

/// The same from text; `file` only names it in messages and anchors relative paths.     [setup]
SceneDescription parse_scene(std::string_view text, const std::filesystem::path& file);

/// What a program has in memory for a scene's text.
struct SceneData {
    std::map<std::string, VolumeDescription> volumes; ///< by NAME of a [volume.NAME] without keys
    std::map<std::string, std::shared_ptr<const TriangleMesh>>
        meshes; ///< by NAME of a [surface.NAME] without mesh = "..."
};

/// The same from text whose volumes and meshes are in part in memory.                   [setup]
/// Throws also where the text has no such table, or where that names a source of its own.
SceneDescription parse_scene(std::string_view text, const std::filesystem::path& file,
                             const SceneData& data);

/// `keep` as scenes and options spell it: "all", "largest", a positive number of components, or
/// ">V" for a smallest volume in mm3. Throws std::invalid_argument that says what is allowed.
/// [setup]
ComponentPolicy parse_keep(const std::string& text);

/// The name of a value as scene files spell it.                                         [any]
std::string_view name(ContactKind kind) noexcept;
std::string_view name(SteppingMethod method) noexcept;

} // namespace palpate
