// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/level_distance.h>
#include <palpate/volume/fields/nearest_on_level.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace palpate {
namespace {

constexpr double kReach = 3.0; // feature sizes
// m, a hundredth of a nanometre: what a root or a foot is known to; rounding at 0.1 m is 1e-17.
constexpr double kRootEnd = 1.0e-11;
constexpr int kMostNewtonSteps = 30; // 3 to 5 where it is smooth; the rest is for kinks
// Turning contracts by distance over radius of curvature each time: 2^-20 at half a radius.
constexpr int kMostTurns = 20;
// Slides along a level halve what is left of the way where they are not exact at once.
constexpr int kMostSlides = 40;
constexpr double kShortestSlide = 1.0e-3; // share of the way along the tangent
constexpr int kSearchSteps = 8;           // in which a line is searched: parts of a foot's distance

/// One point's way to the level.
class LevelSearch {
public:
    LevelSearch(FieldSampler& sampler, double level, double feature_size_m, double reach_m) noexcept
        : sampler_(sampler), level_(level), feature_(feature_size_m), reach_(reach_m) {}

    std::optional<LevelFoot> foot(const Vec3& p) noexcept { return foot(p, p); }

    std::optional<LevelFoot> foot(const Vec3& p, const Vec3& start) noexcept {
        if (!is_finite(p) || !is_finite(start)) return std::nullopt;
        const std::optional<Vec3> found = newton(start);
        if (!found) return std::nullopt;
        double best = glm::length(*found - p);
        const double side = above(p) > 0.0 ? 1.0 : -1.0;
        if (best <= kRootEnd) return LevelFoot{*found, side * best};
        Vec3 foot = *found;
        for (int turn = 0; turn < kMostTurns; ++turn) {
            const Vec3 along = turn == 0 ? foot - p : turned(p, foot);
            const auto nearer = first_crossing(p, along, best);
            if (turn > 0 && (!nearer || best - *nearer <= kRootEnd)) break;
            if (!nearer) continue; // the foot found first is the line's only one
            best = *nearer;
            foot = p + best * glm::normalize(along);
        }
        return LevelFoot{foot, side * best};
    }

    /// A foot that goes on along the level as long as that brings it nearer: also where the point
    /// is farther away than the level is round, and turning leads away.
    std::optional<LevelFoot> nearest(const Vec3& p, const Vec3& start) noexcept {
        std::optional<LevelFoot> best = foot(p, start);
        for (int slide = 0; best && slide < kMostSlides; ++slide) {
            const Vec3 slope = sampler_.sample(best->position).slope;
            const double length = glm::length(slope);
            if (!(length > 0.0) || !std::isfinite(length)) return best;
            const Vec3 n = slope / length, way = p - best->position;
            const Vec3 along = way - glm::dot(n, way) * n;
            if (!(glm::length(along) > kRootEnd) || !slid(p, along, *best)) return best;
        }
        return best;
    }

private:
    /// Whether a share of a step along the level led to a nearer foot: then it is the best.
    bool slid(const Vec3& p, const Vec3& along, LevelFoot& best) noexcept {
        const double reach_m = std::abs(best.depth_m);
        for (double share = 1.0; share > kShortestSlide; share *= 0.5) {
            const std::optional<Vec3> found = newton(best.position + share * along);
            if (!found) continue;
            const double distance_m = glm::length(*found - p);
            if (!(distance_m < reach_m)) continue;
            best = {*found, std::copysign(distance_m, best.depth_m)};
            return true;
        }
        return false;
    }

    double above(const Vec3& p) noexcept { return sampler_.value(p) - level_; } // U

    /// A point of the level, by steps along the slope, no longer than a feature each. A step that
    /// crosses the level brackets it: kinks between cells cannot keep it from being found.
    std::optional<Vec3> newton(const Vec3& from) noexcept {
        Vec3 p = from;
        for (int step = 0; step < kMostNewtonSteps; ++step) {
            const FieldSample s = sampler_.sample(p);
            const double missing = level_ - s.value;
            if (missing == 0.0) return p;
            const double slope = glm::length(s.slope);
            if (!(slope > 0.0) || !std::isfinite(slope)) return std::nullopt;
            const double length = std::min(std::abs(missing) / slope, feature_);
            const Vec3 q = p + (missing > 0.0 ? length : -length) * (s.slope / slope);
            if (glm::length(q - from) > reach_) return std::nullopt;
            if ((above(q) > 0.0) != (missing < 0.0)) return root_between(p, q);
            if (length <= kRootEnd) return q;
            p = q;
        }
        return std::nullopt;
    }

