// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/picture/internal/preview_surface.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/volume/fields/grid_field.h>
#include <palpate/volume/filters/volume_filters.h>

namespace palpate::internal {
namespace {

/// A range of voxels, ends included.
struct VoxelBox {
    std::array<int, 3> first;
    std::array<int, 3> last;
    int length(std::size_t axis) const noexcept { return last[axis] - first[axis] + 1; }
};

/// Edge of the blocks, in voxels, that leaves at most so many.
int block_edge(const VoxelBox& box, std::size_t most) noexcept {
    int edge = 1;
    const auto blocks = [&] {
        std::size_t count = 1;
        for (std::size_t axis = 0; axis < 3; ++axis)
            count *= static_cast<std::size_t>((box.length(axis) + edge - 1) / edge);
        return count;
    };
    while (blocks() > most)
        ++edge;
    return edge;
}

/// Means of value(i, j, k) over blocks of a box; values that are not finite do not count, and a
/// block of nothing else is `missing`. A block that the box cuts off is the mean of what is there.
template <class Function>
VoxelVolume block_means(const VoxelBox& box, int edge, const AffineTransform& index_to_scene,
                        float missing, const Function& value) {
    VoxelVolume coarse;
    for (std::size_t axis = 0; axis < 3; ++axis)
        coarse.size[axis] = (box.length(axis) + edge - 1) / edge;
    coarse.index_to_scene.linear = index_to_scene.linear * static_cast<double>(edge);
    coarse.index_to_scene.offset = index_to_scene.point(
        Vec3(box.first[0], box.first[1], box.first[2]) + Vec3(0.5 * (edge - 1)));
    coarse.values.reserve(coarse.voxels());
    const auto mean = [&](const std::array<int, 3>& from, const std::array<int, 3>& to) {
        double sum = 0.0;
        int count = 0;
        for (int k = from[2]; k <= to[2]; ++k)
            for (int j = from[1]; j <= to[1]; ++j)
                for (int i = from[0]; i <= to[0]; ++i) {
                    const double v = value(i, j, k);
                    if (!std::isfinite(v)) continue;
                    sum += v;
                    ++count;
                }
        return count > 0 ? static_cast<float>(sum / count) : missing;
    };
    for (int k = 0; k < coarse.size[2]; ++k)
        for (int j = 0; j < coarse.size[1]; ++j)
            for (int i = 0; i < coarse.size[0]; ++i) {
                std::array<int, 3> from{i, j, k};
                std::array<int, 3> to{};
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    from[axis] = box.first[axis] + edge * from[axis];
                    to[axis] = std::min(from[axis] + edge - 1, box.last[axis]);
                }
                coarse.values.push_back(mean(from, to));
            }
    return coarse;
}

/// The voxels that any layer marks; first > last where there are none.
VoxelBox marked_voxels(const LabelVolume& volume) {
    constexpr int kNone = std::numeric_limits<int>::max();
    VoxelBox box{{kNone, kNone, kNone}, {-1, -1, -1}};
    for (const VoxelNumbers<std::int32_t>& layer : volume.layers) {
        std::size_t at = 0;
        for (int k = 0; k < volume.size[2]; ++k)
            for (int j = 0; j < volume.size[1]; ++j)
                for (int i = 0; i < volume.size[0]; ++i) {
                    if (layer[at++] == 0) continue;
                    const std::array<int, 3> index{i, j, k};
                    for (std::size_t axis = 0; axis < 3; ++axis) {
                        box.first[axis] = std::min(box.first[axis], index[axis]);
                        box.last[axis] = std::max(box.last[axis], index[axis]);
                    }
                }
    }
    return box;
}

bool any_above(const VoxelVolume& volume, double level) noexcept {
    return std::any_of(volume.values.begin(), volume.values.end(),
                       [level](float value) { return value >= level; });
}

} // namespace

TriangleMesh preview_surface(const VoxelVolume& volume, double level, std::size_t most) {
    const auto [low, high] = value_range(volume);
    if (!(level > low && level <= high))
        throw std::invalid_argument(
            fmt::format("no isosurface at {:.6g}: values are {:.6g} to {:.6g}; choose one between",
                        level, low, high));
    const auto background = static_cast<float>(low);
    if (volume.voxels() <= most) return GridField(volume, background).preview(level);
    const VoxelBox all{{0, 0, 0}, {volume.size[0] - 1, volume.size[1] - 1, volume.size[2] - 1}};
    VoxelVolume coarse = block_means(all, block_edge(all, most), volume.index_to_scene, background,
                                     [&](int i, int j, int k) { return volume.at(i, j, k); });
    clear_far_from_level(coarse, level, background);
    return GridField(coarse, background).preview(level);
}

TriangleMesh preview_surface(const LabelVolume& volume, std::size_t most) {
    constexpr double kHalf = 0.5;
    constexpr double kSigma = 1.0; // voxels
    constexpr int kReach = 4;      // voxels: the Gaussian's kernel ends there
    const VoxelBox box = marked_voxels(volume);
    if (box.last[0] < 0) return {};
    const auto marked = [&](int i, int j, int k) {
        const auto at =
            static_cast<std::size_t>(i) +
            static_cast<std::size_t>(volume.size[0]) *
                (static_cast<std::size_t>(j) +
                 static_cast<std::size_t>(volume.size[1]) * static_cast<std::size_t>(k));
        return std::any_of(volume.layers.begin(), volume.layers.end(),
                           [at](const auto& layer) { return layer[at] != 0; })
                   ? 1.0
                   : 0.0;
    };
    const VoxelVolume voxels = padded(
        block_means(box, block_edge(box, most), volume.index_to_scene, 0.0F, marked), kReach, 0.0F);
    VoxelVolume smoothed = voxels;
    smooth(smoothed, kSigma);
    const VoxelVolume& shown = any_above(smoothed, kHalf) ? smoothed : voxels;
    return GridField(shown, 0.0F).preview(kHalf);
}

} // namespace palpate::internal
