// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <palpate/volume/filters/label_filters.h>
#include <palpate/volume/filters/volume_filters.h>
#include <palpate/volume/label_volume.h>

/// How the smoothed surfaces of two labels that touch lie to one another.
namespace palpate::test {

/// A label's smoothed field and the level of its surface.
struct LabelSurface {
    VoxelVolume field;
    double level = 0.0;

    /// Trilinear value at a scene point; 0 outside.
    double value(const Vec3& point) const {
        const Vec3 index = field.index_to_scene.inverse().point(point);
        std::array<int, 3> cell{};
        std::array<double, 3> t{};
        for (int axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            if (!(index[axis] >= 0.0 && index[axis] <= field.size[a] - 1)) return 0.0;
            cell[a] = std::min(static_cast<int>(index[axis]), field.size[a] - 2);
            t[a] = index[axis] - cell[a];
        }
        double sum = 0.0;
        for (int corner = 0; corner < 8; ++corner) {
            const int i = corner & 1, j = corner >> 1 & 1, k = corner >> 2;
            sum += (i ? t[0] : 1.0 - t[0]) * (j ? t[1] : 1.0 - t[1]) * (k ? t[2] : 1.0 - t[2]) *
                   field.at(cell[0] + i, cell[1] + j, cell[2] + k);
        }
        return sum;
    }
    bool contains(const Vec3& point) const { return value(point) >= level; }
};

enum class Smoothing { against_neighbours, plain_gaussian };

/// The label's surface at the level that keeps the volume of its voxels.
inline LabelSurface smoothed_label(const LabelVolume& volume, std::size_t label, double sigma,
                                   Smoothing smoothing = Smoothing::against_neighbours) {
    const std::array<std::size_t, 1> chosen{label};
    const int margin = static_cast<int>(std::ceil(4.0 * sigma)) + 2;
    LabelSurface surface;
    surface.field = label_occupancy(volume, chosen, margin);
    if (smoothing == Smoothing::plain_gaussian)
        smooth(surface.field, sigma);
    else
        surface.field = smooth_against_neighbours(volume, chosen, surface.field, sigma);
    surface.level =
        level_keeping_volume(surface.field, 1e-9 * label_extents(volume)[label].volume_mm3);
    return surface;
}

/// Distances from where A's surface is left to where B's is entered, along the normals of the voxel
/// faces between A and B, in voxels: positive = a gap, negative = an overlap. Nine points a face.
struct LabelGaps {
    std::vector<double> between_two;     ///< faces with nothing but A and B near; sorted
    std::vector<double> near_third;      ///< a third label is near, but no background; sorted
    std::vector<double> near_background; ///< background is near: the rim; sorted
    std::size_t taken = 0;  ///< points in one of them where the other's is not within 2.5 voxels
    std::size_t absent = 0; ///< points in neither where one's is not within 2.5 voxels
};

/// Value at that share of sorted numbers; 0 of none.
inline double quantile(const std::vector<double>& sorted, double share) {
    if (sorted.empty()) return 0.0;
    const auto at = static_cast<std::size_t>(share * static_cast<double>(sorted.size()));
    return sorted[std::min(at, sorted.size() - 1)];
}

/// How far the surface reaches along `step` (a voxel long) from `point`, in voxels: negative where
/// it ends before. Nothing where it does not reach within 2.5 voxels, or does not end there.
inline std::optional<double> reach(const LabelSurface& surface, const Vec3& point,
                                   const Vec3& step) {
    constexpr double kSearch = 2.5;
    constexpr double kStep = 0.05;
    const bool inside = surface.contains(point);
    const double direction = inside ? 1.0 : -1.0;
    double near_value = surface.value(point);
    for (int n = 1; n * kStep <= kSearch; ++n) {
        const double value = surface.value(point + direction * n * kStep * step);
        if ((value >= surface.level) != inside)
            return direction * kStep *
                   (n - 1 + (surface.level - near_value) / (value - near_value));
        near_value = value;
    }
    return std::nullopt;
}

/// `near`: how many voxels around a face count as there.
inline LabelGaps gaps_between(const LabelVolume& volume, std::size_t a, std::size_t b,
                              const LabelSurface& surface_a, const LabelSurface& surface_b,
                              int near = 1) {
    const VoxelNumbers<std::int32_t>& values = volume.layers[volume.labels[a].layer];
    const std::int32_t value_a = volume.labels[a].value;
    const std::int32_t value_b = volume.labels[b].value;
    const auto value_at = [&](const std::array<int, 3>& v) -> std::int32_t {
        for (std::size_t axis = 0; axis < 3; ++axis)
            if (v[axis] < 0 || v[axis] >= volume.size[axis]) return 0;
        const auto width = static_cast<std::size_t>(volume.size[0]);
        const auto height = static_cast<std::size_t>(volume.size[1]);
        return values[static_cast<std::size_t>(v[0]) +
                      width * (static_cast<std::size_t>(v[1]) +
                               height * static_cast<std::size_t>(v[2]))];
    };
    enum class Around { two_labels, third_label, background };
    const auto around = [&](const std::array<int, 3>& v) {
        Around found = Around::two_labels;
        for (int k = -near; k <= near; ++k)
            for (int j = -near; j <= near; ++j)
                for (int i = -near; i <= near; ++i) {
                    const std::int32_t value = value_at({v[0] + i, v[1] + j, v[2] + k});
                    if (value == 0) return Around::background;
                    if (value != value_a && value != value_b) found = Around::third_label;
                }
        return found;
    };

    LabelGaps gaps;
    const auto add_face = [&](const std::array<int, 3>& in_a, const std::array<int, 3>& in_b) {
        const Vec3 index_a(in_a[0], in_a[1], in_a[2]);
        const Vec3 along = Vec3(in_b[0], in_b[1], in_b[2]) - index_a;
        const Vec3 step = volume.index_to_scene.direction(along);
        const Around worst = std::max(around(in_a), around(in_b));
        std::vector<double>& distances = worst == Around::two_labels    ? gaps.between_two
                                         : worst == Around::third_label ? gaps.near_third
                                                                        : gaps.near_background;
        for (int n = 0; n < 9; ++n) {
            const Vec3 u(along.y, along.z, along.x);
            const Vec3 v(along.z, along.x, along.y);
            const Vec3 index =
                index_a + 0.5 * along + (n % 3 - 1) / 3.0 * u + (n / 3 - 1) / 3.0 * v;
            const Vec3 point = volume.index_to_scene.point(index);
            const auto reach_a = reach(surface_a, point, step);
            const auto reach_b = reach(surface_b, point, -step);
            if (reach_a && reach_b)
                distances.push_back(-*reach_a - *reach_b);
            else
                ++(surface_a.contains(point) || surface_b.contains(point) ? gaps.taken
                                                                          : gaps.absent);
        }
    };
    for (int k = 0; k < volume.size[2]; ++k)
        for (int j = 0; j < volume.size[1]; ++j)
            for (int i = 0; i < volume.size[0]; ++i)
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    const std::array<int, 3> here{i, j, k};
                    std::array<int, 3> next = here;
                    ++next[axis];
                    if (value_at(here) == value_a && value_at(next) == value_b)
                        add_face(here, next);
                    else if (value_at(here) == value_b && value_at(next) == value_a)
                        add_face(next, here);
                }
    std::sort(gaps.between_two.begin(), gaps.between_two.end());
    std::sort(gaps.near_third.begin(), gaps.near_third.end());
    std::sort(gaps.near_background.begin(), gaps.near_background.end());
    return gaps;
}

} // namespace palpate::test
