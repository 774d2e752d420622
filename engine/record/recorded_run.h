// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <palpate/engine/record/recording.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_overrides.h>

namespace palpate {

/// Hashes of everything that a scene was built from: data in memory (sha256_of_data(), named by
/// data_in_words()), volumes with the settings of their surfaces, and the numbers of each mesh that
/// a contact uses, from a file, from memory, extracted or from the cache.               [setup]
std::vector<RecordedSource> sources(const Scene& scene);

/// The recording of a trace. Where the scene is of one of its hands (Scene::of_hand()) and the
/// overrides do not choose it, it is that of this hand, beside others in a file.        [setup]
Recording recorded(const Scene& scene, const SceneOverrides& overrides, const Trace& trace);

/// The scene that a recording was made with, loaded again.                              [setup]
/// Throws std::runtime_error when its inputs, frames and clock do not belong together (so that
/// run_again() may be given it), a source has changed since, this build chooses another contact
/// than the one that recorded, a gain was changed while the loop ran, which is not recorded, or
/// frames are missing as the recorder could not keep up; or when a program made the scene, or gave
/// it data in memory, which a recording does not keep: then the program has to give it again.
/// `file` is the recording's, for the message. Of a hand of several it is the scene as that hand
/// has it.
std::shared_ptr<const Scene> recorded_scene(const Recording& recording,
                                            const std::filesystem::path& file,
                                            const SceneResources& resources);

/// The scenes of all hands of one file: one is loaded, and each hand has it as its own. [setup]
/// Throws as above.
std::vector<std::shared_ptr<const Scene>> recorded_scenes(std::span<const Recording> hands,
                                                          const std::filesystem::path& file,
                                                          const SceneResources& resources);

/// The same for a scene that a program made: `scene` is its description, with its data, as it was
/// recorded. Data that is not what was recorded is refused, with its name and both hashes. Settings
/// that no source depends on (coupling, limits, effects) are not compared: where they differ,
/// run_again() gives other frames.                                                      [setup]
std::shared_ptr<const Scene> recorded_scene(const Recording& recording,
                                            const std::filesystem::path& file,
                                            SceneDescription scene,
                                            const SceneResources& resources);

/// Where frames that were computed again are not those of a recording.
struct RunDifference {
    std::size_t frames = 0;           ///< that differ
    std::optional<std::size_t> first; ///< nothing where none differs
};

/// Compares them bit for bit: all that frames.csv says, and what each frame touched. What a version
/// of the format did not record is not compared. `again` has the recording's frames.    [setup]
RunDifference difference(const Recording& recording, const Run& again);

} // namespace palpate
