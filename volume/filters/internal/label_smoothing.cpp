// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include <palpate/volume/filters/label_filters.h>
#include <palpate/volume/filters/volume_filters.h>

// The part of label_filters.h that smooths a label against its neighbours.
namespace palpate {
namespace {

// Exponent of the norm of what stands against a label. 1 is the plain Gaussian: where three meet at
// a third each, nobody reaches one half, and a groove opens between them. At infinity it is the
// largest of the others: no groove, but a crease where another one becomes the largest. At 4, where
// three meet the chosen one has 0.457 of 1, and the crease is rounded.
constexpr double kRivalPower = 4.0;

// Beyond these the kernel of smooth() has no weight (volume_filters.h).
constexpr double kKernelSigmas = 4.0;
constexpr int kKernelVoxels = 2;

constexpr double kOnVoxels = 1e-3; // voxels by which an occupancy may lie off the labels' voxels

constexpr double kFarthest = 1e9; // voxels between the two: an int holds it and a size

constexpr float kInside = 0.5F;

/// Voxels from `lower` up to, not with, `upper`.
struct IndexBox {
    std::array<int, 3> lower{};
    std::array<int, 3> upper{};

    void add(const std::array<int, 3>& voxel) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            lower[axis] = std::min(lower[axis], voxel[axis]);
            upper[axis] = std::max(upper[axis], voxel[axis] + 1);
        }
    }
    IndexBox grown(int voxels) const {
        IndexBox box = *this;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            box.lower[axis] -= voxels;
            box.upper[axis] += voxels;
        }
        return box;
    }
    IndexBox within(const IndexBox& other) const {
        IndexBox box;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            box.lower[axis] = std::max(lower[axis], other.lower[axis]);
            box.upper[axis] = std::max(box.lower[axis], std::min(upper[axis], other.upper[axis]));
        }
        return box;
    }
};

/// Calls visit(voxel) for each voxel of a box, i fastest.
template <class Visit>
void for_each_voxel(const IndexBox& box, const Visit& visit) {
    for (int k = box.lower[2]; k < box.upper[2]; ++k)
        for (int j = box.lower[1]; j < box.upper[1]; ++j)
            for (int i = box.lower[0]; i < box.upper[0]; ++i)
                visit(std::array<int, 3>{i, j, k});
}

/// Where the occupancy's voxel 0,0,0 lies among the labels' voxels.
std::array<int, 3> offset_in(const LabelVolume& volume, const VoxelVolume& occupancy) {
    const AffineTransform to_index = volume.index_to_scene.inverse();
    const Vec3 corner = to_index.point(occupancy.index_to_scene.offset);
    bool same_voxels = true; // written so that NaN is not
    std::array<int, 3> offset{};
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        const double whole = std::round(corner[axis]);
        same_voxels = same_voxels && std::abs(whole) < kFarthest &&
                      std::abs(corner[axis] - whole) < kOnVoxels;
        if (!same_voxels) break;
        offset[a] = static_cast<int>(whole);

        Vec3 expected(0.0);
        expected[axis] = occupancy.size[a];
        const Vec3 end = to_index.direction(occupancy.index_to_scene.linear[axis]) * expected[axis];
        same_voxels = glm::length(end - expected) < kOnVoxels;
    }
    if (!same_voxels)
        throw std::invalid_argument("smooth_against_neighbours: the occupancy's voxels are not "
                                    "those of the label volume");
    return offset;
}

std::int32_t label_at(const LabelVolume& volume, std::size_t layer,
                      const std::array<int, 3>& voxel) {
    const auto i = static_cast<std::size_t>(voxel[0]);
    const auto j = static_cast<std::size_t>(voxel[1]);
    const auto k = static_cast<std::size_t>(voxel[2]);
    const auto width = static_cast<std::size_t>(volume.size[0]);
    const auto height = static_cast<std::size_t>(volume.size[1]);
    return volume.layers[layer][i + width * (j + height * k)];
}

