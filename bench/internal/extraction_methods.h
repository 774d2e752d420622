// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <palpate/geometry/isosurface.h>
#include <palpate/volume/scalar_field.h>

/// Ways to mesh an isosurface that the library does not take, to compare its own with. CGAL, GPL.
namespace palpate::bench {

/// A level of a field, with points on it: they decide which components exist.
struct ExtractionTask {
    const ScalarField& field;
    double level = 0.0;             ///< the field's unit
    const std::vector<Vec3>& seeds; ///< m, scene frame
    IsosurfaceSettings settings;
};

/// CGAL's Surface_mesher with its manifold criterion. Facets come without an orientation; they are
/// turned alike where that is possible, and each component towards lower values.
TriangleMesh by_surface_mesher(const ExtractionTask& task);

/// CGAL's Mesh_3 with Parallel_tag and its manifold criterion, one round.
TriangleMesh by_parallel_mesh_3(const ExtractionTask& task);

} // namespace palpate::bench
