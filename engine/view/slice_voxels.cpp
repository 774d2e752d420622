// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/slice_voxels.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <palpate/engine/view/internal/voxel_blocks.h>

namespace palpate {
namespace {

/// Mean of what is finite in a block of voxels; NaN where nothing is.
double block_mean(const VoxelVolume& volume, const std::array<int, 3>& first,
                  const std::array<int, 3>& end) {
    double sum = 0.0;
    int count = 0;
    for (int k = first[2]; k < end[2]; ++k)
        for (int j = first[1]; j < end[1]; ++j)
            for (int i = first[0]; i < end[0]; ++i)
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
    const internal::VoxelBlocks blocks = internal::voxel_blocks(volume.size, most_edge);
    SliceVoxels slices;
    slices.name = std::move(name);
    slices.shape = blocks.count;
    slices.index_to_scene = blocks.index_to_scene(volume.index_to_scene);

    std::vector<double> means;
    means.reserve(blocks.all());
    blocks.for_each([&](const std::array<int, 3>& first, const std::array<int, 3>& end) {
        means.push_back(block_mean(volume, first, end));
    });

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
