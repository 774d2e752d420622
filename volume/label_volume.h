// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <palpate/volume/voxel_volume.h>

namespace palpate {

/// A structure that a label volume marks.
struct Label {
    std::string name;       ///< from a name table or a .seg.nrrd; else the value in digits
    std::int32_t value = 0; ///< of its voxels, never 0 (the background)
    std::size_t layer = 0;  ///< of LabelVolume::layers
    std::optional<std::array<std::uint8_t, 3>> color; ///< sRGB
};

/// An image whose values are names. Overlapping segments lie in layers.
struct LabelVolume {
    std::array<int, 3> size{0, 0, 0};               ///< voxels along i, j, k
    AffineTransform index_to_scene;                 ///< as VoxelVolume's
    std::vector<VoxelNumbers<std::int32_t>> layers; ///< i fastest; at least one
    std::vector<Label> labels;         ///< every value that occurs, by layer, then value
    std::string source_type;           ///< voxel type of the file
    std::filesystem::path name_table;  ///< that was found beside the file and read; or empty
    std::vector<std::string> warnings; ///< what a user should know of how the file was read

    /// Voxels of one layer.                                                              [any]
    std::size_t voxels() const noexcept { return layers.empty() ? 0 : layers.front().size(); }
};

/// Gives each value but 0 that occurs and has no label one, named by its digits, and leaves out the
/// labels that no voxel has, as a file's reader does: one table of names is for many patients.
/// [setup]
void match_labels_to_voxels(LabelVolume& volume);

/// True when a volume is most likely a label map and no measured image: whole numbers from 0 on, of
/// which either just two occur (a mask), or most voxels equal their neighbours, those of 0 and of a
/// background left out (what all eight corners have). Large volumes are sampled, about four million
/// voxels.                                                                               [setup]
bool looks_like_labels(const VoxelVolume& volume);

/// What a label takes up.
struct LabelExtent {
    std::size_t voxels = 0;  ///< that have the label
    double volume_mm3 = 0.0; ///< of these voxels
    Box bounds; ///< of its voxels, with their borders; axis-aligned in the scene frame, m
};

/// Extent of every label, in the order of `volume.labels`.                              [setup]
std::vector<LabelExtent> label_extents(const LabelVolume& volume);

/// Indices into `volume.labels` of labels given by name or by number ("Hippocampus_L", "37"). A
/// name is taken as it stands, else without regard to case; it may stand for several labels of one
/// name. Each index once, in the order wanted. [setup] Throws std::invalid_argument that names the
/// nearest existing names, or the range of values.
std::vector<std::size_t> find_labels(const LabelVolume& volume,
                                     std::span<const std::string> wanted);

/// 1 in the voxels of any of the chosen labels and 0 elsewhere, cropped to them with `margin`
/// voxels of 0 around (also beyond the volume's border). [setup] `chosen` are indices into
/// volume.labels, at least one; else std::invalid_argument.
VoxelVolume label_occupancy(const LabelVolume& volume, std::span<const std::size_t> chosen,
                            int margin);

} // namespace palpate
