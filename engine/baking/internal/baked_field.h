// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include <palpate/engine/scene/baked_surface.h>
#include <palpate/geometry/isosurface.h>
#include <palpate/volume/label_volume.h>

namespace palpate::internal {

/// What tells, beside its voxels, that a file is a label map.
enum class LabelMark {
    none,
    table, ///< a table of names lies beside it: it is one where its voxels look like labels
    name   ///< its own: .seg.nrrd or .seg.nhdr
};

/// That of a volume's file; none of a volume in memory, which has no file.                [setup]
LabelMark label_mark(const std::filesystem::path& file);

/// Refuses the volume of an effect that has names for its values: between two of them lie those of
/// others. A map of numbers without names may be a property.                              [setup]
/// Throws std::runtime_error that begins with `place`.
void require_no_names(const VolumeDescription& source, const VoxelVolume& volume,
                      const std::string& place);

/// Bakes a field for an isosurface of a measured volume, which is of `source`.           [setup]
/// `place` begins messages: "FILE:LINE: [surface.bone]". Throws std::runtime_error; refuses label
/// maps.
BakedSurface bake_level(const VolumeDescription& source, const VoxelVolume& volume,
                        const SurfaceDescription& surface, const std::string& place,
                        const Progress& progress);

/// Bakes a field for the border of labels, without a groove along borders with those of `alike`:
/// labels_felt_alike(). Refuses measured images.                                         [setup]
BakedSurface bake_labels(const VolumeDescription& source, const LabelVolume& volume,
                         const SurfaceDescription& surface, std::span<const std::string> alike,
                         const std::string& place, const Progress& progress);

} // namespace palpate::internal
