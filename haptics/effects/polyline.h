// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <palpate/geometry/vec.h>
#include <palpate/haptics/choices.h>

namespace palpate {

/// A place on a polyline: on a piece, or at the corner where a piece begins. Pieces are counted
/// on, round after round, where the polyline is closed.
struct PolylinePlace {
    std::int64_t piece = 0; ///< a corner's is the piece that begins there
    double along_m = 0.0;   ///< from where the piece begins; 0 at a corner
    bool at_corner = false;
    bool cut = false; ///< a walk ends here, though it should go on

    /// Order along the polyline: corners are even, the pieces after them odd.            [any]
    std::int64_t order() const noexcept { return 2 * piece + (at_corner ? 0 : 1); }
};

/// A chain of straight pieces in space: a centre line, a planned trajectory, a line or a part of
/// one. Immutable. Scene frame, m.
class Polyline {
public:
    static constexpr std::size_t kMostPoints = 100'000;
    static constexpr int kMostSteps = 4096; ///< pieces that a walk passes

    /// Through 2 to kMostPoints points in m; one that repeats the one before it is left out. Throws
    /// std::invalid_argument on fewer or more, on points that are not finite, and where fewer
    /// remain than 2, or than 3 of a closed one.                                      [setup]
    Polyline(std::span<const Vec3> points, PolylineEnds ends);

    /// The point nearest to `point` that is no further than `reach_m` (may be infinite), on a
    /// piece; nothing where there is none. A search in a tree of boxes: as many steps as pieces at
    /// worst, their logarithm where the polyline is no tangle.                         [loop]
    std::optional<PolylinePlace> nearest(const Vec3& point, double reach_m) const noexcept;

    /// The first place, on the way from `from` towards `point`, where the way on no longer leads
    /// nearer to it. Ends after kMostSteps pieces.                                     [loop]
    PolylinePlace walk(const PolylinePlace& from, const Vec3& point) const noexcept;

    Vec3 position(const PolylinePlace& place) const noexcept; ///< m  [loop]
    const Vec3& direction(std::int64_t piece) const noexcept; ///< unit  [loop]
    double length_m(std::int64_t piece) const noexcept;       ///< [loop]
    /// The middle of a piece.                                                           [loop]
    PolylinePlace middle(std::int64_t piece) const noexcept;
    /// How far beyond its piece's ends a way from where that begins is, m: < 0 before it, > 0
    /// behind it, 0 on it; rounding of less than kOnPiece is on it.                    [loop]
    double beyond(std::int64_t piece, double along_m) const noexcept;
    std::size_t pieces() const noexcept { return pieces_.size(); } ///< [any]
    bool exists(std::int64_t piece) const noexcept; ///< always, of a closed one         [loop]
    /// The same piece, counted in the first round.                                     [loop]
    std::int64_t first_round(std::int64_t piece) const noexcept;

    static constexpr double kOnPiece = 1e-13; ///< m: what the loop takes for no movement

private:
    struct Piece {
        Vec3 begin{0.0};
        Vec3 direction{0.0}; // unit
        double length_m = 0.0;
    };
    struct Node {
        std::size_t level = 0;
        std::size_t index = 0;
        double squared_distance = 0.0; // of its box
    };

    const Piece& piece_at(std::int64_t piece) const noexcept;
    void build_boxes();
    void consider(std::size_t piece, const Vec3& point, double& squared_reach,
                  std::optional<PolylinePlace>& best) const noexcept;
    double lower_end(std::int64_t piece) const noexcept;
    double upper_end(std::int64_t piece) const noexcept;

    std::vector<Piece> pieces_;
    Vec3 last_point_{0.0};
    PolylineEnds ends_;
    // Boxes around kLeaf pieces in a row, around two of those, and so on up to a single one.
    std::vector<std::vector<Box>> boxes_;
};

/// The infinite line through a point along a direction of any length. Throws std::invalid_argument
/// where they are not finite or the direction is zero.                                 [setup]
Polyline make_line(const Vec3& point, const Vec3& direction);

} // namespace palpate
