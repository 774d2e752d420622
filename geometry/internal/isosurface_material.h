// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <palpate/geometry/internal/extraction_progress.h>
#include <palpate/geometry/isosurface.h>

namespace palpate::internal {

inline constexpr double kMmPerM = 1000.0;

/// The function of an isosurface in millimetres from the centre of its bounds: CGAL's numbers are
/// then about 1 to 100, where rounding is 1e-14. Every value is work done. Both arguments must
/// outlive it.
class Material {
public:
    Material(const Isosurface& surface, ExtractionProgress& progress);

    /// Own unit of the field; free space beyond the bounds and where the field has no number.
    double value(const Vec3& p_mm);
    Vec3 to_scene(const Vec3& p_mm) const { return center_ + p_mm / kMmPerM; }
    Vec3 from_scene(const Vec3& p_m) const { return kMmPerM * (p_m - center_); }

private:
    const Isosurface& surface_;
    ExtractionProgress& progress_;
    Vec3 center_; // m, scene frame: the origin in millimetres
};

/// Gradient direction by central differences over 2 um: short against any facet, long against
/// rounding. Own unit per mm.
Vec3 gradient(Material& material, const Vec3& p);

/// The surface on the gradient's line through p, no farther than `reach` mm.
std::optional<Vec3> onto_surface(Material& material, const Vec3& p, double reach);

/// Points on the surface at about `spacing` mm around p, in its tangent plane's six main
/// directions.
std::vector<Vec3> ring(Material& material, const Vec3& p, double spacing);

} // namespace palpate::internal
