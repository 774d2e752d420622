// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <palpate/engine/files/result_cache.h>
#include <palpate/engine/scene/baked_surface.h>
#include <palpate/engine/scene/scene_description.h>
#include <palpate/geometry/isosurface.h>
#include <palpate/volume/label_volume.h>
#include <palpate/volume/voxel_volume.h>

namespace palpate {

/// The volumes of a scene, each read once while surfaces and effects that need it are made one
/// after the other; those in memory are taken as they are.
class VolumeReader {
public:
    /// Reads nothing yet. `scene` must outlive the reader.                                  [setup]
    explicit VolumeReader(const SceneDescription& scene);
    ~VolumeReader();

    /// Throw as read_volume() and read_label_volume(). The last volume of either kind is kept.
    const VoxelVolume& volume(const std::string& name);
    /// The labels of a volume; `name` is a key of SceneDescription::volumes.                [setup]
    const LabelVolume& labels(const std::string& name);
    /// Hash of the files that a volume is read from, and of how it is read; of data in memory
    /// sha256_of_data().
    const std::string& key(const std::string& name);

private:
    struct Kept;
    const SceneDescription& scene_;
    std::unique_ptr<Kept> kept_;
};

/// Bakes a surface of a scene; what was baked before comes from `cache`, without its volume being
/// read.     [setup] Throws std::runtime_error "FILE:LINE: what is
/// wrong; what to do": file errors as read_volume(), a level that no voxel reaches, a label that
/// does not exist, a policy that keeps nothing; or progress cancelled it.
BakedSurface bake_surface(const SceneDescription& scene, const std::string& surface,
                          VolumeReader& reader, const ResultCache& cache,
                          const Progress& progress = {});
/// The same with a reader of its own, for a single surface.                             [setup]
BakedSurface bake_surface(const SceneDescription& scene, const std::string& surface,
                          const ResultCache& cache, const Progress& progress = {});

/// A mesh of a baked surface.
struct BakedMesh {
    std::shared_ptr<const TriangleMesh> mesh; ///< vertices in m, scene frame; never null
    bool from_cache = false;                  ///< it was read from the cache, not extracted
};

/// Preview components with fewer triangles are noise of single voxels: not seeded, and not missed.
inline constexpr std::size_t kSmallestComponentTriangles = 40;

/// Extracts the mesh of a baked surface, or reads it from the cache.                     [setup]
/// Throws as `extract` does, and std::runtime_error when `extract` is empty (a build without CGAL)
/// or the surface is a formula or of a field of the program's own.
BakedMesh mesh_surface(const BakedSurface& surface, const IsosurfaceSettings& settings,
                       const IsosurfaceExtractor& extract, const ResultCache& cache,
                       const Progress& progress = {});

} // namespace palpate
