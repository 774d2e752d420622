// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/label_volume.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <numeric>
#include <set>
#include <stdexcept>
#include <utility>

namespace palpate {
namespace {

constexpr double kMm3PerM3 = 1e9;

/// Voxels of a label that follow one another along i: both ends, in voxels.
struct VoxelRun {
    std::int32_t value = 0;
    int begin = 0;
    int last = 0;
    int j = 0;
    int k = 0;
};

/// Calls visit(run) for each run of equal values but 0.
template <class Visit>
void for_each_run(const LabelVolume& volume, std::size_t layer, const Visit& visit) {
    const std::int32_t* row = volume.layers[layer].data();
    for (int k = 0; k < volume.size[2]; ++k)
        for (int j = 0; j < volume.size[1]; ++j, row += volume.size[0])
            for (int begin = 0; begin < volume.size[0];) {
                int end = begin + 1;
                while (end < volume.size[0] && row[end] == row[begin])
                    ++end;
                if (row[begin] != 0) visit(VoxelRun{row[begin], begin, end - 1, j, k});
                begin = end;
            }
}

/// Index of labels by layer and value.
class LabelIndex {
public:
    explicit LabelIndex(const std::vector<Label>& labels) : order_(labels.size()), labels_(labels) {
        std::iota(order_.begin(), order_.end(), std::size_t{0});
        std::stable_sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) {
            return key(labels_[a]) < key(labels_[b]);
        });
    }

    /// labels.size() where there is none.
    std::size_t find(std::size_t layer, std::int32_t value) const {
        const Key wanted{layer, value};
        const auto found = std::lower_bound(
            order_.begin(), order_.end(), wanted,
            [&](std::size_t label, const Key& k) { return key(labels_[label]) < k; });
        return found != order_.end() && key(labels_[*found]) == wanted ? *found : labels_.size();
    }

private:
    using Key = std::pair<std::size_t, std::int32_t>;
    static Key key(const Label& label) { return {label.layer, label.value}; }

    std::vector<std::size_t> order_;
    const std::vector<Label>& labels_;
};

void require_layers(const LabelVolume& volume, const char* who) {
    const auto [i, j, k] = volume.size;
    const auto voxels = static_cast<std::size_t>(std::max(i, 0)) *
                        static_cast<std::size_t>(std::max(j, 0)) *
                        static_cast<std::size_t>(std::max(k, 0));
    const bool filled = std::all_of(volume.layers.begin(), volume.layers.end(),
                                    [=](const auto& layer) { return layer.size() == voxels; });
    if (voxels == 0 || volume.layers.empty() || !filled)
        throw std::invalid_argument(std::string(who) +
                                    ": the volume is empty or its layers do not fill its size");
}

} // namespace

void match_labels_to_voxels(LabelVolume& volume) {
    std::set<std::pair<std::size_t, std::int32_t>> occur;
    for (std::size_t layer = 0; layer < volume.layers.size(); ++layer)
        for (const std::int32_t value :
             std::set<std::int32_t>(volume.layers[layer].begin(), volume.layers[layer].end()))
            if (value != 0) occur.insert({layer, value});
    const auto is_in_no_voxel = [&occur, layers = volume.layers.size()](const Label& label) {
        return label.value != 0 && label.layer < layers && !label.name.empty() &&
               !occur.contains({label.layer, label.value});
    };
    std::erase_if(volume.labels, is_in_no_voxel); // what is wrong stays for require_volume()
    for (const Label& label : volume.labels)
        occur.erase({label.layer, label.value});
    for (const auto& [layer, value] : occur)
        volume.labels.push_back({std::to_string(value), value, layer, {}});
}

