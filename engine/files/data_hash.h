// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <palpate/engine/scene/scene_description.h>

namespace palpate {

/// What a volume in memory is of, as recordings name it: "volumes[\"ct\"].voxels, 60 x 60 x 60";
/// `name` is its key in the scene.                                                      [setup]
std::string data_in_words(const std::string& name, const VolumeDescription& volume);

/// SHA-256, hexadecimal, of a volume in memory: of its kind, size, map to the scene and content, so
/// that the same data has the same hash wherever it lies. Names of labels are among it; how files
/// were read (source_type, frame, warnings) is not. Of a field of the program's own: of its bounds
/// and scales, and of samples on a lattice of 33 points along each axis, so that fields which
/// differ between these alone are taken for one.                                        [setup]
/// Throws std::invalid_argument where the volume is not in memory.
std::string sha256_of_data(const VolumeDescription& volume);

} // namespace palpate
