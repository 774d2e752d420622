// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include <palpate/geometry/rigid_pose.h>
#include <palpate/geometry/vec.h>
#include <palpate/haptics/solver/fixed_vector.h>
#include <palpate/haptics/solver/gain.h>

namespace palpate {

/// A plane that holds the proxy on its normal's side and yields above its strength:
/// P = +lambda n, lambda in [0, s], while n.(x - p) < 0.                     numerics 1.1
struct PlanePrimitive {
    Vec3 anchor{0.0};        ///< p: a point of the plane, m, scene frame
    Vec3 normal{0.0};        ///< n: unit, towards free space
    double strength_n = 0.0; ///< s: N, >= 0; infinite: a constraint
    /// Whether s is one strength for this plane and the one that was added before it, which is as
    /// strong: sum lambda <= s. So are the planes of one surface that yields: where it is pressed
    /// in a corner, its energy is s max(0, max over its planes of -n.(x - p)), and it holds with s
    /// at the most. Nothing to hard planes.
    bool shares = false;
};

/// A line that draws the proxy onto itself and lets it slip above its strength: P = -mu across the
/// axis, |mu| <= s, towards the nearest point of the line.                    numerics 1.1
struct LinePrimitive {
    Vec3 anchor{0.0};        ///< q: a point of the line, m, scene frame
    Vec3 axis{0.0};          ///< u: unit, either sense
    double strength_n = 0.0; ///< s: N, >= 0; infinite: a constraint
};

/// A point that draws the proxy into itself and lets it slip above its strength: P = -mu, |mu| <=
/// s.
struct PointPrimitive {
    Vec3 anchor{0.0};        ///< q: m, scene frame
    double strength_n = 0.0; ///< s: N, >= 0; infinite: a constraint
};

/// The haptic primitives of one evaluation: planes, lines and points in one fixed capacity, forces
/// and springs merged into one each. Planes, lines and points are numbered in the order in which
/// they were added. What is not finite counts as nothing, and is remembered: nobody downstream has
/// to reckon with it.
class PrimitiveSet {
public:
    static constexpr std::size_t kCapacity = 32; ///< planes, lines and points together

    /// Nothing is in it, and the gain is 1 again.                                           [loop]
    void clear() noexcept {
        planes_.clear();
        lines_.clear();
        points_.clear();
        force_ = Vec3{0.0};
        spring_ = fading_spring_ = 0.0;
        spring_moment_ = Vec3{0.0};
        overflowed_ = false;
        all_finite_ = true;
        draws_ = false;
        shares_strengths_ = false;
        gain_ = {};
    }

    /// What is added from here on is added with this gain: strengths by Gain::strength_n(), forces
    /// and springs in proportion.                                                        [loop]
    void set_gain(const Gain& gain) noexcept { gain_ = gain; }
    /// What a strength in N comes to with it.                                           [loop]
    double scaled_n(double strength_n) const noexcept { return gain_.strength_n(strength_n); }

    /// Adds a plane; one beyond the capacity is left out and remembered as overflow.       [loop]
    void add(const PlanePrimitive& plane) noexcept {
        if (!has_room()) return;
        if (!usable(plane.anchor, plane.normal, plane.strength_n))
            return planes_.push_back({Vec3{0.0}, any_direction(), 0.0, plane.shares}); // a number
        planes_.push_back({plane.anchor, plane.normal, scaled_n(plane.strength_n), plane.shares});
        shares_strengths_ = shares_strengths_ || (plane.shares && std::isfinite(plane.strength_n));
    }
    /// Nothing but a hard plane at gain 1: clear() and add(). `anchor`: m, scene frame; `normal`:
    /// unit. Both are finite: it is not asked.                                             [loop]
    void set_hard_plane(const Vec3& anchor, const Vec3& normal) noexcept {
        clear();
        planes_.push_back({anchor, normal, std::numeric_limits<double>::infinity()});
    }
    /// Adds a line, as add() does.                                                         [loop]
    void add_line(const LinePrimitive& line) noexcept {
        if (!has_room()) return;
        if (!usable(line.anchor, line.axis, line.strength_n))
            return lines_.push_back({Vec3{0.0}, any_direction(), 0.0});
        lines_.push_back({line.anchor, line.axis, scaled_n(line.strength_n)});
    }
    /// Replaces a plane that is there by one that is usable, as it is.                    [loop]
    void set_plane(std::size_t i, const PlanePrimitive& plane) noexcept { planes_[i] = plane; }
    /// Strength of a line that is there, N, >= 0, whatever the gain.                      [loop]
    void set_line_strength(std::size_t line, double strength_n) noexcept {
        lines_[line].strength_n = strength_n;
    }
    /// Adds a point, as add() does.                                                        [loop]
    void add_point(const PointPrimitive& point) noexcept {
        if (!has_room()) return;
        if (!usable(point.anchor, Vec3{0.0}, point.strength_n))
            return points_.push_back({Vec3{0.0}, 0.0});
        points_.push_back({point.anchor, scaled_n(point.strength_n)});
    }

