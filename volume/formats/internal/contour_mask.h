// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <palpate/geometry/vec.h>
#include <palpate/volume/formats/internal/label_layers.h>

namespace palpate::internal {

/// Corners of a closed polygon in one plane.
using Contour = std::vector<Vec3>;

/// The voxels inside the contours of one structure, which lie in parallel planes.
///
/// A voxel is inside where its centre, moved along one axis of the grid into a contour plane, is
/// inside an odd number of that plane's contours: a contour within another one is a hole, and a
/// channel of no width to it (a keyhole) changes nothing. The axis is the one nearest to the
/// normal of the planes, where both are seen in voxels. The plane is the nearest one along that
/// axis, no farther away than half of `usual_step`; half-way between two planes it is the one with
/// the greater index. A centre on a contour is inside where the structure lies at greater indices.
class ContourMask {
public:
    /// Contours in voxels of a grid (index 0 is the centre of the first voxel), all finite.
    /// [setup] Throws std::invalid_argument with words that follow the structure's name: contours
    /// that are not in planes, or whose planes are not parallel.
    explicit ContourMask(const std::vector<Contour>& contours);

    /// Distances between neighbouring planes along the axis, voxels.                    [setup]
    std::vector<double> steps() const;

    /// The voxels inside, for a grid of that size; each once. `usual_step` > 0, voxels. [setup]
    std::vector<VoxelRun> voxels(const std::array<int, 3>& size, double usual_step) const;

private:
    using Polygon = std::vector<std::array<double, 2>>; ///< along the two other axes

    /// Contours of one plane: the axis' index is height - slope_[0] * b - slope_[1] * c.
    struct Plane {
        double height = 0.0;
        std::vector<Polygon> polygons;
    };

    bool lies_along(const std::vector<Contour>& contours, int axis);
    void fit_plane(const std::vector<Contour>& contours);
    void sort_into_planes(const std::vector<Contour>& contours);
    double height_of(const Vec3& corner) const noexcept;

    int axis_ = 2;                    ///< nearest to the normal
    std::array<int, 2> others_{0, 1}; ///< b, c
    std::array<double, 2> slope_{0.0, 0.0};
    std::vector<Plane> planes_; ///< by height
};

/// What half of the planes are closer than; nothing where there is one plane only.       [any]
std::optional<double> median_step(std::vector<double> steps) noexcept;

} // namespace palpate::internal
