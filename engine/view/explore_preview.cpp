// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/explore_preview.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/baking/baking.h>
#include <palpate/engine/files/result_cache.h>
#include <palpate/engine/scene/internal/progress.h>
#include <palpate/engine/scene/scene_description.h>

namespace palpate {
namespace {

constexpr const char* kName = "surface";
constexpr double kSmoothing = 0.7; // voxels, as in a starter scene

/// Edge of the blocks, voxels.
int block_edge(const VoxelVolume& volume, std::size_t most) {
    const auto blocks = [&](int edge) {
        std::size_t count = 1;
        for (const int size : volume.size)
            count *= static_cast<std::size_t>((size + edge - 1) / edge);
        return count;
    };
    int edge = 1;
    while (blocks(edge) > most)
        ++edge;
    return edge;
}

/// Mean of what is finite in a block; NaN where nothing is.
float mean_of(const VoxelVolume& volume, const std::array<int, 3>& from, int edge) {
    double sum = 0.0;
    int count = 0;
    for (int k = from[2]; k < std::min(from[2] + edge, volume.size[2]); ++k)
        for (int j = from[1]; j < std::min(from[1] + edge, volume.size[1]); ++j)
            for (int i = from[0]; i < std::min(from[0] + edge, volume.size[0]); ++i)
                if (const double value = volume.at(i, j, k); std::isfinite(value)) {
                    sum += value;
                    ++count;
                }
    return count > 0 ? static_cast<float>(sum / count) : std::numeric_limits<float>::quiet_NaN();
}

} // namespace

VoxelVolume block_means(const VoxelVolume& volume, std::size_t most) {
    const int edge = block_edge(volume, most);
    if (edge == 1) return volume;
    VoxelVolume coarse;
    for (std::size_t axis = 0; axis < 3; ++axis)
        coarse.size[axis] = (volume.size[axis] + edge - 1) / edge;
    coarse.index_to_scene.linear = volume.index_to_scene.linear * static_cast<double>(edge);
    coarse.index_to_scene.offset = volume.index_to_scene.point(Vec3(0.5 * (edge - 1)));
    coarse.values.reserve(coarse.voxels());
    for (int k = 0; k < coarse.size[2]; ++k)
        for (int j = 0; j < coarse.size[1]; ++j)
            for (int i = 0; i < coarse.size[0]; ++i)
                coarse.values.push_back(mean_of(volume, {i * edge, j * edge, k * edge}, edge));
    return coarse;
}

std::vector<std::uint32_t> histogram(const VoxelVolume& volume, const std::array<double, 2>& bounds,
                                     std::size_t steps) {
    std::vector<std::uint32_t> counts(steps, 0);
    const double scale = static_cast<double>(steps) / (bounds[1] - bounds[0]);
    for (const float value : volume.values)
        // False of what is not a number.
        if (value >= bounds[0] && value <= bounds[1]) {
            const auto step = static_cast<std::size_t>((value - bounds[0]) * scale);
            ++counts[std::min(step, steps - 1)];
        }
    return counts;
}

/// A scene of one volume in memory and one surface of it. The reader remembers the hash of the
/// volume from one preview to the next.
struct ExplorePreview::Source {
    explicit Source(VolumeDescription volume) {
        scene.volumes["volume"] = std::move(volume);
        scene.surfaces[kName].volume = "volume";
        reader.emplace(scene);
    }
    SurfaceDescription& surface() { return scene.surfaces.at(kName); }
    /// Whether a surface is there: one voxel has that value or more, and another one less.
    bool passes(double level) const {
        const auto& values = scene.volumes.at("volume").voxels->values;
        return std::ranges::any_of(values, [&](float value) { return value >= level; }) &&
               std::ranges::any_of(values, [&](float value) { return value < level; });
    }
    TriangleMesh preview(const Progress& progress) {
        const BakedSurface baked = bake_surface(scene, kName, *reader, ResultCache(), progress);
        internal::report(progress, 0.9, "drawing");
        return baked.grid->preview(baked.level);
    }

    SceneDescription scene;
    std::optional<VolumeReader> reader; // of `scene`
};

ExplorePreview::~ExplorePreview() = default;

ExplorePreview::ExplorePreview(DataFile data) {
    if (const auto* volume = std::get_if<VoxelVolume>(&data.content)) {
        const auto source = [&](std::size_t most) {
            VolumeDescription described;
            auto voxels = std::make_shared<const VoxelVolume>(block_means(*volume, most));
            // Means of blocks are smooth already.
            const bool is_coarse = voxels->voxels() < volume->voxels();
            const bool has_gaps =
                std::ranges::any_of(voxels->values, [](float v) { return std::isnan(v); });
            described.voxels = std::move(voxels);
            auto made = std::make_unique<Source>(std::move(described));
            made->surface().smooth_voxels = is_coarse || has_gaps ? 0.0 : kSmoothing;
            made->surface().keep.kind = ComponentPolicy::Kind::largest;
            return made;
        };
        soon_ = source(kSoonVoxels);
        fine_ = source(kFineVoxels);
    } else if (auto* labels = std::get_if<LabelVolume>(&data.content)) {
        VolumeDescription described;
        described.label_volume = std::make_shared<const LabelVolume>(std::move(*labels));
        fine_ = std::make_unique<Source>(std::move(described));
    } else {
        mesh_ =
            std::make_shared<const TriangleMesh>(std::move(std::get<MeshFile>(data.content).mesh));
    }
}

TriangleMesh ExplorePreview::isosurface(double level, std::size_t most_voxels,
                                        const Progress& progress) {
    // Means of blocks may not reach what single voxels do.
    const bool is_soon = most_voxels <= kSoonVoxels && soon_->passes(level);
    Source& source = is_soon ? *soon_ : *fine_;
    if (!source.passes(level))
        throw std::runtime_error(
            fmt::format("iso-value {}: nothing is to be seen here, where blocks "
                        "of voxels are drawn by their means; a saved scene has "
                        "each voxel",
                        level));
    source.surface().iso_value = level;
    return source.preview(progress);
}

TriangleMesh ExplorePreview::label(const std::string& named, const Progress& progress) {
    fine_->surface().labels = {named};
    return fine_->preview(progress);
}

} // namespace palpate