/// Everything that is not chosen, near the chosen: label by label, each on its own small box.
class Rivals {
public:
    Rivals(const LabelVolume& volume, std::span<const std::size_t> chosen,
           const VoxelVolume& occupancy, int kernel)
        : volume_(volume), occupancy_(occupancy), offset_(offset_in(volume, occupancy)),
          kernel_(kernel) {
        for (const std::size_t label : chosen)
            chosen_.insert({volume.labels[label].layer, volume.labels[label].value});
        grid_.upper = occupancy.size;
        find();
    }

    /// Calls visit(index in the occupancy, smoothed occupancy of one rival) for every rival and
    /// every voxel that it may reach.
    template <class Visit>
    void for_each_value(double sigma, const Visit& visit) const {
        for (const auto& [rival, box] : boxes_) {
            // What it may reach, and what these values are made of: as much as is looked at.
            const IndexBox reached = box.grown(kernel_);
            const IndexBox domain = reached.within(grid_).grown(kernel_).within(reached);
            const VoxelVolume smoothed = smoothed_rival(rival, box, domain, sigma);
            for_each_voxel(reached.within(grid_), [&](const std::array<int, 3>& voxel) {
                const float value =
                    smoothed.at(voxel[0] - domain.lower[0], voxel[1] - domain.lower[1],
                                voxel[2] - domain.lower[2]);
                visit(occupancy_.index(voxel[0], voxel[1], voxel[2]), value);
            });
        }
    }

private:
    using Rival = std::pair<std::size_t, std::int32_t>; ///< layer, value

    /// Voxels of the label volume as the occupancy counts them: those near enough to matter.
    IndexBox visible() const {
        IndexBox box;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            box.lower[axis] = -offset_[axis];
            box.upper[axis] = volume_.size[axis] - offset_[axis];
        }
        return box.within(grid_.grown(kernel_));
    }

    std::int32_t value_at(std::size_t layer, const std::array<int, 3>& voxel) const {
        return label_at(volume_, layer,
                        {voxel[0] + offset_[0], voxel[1] + offset_[1], voxel[2] + offset_[2]});
    }

    /// In several layers the same voxel may be chosen and another's as well: then it is chosen.
    bool is_chosen(const std::array<int, 3>& voxel) const {
        for (std::size_t axis = 0; axis < 3; ++axis)
            if (voxel[axis] < 0 || voxel[axis] >= occupancy_.size[axis]) return false;
        return occupancy_.at(voxel[0], voxel[1], voxel[2]) >= kInside;
    }

    void find() {
        std::set<std::size_t> layers;
        for (const Rival& label : chosen_)
            layers.insert(label.first);
        for (const std::size_t layer : layers)
            for_each_voxel(visible(), [&](const std::array<int, 3>& voxel) {
                const Rival rival{layer, value_at(layer, voxel)};
                if (rival.second == 0 || chosen_.contains(rival)) return;
                boxes_.try_emplace(rival, IndexBox{voxel, voxel}).first->second.add(voxel);
            });
    }

    VoxelVolume smoothed_rival(const Rival& rival, const IndexBox& box, const IndexBox& domain,
                               double sigma) const {
        VoxelVolume one;
        for (std::size_t axis = 0; axis < 3; ++axis)
            one.size[axis] = domain.upper[axis] - domain.lower[axis];
        one.values.assign(one.voxels(), 0.0F);
        for_each_voxel(box.within(domain), [&](const std::array<int, 3>& voxel) {
            if (value_at(rival.first, voxel) == rival.second && !is_chosen(voxel))
                one.values[one.index(voxel[0] - domain.lower[0], voxel[1] - domain.lower[1],
                                     voxel[2] - domain.lower[2])] = 1.0F;
        });
        smooth(one, sigma);
        return one;
    }

    const LabelVolume& volume_;
    const VoxelVolume& occupancy_;
    std::array<int, 3> offset_;
    int kernel_;
    IndexBox grid_; ///< of the occupancy, in its own voxels, as all boxes here
    std::set<Rival> chosen_;
    std::map<Rival, IndexBox> boxes_;
};

