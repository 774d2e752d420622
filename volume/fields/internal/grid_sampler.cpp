// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/internal/grid_sampler.h>

#include <cmath>
#include <limits>

namespace palpate::internal {
namespace {

/// A walk through the cells that a segment passes, in order (Amanatides and Woo 1987), in local
/// coordinates; at most the cells of the grid's three edges together and three more, for each step
/// leaves a cell for good.
///
/// Faces are where start + t along is a whole number: each is computed from the segment itself,
/// never summed up, so the error of a t does not grow on the way. A segment in a face may be given
/// either neighbour: on the face both interpolate alike.
class CellWalk {
public:
    CellWalk(const GridNodes& nodes, const Vec3& start, const Vec3& along) noexcept
        : start_(start), along_(along), nodes_(nodes) {}

    /// Goes to the first cell with data; false when the segment passes none.
    bool enter() noexcept {
        for (int a = 0; a < 3; ++a) {
            const double low = GridNodes::first_cell();
            const double high = nodes_.end_cell(a);
            if (std::abs(along_[a]) < kStill) {
                if (start_[a] < low || start_[a] > high) return false;
                continue;
            }
            const double to_low = (low - start_[a]) / along_[a];
            const double to_high = (high - start_[a]) / along_[a];
            t_ = std::max(t_, std::min(to_low, to_high));
            t_last_ = std::min(t_last_, std::max(to_low, to_high));
        }
        if (t_ > t_last_) return false;
        for (int a = 0; a < 3; ++a) {
            const double first = GridNodes::first_cell();
            const double last =
                nodes_.end_cell(a) - 1; // clamped as a double: from far away it rounds to anything
            cell_[a] = static_cast<int>(std::clamp(start_[a] + t_ * along_[a], first, last));
            find_face(a);
        }
        leave();
        return true;
    }

    /// Goes to the next cell; false when the segment or the data end.
    bool next() noexcept {
        if (t_leave_ >= t_last_) return false;
        const int a = exit_axis_;
        cell_[a] += along_[a] > 0.0 ? 1 : -1;
        if (cell_[a] < GridNodes::first_cell() || cell_[a] >= nodes_.end_cell(a)) return false;
        find_face(a);
        t_ = t_leave_;
        leave();
        return true;
    }

    CellIndex cell() const noexcept { return {cell_[0], cell_[1], cell_[2]}; }
    double enter_t() const noexcept { return t_; }
    double leave_t() const noexcept { return t_leave_; }
    Vec3 position_in_cell() const noexcept {
        return start_ + t_ * along_ - Vec3(cell_[0], cell_[1], cell_[2]);
    }

private:
    // Index steps along the whole segment: less than any rounding of the position, and safe to
    // divide by above it.
    static constexpr double kStill = 1e-30;

    void find_face(int a) noexcept {
        if (std::abs(along_[a]) < kStill) return;
        const int face = along_[a] > 0.0 ? cell_[a] + 1 : cell_[a];
        face_t_[a] = (face - start_[a]) / along_[a];
    }

    void leave() noexcept {
        exit_axis_ = face_t_[0] < face_t_[1] ? 0 : 1;
        if (face_t_[2] < face_t_[exit_axis_]) exit_axis_ = 2;
        // Rounding can put a face that is passed at an edge a little before t_: then the cell is
        // passed in no time.
        t_leave_ = std::max(t_, std::min(t_last_, face_t_[exit_axis_]));
    }

    Vec3 start_;
    Vec3 along_;
    const GridNodes& nodes_;
    int cell_[3] = {0, 0, 0};
    double face_t_[3] = {kNever, kNever,
                         kNever}; // where the segment leaves the cell along each axis
    int exit_axis_ = 0;
    double t_ = 0.0;
    double t_leave_ = 0.0;
    double t_last_ = 1.0;

