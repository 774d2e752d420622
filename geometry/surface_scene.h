// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include <palpate/geometry/triangle_mesh.h>

namespace palpate {

/// A point of a surface found by a query; everything but the triangle id is computed again in double.
struct SurfaceHit {
    Vec3 position{0.0};          ///< m, scene frame; on the triangle's plane to double rounding
    Vec3 normal{0.0};            ///< unit, towards free space as the mesh is oriented
    double distance_m = 0.0;     ///< from the query's start or centre
    std::uint32_t triangle = 0;  ///< index into TriangleMesh::triangles
};

/// An immutable triangle mesh behind Embree: float32 relative to a local origin finds the triangle, double says where.
///
/// Error: Embree sees vertices rounded to float32 around the centre of the bounds: at most ulp32(L)/2 per coordinate, L the half
/// extent (3.7 nm at L = 60 mm). first_hit() can therefore miss, or report, a surface that the segment's end comes closer to than
/// query_error_m(). Everything reported is exact on the double mesh.
class SurfaceScene {
public:
    /// Builds the acceleration structure; vertices must be finite.                      [setup]
    /// Throws std::invalid_argument (bad index, vertex not finite, empty mesh) or std::runtime_error (Embree).
    explicit SurfaceScene(std::shared_ptr<const TriangleMesh> mesh);
    ~SurfaceScene();
    SurfaceScene(const SurfaceScene&) = delete;
    SurfaceScene& operator=(const SurfaceScene&) = delete;

    /// First triangle, either face, on the segment from -> to.                          [any]
    /// Nothing where there is none, or an end is not finite or beyond kQueryRange.
    std::optional<SurfaceHit> first_hit(const Vec3& from, const Vec3& to) const noexcept;

    /// Closest point of the surface within `radius_m` of `point`; of equal ones that of the lowest triangle id.   [any]
    /// Nothing where there is none, or an argument is not finite, out of kQueryRange, or radius_m <= 0.
    std::optional<SurfaceHit> closest_point(const Vec3& point, double radius_m) const noexcept;

    const TriangleMesh& mesh() const noexcept;
    double query_error_m() const noexcept;  ///< bound on the float32 position error of a query, m

    static constexpr double kQueryRange = 1.0e6;  ///< m; Debian's Embree aborts the process on rays beyond 1.8e18 or NaN

private:
    struct Embree;
    std::unique_ptr<Embree> embree_;
};

}  // namespace palpate
