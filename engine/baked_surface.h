// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <palpate/engine/scene_description.h>
#include <palpate/geometry/isosurface.h>
#include <palpate/volume/grid_field.h>
#include <palpate/volume/scalar_field.h>
#include <palpate/volume/volume_filters.h>

namespace palpate {

/// A field made ready for one surface: smoothed, its level chosen again, unwanted components
/// removed. Mesh and contact take the same one, so that they are of the same thing.
struct BakedSurface {
    std::shared_ptr<const ScalarField> field;
    std::shared_ptr<const GridField> grid; ///< the same when it is a grid; null for a formula
    double level = 0.0;                    ///< the field's unit
    SurfaceShift shift;                    ///< against the surface before smoothing
    std::vector<VolumeComponent>
        components;  ///< of the material, largest first; empty for a formula
    std::string key; ///< hash of everything that went in: names it in the cache
    bool from_cache = false;
};

/// Bakes a surface of a scene; what was baked before comes from `cache` (a folder; empty = no
/// cache).     [setup] Throws std::runtime_error "FILE:LINE: what is wrong; what to do": file
/// errors as read_volume(), a level that no voxel reaches, a policy that keeps nothing; or progress
/// cancelled it.
BakedSurface bake_surface(const SceneDescription& scene, const std::string& surface,
                          const std::filesystem::path& cache, const Progress& progress = {});

/// A mesh of a baked surface.
struct BakedMesh {
    std::shared_ptr<const TriangleMesh> mesh;
    bool from_cache = false;
};

/// Preview components with fewer triangles are noise of single voxels: not seeded, and not missed.
inline constexpr std::size_t kSmallestComponentTriangles = 40;

/// Extracts the mesh of a baked surface, or reads it from the cache.                     [setup]
/// Throws as `extract` does, and std::runtime_error when `extract` is empty (a build without CGAL)
/// or the surface is a formula.
BakedMesh mesh_surface(const BakedSurface& surface, const IsosurfaceSettings& settings,
                       const IsosurfaceExtractor& extract, const std::filesystem::path& cache,
                       const Progress& progress = {});

} // namespace palpate
