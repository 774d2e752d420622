// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <palpate/volume/formats/internal/label_names.h>
#include <palpate/volume/label_volume.h>

namespace palpate::internal {

/// Voxels that follow each other in the memory of a grid.
struct VoxelRun {
    std::size_t first = 0; ///< index of a voxel, i fastest
    std::size_t count = 0;
};

/// Puts structures that may overlap into layers of one label volume: each into the first layer
/// where none of its voxels has a label yet.
class LabelLayers {
public:
    /// A volume of that size and place, without a label. Throws import_error where one layer is
    /// more than this machine has memory for.                                          [setup]
    LabelLayers(std::filesystem::path file, const LabelVolume& grid);

    /// Gives the voxels of a structure its value, not 0, and that value its name. No voxel may be
    /// in two of its runs.  [setup] Throws import_error when memory does not hold another layer.
    void add(std::int32_t value, LabelName name, std::span<const VoxelRun> runs);

    /// The volume with a label for each structure that has voxels; the others are warned of. Names
    /// of `table` go before those of the structures.                                    [setup]
    LabelVolume taken(const LabelNames& table) &&;

private:
    using Layer = std::vector<std::int32_t>;
    Layer& free_layer(std::span<const VoxelRun> runs);

    std::filesystem::path file_;
    LabelVolume volume_;
    std::vector<Layer> layers_;
    LabelNames names_;
    std::vector<std::string> empty_; ///< names of structures without voxels
};

} // namespace palpate::internal
