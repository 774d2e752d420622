// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <palpate/volume/filters/volume_filters.h>

// The part of volume_filters.h that measures where a surface lies against another.
namespace palpate {
namespace {

// Search length to either side along a normal: a smoothing by a voxel moves no surface further;
// what is further is another surface. In voxels along the normal.
constexpr double kSearchVoxels = 2.0;
constexpr int kSearchSteps = 8;      // a quarter of a voxel: no bone-to-air layer is thinner
constexpr int kBisections = 20;      // a quarter of a voxel / 2^20: below 1 nm for 4 mm voxels
constexpr std::size_t kTogether = 8; // points whose levels are found side by side
constexpr std::size_t kMaxPoints = 200000; // the mean of so many is good to sd / 400

constexpr std::size_t kFewestPointsPerShare = 1000; // some 1 ms
constexpr std::size_t kFewestSlicesPerShare = 8;

constexpr double kLevelTolerance = 1e-6; // m, mean shift that counts as none
constexpr int kMaxLevelSteps = 60;       // every second one halves: the bracket shrinks by 2^30
constexpr double kFirstStep = 0.01;      // of the range of values
constexpr int kMostHalvings = 16;        // of that step
constexpr double kMinFound = 0.5;        // of the points: the mean of fewer is of another surface
constexpr double kJumpVoxels = 0.01;     // what one vanishing point of a small surface may leave

/// A point of the reference surface.
struct SurfacePoint {
    Vec3 index{0.0};    ///< in voxels
    Vec3 step{0.0};     ///< normal towards free space in index space, per metre
    double voxel = 0.0; ///< length of a voxel along the normal, m
    double weight = 0.0;
};

class Trilinear {
public:
    explicit Trilinear(const VoxelVolume& volume) : volume_(volume) {}

