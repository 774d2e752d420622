// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/label_layers.h>

#include <algorithm>
#include <new>
#include <utility>

#include <palpate/volume/formats/internal/segmentation.h>
#include <palpate/volume/formats/internal/volume_import.h>

namespace palpate::internal {
namespace {

std::size_t voxels_of(const std::array<int, 3>& size) {
    return static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
           static_cast<std::size_t>(size[2]);
}

bool is_free(const std::vector<std::int32_t>& layer, std::span<const VoxelRun> runs) {
    return std::all_of(runs.begin(), runs.end(), [&](const VoxelRun& run) {
        const auto first = layer.begin() + static_cast<std::ptrdiff_t>(run.first);
        return std::all_of(first, first + static_cast<std::ptrdiff_t>(run.count),
                           [](std::int32_t value) { return value == 0; });
    });
}

} // namespace

LabelLayers::LabelLayers(std::filesystem::path file, const LabelVolume& grid)
    : file_(std::move(file)), volume_(grid) {
    volume_.layers.clear();
    volume_.labels.clear();
    free_layer({});
}

LabelLayers::Layer& LabelLayers::free_layer(std::span<const VoxelRun> runs) {
    for (Layer& layer : layers_)
        if (is_free(layer, runs)) return layer;
    // A system may promise more memory than it has, and end the process that uses it.
    require_memory(file_, static_cast<double>(voxels_of(volume_.size)) *
                              static_cast<double>(layers_.size() + 1));
    try {
        return layers_.emplace_back(voxels_of(volume_.size));
    } catch (const std::bad_alloc&) {
        throw import_error(file_, "has structures that overlap in " +
                                      std::to_string(layers_.size() + 1) +
                                      " layers, which do not fit into memory; crop or resample it");
    }
}

void LabelLayers::add(std::int32_t value, LabelName name, std::span<const VoxelRun> runs) {
    if (runs.empty()) {
        empty_.push_back(std::move(name.name));
        return;
    }
    Layer& layer = free_layer(runs);
    for (const VoxelRun& run : runs) {
        const auto first = layer.begin() + static_cast<std::ptrdiff_t>(run.first);
        std::fill(first, first + static_cast<std::ptrdiff_t>(run.count), value);
    }
    names_.insert_or_assign(value, std::move(name));
}

LabelVolume LabelLayers::taken(const LabelNames& table) && {
    LabelNames names = table;
    names.merge(names_);
    for (Layer& layer : layers_) {
        volume_.layers.emplace_back(std::move(layer));
        add_labels(volume_, volume_.layers.size() - 1, names);
    }
    if (!empty_.empty())
        volume_.warnings.push_back("structures without voxels are left out: " + short_list(empty_));
    return std::move(volume_);
}

} // namespace palpate::internal
