// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/devices/surface_tour.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_map>
#include <utility>

#include <palpate/engine/devices/internal/device_surfaces.h>
#include <palpate/engine/devices/internal/surface_loops.h>
#include <palpate/engine/devices/internal/surface_walk.h>
#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/truth/place_on.h>
#include <palpate/volume/fields/grid_field.h>

namespace palpate {
namespace {

using internal::LoopPoint;
using internal::SurfaceLoop;
using internal::SurfaceWalk;
using internal::TouchPlace;

constexpr double kApproach = 5e-3;     // m in front of the surface where a trial begins at most
constexpr double kBridge = 0.5e-3;     // m between places from one line to the next
constexpr double kLongestBridge = 1.5; // spacings between two lines that are gone without a gap
constexpr int kNodes = 128;            // along the longest side of a formula's bounds

/// A formula's level where it is, without the ends of the grid that closes it.
TriangleMesh formula_mesh(const ScalarField& field, double level) {
    const Box bounds = field.bounds_at(level);
    const Vec3 extent = bounds.extent();
    const double spacing = std::max({extent.x, extent.y, extent.z}) / (kNodes - 1);
    VoxelVolume volume;
    volume.index_to_scene = {Mat3(spacing), bounds.lower};
    for (int axis = 0; axis < 3; ++axis)
        volume.size[static_cast<std::size_t>(axis)] =
            std::max(2, static_cast<int>(std::lround(extent[axis] / spacing)) + 1);
    const std::unique_ptr<FieldSampler> sampler = field.make_sampler();
    double lowest = level;
    for (int k = 0; k < volume.size[2]; ++k)
        for (int j = 0; j < volume.size[1]; ++j)
            for (int i = 0; i < volume.size[0]; ++i) {
                const double value = sampler->value(volume.index_to_scene.point(Vec3(i, j, k)));
                lowest = std::min(lowest, value);
                volume.values.push_back(static_cast<float>(value));
            }
    const double slope = std::max(field.typical_slope(level), 1e-300); // U/m
    const auto background = static_cast<float>(lowest - slope * spacing);
    TriangleMesh mesh = GridField(volume, background).preview(level);
    std::erase_if(mesh.triangles, [&](const auto& t) {
        const Vec3 middle = (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3.0;
        return std::abs(sampler->value(middle) - level) > 0.5 * slope * spacing;
    });
    return mesh;
}

/// Goes from loop to loop: which ones are still to be visited, and where each begins.
class LoopOrder {
public:
    explicit LoopOrder(std::vector<SurfaceLoop> loops) : loops_(std::move(loops)) {
        visited_.resize(loops_.size(), false);
        for (std::size_t i = 0; i < loops_.size(); ++i) {
            const auto level = static_cast<std::size_t>(loops_[i].level);
            if (at_level_.size() < level + 1) at_level_.resize(level + 1);
            at_level_[level].push_back(i);
        }
    }

    /// The first loop that nobody was on; nothing when there is none.
    std::optional<std::size_t> next() {
        while (first_ < loops_.size() && visited_[first_])
            ++first_;
        return first_ < loops_.size() ? std::optional(first_) : std::nullopt;
    }

    /// The points of a loop, from where it is nearest to a point on; visits it. A closed one ends
    /// where it began.
    std::vector<LoopPoint> visit(std::size_t loop, const Vec3& from) {
        visited_[loop] = true;
        std::vector<LoopPoint> points = loops_[loop].points;
        if (!loops_[loop].is_closed) {
            if (glm::distance(points.back().point, from) <
                glm::distance(points.front().point, from))
                std::reverse(points.begin(), points.end());
            return points;
        }
        std::rotate(points.begin(), points.begin() + nearest(points, from).first, points.end());
        points.push_back(points.front());
        return points;
    }

    /// The loop beside one, beyond it, that is nearest to a point and not farther than so far.
    std::optional<std::size_t> beside(std::size_t loop, const Vec3& point, double farthest_m) {
        const auto level = static_cast<std::size_t>(loops_[loop].level) + 1;
        std::optional<std::size_t> best;
        if (level >= at_level_.size()) return best;
        for (const std::size_t other : at_level_[level]) {
            if (visited_[other]) continue;
            const auto& points = loops_[other].points;
            const double distance = loops_[other].is_closed
                                        ? nearest(points, point).second
                                        : std::min(glm::distance(points.front().point, point),
                                                   glm::distance(points.back().point, point));
            if (distance >= farthest_m) continue;
            farthest_m = distance;
            best = other;
        }
        return best;
    }

private:
    static std::pair<std::ptrdiff_t, double> nearest(const std::vector<LoopPoint>& points,
                                                     const Vec3& to) {
        const auto closer = [&](const LoopPoint& a, const LoopPoint& b) {
            return squared_length(a.point - to) < squared_length(b.point - to);
        };
        const auto found = std::min_element(points.begin(), points.end(), closer);
        return {found - points.begin(), glm::distance(found->point, to)};
    }

    std::vector<SurfaceLoop> loops_;
    std::vector<std::vector<std::size_t>> at_level_;
    std::vector<bool> visited_;
    std::size_t first_ = 0;
};

/// The way over a mesh from one point of it to another; nothing where the mesh does not go on
/// between them.
std::optional<std::vector<LoopPoint>> bridge(const SurfaceScene& mesh, const LoopPoint& from,
                                             const LoopPoint& to) {
    const double length = glm::distance(from.point, to.point);
    const int pieces = static_cast<int>(std::ceil(length / kBridge));
    std::vector<LoopPoint> points;
    Vec3 last = from.point;
    for (int i = 1; i < pieces; ++i) {
        const double share = static_cast<double>(i) / pieces;
        const Vec3 chord = from.point + share * (to.point - from.point);
        const std::optional<SurfaceHit> foot = mesh.closest_point(chord, length);
        // What faces away is the other side of a sheet; what is far off, another fold.
        if (!foot || glm::dot(foot->normal, from.normal + to.normal) <= 0.0 ||
            glm::distance(foot->position, last) > 3.0 * kBridge)
            return std::nullopt;
        points.push_back({foot->position, foot->normal});
        last = foot->position;
    }
    if (glm::distance(last, to.point) > 3.0 * kBridge) return std::nullopt;
    return points;
}

/// Half way to what is in front of a place, but no farther than the approach. Nothing where all of
/// that is inside: in a fold that is narrower than the mesh shows.
std::optional<Vec3> in_front_of(const TouchPlace& place, const SurfaceScene& mesh,
                                const OrbitTarget& target,
                                const std::function<bool(const Vec3&)>& is_free) {
    constexpr double kLift = 1e-4; // m: a ray that begins on the mesh would meet it at once
    const Vec3 start = place.point + kLift * place.normal;
    const std::optional<SurfaceHit> opposite =
        mesh.first_hit(start, place.point + 2.0 * kApproach * place.normal);
    double distance = opposite ? 0.5 * (opposite->distance_m + kLift) : kApproach;
    // Through what else is felt, from where nothing is.
    if (is_free && !opposite)
        for (double far = distance; far < glm::length(target.bounds.extent()); far *= 2.0) {
            if (mesh.first_hit(start, place.point + far * place.normal)) break;
            distance = far;
            if (is_free(place.point + far * place.normal)) break;
        }
    // A mesh is not quite where a level is.
    constexpr int kTries = 4;
    for (int tries = 0; target.inside(place.point + distance * place.normal); ++tries) {
        if (tries == kTries) return std::nullopt;
        distance *= 0.5;
    }
    return place.point + distance * place.normal;
}

/// The point of the surface itself, where the mesh is only near it.
TouchPlace place_of(const LoopPoint& point, const OrbitTarget& target, double depth_m) {
    constexpr double kNear = 1e-3; // m between a mesh and what it is a mesh of, and more
    TouchPlace place{point.point, point.normal, depth_m};
    const Vec3 out = point.point + kNear * point.normal, in = point.point - kNear * point.normal;
    if (target.inside(out)) return place;
    if (const std::optional<double> met = target.first_crossing(out, in))
        place.point = out + *met * (in - out);
    if (const Vec3 normal = target.normal(place.point); glm::dot(normal, point.normal) > 0.0)
        place.normal = normal;
    return place;
}

/// Points that are in a grid of cells as wide as a distance.
class PointCells {
public:
    explicit PointCells(double width_m) : width_m_(width_m) {}

    void add(const Vec3& point) { cells_[key_of(cell_of(point))].push_back(point); }

    bool has_within(const Vec3& point, double distance_m) const {
        const std::array<std::int64_t, 3> middle = cell_of(point);
        for (std::int64_t k = -1; k <= 1; ++k)
            for (std::int64_t j = -1; j <= 1; ++j)
                for (std::int64_t i = -1; i <= 1; ++i) {
                    const auto found =
                        cells_.find(key_of({middle[0] + i, middle[1] + j, middle[2] + k}));
                    if (found == cells_.end()) continue;
                    for (const Vec3& other : found->second)
                        if (squared_length(other - point) <= distance_m * distance_m) return true;
                }
        return false;
    }

private:
    std::array<std::int64_t, 3> cell_of(const Vec3& point) const {
        const Vec3 index = glm::floor(point / width_m_);
        return {static_cast<std::int64_t>(index.x), static_cast<std::int64_t>(index.y),
                static_cast<std::int64_t>(index.z)};
    }
    /// Cells that share a key only cost time: each point is compared.
    static std::uint64_t key_of(const std::array<std::int64_t, 3>& cell) {
        constexpr std::uint64_t kBits = 21, kMask = (std::uint64_t{1} << kBits) - 1;
        return (static_cast<std::uint64_t>(cell[0]) & kMask) |
               (static_cast<std::uint64_t>(cell[1]) & kMask) << kBits |
               (static_cast<std::uint64_t>(cell[2]) & kMask) << 2 * kBits;
    }

    double width_m_;
    std::unordered_map<std::uint64_t, std::vector<Vec3>> cells_;
};

} // namespace

std::shared_ptr<const TriangleMesh> mesh_of(const SceneSurface& surface) {
    if (surface.mesh.scene) return {surface.mesh.scene, &surface.mesh.scene->mesh()};
    if (surface.baked.grid)
        return std::make_shared<TriangleMesh>(surface.baked.grid->preview(surface.level.level));
    return std::make_shared<TriangleMesh>(formula_mesh(*surface.baked.field, surface.level.level));
}

std::vector<DeviceState> make_tour(std::shared_ptr<const TriangleMesh> mesh,
                                   const OrbitTarget& target, const DeviceDescription& tour,
                                   double rate_hz, std::size_t most_frames,
                                   const std::function<bool(const Vec3& point)>& is_free) {
    const double spacing_m = 1e-3 * tour.spacing_mm, depth_m = 1e-3 * tour.press_mm;
    const SurfaceScene scene(mesh);
    SurfaceWalk walk(
        {tour.speed_m_per_s, rate_hz, most_frames,
         [&](const TouchPlace& place) { return in_front_of(place, scene, target, is_free); }},
        internal::follower_of(target));
    LoopOrder order(internal::surface_loops(*mesh, spacing_m));
    while (!walk.is_full()) {
        std::optional<std::size_t> loop = order.next();
        if (!loop) break;
        std::vector<TouchPlace> places;
        const auto go_over = [&](const std::vector<LoopPoint>& points) {
            for (const LoopPoint& point : points)
                places.push_back(place_of(point, target, depth_m));
        };
        std::vector<LoopPoint> points = order.visit(*loop, Vec3{0.0});
        go_over(points);
        while ((loop = order.beside(*loop, points.back().point, kLongestBridge * spacing_m))) {
            const LoopPoint end = points.back();
            std::vector<LoopPoint> next = order.visit(*loop, end.point);
            if (const auto way = bridge(scene, end, next.front())) {
                go_over(*way);
            } else {
                walk.add(internal::with_smooth_normals(std::move(places)));
                places.clear();
            }
            points = std::move(next);
            go_over(points);
        }
        walk.add(internal::with_smooth_normals(std::move(places)));
    }
    return walk.take();
}

SurfaceCoverage coverage_of(const TriangleMesh& mesh, std::span<const Vec3> places,
                            double within_m) {
    PointCells touched(within_m);
    for (const Vec3& place : places)
        touched.add(place);
    SurfaceCoverage coverage;
    coverage.within_m = within_m;
    double felt_m2 = 0.0;
    for (const auto& t : mesh.triangles) {
        const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
        const double area = 0.5 * glm::length(glm::cross(b - a, c - a));
        coverage.area_m2 += area;
        if (touched.has_within((a + b + c) / 3.0, within_m)) felt_m2 += area;
    }
    if (coverage.area_m2 > 0.0) coverage.felt_share = felt_m2 / coverage.area_m2;
    return coverage;
}

std::vector<SurfaceCoverage> tour_coverage(const Scene& scene,
                                           std::span<const FrameReport> frames) {
    std::vector<SurfaceCoverage> list;
    const DeviceDescription& device = scene.description().device;
    if (device.kind != DeviceDescription::Kind::tour) return list;
    for (const SceneSurface* surface : internal::surfaces_of_device(scene)) {
        const auto index = static_cast<std::size_t>(surface - scene.surfaces().data());
        if (index >= kFeltBits) continue;
        const PlaceOn place_on(scene, *surface);
        std::vector<Vec3> places;
        places.reserve(frames.size());
        for (const FrameReport& frame : frames) {
            if (!(frame.surfaces_felt >> index & 1U)) continue;
            if (const std::optional<Vec3> place = place_on.of(frame)) places.push_back(*place);
        }
        list.push_back(coverage_of(*mesh_of(*surface), places, 1e-3 * device.spacing_mm));
        list.back().surface = surface->name;
    }
    return list;
}

} // namespace palpate
