// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <palpate/engine/recording.h>
#include <palpate/engine/scene_overrides.h>
#include <palpate/engine/trace.h>

namespace palpate::command {

/// A scene with a run's options applied; wrong options are usage errors.
SceneDescription changed_scene(SceneDescription scene, const SceneOverrides& overrides);

/// Hashes of everything that a scene was built from: volume files, and meshes that contacts use.
std::vector<RecordedSource> sources(const Scene& scene);

/// The recording of a trace.
Recording recorded(const Scene& scene, const SceneOverrides& overrides,
                   std::span<const DeviceState> inputs, const Trace& trace);

/// The scene that a recording was made with, loaded again; throws std::runtime_error when a source
/// has changed since.
std::shared_ptr<const Scene> recorded_scene(const Recording& recording,
                                            const std::filesystem::path& file);

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
