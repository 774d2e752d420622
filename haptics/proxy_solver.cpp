// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/proxy_solver.h>

#include <algorithm>
#include <cmath>

#include <palpate/haptics/internal/mixed_solver.h>
#include <palpate/haptics/internal/solver_limits.h>

namespace palpate {
namespace {

using solver::kAbsoluteGap;
using solver::kGapRounding;
using solver::kHardMultiplier;
using solver::kRelativeGap;

constexpr std::size_t kCapacity = PrimitiveSet::kCapacity;
constexpr std::size_t kNone = kCapacity;

// A normal whose rest after projection on the free normals is shorter depends on them
// (numerics 1.4).
constexpr double kDependent = 1e-13;

/// The dual of eq. (5) in displacements: y = x - a' = sum lambda_i n_i, 0 <= lambda_i <= sigma_i,
/// all in metres (lambda = N / k). A primal active-set method on the bounded multipliers: at most
/// three normals are free at a time.
class DualProblem {
public:
    DualProblem(const PrimitiveSet& primitives, const Vec3& target, double stiffness) noexcept {
        count_ = primitives.planes().size();
        double scale = 0.0;
        for (std::size_t i = 0; i < count_; ++i) {
            const PlanePrimitive& plane = primitives.planes()[i];
            const double length = glm::length(plane.normal);
            usable_[i] = solver::is_usable(plane.anchor, length, plane.strength_n);
            if (!usable_[i]) continue;
            normal_[i] = plane.normal / length;
            offset_[i] = glm::dot(normal_[i], plane.anchor - target);
            scale = std::max(scale, glm::length(plane.anchor - target));
        }
        for (std::size_t i = 0; i < count_; ++i) {
            if (!usable_[i]) continue;
            const double sigma = primitives.planes()[i].strength_n / stiffness;
            yields_[i] = sigma <= kHardMultiplier * scale;
            bound_[i] = yields_[i] ? sigma : kHardMultiplier * scale;
        }
        scale_ = scale;
        tolerance_ = kAbsoluteGap + kRelativeGap * scale;
    }

    bool solve() noexcept {
        const int cap = 40 * static_cast<int>(count_) + 60;
        const int bland_after = 20 * static_cast<int>(count_) + 30;
        for (int step = 0; step < cap; ++step) {
            const std::size_t entering = most_violated(step > bland_after);
            if (entering == kNone) return true;
            enter(entering);
            settle_free_set();
        }
        return false;
    }

    Vec3 displacement() const noexcept {
        Vec3 y{0.0};
        for (std::size_t i = 0; i < count_; ++i)
            if (usable_[i]) y += lambda_[i] * normal_[i];
        return y;
    }

    double residual() const noexcept {
        const Vec3 y = displacement();
        double worst = 0.0;
        for (std::size_t i = 0; i < count_; ++i) {
            if (!usable_[i]) continue;
            const double gap = glm::dot(normal_[i], y) - offset_[i];
            const double projected = std::clamp(lambda_[i] - gap, 0.0, bound_[i]);
            worst = std::max(worst, std::abs(lambda_[i] - projected));
        }
        return worst;
    }

    /// The square root of the duality gap: see ProxySolution::error_bound_m.
    double error_bound() const noexcept {
        const Vec3 y = displacement();
        double size = scale_;
        for (std::size_t i = 0; i < count_; ++i)
            if (usable_[i]) size += lambda_[i];
        double gap_m2 = 0.0;
        for (std::size_t i = 0; i < count_; ++i) {
            if (!usable_[i]) continue;
            const double gap = glm::dot(normal_[i], y) - offset_[i];
            gap_m2 += bound_[i] * (std::max(0.0, -gap) + kGapRounding * size) + lambda_[i] * gap;
        }
        return std::sqrt(std::max(0.0, gap_m2));
    }

