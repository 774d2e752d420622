// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <palpate/engine/info/data_file.h>
#include <palpate/geometry/isosurface.h>
#include <palpate/geometry/triangle_mesh.h>

namespace palpate {

/// Voxels of previews: soon, and when nobody moves the slider any more.
inline constexpr std::size_t kSoonVoxels = 1'500'000;
inline constexpr std::size_t kFineVoxels = 8'000'000; ///< at most, of a preview that takes longer

/// Means of cubic blocks of voxels, so that at most `most` of them are left, 1 or more; values that
/// are not finite do not count. A volume that is small enough is given back as it is.    [setup]
VoxelVolume block_means(const VoxelVolume& volume, std::size_t most);

/// How many values lie in each of `steps` equal steps of `bounds`, first < second; what is outside
/// or not finite does not count.                                                         [setup]
std::vector<std::uint32_t> histogram(const VoxelVolume& volume, const std::array<double, 2>& bounds,
                                     std::size_t steps);

/// Surfaces of data as a starter scene would have them, drawn by the preview of their field. For
/// one thread at a time.
class ExplorePreview {
public:
    /// Keeps what previews need of the data, and nothing else.                           [setup]
    explicit ExplorePreview(DataFile data);
    ~ExplorePreview();
    ExplorePreview(const ExplorePreview&) = delete;
    ExplorePreview& operator=(const ExplorePreview&) = delete;

    /// The largest part of a volume's isosurface, m, scene frame.                        [setup]
    /// Throws std::runtime_error where no voxel reaches the level; "cancelled" where progress says
    /// so.
    TriangleMesh isosurface(double level, std::size_t most_voxels, const Progress& progress);

    /// The border of a label, by what scenes call it, m, scene frame.                    [setup]
    /// Throws std::runtime_error where there is nothing of it; "cancelled" as above.
    TriangleMesh label(const std::string& named, const Progress& progress);

    /// A mesh as it is; null of a volume.                                                [setup]
    const std::shared_ptr<const TriangleMesh>& mesh() const noexcept { return mesh_; }

private:
    struct Source;
    std::unique_ptr<Source> soon_; ///< of a volume
    std::unique_ptr<Source> fine_; ///< of a volume: of more voxels; of labels
    std::shared_ptr<const TriangleMesh> mesh_;
};

} // namespace palpate
