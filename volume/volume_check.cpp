// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/volume_check.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include <palpate/geometry/patient_size.h>

namespace palpate {
namespace {

[[noreturn]] void fail(std::string_view what, const std::string& why) {
    throw std::invalid_argument(std::string(what) + why);
}

std::string in_words(const std::array<int, 3>& size) {
    return std::to_string(size[0]) + " x " + std::to_string(size[1]) + " x " +
           std::to_string(size[2]);
}

/// Size and place, which all volumes have.
void require_grid(std::string_view what, const std::array<int, 3>& size, int least,
                  const AffineTransform& index_to_scene) {
    constexpr double kMostVoxels = 1e12; // as of files; their count is then exact
    double voxels = 1.0;
    for (const int n : size)
        voxels *= n;
    if (*std::min_element(size.begin(), size.end()) < least || voxels > kMostVoxels)
        fail(what, ".size = " + in_words(size) + " is out of range; give at least " +
                       std::to_string(least) + " along each axis, and at most 1e12 voxels");
    if (const std::string why = irregularity(index_to_scene); !why.empty())
        fail(what, ".index_to_scene " + why);
    if (const auto implausible = implausible_grid(size, index_to_scene))
        fail(what, " " + implausible->what);
}

void require_count(std::string_view what, std::string_view field, std::size_t count,
                   const std::array<int, 3>& size, std::size_t voxels, std::size_t of_each) {
    if (count == voxels * of_each) return;
    fail(what, "." + std::string(field) + " has " + std::to_string(count) + " numbers, and size " +
                   in_words(size) + " takes " + std::to_string(voxels * of_each) + "; give " +
                   std::to_string(of_each) + " for each voxel, i fastest");
}

using Value = std::pair<std::size_t, std::int32_t>; // layer, value

/// The labels' values, each once.
std::set<Value> values_of(std::string_view what, const LabelVolume& volume) {
    std::set<Value> values;
    for (std::size_t i = 0; i < volume.labels.size(); ++i) {
        const Label& label = volume.labels[i];
        const std::string at = ".labels[" + std::to_string(i) + "]";
        if (label.name.empty()) fail(what, at + ".name is empty; give it a name");
        if (label.value == 0)
            fail(what, at + ".value = 0 is the background's; give the value of its voxels");
        if (label.layer >= volume.layers.size())
            fail(what, at + ".layer = " + std::to_string(label.layer) + ", and there are " +
                           std::to_string(volume.layers.size()) + " layers; count them from 0");
        if (!values.insert({label.layer, label.value}).second)
            fail(what, at + " has the value and the layer of another; keep one of them");
    }
    return values;
}

} // namespace

void require_volume(std::string_view what, const VoxelVolume& volume) {
    require_grid(what, volume.size, 1, volume.index_to_scene);
    require_count(what, "values", volume.values.size(), volume.size, volume.voxels(), 1);
}

void require_volume(std::string_view what, const LabelVolume& volume) {
    require_grid(what, volume.size, 1, volume.index_to_scene);
    if (volume.layers.empty()) fail(what, ".layers is empty; give one, or one more per overlap");
    std::size_t voxels = 1;
    for (const int n : volume.size)
        voxels *= static_cast<std::size_t>(n);
    for (std::size_t layer = 0; layer < volume.layers.size(); ++layer)
        require_count(what, "layers[" + std::to_string(layer) + "]", volume.layers[layer].size(),
                      volume.size, voxels, 1);
    const std::set<Value> values = values_of(what, volume);
    for (std::size_t layer = 0; layer < volume.layers.size(); ++layer) {
        std::int32_t last = 0; // voxels beside each other mostly have the same
        for (const std::int32_t value : volume.layers[layer]) {
            if (value == last || value == 0) continue;
            if (!values.contains({layer, value}))
                fail(what, ".layers[" + std::to_string(layer) + "] has voxels of value " +
                               std::to_string(value) +
                               ", which no label has; name it in labels, or call "
                               "match_labels_to_voxels()");
            last = value;
        }
    }
}

void require_volume(std::string_view what, const VectorVolume& volume) {
    const bool tensors = volume.kind == VectorVolume::Kind::symmetric_tensor;
    const int components = tensors ? 6 : 3;
    require_grid(what, volume.size, 2, volume.index_to_scene);
    if (volume.components != components)
        fail(what, ".components = " + std::to_string(volume.components) + " is not of its kind; " +
                       "give " + std::to_string(components));
    require_count(what, "values", volume.values.size(), volume.size, volume.voxels(),
                  static_cast<std::size_t>(components));
}

} // namespace palpate