    double lambda(std::size_t i) const noexcept { return lambda_[i]; }
    MultiplierState state(std::size_t i) const noexcept {
        if (!usable_[i] || lambda_[i] <= 0.0) return MultiplierState::released;
        return yields_[i] && lambda_[i] >= bound_[i] ? MultiplierState::saturated
                                                     : MultiplierState::active;
    }

private:
    bool is_free(std::size_t i) const noexcept {
        return std::find(free_.begin(), free_.begin() + free_count_, i) !=
               free_.begin() + free_count_;
    }

    /// The bounded multiplier that most wants to move; with `first`, the lowest one (Bland: no
    /// cycles).
    std::size_t most_violated(bool first) const noexcept {
        const Vec3 y = displacement();
        std::size_t chosen = kNone;
        double worst = tolerance_;
        for (std::size_t i = 0; i < count_; ++i) {
            if (!usable_[i] || is_free(i)) continue;
            const double gap = glm::dot(normal_[i], y) - offset_[i];
            const bool grow = lambda_[i] < bound_[i] && -gap > worst;
            const bool shrink = lambda_[i] > 0.0 && gap > worst;
            if (!grow && !shrink) continue;
            chosen = i;
            worst = std::abs(gap);
            if (first) break;
        }
        return chosen;
    }

    /// Frees a multiplier; where its normal depends on the free ones, first moves along that
    /// dependency until one meets a bound.
    void enter(std::size_t entering) noexcept {
        std::array<double, 3> share{};
        if (free_count_ > 0 && depends_on_free(normal_[entering], share)) {
            const double gap = glm::dot(normal_[entering], displacement()) - offset_[entering];
            const double direction = gap < 0.0 ? 1.0 : -1.0;
            double step =
                direction > 0.0 ? bound_[entering] - lambda_[entering] : lambda_[entering];
            std::size_t blocking = kNone;
            for (std::size_t k = 0; k < free_count_; ++k) {
                const double rate = -direction * share[k];
                if (rate == 0.0) continue;
                const double room =
                    rate > 0.0 ? bound_[free_[k]] - lambda_[free_[k]] : lambda_[free_[k]];
                if (room / std::abs(rate) < step) {
                    step = room / std::abs(rate);
                    blocking = k;
                }
            }
            for (std::size_t k = 0; k < free_count_; ++k)
                move(free_[k], -direction * share[k] * step);
            move(entering, direction * step);
            if (blocking == kNone) { // it went from bound to bound itself
                lambda_[entering] = direction > 0.0 ? bound_[entering] : 0.0;
                return;
            }
            const double rate = -direction * share[blocking];
            lambda_[free_[blocking]] = rate > 0.0 ? bound_[free_[blocking]] : 0.0;
            release(blocking);
        }
        if (free_count_ < free_.size()) free_[free_count_++] = entering;
    }

    /// Moves the free multipliers to where their planes hold exactly; one that meets a bound on the
    /// way leaves.
    void settle_free_set() noexcept {
        while (free_count_ > 0) {
            std::array<double, 3> target{};
            if (!balance(target)) { // the newest normal is not independent enough to be solved for
                release(free_count_ - 1);
                continue;
            }
            double step = 1.0;
            std::size_t blocking = kNone;
            for (std::size_t k = 0; k < free_count_; ++k) {
                const std::size_t i = free_[k];
                const double move_by = target[k] - lambda_[i];
                const double room = move_by > 0.0 ? bound_[i] - lambda_[i] : lambda_[i];
                if (std::abs(move_by) > 0.0 && room / std::abs(move_by) < step) {
                    step = room / std::abs(move_by);
                    blocking = k;
                }
            }
            if (blocking == kNone) {
                for (std::size_t k = 0; k < free_count_; ++k)
                    lambda_[free_[k]] = target[k];
                return;
            }
            const bool up = target[blocking] > lambda_[free_[blocking]];
            for (std::size_t k = 0; k < free_count_; ++k)
                move(free_[k], step * (target[k] - lambda_[free_[k]]));
            lambda_[free_[blocking]] = up ? bound_[free_[blocking]] : 0.0;
            release(blocking);
        }
    }

