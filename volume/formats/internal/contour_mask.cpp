// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/contour_mask.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace palpate::internal {
namespace {

// Corners are stated with a few digits: this is how far they may be off their plane, in voxels.
constexpr double kInPlane = 0.1;
// Contours so close to each other, in voxels, are of one plane.
constexpr double kSamePlane = 0.1;
// Of contours that no axis of the grid is perpendicular to: how far off the common plane, voxels.
constexpr double kInFittedPlane = 0.25;

// Indices are taken to this part of a voxel, so that corners on voxel centres are that exactly.
constexpr double kGrain = 0x1p-20;

double rounded(double index) { return std::round(index / kGrain) * kGrain; }

/// Twice the vector area of a polygon (Newell).
Vec3 area_of(const Contour& contour) {
    Vec3 area(0.0);
    for (std::size_t n = 0; n < contour.size(); ++n) {
        const Vec3 a = contour[n] - contour.front();
        const Vec3 b = contour[(n + 1) % contour.size()] - contour.front();
        area += glm::cross(a, b);
    }
    return area;
}

/// Where the lines c = 0, 1, .. cross the edges of polygons: for each the b of the crossings.
class Crossings {
public:
    explicit Crossings(int lines) : of_line_(static_cast<std::size_t>(lines)) {}

    void add(std::array<double, 2> from, std::array<double, 2> to) {
        // Both ways along an edge give the same numbers, so that a keyhole's cancel.
        if (from[1] > to[1]) std::swap(from, to);
        const double last = static_cast<double>(of_line_.size()) - 1.0;
        // An edge meets a line where it begins on it, not where it ends on it.
        const double first_line = std::max(std::ceil(from[1]), 0.0);
        const double last_line = std::min(std::ceil(to[1]) - 1.0, last);
        for (double c = first_line; c <= last_line; c += 1.0)
            of_line_[static_cast<std::size_t>(c)].push_back(
                from[0] + (c - from[1]) / (to[1] - from[1]) * (to[0] - from[0]));
    }

    /// Calls fill(c, first b, end b) for what is inside, b in [0, width).
    template <class Fill>
    void for_each_span(int width, const Fill& fill) {
        for (std::size_t c = 0; c < of_line_.size(); ++c) {
            std::vector<double>& at = of_line_[c];
            std::sort(at.begin(), at.end());
            for (std::size_t n = 0; n + 1 < at.size(); n += 2) {
                const double first = std::clamp(std::ceil(at[n]), 0.0, static_cast<double>(width));
                const double end =
                    std::clamp(std::ceil(at[n + 1]), 0.0, static_cast<double>(width));
                if (first < end)
                    fill(static_cast<int>(c), static_cast<int>(first), static_cast<int>(end));
            }
        }
    }

private:
    std::vector<std::vector<double>> of_line_;
};

/// Voxels one by one, joined to runs where they follow each other.
class Runs {
public:
    explicit Runs(const std::array<int, 3>& size) : size_(size) {}

    void add(const std::array<int, 3>& index) {
        const auto at = [](int i) { return static_cast<std::size_t>(i); };
        const std::size_t voxel =
            at(index[0]) + at(size_[0]) * (at(index[1]) + at(size_[1]) * at(index[2]));
        if (!runs_.empty() && runs_.back().first + runs_.back().count == voxel)
            ++runs_.back().count;
        else
            runs_.push_back({voxel, 1});
    }
    std::vector<VoxelRun> taken() && { return std::move(runs_); }

private:
    std::array<int, 3> size_;
    std::vector<VoxelRun> runs_;
};

} // namespace

ContourMask::ContourMask(const std::vector<Contour>& contours) {
    const bool is_along_an_axis =
        lies_along(contours, 2) || lies_along(contours, 1) || lies_along(contours, 0);
    if (!is_along_an_axis) fit_plane(contours);
    sort_into_planes(contours);
}

/// Whether an axis of the grid is perpendicular to the contours, in voxels; then it is taken.
bool ContourMask::lies_along(const std::vector<Contour>& contours, int axis) {
    for (const Contour& contour : contours) {
        const auto [lowest, highest] =
            std::minmax_element(contour.begin(), contour.end(),
                                [&](const Vec3& a, const Vec3& b) { return a[axis] < b[axis]; });
        if ((*highest)[axis] - (*lowest)[axis] > kInPlane) return false;
    }
    axis_ = axis;
    others_ = axis == 2 ? std::array{0, 1} : axis == 1 ? std::array{0, 2} : std::array{1, 2};
    return true;
}

