// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/loop/scene_warnings.h>

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/scene/scene_surface.h>

namespace palpate {
namespace {

/// A warning behind the file that it is of, where there is one.
std::string in_file(const std::filesystem::path& file, const std::string& warning) {
    return file.empty() ? warning : fmt::format("{}: {}", file.string(), warning);
}

} // namespace

std::vector<std::string> source_warnings(const Scene& scene) {
    std::vector<std::string> lines;
    const auto add = [&](const std::filesystem::path& file, const std::string& warning) {
        const std::string line = in_file(file, warning);
        if (std::find(lines.begin(), lines.end(), line) == lines.end()) lines.push_back(line);
    };
    for (const SceneSurface& surface : scene.surfaces()) {
        const SurfaceDescription& description = scene.description().surfaces.at(surface.name);
        for (const std::string& warning : surface.baked.warnings)
            add(scene.description().volumes.at(description.volume).file, warning);
        for (const std::string& warning : surface.mesh.warnings)
            add(surface.mesh.file, warning);
    }
    for (const auto& [volume, warnings] : scene.effect_warnings())
        for (const std::string& warning : warnings)
            add(scene.description().volumes.at(volume).file, warning);
    return lines;
}

std::vector<std::string> scene_warnings(const Scene& scene) {
    const SceneDescription& description = scene.description();
    std::vector<std::string> lines;
    const auto add = [&](const std::string& warning) {
        if (!warning.empty()) lines.push_back(in_file(description.file, warning));
    };
    if (description.loop.method == SteppingMethod::adaptive) add(scene.plan().uncertified);
    add(felt_warning(scene));
    for (const std::string& warning : scene.plan().warnings)
        add(warning);
    return lines;
}

} // namespace palpate