    void move(std::size_t i, double by) noexcept {
        lambda_[i] = std::clamp(lambda_[i] + by, 0.0, bound_[i]);
    }

    void release(std::size_t k) noexcept {
        for (std::size_t j = k + 1; j < free_count_; ++j)
            free_[j - 1] = free_[j];
        --free_count_;
    }

    /// Orthonormal basis of the free normals and its triangle, by Gram-Schmidt, twice for accuracy.
    bool factorise(std::array<Vec3, 3>& q, std::array<std::array<double, 3>, 3>& r) const noexcept {
        for (std::size_t k = 0; k < free_count_; ++k) {
            Vec3 rest = normal_[free_[k]];
            for (int pass = 0; pass < 2; ++pass)
                for (std::size_t j = 0; j < k; ++j) {
                    const double part = glm::dot(q[j], rest);
                    r[j][k] += part;
                    rest -= part * q[j];
                }
            const double length = glm::length(rest);
            if (length < kDependent) return false;
            r[k][k] = length;
            q[k] = rest / length;
        }
        return true;
    }

    /// Multipliers of the free set at which its planes hold: N_F^T (y_rest + N_F z) = b_F.
    bool balance(std::array<double, 3>& target) const noexcept {
        std::array<Vec3, 3> q{};
        std::array<std::array<double, 3>, 3> r{};
        if (!factorise(q, r)) return false;
        Vec3 rest{0.0};
        for (std::size_t i = 0; i < count_; ++i)
            if (usable_[i] && !is_free(i)) rest += lambda_[i] * normal_[i];
        for (std::size_t k = 0; k < free_count_; ++k)
            target[k] = offset_[free_[k]] - glm::dot(normal_[free_[k]], rest);
        solve_triangles(r, target);
        return true;
    }

    /// x := (R^T R)^-1 x for the free normals' triangle R, whose diagonal is at least kDependent.
    void solve_triangles(const std::array<std::array<double, 3>, 3>& r,
                         std::array<double, 3>& x) const noexcept {
        for (std::size_t k = 0; k < free_count_; ++k) {
            for (std::size_t j = 0; j < k; ++j)
                x[k] -= r[j][k] * x[j];
            x[k] /= r[k][k];
        }
        for (std::size_t k = free_count_; k-- > 0;) {
            for (std::size_t j = k + 1; j < free_count_; ++j)
                x[k] -= r[k][j] * x[j];
            x[k] /= r[k][k];
        }
    }

    /// Whether a normal is a combination of the free ones, and of which shares.
    bool depends_on_free(const Vec3& normal, std::array<double, 3>& share) const noexcept {
        std::array<Vec3, 3> q{};
        std::array<std::array<double, 3>, 3> r{};
        if (!factorise(q, r)) return false;
        Vec3 rest = normal;
        std::array<double, 3> u{};
        for (int pass = 0; pass < 2; ++pass)
            for (std::size_t k = 0; k < free_count_; ++k) {
                const double part = glm::dot(q[k], rest);
                u[k] += part;
                rest -= part * q[k];
            }
        if (free_count_ < 3 && glm::length(rest) >= kDependent) return false;
        for (std::size_t k = free_count_; k-- > 0;) {
            share[k] = u[k];
            for (std::size_t j = k + 1; j < free_count_; ++j)
                share[k] -= r[k][j] * share[j];
            share[k] /= r[k][k];
        }
        return true;
    }

