// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <palpate/engine/scene_description.h>

namespace palpate {

/// Reads a scene (TOML, strict). Relative file paths become relative to the scene file's folder.     [setup]
/// Throws std::runtime_error "FILE:LINE: what is wrong; what to do" for a file that cannot be read, TOML syntax, unknown keys
/// (with the nearest valid name), wrong types, values out of range, keys that exclude each other, names that do not exist.
SceneDescription read_scene(const std::filesystem::path& file);

/// The same from text; `file` only names it in messages and anchors relative paths.     [setup]
SceneDescription parse_scene(std::string_view text, const std::filesystem::path& file);

/// The name of a value as scene files spell it.                                         [any]
std::string_view name(ContactKind kind) noexcept;
std::string_view name(SteppingMethod method) noexcept;
std::string_view name(EffectKind kind) noexcept;

}  // namespace palpate
