// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include <palpate/engine/scene/scene_description.h>

/// How messages name a part of a scene, in front of what is wrong with it: "FILE:LINE: [device]".
/// A scene in text has "scene" for its file. Where the part has no line, it is made from options:
/// "FILE: [device]"; or in code: "surfaces["bone"]".
namespace palpate {

/// All of it: its file, or "scene" where a program made it.                              [setup]
std::string place_of_scene(const SceneDescription& scene);

/// A surface. One made from options is its data file alone, which has nothing else.      [setup]
std::string place_of_surface(const SceneDescription& scene, const std::string& surface);

/// A volume. [setup]
std::string place_of_volume(const SceneDescription& scene, const std::string& volume);

/// An effect, by its index. [setup]
std::string place_of_effect(const SceneDescription& scene, std::size_t effect);

/// The device of the scene. [setup]
std::string place_of_device(const SceneDescription& scene);

} // namespace palpate