    static constexpr double kNever = std::numeric_limits<double>::infinity();
};

/// The first root of the level on x + s along, s in [0, 1], within one cell.
std::optional<double> root_in_cell(const Corners& corners, const Vec3& x, const Vec3& along,
                                   double level) noexcept {
    const float highest =
        std::max(std::max(std::max(corners[0], corners[1]), std::max(corners[2], corners[3])),
                 std::max(std::max(corners[4], corners[5]), std::max(corners[6], corners[7])));
    if (highest < level) return std::nullopt; // a trilinear value never exceeds its corners
    const Polynomial<3> p = on_line(corners, x, along);
    // Nor does a cubic exceed its Bezier points.
    const double b_1 = p[0] + p[1] / 3.0;
    const double b_2 = p[0] + (2.0 * p[1] + p[2]) / 3.0;
    const double b_3 = p[0] + p[1] + p[2] + p[3];
    if (p[0] < level && b_1 < level && b_2 < level && b_3 < level) return std::nullopt;
    return first_reach<3>(p, level);
}

/// The same in the cell where the walk is, as t of the whole segment.
std::optional<double> root_in_cell(const GridNodes& nodes, const CellWalk& walk, const Vec3& along,
                                   double level) noexcept {
    const double length = walk.leave_t() - walk.enter_t();
    const std::optional<double> s =
        root_in_cell(nodes.corners(walk.cell()), walk.position_in_cell(), length * along, level);
    if (!s) return std::nullopt;
    return walk.enter_t() + *s * length;
}

/// Whether a point is inside a cell, and not on a face of it.
bool is_within(const CellIndex& cell, const Vec3& point) noexcept {
    return point.x > cell.i && point.x < cell.i + 1 && point.y > cell.j && point.y < cell.j + 1 &&
           point.z > cell.k && point.z < cell.k + 1;
}

} // namespace

FieldSample GridSampler::sample(const Vec3& point) noexcept {
    ++samples_;
    FieldSample result;
    const Vec3 local = nodes_.scene_to_local.point(point);
    if (!nodes_.inside(local)) {
        result.value = nodes_.background;
        return result;
    }
    const CellIndex index = GridNodes::cell_of(local);
    if (index != cached_) {
        nodes_.gather(index, cell_);
        cell_is_missing_ = nodes_.is_missing(index);
        cached_ = index;
    }
    if (cell_is_missing_) {
        result.value = nodes_.background;
        return result;
    }
    const CellSample s = interpolate(cell_, local - Vec3(index.i, index.j, index.k));
    const Mat3& to_scene = nodes_.gradient_to_scene;
    result.value = s.at.v[0];
    result.slope = to_scene * Vec3(s.by[0].v[0], s.by[1].v[0], s.by[2].v[0]);
    result.gradient = to_scene * Vec3(s.at.v[1], s.at.v[2], s.at.v[3]);
    // Column b: derivative of the gradient by index b; by the chain rule once more for derivatives
    // by metre.
    Mat3 by_index;
    for (int b = 0; b < 3; ++b) {
        const auto& column = s.by[static_cast<std::size_t>(b)].v;
        by_index[b] = to_scene * Vec3(column[1], column[2], column[3]);
    }
    result.hessian = by_index * nodes_.scene_to_local.linear;
    result.valid = true;
    return result;
}

double GridSampler::value(const Vec3& point) noexcept {
    ++samples_;
    const Vec3 local = nodes_.scene_to_local.point(point);
    if (!nodes_.inside(local)) return nodes_.background;
    const CellIndex index = GridNodes::cell_of(local);
    return interpolate_value(nodes_.corners(index), local - Vec3(index.i, index.j, index.k));
}

std::optional<double> GridSampler::first_root(const Vec3& from, const Vec3& to,
                                              double level) noexcept {
    ++roots_;
    const Vec3 start = nodes_.scene_to_local.point(from);
    const Vec3 along = nodes_.scene_to_local.direction(to - from);
    if (!is_finite(start) || !is_finite(along)) return 0.0;
    if (nodes_.inside(start)) { // most chords of sub-steps end in the cell where they begin
        const CellIndex cell = GridNodes::cell_of(start);
        if (is_within(cell, start + along))
            return root_in_cell(nodes_.corners(cell), start - Vec3(cell.i, cell.j, cell.k), along,
                                level);
    }
    CellWalk walk(nodes_, start, along);
    if (!walk.enter()) return std::nullopt;
    const int most_cells = nodes_.size[0] + nodes_.size[1] + nodes_.size[2] + 6;
    for (int n = 0; n < most_cells; ++n) {
        if (const std::optional<double> root = root_in_cell(nodes_, walk, along, level))
            return root;
        if (!walk.next()) return std::nullopt;
    }
    return std::nullopt;
}

} // namespace palpate::internal
