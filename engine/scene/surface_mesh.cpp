// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/surface_mesh.h>

#include <utility>

#include <palpate/engine/scene/internal/progress.h>

namespace palpate {

IsosurfaceSettings mesh_settings(const SurfaceDescription& description, const BakedSurface& baked) {
    // Coarser facets would turn by more than 40 degrees over what a smoothed label keeps of its
    // voxels: 2 % of the edges at the isosurfaces' 2 mm, at most 0.9 % with these (AAL, 1 mm).
    constexpr double label_size_voxels = 0.5, label_distance_voxels = 0.05;
    IsosurfaceSettings settings;
    if (!description.labels.empty()) {
        settings.facet_size_m = label_size_voxels * baked.field->feature_size_m();
        settings.facet_distance_m = label_distance_voxels * baked.field->feature_size_m();
    }
    if (description.facet_size_mm) settings.facet_size_m = 1e-3 * *description.facet_size_mm;
    if (description.facet_distance_mm)
        settings.facet_distance_m = 1e-3 * *description.facet_distance_mm;
    return settings;
}

double leash_of(const SurfaceDescription& description, const BakedSurface& baked) {
    constexpr double kLeashOfGiven = 1e-3;         // m
    constexpr double kLeashInFacetDistances = 5.0; // well beyond what an extracted mesh errs by
    if (description.leash_mm) return 1e-3 * *description.leash_mm;
    if (has_mesh(description) || !baked.field) return kLeashOfGiven;
    return kLeashInFacetDistances * mesh_settings(description, baked).facet_distance_m;
}

SurfaceMesh make_surface_mesh(FoundMesh found, ContactKind contact, const Progress& progress) {
    SurfaceMesh result{static_cast<MeshOrigin&&>(found), nullptr, nullptr};
    if (contact == ContactKind::direct) {
        result.scene = std::make_shared<SurfaceScene>(std::move(found.mesh));
        return result;
    }
    internal::report(progress, 0.0, "certifying the mesh");
    result.certified = std::make_shared<CertifiedMesh>(std::move(found.mesh));
    result.scene = {result.certified, &result.certified->scene()};
    internal::report(progress, 1.0, "mesh ready");
    return result;
}

} // namespace palpate
