// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include <palpate/haptics/effects/curve_guide.h>

#include "tests/support/contact_loop.h"
#include "tests/support/effect_lists.h"

namespace palpate::test {

inline constexpr double kInfinite = std::numeric_limits<double>::infinity();
inline constexpr double kStiffness = ContactLoop::kStiffness;
inline constexpr double kTau = 2.0 * std::numbers::pi;
inline constexpr double kTolerance = 1e-7; // m, of the adaptive loop

inline const SteppingSettings kMethods[] = {
    stepping(SteppingMethod::single), stepping(SteppingMethod::fixed, 2),
    stepping(SteppingMethod::fixed, 7), stepping(SteppingMethod::adaptive)};

class Anywhere {
public:
    double number() { return one(random); }
    Vec3 vector() { return {one(random), one(random), one(random)}; }

private:
    std::mt19937 random{23};
    std::uniform_real_distribution<double> one{-1.0, 1.0};
};

inline std::unique_ptr<Effect> guide(Polyline curve, double strength_n,
                                     double capture_m = kInfinite) {
    return std::make_unique<CurveGuide>(std::move(curve), GuideSettings{strength_n, capture_m});
}

inline Polyline polyline(const std::vector<Vec3>& points, PolylineEnds ends = PolylineEnds::open) {
    return {points, ends};
}

/// Corners of a circle about z at a height, a power of two or any number of them.
inline std::vector<Vec3> circle(double radius, double height, int corners) {
    std::vector<Vec3> points;
    for (int i = 0; i < corners; ++i) {
        const double angle = kTau * i / corners;
        points.push_back({radius * std::cos(angle), radius * std::sin(angle), height});
    }
    return points;
}

/// The nearest point of all pieces, one by one.
inline Vec3 nearest_of_all(const std::vector<Vec3>& points, const Vec3& point) {
    Vec3 best{kInfinite};
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
        const Vec3 way = points[i + 1] - points[i];
        const double share =
            std::clamp(glm::dot(point - points[i], way) / squared_length(way), 0.0, 1.0);
        const Vec3 here = points[i] + share * way;
        if (!(glm::length(point - here) >= glm::length(point - best))) best = here;
    }
    return best;
}

/// What a tether of strength s at `on` leaves of a pull: a - r min(1, s / (k |r|)).
inline Vec3 slipped(const Vec3& on, const Vec3& pull, double strength_n) {
    const Vec3 way = pull - on;
    const double distance = glm::length(way);
    return distance <= strength_n / kStiffness ? on
                                               : pull - strength_n / (kStiffness * distance) * way;
}

/// How far `x` is from the answer for a pull: of all places of an open polyline where the way to
/// the pull is shortest among their neighbours, that of its branch. A guide of strength s leaves
/// a' - r min(1, s / (k |r|)).
inline double off_branch(const std::vector<Vec3>& points, const Vec3& pull, double strength_n,
                         const Vec3& x) {
    double least = kInfinite;
    const std::size_t pieces = points.size() - 1;
    const auto part = [&](std::size_t piece, const Vec3& from) {
        return glm::dot(pull - from, points[piece + 1] - points[piece]);
    };
    const auto consider = [&](const Vec3& foot) {
        least = std::min(least, glm::length(slipped(foot, pull, strength_n) - x));
    };
    for (std::size_t i = 0; i <= pieces; ++i) {
        const bool on = i > 0 ? part(i - 1, points[i]) >= 0.0 : true;
        const bool back = i < pieces ? part(i, points[i]) <= 0.0 : true;
        if (on && back) consider(points[i]);
        if (i == pieces) break;
        const double share = part(i, points[i]) / squared_length(points[i + 1] - points[i]);
        if (share >= 0.0 && share <= 1.0) consider(points[i] + share * (points[i + 1] - points[i]));
    }
    return least;
}

} // namespace palpate::test