std::vector<LabelExtent> label_extents(const LabelVolume& volume) {
    require_layers(volume, "label_extents");
    const AffineTransform& to_scene = volume.index_to_scene;
    const double voxel_mm3 = kMm3PerM3 * std::abs(glm::determinant(to_scene.linear));
    Vec3 half_voxel(0.0); // from a voxel's centre to the faces of the box around it
    for (int axis = 0; axis < 3; ++axis)
        half_voxel += 0.5 * glm::abs(to_scene.linear[axis]);

    const LabelIndex index(volume.labels);
    std::vector<LabelExtent> extents(volume.labels.size());
    for (std::size_t layer = 0; layer < volume.layers.size(); ++layer)
        for_each_run(volume, layer, [&](const VoxelRun& run) {
            const std::size_t label = index.find(layer, run.value);
            if (label == extents.size()) return;
            LabelExtent& extent = extents[label];
            extent.voxels += static_cast<std::size_t>(run.last - run.begin) + 1;
            for (const int i : {run.begin, run.last}) { // those between lie between
                const Vec3 center = to_scene.point(Vec3(i, run.j, run.k));
                extent.bounds.add(center - half_voxel);
                extent.bounds.add(center + half_voxel);
            }
        });
    for (LabelExtent& extent : extents)
        extent.volume_mm3 = voxel_mm3 * static_cast<double>(extent.voxels);
    return extents;
}

namespace {

/// Voxels from `lower` to `upper`, both among them.
struct IndexBox {
    std::array<int, 3> lower{};
    std::array<int, 3> upper{};
    bool empty = true;

    void add(const VoxelRun& run) {
        const std::array<int, 3> begin{run.begin, run.j, run.k};
        const std::array<int, 3> last{run.last, run.j, run.k};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            lower[axis] = empty ? begin[axis] : std::min(lower[axis], begin[axis]);
            upper[axis] = empty ? last[axis] : std::max(upper[axis], last[axis]);
        }
        empty = false;
    }
};

/// Calls visit(run) for each run of any of the chosen labels.
template <class Visit>
void for_each_chosen_run(const LabelVolume& volume, std::span<const std::size_t> chosen,
                         const Visit& visit) {
    std::vector<Label> wanted;
    for (const std::size_t label : chosen)
        wanted.push_back(volume.labels[label]);
    const LabelIndex index(wanted);
    for (std::size_t layer = 0; layer < volume.layers.size(); ++layer)
        if (std::any_of(wanted.begin(), wanted.end(),
                        [layer](const Label& label) { return label.layer == layer; }))
            for_each_run(volume, layer, [&](const VoxelRun& run) {
                if (index.find(layer, run.value) < wanted.size()) visit(run);
            });
}

void require_chosen(const LabelVolume& volume, std::span<const std::size_t> chosen) {
    require_layers(volume, "label_occupancy");
    if (chosen.empty()) throw std::invalid_argument("label_occupancy: no label is chosen");
    for (const std::size_t label : chosen)
        if (label >= volume.labels.size())
            throw std::invalid_argument("label_occupancy: there is no label " +
                                        std::to_string(label) + " of " +
                                        std::to_string(volume.labels.size()));
}

} // namespace

VoxelVolume label_occupancy(const LabelVolume& volume, std::span<const std::size_t> chosen,
                            int margin) {
    require_chosen(volume, chosen);
    IndexBox box;
    for_each_chosen_run(volume, chosen, [&](const VoxelRun& run) { box.add(run); });
    if (box.empty)
        throw std::invalid_argument(
            "label_occupancy: no voxel has the label \"" + volume.labels[chosen.front()].name +
            (chosen.size() > 1 ? "\" or the others" : "\"") + "; choose one that occurs");

    VoxelVolume occupancy;
    Vec3 corner(0.0); // voxel 0,0,0 of the occupancy in the label volume
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::int64_t size =
            std::int64_t{box.upper[axis]} - box.lower[axis] + 1 + 2 * std::int64_t{margin};
        if (margin < 0 || size > std::numeric_limits<int>::max())
            throw std::invalid_argument("label_occupancy: a margin of " + std::to_string(margin) +
                                        " voxels is negative or too large");
        occupancy.size[axis] = static_cast<int>(size);
        corner[static_cast<int>(axis)] = box.lower[axis] - margin;
    }
    occupancy.index_to_scene = {volume.index_to_scene.linear, volume.index_to_scene.point(corner)};
    occupancy.source_type = volume.source_type;
    occupancy.values.assign(occupancy.voxels(), 0.0F);
    for_each_chosen_run(volume, chosen, [&](const VoxelRun& run) {
        const std::size_t first =
            occupancy.index(run.begin - box.lower[0] + margin, run.j - box.lower[1] + margin,
                            run.k - box.lower[2] + margin);
        std::fill_n(occupancy.values.begin() + static_cast<std::ptrdiff_t>(first),
                    run.last - run.begin + 1, 1.0F);
    });
    return occupancy;
}

} // namespace palpate