    std::size_t count_ = 0;
    std::array<Vec3, kCapacity> normal_{};
    std::array<double, kCapacity> offset_{}; // b_i = n_i.(p_i - a'), m
    std::array<double, kCapacity> bound_{};  // sigma_i = s_i / k, m
    std::array<double, kCapacity> lambda_{}; // m
    std::array<bool, kCapacity> usable_{};
    std::array<bool, kCapacity> yields_{}; // the bound is the strength, not the hard planes' cap
    std::array<std::size_t, 3> free_{};
    std::size_t free_count_ = 0;
    double scale_ = 0.0;
    double tolerance_ = 0.0;
};

/// One plane, as most evaluations have: lambda is the depth, within its bounds.
ProxySolution solve_one_plane(const PlanePrimitive& plane, const Vec3& target,
                              double stiffness) noexcept {
    ProxySolution solution;
    solution.proxy = target;
    const double length = glm::length(plane.normal);
    if (!solver::is_usable(plane.anchor, length, plane.strength_n)) return solution;
    const Vec3 normal = plane.normal / length;
    const double offset = glm::dot(normal, plane.anchor - target);
    if (!(offset > kAbsoluteGap)) return solution;
    const double sigma = plane.strength_n / stiffness;
    const double lambda = std::min(offset, sigma);
    solution.proxy = target + lambda * normal;
    solution.multiplier_n[0] = stiffness * lambda;
    solution.state[0] = lambda < sigma ? MultiplierState::active : MultiplierState::saturated;
    const double gap = glm::dot(normal, lambda * normal) - offset;
    solution.residual_m = std::abs(lambda - std::clamp(lambda - gap, 0.0, sigma));
    return solution;
}

/// Planes alone.
ProxySolution solve_planes(const PrimitiveSet& primitives, const Vec3& target,
                           double stiffness) noexcept {
    const auto planes = primitives.planes();
    if (planes.size() == 1) return solve_one_plane(planes.front(), target, stiffness);
    DualProblem problem(primitives, target, stiffness);
    ProxySolution solution;
    solution.status = problem.solve() ? SolveStatus::exact : SolveStatus::capped;
    solution.residual_m = problem.residual();
    solution.error_bound_m = problem.error_bound();
    solution.proxy = target + problem.displacement();
    for (std::size_t i = 0; i < planes.size(); ++i) {
        solution.multiplier_n[i] = stiffness * problem.lambda(i);
        solution.state[i] = problem.state(i);
    }
    return solution;
}

/// Whether there are planes, and all of them across an axis.
bool all_across(std::span<const PlanePrimitive> planes, const Vec3& axis) noexcept {
    return !planes.empty() && std::all_of(planes.begin(), planes.end(), [&](const auto& plane) {
        return plane.normal == axis || plane.normal == -axis;
    });
}

/// Planes and a line along their normal, as friction on one contact makes them, with a magnet or
/// without: each answers its own part of the way.
ProxySolution solve_planes_and_normal_line(const PrimitiveSet& primitives, const Vec3& target,
                                           double stiffness) noexcept {
    const LinePrimitive& line = primitives.lines().front();
    ProxySolution solution = solve_planes(primitives, target, stiffness);
    const ProxySolution along = solve_one_line(line, target, stiffness);
    solution.proxy += along.proxy - target;
    solution.line_force_n[0] = along.line_force_n[0];
    solution.line_state[0] = along.line_state[0];
    return solution;
}

} // namespace

ProxySolution solve_proxy(const PrimitiveSet& primitives, const Vec3& probe, double coupling,
                          int pass_cap) noexcept {
    const double stiffness = primitives.total_stiffness(coupling); // K
    const Vec3 target = primitives.pull(probe, coupling);          // a'
    const auto planes = primitives.planes();
    const auto lines = primitives.lines();
    const auto points = primitives.points();
    if (planes.empty() && lines.size() == 1 && points.empty())
        return solve_one_line(lines.front(), target, stiffness);
    if (planes.empty() && lines.empty() && points.size() == 1)
        return solve_one_point(points.front(), target, stiffness);
    if (lines.size() == 1 && points.empty() && all_across(planes, lines.front().axis))
        return solve_planes_and_normal_line(primitives, target, stiffness);
    if (!lines.empty() || !points.empty())
        return solve_mixed(primitives, target, stiffness, pass_cap);

    if (!planes.empty()) return solve_planes(primitives, target, stiffness);
    return {.proxy = target};
}

} // namespace palpate