void require_chosen(const LabelVolume& volume, std::span<const std::size_t> chosen) {
    const auto [i, j, k] = volume.size;
    const std::size_t voxels = static_cast<std::size_t>(std::max(i, 0)) *
                               static_cast<std::size_t>(std::max(j, 0)) *
                               static_cast<std::size_t>(std::max(k, 0));
    const bool exist = std::all_of(chosen.begin(), chosen.end(), [&](std::size_t label) {
        return label < volume.labels.size() && volume.labels[label].layer < volume.layers.size() &&
               volume.layers[volume.labels[label].layer].size() == voxels;
    });
    if (chosen.empty() || !exist)
        throw std::invalid_argument("smooth_against_neighbours: no label is chosen, or one that "
                                    "the volume does not have");
}

} // namespace

VoxelVolume smooth_against_neighbours(const LabelVolume& volume,
                                      std::span<const std::size_t> chosen,
                                      const VoxelVolume& occupancy, double sigma_voxels) {
    require_chosen(volume, chosen);
    VoxelVolume smoothed = occupancy;
    smooth(smoothed, sigma_voxels);
    if (sigma_voxels == 0.0) return smoothed;

    const int kernel = static_cast<int>(std::ceil(kKernelSigmas * sigma_voxels)) + kKernelVoxels;
    std::vector<float> rivals(occupancy.voxels(), 0.0F); // sum of all others but the background
    std::vector<float> powers(occupancy.voxels(), 0.0F); // sum of their fourth powers
    Rivals(volume, chosen, occupancy, kernel)
        .for_each_value(sigma_voxels, [&](std::size_t voxel, float value) {
            rivals[voxel] += value;
            powers[voxel] += value * value * value * value;
        });
    for (std::size_t voxel = 0; voxel < rivals.size(); ++voxel) {
        const double own = smoothed.values[voxel];
        if (!(own > 0.0)) continue;
        const double background = std::max(0.0, 1.0 - own - rivals[voxel]);
        const double against =
            std::pow(powers[voxel] + std::pow(background, kRivalPower), 1.0 / kRivalPower);
        smoothed.values[voxel] = static_cast<float>(own / (own + against));
    }
    return smoothed;
}

VoxelVolume without_grooves(const LabelVolume& volume, std::span<const std::size_t> chosen,
                            std::span<const std::size_t> joined, const VoxelVolume& smoothed,
                            double sigma_voxels) {
    require_chosen(volume, chosen);
    require_chosen(volume, joined);
    const std::array<int, 3> offset = offset_in(volume, smoothed);
    using LayerAndValue = std::pair<std::size_t, std::int32_t>;
    const auto values_of = [&](std::span<const std::size_t> labels) {
        std::set<LayerAndValue> values;
        for (const std::size_t label : labels)
            values.insert({volume.labels[label].layer, volume.labels[label].value});
        return values;
    };
    const std::set<LayerAndValue> own = values_of(chosen);
    const std::set<LayerAndValue> all = values_of(joined);

    // The voxels of `joined` in the box of `smoothed`.
    VoxelVolume together = smoothed;
    together.values.assign(together.voxels(), 0.0F);
    IndexBox visible; // of the label volume
    for (std::size_t axis = 0; axis < 3; ++axis) {
        visible.lower[axis] = -offset[axis];
        visible.upper[axis] = volume.size[axis] - offset[axis];
    }
    IndexBox grid;
    grid.upper = smoothed.size;
    bool alone = true;
    for (std::size_t layer = 0; layer < volume.layers.size(); ++layer)
        for_each_voxel(visible.within(grid), [&](const std::array<int, 3>& voxel) {
            const LayerAndValue here{layer, label_at(volume, layer,
                                                     {voxel[0] + offset[0], voxel[1] + offset[1],
                                                      voxel[2] + offset[2]})};
            if (here.second == 0 || !all.contains(here)) return;
            together.values[together.index(voxel[0], voxel[1], voxel[2])] = 1.0F;
            alone = alone && own.contains(here);
        });
    if (alone) return smoothed;

    VoxelVolume closed = smooth_against_neighbours(volume, joined, together, sigma_voxels);
    for (std::size_t voxel = 0; voxel < closed.values.size(); ++voxel)
        closed.values[voxel] = std::min(closed.values[voxel],
                                        static_cast<float>(smoothed.values[voxel] / kGrooveReach));
    return closed;
}

} // namespace palpate
