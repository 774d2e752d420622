// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include <palpate/engine/record/recording.h>
#include <palpate/engine/scene/scene_description.h>

namespace palpate {

/// What an output may replace.
enum class Replace {
    own, ///< files that Palpate wrote
    any  ///< any file that is not being read
};

/// Refuses outputs before anything is computed for them: one that is also an input, by this or any
/// other name (links included), one that would replace a file which Palpate did not write, one that
/// is no ordinary file, and one in a folder that is not there or cannot be written.       [setup]
/// Throws std::runtime_error "FILE: what is wrong; what to do".
void check_outputs(std::span<const std::filesystem::path> outputs,
                   std::span<const std::filesystem::path> inputs, Replace replace);

/// Whether a file is one that Palpate writes, by what is in it: columns, keys, comments and marks
/// of its own.                                                                          [setup]
bool is_written_by_palpate(const std::filesystem::path& file);

/// Every file that a scene and its device are read from: the scene's own, volumes with their data
/// files and tables of names, meshes, lists of points, paths and recordings.             [setup]
std::vector<std::filesystem::path> input_files(const SceneDescription& scene);

/// The same of a recording that is read from `file`, and of the scene that it was made with. Where
/// that names a file which is gone: the recording and the scene's own alone.             [setup]
std::vector<std::filesystem::path> input_files(const Recording& recording,
                                               const std::filesystem::path& file);

} // namespace palpate
