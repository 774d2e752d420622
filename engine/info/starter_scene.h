// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <palpate/engine/info/data_file.h>
#include <palpate/geometry/vec.h>

namespace palpate {

/// A structure of a segmentation that a scene can name.
struct StarterLabel {
    std::string name;       ///< as the file or its table says
    std::int32_t value = 0; ///< of its voxels, never 0
    std::string named;      ///< what `label` of a scene takes for this one alone: its name, or its
                            ///< number where several have that name
    std::optional<std::array<std::uint8_t, 3>> color; ///< sRGB
    std::size_t voxels = 0;                           ///< that have the label
};

/// The image that labels were made from, which lies beside them.
struct StarterImage {
    std::filesystem::path file;    ///< or a DICOM folder
    VolumeSelection selection;     ///< which of several in it
    std::array<double, 2> range{}; ///< smallest and largest value, its own unit
    std::optional<double> iso;     ///< Otsu's threshold; nothing: all values are equal
};

/// What a starter scene has to know of data, without its voxels.
struct StarterData {
    /// What surfaces are made of.
    enum class Kind {
        volume, ///< the level of a measured volume
        labels, ///< the border of labels
        mesh    ///< a mesh as it is
    };
    Kind kind = Kind::volume;      ///< decides which of the following count
    std::filesystem::path file;    ///< or a DICOM folder
    VolumeSelection selection;     ///< volume, labels: which of several in the file
    std::array<double, 2> range{}; ///< volume: smallest and largest value, its own unit
    std::optional<double> iso;     ///< volume: Otsu's threshold; nothing: all values are equal
    bool has_gaps = false;       ///< volume: voxels without a number, which smoothing would spread
    std::filesystem::path table; ///< labels: that names them; empty: the file's own names
    std::vector<StarterLabel> labels; ///< labels: all of them
    std::optional<StarterImage> image; ///< labels: that they were made from
    MeshFileSettings mesh;            ///< mesh: as it was read
    bool mesh_stated = false;         ///< mesh: the file says its frame and unit itself
    Box bounds;                       ///< around the voxels, the labels or the mesh, m, scene frame
};

/// Looks at data once.                                                                   [setup]
StarterData starter_data(const DataFile& data);

/// Looks at the image of a segmentation once.                                            [setup]
StarterImage starter_image(const std::filesystem::path& file, const VolumeSelection& selection,
                           const VoxelVolume& volume);

/// What is felt of it; empty: what is sensible.
struct StarterChoice {
    std::optional<double> iso;       ///< of a volume, its own unit; nothing: StarterData::iso
    std::vector<std::string> labels; ///< of labels, by name or number; empty: the largest ones
};

/// Labels of a scene of which nobody said which: as many as a scene is ready with in seconds.
inline constexpr std::size_t kStarterLabels = 8;

/// Indices of the labels with the most voxels, kStarterLabels of them, in their own order. [setup]
std::vector<std::size_t> largest_labels(const StarterData& data);

/// The text of a scene that `palpate trace` and `palpate view` take at once: one surface for each
/// thing to feel, an orbit around them; a comment says what each line means and how to change it.
/// Paths are relative to the folder of `scene_file`, which need not be there. The text has been
/// read as a scene and checked.                                                           [setup]
/// Throws std::invalid_argument where the choice is not one of this data: says what there is.
/// Throws std::runtime_error as parse_scene().
std::string starter_scene(const StarterData& data, const StarterChoice& choice,
                          const std::filesystem::path& scene_file);

} // namespace palpate
