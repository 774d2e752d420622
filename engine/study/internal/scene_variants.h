// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>

#include <palpate/engine/scene/scene.h>
#include <palpate/engine/study/converged_proxy.h>
#include <palpate/geometry/isosurface.h>
#include <palpate/volume/voxel_volume.h>

namespace palpate::internal {

/// A scene with one thing of its one surface made otherwise, and all else as it is.
class SceneVariants {
public:
    /// Both must outlive the variants. `name()` is the one surface with a volume that the scene
    /// lets one feel; without one, or with several, there are no variants.               [setup]
    SceneVariants(const Scene& scene, const SceneResources& resources);

    /// Why there is none, without a comma; empty where there are.                        [any]
    const std::string& why_not() const noexcept { return why_not_; }
    bool is_formula() const noexcept { return is_formula_; }      ///< its volume is one       [any]
    const std::string& name() const noexcept { return surface_; } ///< of the surface    [any]

    /// The surface as the scene has it, felt by its volume alone.                        [setup]
    std::shared_ptr<const Scene> by_volume() const;
    /// The same over other voxels in the place of its volume, smoothed by so many of them. [setup]
    std::shared_ptr<const Scene> over(std::shared_ptr<const VoxelVolume> voxels,
                                      double smooth_voxels) const;
    /// The same over every n-th voxel, along each axis, of the grid that its surface is baked to,
    /// around a box, m: the same level, and nothing smoothed or sorted out again. Null where there
    /// is no grid, or fewer than four such voxels along an axis.                         [setup]
    std::shared_ptr<const Scene> over_every(int n, const Box& box) const;
    /// The scene with another contact, and with a mesh where one is given; throws
    /// std::runtime_error where it cannot have it.                                       [setup]
    std::shared_ptr<const Scene> with_contact(ContactKind contact,
                                              std::shared_ptr<const TriangleMesh> mesh = {}) const;

    /// A scene of the caller's own making.                                               [setup]
    std::shared_ptr<const Scene> built(SceneDescription description) const;

    /// The formula at voxels `spacing_m` apart in a box with room around it, m, rounded to so many
    /// bits; null where that would be more than kMostVoxels.                             [setup]
    std::shared_ptr<const VoxelVolume> voxels_of(const Scene& scene, const Box& box,
                                                 double spacing_m, int bits = 24) const;
    /// The mesh criteria of the surface or, where the scene has none, 2 mm and 0.2 mm. [setup]
    IsosurfaceSettings facets() const;
    /// A mesh of a formula by the resources' extractor, from where proxies touch it. Throws what
    /// the extractor throws; std::runtime_error where there is none, or nothing is touched. [setup]
    std::shared_ptr<const TriangleMesh> mesh_of(const Scene& formula,
                                                const ConvergedProxies& proxies,
                                                const IsosurfaceSettings& facets) const;

    static constexpr double kMostVoxels = 64e6; ///< 256 MB

private:
    SceneDescription changed(ContactKind contact) const;
    /// The surface over other voxels than its own, by contact `volume`.
    SceneDescription felt_in(std::shared_ptr<const VoxelVolume> voxels) const;

    const Scene& scene_;
    const SceneResources& resources_;
    std::string surface_;
    std::string volume_;
    std::string why_not_;
    bool is_formula_ = false;
};

} // namespace palpate::internal
