// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <palpate/geometry/triangle_mesh.h>
#include <palpate/volume/label_volume.h>
#include <palpate/volume/vector_volume.h>
#include <palpate/volume/voxel_volume.h>

/// Pictures that show at a glance what a file holds and which way round it is: PNG, two by two
/// square tiles. Drawn in the patient's frame, so they are right for oblique and left-handed
/// volumes; true proportions, and one scale for the slices.
///
///     axial       sagittal      Slices through the middle of the content (its centroid). As
///     coronal     surface       radiologists look: the patient's right is on the picture's left,
///                               anterior is up (axial) or on the left (sagittal), superior is up.
///                               Letters R L A P S I at the edges say so.
namespace palpate {

inline constexpr int kOverviewTile = 480;  ///< pixels, a tile's width and height
inline constexpr int kOverviewGap = 4;     ///< pixels, between tiles
inline constexpr int kOverviewMargin = 30; ///< pixels, around the content: room for the letters

/// The value that parts a volume in two classes with the largest variance between them (Otsu 1979),
/// from at most a million voxels, regularly chosen. Nothing where all values are equal. [setup]
std::optional<double> otsu_threshold(const VoxelVolume& volume);

/// Slices in grey, black to white from the 1st to the 99th percentile of the values, and the
/// isosurface at `level` seen from the patient's front, left and above. A tile's middle is that of
/// the volume's bounds. No level: slices through the volume's middle and no surface.     [setup]
/// Volumes of more than 16 million voxels are averaged in blocks for the surface.
/// Throws std::invalid_argument when no value reaches the level, or all do.
std::string overview_png(const VoxelVolume& volume, std::optional<double> level);

/// Labels in their own colours, else in seven that colour-blind eyes tell apart, over black; where
/// layers overlap, the last. A tile's middle is that of the labels' bounds. The surface is that of
/// all labels together, smoothed by a voxel.                                             [setup]
std::string overview_png(const LabelVolume& volume);

/// Directions in colours: red to the right or left, green anterior or posterior, blue superior or
/// inferior; brightness by magnitude up to its 99th percentile. Tensors: principal direction,
/// brightness by fractional anisotropy. The fourth tile is the key: a ball of directions. [setup]
std::string overview_png(const VectorVolume& volume);

/// Four views of a mesh: from the front, from the left, from above, and from the front, left and
/// above. Edges that are open or not manifold are red, sides that face away from free space blue.
/// [setup] Throws std::invalid_argument when it has no triangle with an area.
std::string overview_png(std::shared_ptr<const TriangleMesh> mesh);

} // namespace palpate
