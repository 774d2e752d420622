// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <palpate/haptics/solver/proxy_solver.h>

/// The minimisation of eq. (5) once more, in long double: what a solution is worth, and a slow
/// solver to compare with.
namespace palpate::test {

using Exact = long double;

struct Exact3 {
    Exact x = 0, y = 0, z = 0;
    Exact3() = default;
    Exact3(Exact a, Exact b, Exact c) : x(a), y(b), z(c) {}
    explicit Exact3(const Vec3& v) : x(v.x), y(v.y), z(v.z) {}
    Exact3 operator+(const Exact3& o) const { return {x + o.x, y + o.y, z + o.z}; }
    Exact3 operator-(const Exact3& o) const { return {x - o.x, y - o.y, z - o.z}; }
    Exact3 operator*(Exact f) const { return {x * f, y * f, z * f}; }
    Exact dot(const Exact3& o) const { return x * o.x + y * o.y + z * o.z; }
    Exact length() const { return std::sqrt(dot(*this)); }
};

/// A primitive as a convex function of y = x - a' whose multiplier, over k, lies in a set.
struct ExactPrimitive {
    enum class Kind { plane, line, point } kind;
    std::size_t index;
    Exact3 anchor;       // from a', m
    Exact3 direction;    // unit
    Exact bound;         // m
    bool shares = false; // the bound is one for it and the plane before it

    /// A plane's gap along its normal; the way from the line or the point.
    Exact3 offset(const Exact3& y) const {
        const Exact3 way = y - anchor;
        if (kind == Kind::plane) return direction * direction.dot(way);
        if (kind == Kind::line) return way - direction * direction.dot(way);
        return way;
    }
    /// The nearest multiplier that the primitive may have; `w` is along the normal of a plane,
    /// across a line.
    Exact3 allowed(const Exact3& w) const {
        if (kind == Kind::plane) return direction * std::clamp<Exact>(direction.dot(w), 0, bound);
        const Exact length = w.length();
        return length > bound ? w * (bound / length) : w;
    }
    /// The greatest of -w.r over the multipliers that it may have: its energy over k.
    Exact energy(const Exact3& y) const {
        const Exact3 r = offset(y);
        if (kind == Kind::plane) return bound * std::max<Exact>(0, -direction.dot(r));
        return bound * r.length();
    }
};

class ExactProblem {
public:
    ExactProblem(const PrimitiveSet& set, const Vec3& probe, double stiffness)
        : target_(Exact3(probe) + Exact3(set.force()) * (1 / Exact(stiffness))) {
        using Kind = ExactPrimitive::Kind;
        for (std::size_t i = 0; i < set.planes().size(); ++i) {
            const PlanePrimitive& p = set.planes()[i];
            if (add(Kind::plane, i, p.anchor, p.normal, p.strength_n / Exact(stiffness)))
                primitives_.back().shares = p.shares && i > 0;
        }
        for (std::size_t i = 0; i < set.lines().size(); ++i) {
            const LinePrimitive& p = set.lines()[i];
            add(Kind::line, i, p.anchor, p.axis, p.strength_n / Exact(stiffness));
        }
        for (std::size_t i = 0; i < set.points().size(); ++i) {
            const PointPrimitive& p = set.points()[i];
            add(Kind::point, i, p.anchor, {1, 0, 0}, p.strength_n / Exact(stiffness));
        }
        for (ExactPrimitive& primitive : primitives_) // hard ones: as solve_proxy documents
            primitive.bound = std::min(primitive.bound, 64 * scale_);
        stiffness_ = stiffness;
    }

    /// The furthest anchor from a', m, and at least a millimetre: the coordinates round, too.
    Exact scale() const { return std::max<Exact>(scale_, 1e-3L); }

    struct Worth {
        Exact residual_m = 0; ///< natural residual, and of the balance of forces
        Exact error_m = 0;    ///< the minimiser is no further away
    };

    /// What a solution is worth by its proxy and its multipliers alone.
    Worth worth(const ProxySolution& solution) const {
        std::vector<Exact3> w;
        for (const ExactPrimitive& primitive : primitives_) {
            Exact3 force;
            if (primitive.kind == ExactPrimitive::Kind::plane)
                force = primitive.direction * Exact(solution.planes[primitive.index].multiplier_n);
            if (primitive.kind == ExactPrimitive::Kind::line)
                force = Exact3(solution.lines[primitive.index].force_n);
            if (primitive.kind == ExactPrimitive::Kind::point)
                force = Exact3(solution.points[primitive.index].force_n);
            w.push_back(force * (1 / stiffness_));
        }
        return worth(Exact3(solution.proxy) - target_, w);
    }