    /// Nothing outside the voxel centres.
    std::optional<double> value(const Vec3& index) const {
        std::array<int, 3> cell{};
        std::array<double, 3> t{};
        for (int axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            const int last = volume_.size[a] - 1;
            if (!(index[axis] >= 0.0 && index[axis] <= last) || last < 1) return std::nullopt;
            cell[a] = std::min(static_cast<int>(index[axis]), last - 1);
            t[a] = index[axis] - cell[a];
        }
        double sum = 0.0;
        for (int corner = 0; corner < 8; ++corner) {
            const int di = corner & 1, dj = (corner >> 1) & 1, dk = corner >> 2;
            const double weight =
                (di ? t[0] : 1.0 - t[0]) * (dj ? t[1] : 1.0 - t[1]) * (dk ? t[2] : 1.0 - t[2]);
            sum += weight * volume_.at(cell[0] + di, cell[1] + dj, cell[2] + dk);
        }
        return sum;
    }

private:
    const VoxelVolume& volume_;
};

Vec3 central_difference(const VoxelVolume& v, int i, int j, int k) {
    return 0.5 * Vec3(static_cast<double>(v.at(i + 1, j, k)) - v.at(i - 1, j, k),
                      static_cast<double>(v.at(i, j + 1, k)) - v.at(i, j - 1, k),
                      static_cast<double>(v.at(i, j, k + 1)) - v.at(i, j, k - 1));
}

/// Turns a crossing and its gradient in index space into a point with normal and weight.
///
/// Weight: the grid lines along axis e, one per unit of area across e, cross a patch of index-space
/// area dA and unit normal m |m.e| dA times; the three families together (|m_i|+|m_j|+|m_k|) dA. So
/// a crossing stands for dA = 1/(|m_i|+|m_j|+|m_k|). The scene's area is |det L| |L^-T m| dA
/// (Nanson); with m = g/|g| the lengths of g cancel: |L^-T g| / (|g_i|+|g_j|+|g_k|), |det L| being
/// common.
std::optional<SurfacePoint> surface_point(const AffineTransform& scene_to_index, const Vec3& index,
                                          const Vec3& gradient) {
    const Vec3 scene_gradient = glm::transpose(scene_to_index.linear) * gradient; // U/m
    const double length = glm::length(scene_gradient);
    const double sum = std::abs(gradient.x) + std::abs(gradient.y) + std::abs(gradient.z);
    if (!(sum > 0.0) || !std::isfinite(length) || !(length > 0.0))
        return std::nullopt; // no normal: the tip of a voxel
    SurfacePoint point;
    point.index = index;
    point.step = scene_to_index.direction(-scene_gradient / length);
    point.voxel = 1.0 / glm::length(point.step);
    point.weight = length / sum;
    return point;
}

/// Does work(first, last) for shares of `count` things, on all processors; returns once all is
/// done. What a share is does not depend on who does it.
template <class Work>
void in_shares(std::size_t count, std::size_t fewest, const Work& work) {
    const std::size_t shares = std::min<std::size_t>(
        std::max(1u, std::thread::hardware_concurrency()), count / fewest + 1);
    std::vector<std::jthread> others; // end with this
    for (std::size_t n = 1; n < shares; ++n)
        others.emplace_back(work, n * count / shares, (n + 1) * count / shares);
    work(std::size_t{0}, count / shares);
}

/// A voxel edge that crosses the level: from a voxel one step along an axis.
struct Crossing {
    std::uint64_t voxel_and_axis; ///< 4 * index in storage + axis
};

/// Those whose ends have neighbours on all sides, so that the gradient exists; in storage order.
std::vector<Crossing> crossings_of(const VoxelVolume& volume, double level) {
    const auto [ni, nj, nk] = volume.size;
    const std::array<std::size_t, 3> stride{1, static_cast<std::size_t>(ni),
                                            static_cast<std::size_t>(ni) *
                                                static_cast<std::size_t>(nj)};
    std::vector<std::vector<Crossing>> of_slice(static_cast<std::size_t>(std::max(nk, 0)));
    const auto find = [&, ni = ni, nj = nj, nk = nk](std::size_t first, std::size_t last) {
        for (std::size_t slice = std::max<std::size_t>(first, 1); slice < last; ++slice) {
            const int k = static_cast<int>(slice);
            if (k >= nk - 1) break;
            for (int j = 1; j < nj - 1; ++j)
                for (int i = 1; i < ni - 1; ++i) {
                    const std::size_t here = volume.index(i, j, k);
                    const std::array<bool, 3> inside{i < ni - 2, j < nj - 2, k < nk - 2};
                    const double a = volume.values[here];
                    for (std::size_t axis = 0; axis < 3; ++axis) {
                        const double b = volume.values[here + stride[axis]];
                        if (inside[axis] && (a >= level) != (b >= level) && std::isfinite(a - b))
                            of_slice[slice].push_back({4 * here + axis});
                    }
                }
        }
    };
    in_shares(of_slice.size(), kFewestSlicesPerShare, find);
    std::vector<Crossing> crossings;
    for (std::vector<Crossing>& slice : of_slice) {
        crossings.insert(crossings.end(), slice.begin(), slice.end());
        slice = {};
    }
    return crossings;
}

/// Points of the surface, regularly thinned to kMaxPoints at most: every n-th crossing in storage
/// order, so that the same volume gives the same points.
std::vector<SurfacePoint> surface_points(const VoxelVolume& volume, double level) {
    const std::vector<Crossing> crossings = crossings_of(volume, level);
    const std::size_t every = crossings.size() / kMaxPoints + 1;
    const AffineTransform scene_to_index = volume.index_to_scene.inverse();
    const auto row = static_cast<std::uint64_t>(volume.size[0]);
    const auto rows = static_cast<std::uint64_t>(volume.size[1]);

    std::vector<SurfacePoint> points;
    points.reserve(crossings.size() / every + 1);
    for (std::size_t n = 0; n < crossings.size(); n += every) {
        const std::uint64_t voxel = crossings[n].voxel_and_axis / 4;
        const auto axis = static_cast<int>(crossings[n].voxel_and_axis % 4);
        const int i = static_cast<int>(voxel % row), j = static_cast<int>(voxel / row % rows),
                  k = static_cast<int>(voxel / row / rows);
        std::array<int, 3> end{i, j, k};
        ++end[static_cast<std::size_t>(axis)];
        const double a = volume.at(i, j, k), b = volume.at(end[0], end[1], end[2]);
        const double t = (level - a) / (b - a);
        Vec3 index(i, j, k);
        index[axis] += t;
        const Vec3 gradient = (1.0 - t) * central_difference(volume, i, j, k) +
                              t * central_difference(volume, end[0], end[1], end[2]);
        if (const auto point = surface_point(scene_to_index, index, gradient))
            points.push_back(*point);
    }
    return points;
}

/// Where the field passes the level along a point's normal, between two values.
struct Bracket {
    const SurfacePoint* point = nullptr;
    bool material = false;                    ///< the field at the point is at the level or above
    double near = 0.0, far = 0.0;             ///< signed distances along the normal, m
    double near_value = 0.0, far_value = 0.0; ///< of the field there: only `near` is as the point
};

/// Towards free space where the field at the point is material, else the other way. Nothing within
/// the search length.
std::optional<Bracket> bracket(const Trilinear& field, double level, const SurfacePoint& point) {
    const auto start = field.value(point.index);
    if (!start || !std::isfinite(*start)) return std::nullopt;
    const bool material = *start >= level;
    const double step = (material ? 1.0 : -1.0) * point.voxel * kSearchVoxels / kSearchSteps;
    double near = 0.0;
    double near_value = *start;
    for (int n = 1; n <= kSearchSteps; ++n) {
        const double far = n * step;
        const auto value = field.value(point.index + far * point.step);
        if (!value || !std::isfinite(*value)) return std::nullopt;
        if ((*value >= level) != material)
            return Bracket{&point, material, near, far, near_value, *value};
        near = far;
        near_value = *value;
    }
    return std::nullopt;
}

/// Signed distance to the level, m, within a bracket that was halved enough.
double distance_in(const Bracket& b, double level) {
    return b.near + (b.far - b.near) * (level - b.near_value) / (b.far_value - b.near_value);
}

/// Halves brackets side by side: a halving waits for the one before it, but not for those of other
/// points.
void halve(const Trilinear& field, double level, std::span<Bracket> brackets) {
    for (int bisection = 0; bisection < kBisections; ++bisection)
        for (Bracket& b : brackets) {
            const double middle = 0.5 * (b.near + b.far);
            const double value =
                field.value(b.point->index + middle * b.point->step).value_or(level);
            // Selected, not branched to: which half it is cannot be foreseen.
            const bool same = (value >= level) == b.material;
            b.near = same ? middle : b.near;
            b.near_value = same ? value : b.near_value;
            b.far = same ? b.far : middle;
            b.far_value = same ? b.far_value : value;
        }
}

/// Signed distances along the normals, m, to where the field passes the level, of all points, found
/// on all processors; NaN where there is none.
std::vector<double> distances_to_level(const std::vector<SurfacePoint>& points,
                                       const VoxelVolume& smoothed, double level) {
    const Trilinear field(smoothed);
    std::vector<double> distances(points.size(), std::numeric_limits<double>::quiet_NaN());
    const auto find = [&](std::size_t first, std::size_t last) {
        std::array<Bracket, kTogether> together;
        for (std::size_t n = first; n < last;) {
            std::size_t count = 0;
            for (; n < last && count < kTogether; ++n)
                if (const auto found = bracket(field, level, points[n])) together[count++] = *found;
            const std::span<Bracket> found(together.data(), count);
            halve(field, level, found);
            for (const Bracket& b : found)
                distances[static_cast<std::size_t>(b.point - points.data())] =
                    distance_in(b, level);
        }
    };
    in_shares(points.size(), kFewestPointsPerShare, find);
    return distances;
}

/// Summed in the points' order: the same bits with any number of processors.
SurfaceShift measure(const std::vector<SurfacePoint>& points, const VoxelVolume& smoothed,
                     double level) {
    const std::vector<double> distances = distances_to_level(points, smoothed, level);
    SurfaceShift shift;
    double weights = 0.0;
    double sum = 0.0;
    double squares = 0.0;
    for (std::size_t n = 0; n < points.size(); ++n) {
        const double distance = distances[n];
        if (std::isnan(distance)) continue;
        const double weight = points[n].weight;
        weights += weight;
        sum += weight * distance;
        squares += weight * distance * distance;
        ++shift.points;
    }
    if (shift.points == 0) return shift;
    shift.mean_m = sum / weights;
    shift.deviation_m = std::sqrt(std::max(0.0, squares / weights - shift.mean_m * shift.mean_m));
    return shift;
}

void require_same_grid(const VoxelVolume& original, const VoxelVolume& smoothed) {
    if (original.size != smoothed.size || original.values.size() != original.voxels() ||
        smoothed.values.size() != smoothed.voxels())
        throw std::invalid_argument("surface_shift: both volumes must be filled and of one size");
}

/// Finds the level whose mean shift is 0. A higher level lies deeper in the material, so the shift
/// falls with the level; it jumps a little where points of the surface appear or vanish.
class LevelSearch {
public:
    LevelSearch(std::vector<SurfacePoint> points, const VoxelVolume& smoothed)
        : points_(std::move(points)), smoothed_(smoothed), range_(value_range(smoothed)) {}