    /// Adds a constant force F0 in N; several merge exactly: a' = a + sum F0 / k.          [loop]
    void add_force(const Vec3& force) noexcept {
        const Vec3 sum = force_ + gain_.value * force;
        if (!can_be_summed(sum, 0.0)) return;
        force_ = sum;
        draws_ = true;
    }

    /// Adds a spring that never yields, g/2 |x - q|^2, of stiffness g in N/m, >= 0, to an anchor q
    /// in m: what viscosity comes to in one frame (composition.md 1). Several merge exactly. Those
    /// that fade are together no stiffer than Gain::most_spring_n_per_m.          [loop]
    void add_spring(const Vec3& anchor, double stiffness_n_per_m) noexcept {
        const double left = std::max(0.0, gain_.most_spring_n_per_m - fading_spring_);
        const double scaled = std::min(gain_.spring_n_per_m(stiffness_n_per_m), left);
        const double sum = spring_ + scaled;
        const Vec3 moment = spring_moment_ + scaled * anchor;
        if (!can_be_summed(moment, stiffness_n_per_m >= 0.0 ? sum : stiffness_n_per_m)) return;
        spring_ = sum;
        spring_moment_ = moment;
        draws_ = true;
        if (std::isfinite(gain_.most_spring_n_per_m)) fading_spring_ += scaled;
    }

    /// What was in it when a body's frame was entered.
    struct Before {
        std::size_t planes = 0;          ///< how many
        std::size_t lines = 0;           ///< how many
        std::size_t points = 0;          ///< how many
        Vec3 force{0.0};                 ///< N, scene frame
        Vec3 spring_moment{0.0};         ///< N, scene frame
        Vec3 force_in_body{0.0};         ///< N, the same in the body's frame
        Vec3 spring_moment_in_body{0.0}; ///< N, the same in the body's frame
        double spring = 0.0;             ///< N/m
    };
    /// From here on, until leave(), forces and springs are those of a body's frame: what is added,
    /// and pull().                                                                       [loop]
    Before enter(const RigidMap& body) noexcept {
        Before before{planes_.size(), lines_.size(), points_.size(), force_, spring_moment_};
        before.spring = spring_;
        force_ = before.force_in_body = body.direction_back(force_);
        spring_moment_ = before.spring_moment_in_body =
            body.direction_back(spring_moment_ - spring_ * body.position());
        return before;
    }
    /// What was added in the body's frame is now in the scene's, of a strength of at most `most_n`,
    /// N, >= 0; the rest keeps its bits.                                                 [loop]
    void leave(const RigidMap& body, const Before& before, double most_n) noexcept {
        for (std::size_t i = before.planes; i < planes_.size(); ++i)
            planes_[i] = {body.point(planes_[i].anchor), body.direction(planes_[i].normal),
                          std::min(planes_[i].strength_n, most_n), planes_[i].shares};
        for (std::size_t i = before.lines; i < lines_.size(); ++i)
            lines_[i] = {body.point(lines_[i].anchor), body.direction(lines_[i].axis),
                         std::min(lines_[i].strength_n, most_n)};
        for (std::size_t i = before.points; i < points_.size(); ++i)
            points_[i] = {body.point(points_[i].anchor), std::min(points_[i].strength_n, most_n)};
        force_ = before.force + body.direction(force_ - before.force_in_body);
        spring_moment_ = before.spring_moment +
                         body.direction(spring_moment_ - before.spring_moment_in_body) +
                         (spring_ - before.spring) * body.position();
    }