    /// Planes that share a strength apart: minimises over one multiplier after the other, each in
    /// closed form, until the residual is below `tolerance_m` or `most_sweeps` are over. Slow where
    /// primitives nearly agree.
    struct Swept {
        Exact3 proxy;
        Worth worth;
    };
    Swept sweep(Exact tolerance_m, int most_sweeps) const {
        std::vector<Exact3> w(primitives_.size());
        Exact3 y;
        Worth now;
        for (int i = 0; i < most_sweeps; ++i) {
            for (std::size_t j = 0; j < primitives_.size(); ++j) {
                const Exact3 wish = w[j] - primitives_[j].offset(y);
                const Exact3 next = primitives_[j].allowed(wish);
                y = y + (next - w[j]);
                w[j] = next;
            }
            y = Exact3{};
            for (const Exact3& each : w)
                y = y + each;
            now = worth(y, w);
            if (now.residual_m <= tolerance_m) break;
        }
        return {target_ + y, now};
    }

private:
    bool add(ExactPrimitive::Kind kind, std::size_t index, const Vec3& anchor,
             const Vec3& direction, Exact bound) {
        const Exact length = Exact3(direction).length();
        if (!is_finite(anchor) || !(length > 0) || !std::isfinite(length) || !(bound > 0))
            return false;
        const Exact3 way = Exact3(anchor) - target_;
        primitives_.push_back({kind, index, way, Exact3(direction) * (1 / length), bound});
        scale_ = std::max(scale_, way.length());
        return true;
    }

    /// The end of the run of planes that begins with `first` and shares one bound.
    std::size_t run_end(std::size_t first) const {
        std::size_t end = first + 1;
        while (end < primitives_.size() && primitives_[end].shares)
            ++end;
        return end;
    }

    /// Of multipliers of planes: the nearest that are >= 0, and whose sum is at most `bound`.
    static std::vector<Exact> allowed_together(std::vector<Exact> wish, Exact bound) {
        Exact sum = 0;
        for (Exact& each : wish)
            sum += each = std::max<Exact>(each, 0);
        std::vector<Exact> sorted = wish;
        std::sort(sorted.rbegin(), sorted.rend());
        Exact less = 0, head = 0;
        for (std::size_t i = 0; sum > bound && i < sorted.size(); ++i) {
            head += sorted[i];
            const Exact even = (head - bound) / static_cast<Exact>(i + 1);
            if (even < sorted[i]) less = even;
        }
        for (Exact& each : wish)
            each = std::max<Exact>(each - less, 0);
        return wish;
    }

    /// Residual and gap of planes that share a bound; `w` are their multipliers.
    void judge_run(std::size_t first, std::size_t end, const Exact3& y,
                   const std::vector<Exact3>& w, Worth& result, Exact& gap) const {
        std::vector<Exact> lambda, wish;
        Exact deepest = 0;
        for (std::size_t j = first; j < end; ++j) {
            const Exact3& normal = primitives_[j].direction;
            const Exact of_plane = normal.dot(y - primitives_[j].anchor);
            lambda.push_back(normal.dot(w[j]));
            wish.push_back(lambda.back() - of_plane);
            deepest = std::max(deepest, -of_plane);
            gap += lambda.back() * of_plane;
        }
        gap += primitives_[first].bound * deepest;
        const std::vector<Exact> nearest = allowed_together(wish, primitives_[first].bound);
        for (std::size_t i = 0; i < nearest.size(); ++i)
            result.residual_m = std::max(result.residual_m, std::abs(lambda[i] - nearest[i]));
    }

    /// With E(y) = abs(y)^2/2 + energies and its dual D(w) = -abs(v)^2/2 + sum w.anchor, v = sum w:
    /// abs(y - y*)^2/2 <= E(y) - E(y*) <= E(y) - D(w) = abs(y - v)^2/2 + energies + sum w.r.
    Worth worth(const Exact3& y, const std::vector<Exact3>& w) const {
        Worth result;
        Exact3 v;
        Exact gap = 0;
        for (std::size_t j = 0; j < primitives_.size(); ++j) {
            const ExactPrimitive& primitive = primitives_[j];
            v = v + w[j];
            if (primitive.shares) continue; // judged with the first of its run
            if (const std::size_t end = run_end(j); end > j + 1) {
                judge_run(j, end, y, w, result, gap);
                continue;
            }
            const Exact3 r = primitive.offset(y);
            const Exact residual = (w[j] - primitive.allowed(w[j] - r)).length();
            result.residual_m = std::max(result.residual_m, residual);
            gap += primitive.energy(y) + w[j].dot(r);
        }
        const Exact imbalance = (y - v).length();
        result.residual_m = std::max(result.residual_m, imbalance);
        gap += imbalance * imbalance / 2;
        result.error_m = std::sqrt(2 * std::max<Exact>(gap, 0));
        return result;
    }

    Exact3 target_; // a'
    Exact stiffness_ = 1;
    Exact scale_ = 0;
    std::vector<ExactPrimitive> primitives_;
};

} // namespace palpate::test
