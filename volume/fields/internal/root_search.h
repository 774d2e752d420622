// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>

#include <palpate/geometry/vec.h>
#include <palpate/volume/fields/internal/analytic_field.h>

namespace palpate::internal {

/// Searches a stretch [a,b] of a segment for the first root, with a proof for what it passes.
///
/// Along the segment f'' >= -bend, so on an interval of length h between values f_0 and f_1 the
/// field stays below max(f_0, f_1) + bend h^2 / 8; and where f' at its start exceeds bend h it
/// grows throughout. `Shape` has double value(const Vec3&) and Vec3 slope(const Vec3&).
template <typename Shape>
class RootSearch {
public:
    /// The slope along the segment falls by at most bend_per_m2, U/m, per m of it. Positions are
    /// rounded as those of `extent_m` from the origin are.                               [loop]
    RootSearch(const Shape& shape, const Vec3& from, const Vec3& along, double level,
               double bend_per_m2, double extent_m) noexcept
        : shape_(shape), from_(from), along_(along), level_(level) {
        const double length = safe_length(along);
        bend_ = bend_per_m2 * length * length;
        // The rounding of a position, as t: nothing is resolved below it.
        resolution_ = std::max(0x1p-50, 0x1p-52 * extent_m / length);
    }

    /// The first root in [a,b]. Where the evaluations do not suffice for a proof, the start of what
    /// is not proven.                                                                   [loop]
    std::optional<double> first_in(double a, double b) noexcept {
        std::array<End, kMaxDepth> later;
        int depth = 0;
        End start{a, excess(a)};
        End end{b, excess(b)};
        while (true) {
            const double h = end.t - start.t;
            if (std::max(start.f, end.f) + 0.125 * bend_ * h * h < 0.0) {
                if (depth == 0) return std::nullopt;
                start = end;
                end = later[static_cast<std::size_t>(--depth)];
                continue;
            }
            if (start.f >= 0.0 || h <= resolution_ || depth == kMaxDepth ||
                evaluations_ >= kMaxEvaluations)
                return start.t;
            if (end.f >= 0.0 && slope(start.t) > bend_ * h) return growing_root(start, end);
            later[static_cast<std::size_t>(depth++)] = end;
            const double middle = start.t + 0.5 * h;
            end = {middle, excess(middle)};
        }
    }

private:
    struct End {
        double t = 0.0;
        double f = 0.0; // value - level
    };

    double excess(double t) noexcept {
        ++evaluations_;
        return shape_.value(point_at(from_, along_, t)) - level_;
    }
    double slope(double t) noexcept {
        evaluations_ += 2; // costs about as much as two values
        return glm::dot(shape_.slope(point_at(from_, along_, t)), along_);
    }

    /// The root between a < 0 <= b where the field grows: regula falsi with halved weights
    /// (Illinois).
    double growing_root(End a, End b) noexcept {
        double nudge = 0.5 * resolution_;
        double weight_a = a.f;
        double weight_b = b.f;
        int side = 0; // of the last step: an end that stays for a second one is halved
        for (int n = 0; n < kMaxRootSteps && b.t - a.t > resolution_; ++n) {
            double t = n % 4 == 3
                           ? 0.5 * (a.t + b.t)
                           : a.t - weight_a * (b.t - a.t) / (weight_b - weight_a); // divisor > 0
            // From either end only the other end is pulled in: step over the root when there.
            if (t - a.t < nudge || b.t - t < nudge) {
                t = t - a.t < nudge ? a.t + nudge : b.t - nudge;
                nudge *= 4.0;
            }
            t = std::clamp(t, a.t, b.t);
            const double f = excess(t);
            if (f < 0.0) {
                a = {t, f};
                weight_a = f;
                weight_b = side < 0 ? 0.5 * weight_b : b.f;
                side = -1;
            } else {
                b = {t, f};
                weight_b = f;
                weight_a = side > 0 ? 0.5 * weight_a : a.f;
                side = 1;
            }
        }
        return a.t;
    }

    static constexpr int kMaxDepth = 64; // halvings; resolution_ ends them after 50
    static constexpr int kMaxEvaluations =
        512; // about 40 us; a segment of 100 mm along bumps of 1 mm needs about 300
    static constexpr int kMaxRootSteps = 64;

    const Shape& shape_;
    Vec3 from_;
    Vec3 along_;
    double level_;
    double bend_ = 0.0; // U, per t^2
    double resolution_ = 0.0;
    int evaluations_ = 0;
};

} // namespace palpate::internal