    KeptLevel run(double start) {
        if (points_.empty())
            throw std::runtime_error("the volume has no surface at " + std::to_string(start) +
                                     "; choose a level within its range");
        Sample here = measure_at(start);
        if (std::abs(here.mean_m()) <= kLevelTolerance) return here;
        const Sample there = find_other_sign(here);
        return here.mean_m() > 0.0 ? close_in(here, there) : close_in(there, here);
    }

private:
    struct Sample : KeptLevel {
        double mean_m() const { return shift.mean_m; }
    };

    /// Nothing where too few of the surface's points are found at that level.
    std::optional<Sample> sample_at(double level) const {
        const SurfaceShift shift = measure(points_, smoothed_, level);
        if (static_cast<double>(shift.points) < kMinFound * static_cast<double>(points_.size()))
            return std::nullopt;
        return Sample{{level, shift}};
    }

    Sample measure_at(double level) const {
        const std::optional<Sample> sample = sample_at(level);
        if (!sample) fail();
        return *sample;
    }

    /// Goes away from `from`, which becomes the last sample of its own sign, in doubling steps. One
    /// too far, as metal elsewhere makes the range of values long, is halved.
    Sample find_other_sign(Sample& from) const {
        double step = std::copysign(kFirstStep * (range_[1] - range_[0]), from.mean_m());
        for (int halvings = 0; halvings < kMostHalvings && from.level + step != from.level;) {
            const double level = from.level + step;
            const bool is_in_range = level > range_[0] && level < range_[1];
            const std::optional<Sample> next =
                is_in_range ? sample_at(level) : std::optional<Sample>();
            if (!next) {
                step *= 0.5;
                ++halvings;
                continue;
            }
            if ((next->mean_m() > 0.0) != (from.mean_m() > 0.0)) return *next;
            from = *next;
            if (halvings == 0) step *= 2.0;
        }
        fail();
    }

