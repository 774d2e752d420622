// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/scene_place.h>

#include <fmt/format.h>

namespace palpate {
namespace {

/// "FILE:LINE: [volume.scan]"
std::string in_file(const SceneDescription& scene, int line, const std::string& part) {
    return fmt::format("{}:{}: {}", place_of_scene(scene), line, part);
}

} // namespace

std::string place_of_scene(const SceneDescription& scene) {
    return scene.file.empty() ? "scene" : scene.file.string();
}

std::string place_of_surface(const SceneDescription& scene, const std::string& surface) {
    const int line = scene.surfaces.at(surface).line;
    if (line > 0) return in_file(scene, line, fmt::format("[surface.{}]", surface));
    return scene.file.empty() ? fmt::format("surfaces[\"{}\"]", surface) : scene.file.string();
}

std::string place_of_volume(const SceneDescription& scene, const std::string& volume) {
    const int line = scene.volumes.at(volume).line;
    if (line > 0) return in_file(scene, line, fmt::format("[volume.{}]", volume));
    return fmt::format("volumes[\"{}\"]", volume);
}

std::string place_of_effect(const SceneDescription& scene, std::size_t effect) {
    const int line = scene.effects.at(effect).line;
    if (line > 0) return in_file(scene, line, "[[effect]]");
    return fmt::format("effects[{}]", effect);
}

std::string place_of_device(const SceneDescription& scene) {
    const int line = scene.device.line;
    if (line > 0) return in_file(scene, line, "[device]");
    return scene.file.empty() ? "device" : scene.file.string() + ": [device]";
}

} // namespace palpate