    /// As they were added, with their gains; valid until the next change.                 [loop]
    std::span<const PlanePrimitive> planes() const noexcept { return planes_; }
    std::span<const LinePrimitive> lines() const noexcept { return lines_; }    ///< the same [loop]
    std::span<const PointPrimitive> points() const noexcept { return points_; } ///< the same [loop]
    const Vec3& force() const noexcept { return force_; } ///< sum F0, with gains, N        [loop]

    /// Stiffness of everything that draws without a bound, N/m: K = k + sum g.            [loop]
    double total_stiffness(double coupling) const noexcept { return coupling + spring_; }
    /// Where the coupling, the forces and the springs draw together, m:
    ///   a' = (k a + sum g q + sum F0) / K, here a + (sum g (q - a) + sum F0) / K.        [loop]
    /// With it, and K for k, they need no further mention: an exact shift and scale.
    Vec3 pull(const Vec3& probe, double coupling) const noexcept {
        if (!draws_) return probe + 0.0; // as the sum of nothing would
        return probe + (spring_moment_ - spring_ * probe + force_) / total_stiffness(coupling);
    }

    /// Whether nothing in it holds or yields: neither planes, lines nor points.
    /// [loop]
    bool is_free() const noexcept { return count() == 0; }
    /// Whether there are lines or points.                                                 [loop]
    bool has_tethers() const noexcept { return !lines_.empty() || !points_.empty(); }
    /// Whether there are planes that share a strength, and may yield.                     [loop]
    bool shares_strengths() const noexcept { return shares_strengths_; }
    bool overflowed() const noexcept { return overflowed_; } ///< more came than fits  [loop]
    /// Whether everything that was added was finite (strengths: or infinite), no strength or spring
    /// below 0, and no force or spring, nor their sum, above 1e100.                      [loop]
    bool all_finite() const noexcept { return all_finite_; }
    /// Planes, lines and points together.                                                 [loop]
    std::size_t count() const noexcept { return planes_.size() + lines_.size() + points_.size(); }

private:
    // No constant: where a host sets GLM_FORCE_INTRINSICS, GLM's constructors are not constexpr.
    static Vec3 any_direction() noexcept { return {0.0, 0.0, 1.0}; }

    /// Written so that what is no number is none.
    bool usable(const Vec3& at, const Vec3& along, double strength_n) noexcept {
        // A sum of finite numbers that is no finite one has overflowed: then each is looked at.
        const double sum = at.x + at.y + at.z + along.x + along.y + along.z;
        const bool finite = std::isfinite(sum) || (is_finite(at) && is_finite(along));
        const bool good = finite && strength_n >= 0.0;
        all_finite_ = all_finite_ && good;
        return good;
    }
    /// Whether forces and moments, N, or a spring, N/m, are so small that no sum of them, times a
    /// place or over a stiffness, overflows. What is no number is not.
    bool can_be_summed(const Vec3& force, double spring) noexcept {
        constexpr double kMost = 1e100;
        const bool small = std::abs(force.x) < kMost && std::abs(force.y) < kMost &&
                           std::abs(force.z) < kMost && spring >= 0.0 && spring < kMost;
        all_finite_ = all_finite_ && small;
        return small;
    }
    bool has_room() noexcept {
        const bool room = count() < kCapacity;
        overflowed_ = overflowed_ || !room;
        return room;
    }

    FixedVector<PlanePrimitive, kCapacity> planes_;
    FixedVector<LinePrimitive, kCapacity> lines_;
    FixedVector<PointPrimitive, kCapacity> points_;
    Vec3 force_{0.0};
    double spring_ = 0.0;        // sum g, N/m
    double fading_spring_ = 0.0; // the part of it that fades
    Vec3 spring_moment_{0.0};    // sum g q, N
    bool overflowed_ = false;
    bool all_finite_ = true;
    bool draws_ = false; // there are forces or springs
    bool shares_strengths_ = false;
    Gain gain_;
};

} // namespace palpate
