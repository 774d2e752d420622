// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>

#include <palpate/geometry/vec.h>

namespace palpate {

/// What sizes a patient, or a specimen, can have: what is beyond is a damaged header or a wrong
/// unit, and nothing can be computed with it. Of every volume and mesh, whatever it is read from.
struct PatientSize {
    static constexpr double kSmallestVoxel = 2e-8; ///< m, along each axis; OpenVDB's least is 14 nm
    static constexpr double kLargestVoxel = 1.0;   ///< m, along each axis
    static constexpr double kMostUneven = 1e4;     ///< longest side of a voxel by its shortest
    static constexpr double kLargestExtent = 100.0; ///< m, along each axis
    static constexpr double kFarthest = 1000.0;     ///< m from the scene's origin, along each axis
};

/// Why a map from voxel indices to the scene (m) leads nowhere: "is not finite; ...", or "is
/// singular: ...; what to do". Empty where it can be inverted.                             [any]
std::string irregularity(const AffineTransform& index_to_scene);

/// Why no patient has a size.
struct Implausible {
    enum class Part { spacing, place };
    Part part = Part::spacing; ///< of a header, that is wrong
    std::string what;          ///< "has voxels of 1e-30 x 1 x 1 mm, where ...; correct ..."
};

/// What is implausible in a grid of `size` voxels, which `index_to_scene` (m) places; nothing where
/// nothing is. Numbers that are not finite are implausible.                               [any]
std::optional<Implausible> implausible_grid(const std::array<int, 3>& size,
                                            const AffineTransform& index_to_scene);

/// The same for the bounds (m) of a mesh; empty bounds are plausible.                      [any]
std::optional<Implausible> implausible_bounds(const Box& bounds);

} // namespace palpate
