// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <palpate/geometry/triangle_mesh.h>

namespace palpate {

/// A point of a surface found by a query, in double.
struct SurfaceHit {
    Vec3 position{0.0};         ///< m, scene frame; on the triangle to double rounding
    Vec3 normal{0.0};           ///< unit, towards free space as the mesh is oriented
    double distance_m = 0.0;    ///< from the query's start or centre
    std::uint32_t triangle = 0; ///< index into TriangleMesh::triangles
};

/// Which triangles a segment query sees, and how large.
struct SegmentOptions {
    std::span<const std::uint32_t> except; ///< triangles that are not there for this query; few
    /// Per triangle of the mesh, or empty: not 0 where it is widened by widening_m() in its own
    /// plane, so that cracks up to twice that between such triangles are closed.
    std::span<const std::uint8_t> widened;
};

/// An immutable triangle mesh behind Embree, which finds the triangles that a query may meet by
/// float32 boxes about a local origin; which of them it meets, and where, is decided in double from
/// the mesh's own vertices.
///
/// The boxes are grown by more than all float32 rounding, so nothing is lost in them. (Embree's own
/// float32 triangles would let through 0.6 % of the rays aimed at a vertex, ROBUST or not.) What is
/// left is double rounding: a triangle that the segment meets is never missed, so a closed mesh is
/// tight at its edges and vertices; one that is farther from the segment than a few query_error_m()
/// is never reported. Degenerate triangles are not there for queries.
class SurfaceScene {
public:
    /// Builds the acceleration structure; vertices must be finite.                      [setup]
    /// Throws std::invalid_argument (null, bad index, vertex not finite or beyond kQueryRange, no
    /// triangle with an area) or std::runtime_error (Embree).
    explicit SurfaceScene(std::shared_ptr<const TriangleMesh> mesh);
    ~SurfaceScene();
    SurfaceScene(const SurfaceScene&) = delete;
    SurfaceScene& operator=(const SurfaceScene&) = delete;

    /// First triangle, either face, on the segment from -> to, ends included; of equal ones the
    /// lowest id.   [any] Nothing where there is none, from equals to, or an end is not finite or
    /// beyond kQueryRange.
    std::optional<SurfaceHit> first_hit(const Vec3& from, const Vec3& to,
                                        const SegmentOptions& options = {}) const noexcept;

    /// Closest point of the surface within `radius_m` of `point`; of equal ones that of the lowest
    /// triangle id.   [any] Nothing where there is none, or an argument is not finite, out of
    /// kQueryRange, or radius_m <= 0.
    std::optional<SurfaceHit> closest_point(const Vec3& point, double radius_m) const noexcept;

    /// Triangles whose bounding box comes within `radius_m` of `point`, and a few more: `found` is
    /// replaced. Throws std::bad_alloc.   [setup]
    void triangles_near(const Vec3& point, double radius_m,
                        std::vector<std::uint32_t>& found) const;

    /// Calls `found` with every two triangles whose bounding boxes come within near_m() of each
    /// other, and a few more: the lower id first, each pair once, in any order, from several
    /// threads at a time, on all processors. `found` may not throw. Throws std::runtime_error
    /// (Embree). [setup]
    void for_pairs_near(const std::function<void(std::uint32_t, std::uint32_t)>& found) const;

    const TriangleMesh& mesh() const noexcept; ///< that was given: not copied  [any]
    /// Of all triangles, and a hair of rounding more, m. [any]
    const Box& bounds() const noexcept;
    /// Whether a chord's box is apart from bounds(). [any]
    bool is_away(const Vec3& from, const Vec3& to) const noexcept;
    /// Rounding of a position of a query near the mesh, m: 1.8e-15 times the largest coordinate
    /// (1.1e-16 m at 60 mm, 1.8e-14 at 10 m). A query's own coordinate counts where it is larger.
    double query_error_m() const noexcept;
    /// By how much SegmentOptions::widened widens, m: 8 float32 units of the half extent of the
    /// mesh's triangles, or of 1e-5 of their largest coordinate (30 nm at 31-62 mm).
    double widening_m() const noexcept;
    /// How near for_pairs_near() looks, m: eight times widening_m().
    double near_m() const noexcept;

    static constexpr double kQueryRange =
        1.0e6; ///< m; Debian's Embree aborts the process on rays beyond 1.8e18 or NaN
    /// Whether queries at a point are answered: finite, and within kQueryRange along each axis.
    /// [any]
    static bool answers_at(const Vec3& point) noexcept;

private:
    struct Embree;
    std::unique_ptr<Embree> embree_;
};

} // namespace palpate
