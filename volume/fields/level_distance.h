// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include <palpate/geometry/triangle_mesh.h>
#include <palpate/volume/scalar_field.h>

namespace palpate {

/// Distances of points from the iso-level of a field, m.
struct LevelDistance {
    std::size_t points = 0; ///< that were measured, with the lost ones
    std::size_t lost = 0;   ///< points from which no root was found within 3 feature sizes; not in
                            ///< the numbers below
    double mean_m = 0.0;    ///< of the points that are not lost
    double p99_m = 0.0;     ///< nearest rank: the smallest that 99 of 100 do not exceed
    double max_m = 0.0;     ///< of the worst point
};

/// Distance to the level of the field as interpolated (a grid's trilinear one), from each point.
/// Newton steps along the slope find the level, a bracketed root on the line from the point puts a
/// foot on it, and the line is turned along the slope there as long as that brings the foot nearer.
/// So a distance is that to a true point of the level, never too small. It is too large where
/// another sheet is nearer than the one that the slope leads to, and by a fraction of a percent
/// where a kink between cells holds the foot. Deterministic.                            [setup]
LevelDistance level_distance(const ScalarField& field, double level, std::span<const Vec3> points);

/// What a mesh of a level errs by: at its vertices, and at its triangles' centroids, where flat
/// facets leave a curved surface.
struct MeshError {
    LevelDistance vertices;  ///< where the mesh is meant to be exact
    LevelDistance centroids; ///< where it is farthest off, as a rule
};

/// Throws std::invalid_argument when a triangle names a vertex that does not exist.     [setup]
MeshError mesh_error(const ScalarField& field, double level, const TriangleMesh& mesh);

} // namespace palpate
