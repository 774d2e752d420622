// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/slice_voxels.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace palpate {
namespace {

/// Blocks of voxels along each axis, ends cut off where they do not fit.
struct Blocks {
    std::array<int, 3> edge;  // voxels
    std::array<int, 3> count; // blocks
};

Blocks blocks_of(const VoxelVolume& volume, int most_edge) {
    Blocks blocks{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        blocks.edge[axis] = std::max(1, (volume.size[axis] + most_edge - 1) / most_edge);
        blocks.count[axis] = (volume.size[axis] + blocks.edge[axis] - 1) / blocks.edge[axis];
    }
    return blocks;
}

/// Mean of what is finite in the block that begins at `from`; NaN where nothing is.
double block_mean(const VoxelVolume& volume, const Blocks& blocks, const std::array<int, 3>& from) {
    std::array<int, 3> end{};
    for (std::size_t axis = 0; axis < 3; ++axis)
        end[axis] = std::min(from[axis] + blocks.edge[axis], volume.size[axis]);
    double sum = 0.0;
    int count = 0;
    for (int k = from[2]; k < end[2]; ++k)
        for (int j = from[1]; j < end[1]; ++j)
            for (int i = from[0]; i < end[0]; ++i)
                if (const double value = volume.at(i, j, k); std::isfinite(value)) {
                    sum += value;
                    ++count;
                }
    return count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN();
}

/// The value below which that share of `sorted` lies; 0 of none.
double percentile(const std::vector<double>& sorted, double share) {
    if (sorted.empty()) return 0.0;
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}

} // namespace

SliceVoxels slice_voxels(std::string name, const VoxelVolume& volume, int most_edge) {
    const Blocks blocks = blocks_of(volume, most_edge);
    SliceVoxels slices;
    slices.name = std::move(name);
    slices.shape = blocks.count;
    const Vec3 edge(blocks.edge[0], blocks.edge[1], blocks.edge[2]);
    slices.index_to_scene = volume.index_to_scene;
    for (int axis = 0; axis < 3; ++axis)
        slices.index_to_scene.linear[axis] *= edge[axis];
    slices.index_to_scene.offset = volume.index_to_scene.point(0.5 * (edge - Vec3(1.0)));

    std::vector<double> means;
    means.reserve(static_cast<std::size_t>(blocks.count[0]) *
                  static_cast<std::size_t>(blocks.count[1]) *
                  static_cast<std::size_t>(blocks.count[2]));
    for (int k = 0; k < blocks.count[2]; ++k)
        for (int j = 0; j < blocks.count[1]; ++j)
            for (int i = 0; i < blocks.count[0]; ++i)
                means.push_back(block_mean(
                    volume, blocks, {i * blocks.edge[0], j * blocks.edge[1], k * blocks.edge[2]}));

    std::vector<double> sorted;
    sorted.reserve(means.size());
    std::copy_if(means.begin(), means.end(), std::back_inserter(sorted),
                 [](double mean) { return std::isfinite(mean); });
    std::sort(sorted.begin(), sorted.end());
    slices.low = percentile(sorted, 0.001);
    slices.high = percentile(sorted, 0.999);
    if (!(slices.high > slices.low)) slices.high = slices.low + 1.0;
    slices.window = {percentile(sorted, 0.01), percentile(sorted, 0.99)};
    if (!(slices.window[1] > slices.window[0])) slices.window = {slices.low, slices.high};

    slices.values.reserve(means.size());
    for (const double mean : means) {
        const double share =
            std::isfinite(mean) ? (mean - slices.low) / (slices.high - slices.low) : 0.0;
        slices.values.push_back(
            static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(share, 0.0, 1.0))));
    }
    return slices;
}

} // namespace palpate
