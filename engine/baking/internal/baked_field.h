// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include <palpate/engine/scene/baked_surface.h>
#include <palpate/geometry/isosurface.h>
#include <palpate/volume/label_volume.h>

namespace palpate::internal {

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