    /// From p along the slope at a foot, towards it.
    Vec3 turned(const Vec3& p, const Vec3& foot) noexcept {
        const Vec3 slope = sampler_.sample(foot).slope;
        return glm::dot(slope, foot - p) < 0.0 ? -slope : slope;
    }

    /// Distance to where the value crosses the level first, from p along a direction up to `reach`.
    std::optional<double> first_crossing(const Vec3& p, const Vec3& along, double reach) noexcept {
        const double length = glm::length(along);
        if (!(length > 0.0) || !std::isfinite(length)) return std::nullopt;
        const Vec3 d = along / length;
        const bool from_above = above(p) > 0.0;
        Vec3 before = p;
        for (int step = 1; step <= kSearchSteps; ++step) {
            const Vec3 q = p + (reach * step / kSearchSteps) * d;
            if ((above(q) > 0.0) != from_above) return glm::length(root_between(before, q) - p);
            before = q;
        }
        return std::nullopt;
    }

    /// The level between two points on different sides of it: regula falsi, every third step a
    /// bisection.
    Vec3 root_between(Vec3 a, Vec3 b) noexcept {
        constexpr int kMostSteps = 120; // every third halves: 2^-40 of the bracket at the worst
        double at_a = above(a), at_b = above(b);
        const bool a_above = at_a > 0.0;
        for (int step = 0; step < kMostSteps && glm::distance(a, b) > kRootEnd; ++step) {
            double share = 0.5;
            if (step % 3 != 2 && std::isfinite(at_a - at_b) && at_a != at_b)
                share = std::clamp(at_a / (at_a - at_b), 0.01, 0.99);
            const Vec3 p = a + share * (b - a);
            const double value = above(p);
            if ((value > 0.0) == a_above) {
                a = p;
                at_a = value;
            } else {
                b = p;
                at_b = value;
            }
        }
        return 0.5 * (a + b);
    }

    FieldSampler& sampler_;
    double level_;
    double feature_; // m
    double reach_;   // m
};

std::vector<Vec3> centroids(const TriangleMesh& mesh) {
    std::vector<Vec3> centers;
    centers.reserve(mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        Vec3 sum{0.0};
        for (const std::uint32_t vertex : mesh.triangles[t]) {
            if (vertex >= mesh.vertices.size())
                throw std::invalid_argument("triangle " + std::to_string(t) + " names vertex " +
                                            std::to_string(vertex) + " of " +
                                            std::to_string(mesh.vertices.size()) +
                                            "; make every index smaller than the vertex count");
            sum += mesh.vertices[vertex];
        }
        centers.push_back(sum / 3.0);
    }
    return centers;
}

} // namespace

std::optional<LevelFoot> foot_on_level(FieldSampler& sampler, double level, double feature_size_m,
                                       const Vec3& point, double reach_m) noexcept {
    return LevelSearch(sampler, level, feature_size_m, reach_m).foot(point);
}

std::optional<LevelFoot> nearest_on_level(FieldSampler& sampler, double level,
                                          double feature_size_m, const Vec3& point,
                                          const Vec3& start, double reach_m) noexcept {
    return LevelSearch(sampler, level, feature_size_m, reach_m).nearest(point, start);
}

LevelDistance level_distance(const ScalarField& field, double level, std::span<const Vec3> points) {
    const std::unique_ptr<FieldSampler> sampler = field.make_sampler();
    const double feature_m = field.feature_size_m();
    LevelSearch search(*sampler, level, feature_m, kReach * feature_m);
    LevelDistance result;
    result.points = points.size();
    std::vector<double> distances;
    distances.reserve(points.size());
    for (const Vec3& p : points)
        if (const auto foot = search.foot(p)) distances.push_back(std::abs(foot->depth_m));
    result.lost = points.size() - distances.size();
    if (distances.empty()) return result;

    for (const double distance : distances)
        result.mean_m += distance / static_cast<double>(distances.size());
    std::sort(distances.begin(), distances.end());
    result.p99_m = distances[(99 * distances.size() + 99) / 100 - 1];
    result.max_m = distances.back();
    return result;
}

MeshError mesh_error(const ScalarField& field, double level, const TriangleMesh& mesh) {
    const std::vector<Vec3> centers = centroids(mesh);
    return {level_distance(field, level, mesh.vertices), level_distance(field, level, centers)};
}

} // namespace palpate
