// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <palpate/engine/files/result_cache.h>
#include <palpate/engine/scene/scene_description.h>
#include <palpate/geometry/isosurface.h>
#include <palpate/volume/fields/grid_field.h>
#include <palpate/volume/filters/label_filters.h>
#include <palpate/volume/filters/volume_filters.h>
#include <palpate/volume/label_volume.h>
#include <palpate/volume/scalar_field.h>

namespace palpate {

/// A field made ready for one surface: smoothed, its level chosen again, unwanted components
/// removed. Mesh and contact take the same one, so that they are of the same thing.
struct BakedSurface {
    std::shared_ptr<const ScalarField> field;
    std::shared_ptr<const GridField> grid; ///< the same when it is a grid; null for a formula
    double level = 0.0;                    ///< the field's unit
    SurfaceShift shift;                    ///< against the surface before smoothing
    double volume_before_mm3 = 0.0; ///< enclosed before smoothing; of labels: of their voxels
    double volume_mm3 = 0.0;        ///< enclosed by what is kept
    std::vector<VolumeComponent>
        components;                  ///< of the material, largest first; empty for a formula
    std::vector<std::string> labels; ///< names of those it is made of; empty: an isosurface
    bool joined = false; ///< to labels of other surfaces, without_grooves(): it reaches about
                         ///< smooth_voxels into them, which volume_mm3 does not count
    std::vector<ThinPart> thin_parts;  ///< of labels: what smoothing took away
    std::vector<std::string> warnings; ///< of reading the volume
    std::string key;                   ///< hash of everything that went in: names it in the cache
    bool from_cache = false;
};

/// Labels of other surfaces of the scene that are felt as this one is: made of labels of the same
/// volume in the same way, whole, smoothed, hard wherever they are. Along borders with these it is
/// baked without a groove: nobody can tell them apart by pressing, and a groove that is narrower
/// than the voxels is theirs, not the anatomy's. Empty where this one is no such surface.  [setup]
std::vector<std::string> labels_felt_alike(const SceneDescription& scene,
                                           const std::string& surface);

/// What baking did to a surface, in words, a line each: level, shift, volumes, components that were
/// dropped with their sizes, thin parts.                                                 [setup]
std::string baked_in_words(const BakedSurface& baked);

/// The same as JSON text; what the cache keeps beside the grid.                          [setup]
std::string baked_as_json(const BakedSurface& baked);

/// The volumes of a scene, each read once while surfaces and effects that need it are made one
/// after the other.
class VolumeReader {
public:
    explicit VolumeReader(const SceneDescription& scene);
    ~VolumeReader();

    /// Throw as read_volume() and read_label_volume(). The last volume of either kind is kept.
    const VoxelVolume& volume(const std::string& name);
    const LabelVolume& labels(const std::string& name);
    /// The field of a volume given by a formula: the same for all who ask. Throws as
    /// make_analytic_field().
    std::shared_ptr<const ScalarField> formula(const std::string& name);
    /// Hash of the files that a volume is read from, and of how it is read.
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
BakedSurface bake_surface(const SceneDescription& scene, const std::string& surface,
                          const ResultCache& cache, const Progress& progress = {});

/// A mesh of a baked surface.
struct BakedMesh {
    std::shared_ptr<const TriangleMesh> mesh;
    bool from_cache = false;
};

/// Preview components with fewer triangles are noise of single voxels: not seeded, and not missed.
inline constexpr std::size_t kSmallestComponentTriangles = 40;

/// The mesh criteria that a scene asks for or, where it does not, those that fit: 2 mm and 0.2 mm
/// for an isosurface; half a voxel and a twentieth for labels, whose mesh is then as smooth as
/// their field. [setup]
IsosurfaceSettings mesh_settings(const SurfaceDescription& description, const BakedSurface& baked);

/// Extracts the mesh of a baked surface, or reads it from the cache.                     [setup]
/// Throws as `extract` does, and std::runtime_error when `extract` is empty (a build without CGAL)
/// or the surface is a formula.
BakedMesh mesh_surface(const BakedSurface& surface, const IsosurfaceSettings& settings,
                       const IsosurfaceExtractor& extract, const ResultCache& cache,
                       const Progress& progress = {});

} // namespace palpate