    /// Secant steps within the bracket; halving where the last one did not shorten it enough.
    KeptLevel close_in(Sample above, Sample below) const {
        bool halve = false;
        for (int n = 0; n < kMaxLevelSteps; ++n) {
            const double width = below.level - above.level;
            // The shifts have different signs: their difference is not 0.
            const double share = halve ? 0.5 : above.mean_m() / (above.mean_m() - below.mean_m());
            const Sample next = measure_at(above.level + share * width);
            if (std::abs(next.mean_m()) <= kLevelTolerance) return next;
            (next.mean_m() > 0.0 ? above : below) = next;
            halve = std::abs(below.level - above.level) > 0.5 * std::abs(width);
        }
        const Sample& nearer = above.mean_m() < -below.mean_m() ? above : below;
        const Vec3 spacing = smoothed_.spacing_m();
        if (std::abs(nearer.mean_m()) > kJumpVoxels * std::min({spacing.x, spacing.y, spacing.z}))
            fail();
        return nearer;
    }

    [[noreturn]] void fail() const {
        throw std::runtime_error(
            "no level of the smoothed volume keeps the surface in its place; smooth less or keep "
            "the level as given");
    }

    std::vector<SurfacePoint> points_;
    const VoxelVolume& smoothed_;
    std::array<double, 2> range_;
};

} // namespace

SurfaceShift surface_shift(const VoxelVolume& original, double original_level,
                           const VoxelVolume& smoothed, double smoothed_level) {
    require_same_grid(original, smoothed);
    return measure(surface_points(original, original_level), smoothed, smoothed_level);
}

KeptLevel level_keeping_position(const VoxelVolume& original, double original_level,
                                 const VoxelVolume& smoothed) {
    require_same_grid(original, smoothed);
    return LevelSearch(surface_points(original, original_level), smoothed).run(original_level);
}

} // namespace palpate
