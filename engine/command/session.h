// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include <palpate/engine/scene.h>
#include <palpate/engine/scene_overrides.h>

namespace palpate::command {

/// A scene with a run's options applied; wrong options are usage errors.
SceneDescription changed_scene(SceneDescription scene, const SceneOverrides& overrides);

/// Says on stderr what a user should know of how the scene's volumes and mesh files were read, each
/// once.
void warn_of_sources(const Scene& scene);

/// A folder for results, made before the work; if nothing comes of it, a folder that was made goes
/// again.
class ResultFolder {
public:
    /// Makes it, and those above it; throws std::runtime_error naming it.
    explicit ResultFolder(std::filesystem::path folder);
    ~ResultFolder();
    ResultFolder(const ResultFolder&) = delete;
    ResultFolder& operator=(const ResultFolder&) = delete;

    std::filesystem::path operator/(const char* name) const { return folder_ / name; }
    std::string string() const { return folder_.string(); }

private:
    std::filesystem::path folder_;
    bool made_ = false;
};

} // namespace palpate::command