void ContourMask::fit_plane(const std::vector<Contour>& contours) {
    Vec3 normal(0.0);
    for (const Contour& contour : contours) { // clockwise or not: both ways round add up
        const Vec3 area = area_of(contour);
        normal += glm::dot(area, normal) < 0.0 ? -area : area;
    }
    const Vec3 size = glm::abs(normal);
    const int axis = size.z >= std::max(size.x, size.y) ? 2 : (size.y >= size.x ? 1 : 0);
    if (!(size[axis] > 0.0)) throw std::invalid_argument("has contours without an area");
    axis_ = axis;
    others_ = axis == 2 ? std::array{0, 1} : axis == 1 ? std::array{0, 2} : std::array{1, 2};
    slope_ = {normal[others_[0]] / normal[axis], normal[others_[1]] / normal[axis]};
    for (const Contour& contour : contours) {
        const auto [lowest, highest] =
            std::minmax_element(contour.begin(), contour.end(), [&](const Vec3& a, const Vec3& b) {
                return height_of(a) < height_of(b);
            });
        if (height_of(*highest) - height_of(*lowest) > kInFittedPlane)
            throw std::invalid_argument("has contours that do not lie in parallel planes");
    }
}

double ContourMask::height_of(const Vec3& corner) const noexcept {
    return corner[axis_] + slope_[0] * corner[others_[0]] + slope_[1] * corner[others_[1]];
}

void ContourMask::sort_into_planes(const std::vector<Contour>& contours) {
    std::vector<Plane> all;
    for (const Contour& contour : contours) {
        Plane plane;
        Polygon polygon;
        for (const Vec3& corner : contour) {
            plane.height += height_of(corner) / static_cast<double>(contour.size());
            polygon.push_back({rounded(corner[others_[0]]), rounded(corner[others_[1]])});
        }
        plane.height = rounded(plane.height);
        plane.polygons.push_back(std::move(polygon));
        all.push_back(std::move(plane));
    }
    std::stable_sort(all.begin(), all.end(),
                     [](const Plane& a, const Plane& b) { return a.height < b.height; });
    for (Plane& plane : all) {
        if (planes_.empty() || plane.height - planes_.back().height > kSamePlane)
            planes_.push_back(std::move(plane));
        else
            planes_.back().polygons.push_back(std::move(plane.polygons.front()));
    }
}

std::vector<double> ContourMask::steps() const {
    std::vector<double> result;
    for (std::size_t n = 1; n < planes_.size(); ++n)
        result.push_back(planes_[n].height - planes_[n - 1].height);
    return result;
}

std::vector<VoxelRun> ContourMask::voxels(const std::array<int, 3>& size, double usual_step) const {
    const auto along = [&](int axis) { return size[static_cast<std::size_t>(axis)]; };
    const double reach = 0.5 * usual_step;
    Runs runs(size);
    for (std::size_t n = 0; n < planes_.size(); ++n) {
        const Plane& plane = planes_[n];
        double below = reach, above = reach;
        if (n > 0) below = std::min(below, 0.5 * (plane.height - planes_[n - 1].height));
        if (n + 1 < planes_.size())
            above = std::min(above, 0.5 * (planes_[n + 1].height - plane.height));

        Crossings crossings(along(others_[1]));
        for (const Polygon& polygon : plane.polygons)
            for (std::size_t k = 0; k < polygon.size(); ++k)
                crossings.add(polygon[k], polygon[(k + 1) % polygon.size()]);

        const double end_of_axis = along(axis_);
        // The slices that the plane stands for beneath and above (b, c).
        const auto slices = [&](int b, int c) {
            // Rounded, so that the planes' shares of a column meet exactly.
            const double height = plane.height - rounded(slope_[0] * b + slope_[1] * c);
            return std::array{std::clamp(std::ceil(height - below), 0.0, end_of_axis),
                              std::clamp(std::ceil(height + above), 0.0, end_of_axis)};
        };
        crossings.for_each_span(along(others_[0]), [&](int c, int first, int end) {
            std::array<int, 3> index{};
            index[static_cast<std::size_t>(others_[1])] = c;
            // Of planes along an axis the slices are the same everywhere: runs are long then.
            const bool is_flat = slope_[0] == 0.0 && slope_[1] == 0.0;
            const int stride = is_flat ? end - first : 1;
            for (int b = first; b < end; b += stride) {
                const auto [lowest, past] = slices(b, c);
                for (int a = static_cast<int>(lowest); a < static_cast<int>(past); ++a)
                    for (int of_run = b; of_run < b + stride; ++of_run) {
                        index[static_cast<std::size_t>(axis_)] = a;
                        index[static_cast<std::size_t>(others_[0])] = of_run;
                        runs.add(index);
                    }
            }
        });
    }
    return std::move(runs).taken();
}

std::optional<double> median_step(std::vector<double> steps) noexcept {
    if (steps.empty()) return std::nullopt;
    std::sort(steps.begin(), steps.end());
    return steps[(steps.size() - 1) / 2];
}

} // namespace palpate::internal
