// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/solver/proxy_solver.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include <palpate/haptics/solver/internal/mixed_solver.h>
#include <palpate/haptics/solver/internal/one_plane.h>
#include <palpate/haptics/solver/internal/shared_strength.h>
#include <palpate/haptics/solver/internal/solver_limits.h>

namespace palpate {
namespace {

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
    /// `reach_m`: the distance of the furthest anchor beside the planes', m, >= 0.
    DualProblem(std::span<const PlanePrimitive> planes, const Vec3& target, double stiffness,
                double reach_m) noexcept
        : scale_(reach_m) {
        for (const PlanePrimitive& plane : planes) {
            Face face;
            const double length = glm::length(plane.normal);
            face.usable = internal::is_usable(plane.anchor, length, plane.strength_n);
            if (face.usable) {
                face.normal = plane.normal / length;
                face.offset = glm::dot(face.normal, plane.anchor - target);
                face.bound = plane.strength_n / stiffness;
                scale_ = std::max(scale_, glm::length(plane.anchor - target));
            }
            faces_.push_back(face);
        }
        const double hard = internal::kHardMultiplier * scale_;
        for (Face& face : faces_) {
            face.yields = face.bound <= hard;
            face.bound = std::min(face.bound, hard);
        }
        tolerance_ = internal::kAbsoluteGap + internal::kRelativeGap * scale_;
    }

    /// Whether it came to the solution: planes that contradict each other may take more steps than
    /// `pass_cap` and what ends one allow.
    bool solve(int pass_cap) noexcept {
        const int suffice = 40 * static_cast<int>(faces_.size()) + 60;
        const int cap = std::min(pass_cap, suffice - internal::kPassesBeyondCap) +
                        internal::kPassesBeyondCap;
        const int bland_after = 20 * static_cast<int>(faces_.size()) + 30;
        for (int step = 0; step < cap; ++step) {
            ++steps_;
            const std::size_t entering = most_violated(step > bland_after);
            if (entering == kNone) return true;
            enter(entering);
            settle_free_set();
        }
        return false;
    }

    int steps() const noexcept { return steps_; }

    Vec3 displacement() const noexcept {
        Vec3 y{0.0};
        for (const Face& face : faces_)
            if (face.usable) y += face.lambda * face.normal;
        return y;
    }

    double residual() const noexcept {
        const Vec3 y = displacement();
        double worst = 0.0;
        for (const Face& face : faces_) {
            if (!face.usable) continue;
            const double projected = std::clamp(face.lambda - face.gap(y), 0.0, face.bound);
            worst = std::max(worst, std::abs(face.lambda - projected));
        }
        return worst;
    }

    /// The square root of the duality gap: see ProxySolution::error_bound_m.
    double error_bound() const noexcept {
        const Vec3 y = displacement();
        double size = scale_;
        for (const Face& face : faces_)
            if (face.usable) size += face.lambda;
        double gap_m2 = 0.0;
        for (const Face& face : faces_) {
            if (!face.usable) continue;
            const double gap = face.gap(y);
            gap_m2 += face.bound * (std::max(0.0, -gap) + internal::kGapRounding * size) +
                      face.lambda * gap;
        }
        return std::sqrt(std::max(0.0, gap_m2));
    }

    PlaneOutcome outcome(std::size_t i, double stiffness) const noexcept {
        const Face& face = faces_[i];
        if (!face.usable || face.lambda <= 0.0) return {};
        return {stiffness * face.lambda, face.yields && face.lambda >= face.bound
                                             ? MultiplierState::saturated
                                             : MultiplierState::active};
    }

private:
    /// A plane and its multiplier.
    struct Face {
        Vec3 normal{0.0};
        double offset = 0.0; // b = n.(p - a'), m
        double bound = 0.0;  // sigma = s / k, m
        double lambda = 0.0; // m
        bool usable = false;
        bool yields = false; // the bound is the strength, not the hard planes' cap

        double gap(const Vec3& y) const noexcept { return glm::dot(normal, y) - offset; }
    };

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
        for (std::size_t i = 0; i < faces_.size(); ++i) {
            const Face& face = faces_[i];
            if (!face.usable || is_free(i)) continue;
            const double gap = face.gap(y);
            const bool grow = face.lambda < face.bound && -gap > worst;
            const bool shrink = face.lambda > 0.0 && gap > worst;
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
        if (free_count_ > 0 && depends_on_free(faces_[entering].normal, share)) {
            const double gap = faces_[entering].gap(displacement());
            const double direction = gap < 0.0 ? 1.0 : -1.0;
            double step = direction > 0.0 ? faces_[entering].bound - faces_[entering].lambda
                                          : faces_[entering].lambda;
            std::size_t blocking = kNone;
            for (std::size_t k = 0; k < free_count_; ++k) {
                const double rate = -direction * share[k];
                if (rate == 0.0) continue;
                const double room = rate > 0.0 ? faces_[free_[k]].bound - faces_[free_[k]].lambda
                                               : faces_[free_[k]].lambda;
                if (room / std::abs(rate) < step) {
                    step = room / std::abs(rate);
                    blocking = k;
                }
            }
            for (std::size_t k = 0; k < free_count_; ++k)
                move(free_[k], -direction * share[k] * step);
            move(entering, direction * step);
            if (blocking == kNone) { // it went from bound to bound itself
                faces_[entering].lambda = direction > 0.0 ? faces_[entering].bound : 0.0;
                return;
            }
            const double rate = -direction * share[blocking];
            faces_[free_[blocking]].lambda = rate > 0.0 ? faces_[free_[blocking]].bound : 0.0;
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
                const double move_by = target[k] - faces_[i].lambda;
                const double room =
                    move_by > 0.0 ? faces_[i].bound - faces_[i].lambda : faces_[i].lambda;
                if (std::abs(move_by) > 0.0 && room / std::abs(move_by) < step) {
                    step = room / std::abs(move_by);
                    blocking = k;
                }
            }
            if (blocking == kNone) {
                for (std::size_t k = 0; k < free_count_; ++k)
                    faces_[free_[k]].lambda = target[k];
                return;
            }
            const bool up = target[blocking] > faces_[free_[blocking]].lambda;
            for (std::size_t k = 0; k < free_count_; ++k)
                move(free_[k], step * (target[k] - faces_[free_[k]].lambda));
            faces_[free_[blocking]].lambda = up ? faces_[free_[blocking]].bound : 0.0;
            release(blocking);
        }
    }

    void move(std::size_t i, double by) noexcept {
        faces_[i].lambda = std::clamp(faces_[i].lambda + by, 0.0, faces_[i].bound);
    }

    void release(std::size_t k) noexcept {
        for (std::size_t j = k + 1; j < free_count_; ++j)
            free_[j - 1] = free_[j];
        --free_count_;
    }

    /// Orthonormal basis of the free normals and its triangle, by Gram-Schmidt, twice for accuracy.
    bool factorise(std::array<Vec3, 3>& q, std::array<std::array<double, 3>, 3>& r) const noexcept {
        for (std::size_t k = 0; k < free_count_; ++k) {
            Vec3 rest = faces_[free_[k]].normal;
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
        for (std::size_t i = 0; i < faces_.size(); ++i)
            if (faces_[i].usable && !is_free(i)) rest += faces_[i].lambda * faces_[i].normal;
        for (std::size_t k = 0; k < free_count_; ++k)
            target[k] = faces_[free_[k]].offset - glm::dot(faces_[free_[k]].normal, rest);
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

    FixedVector<Face, kCapacity> faces_;
    std::array<std::size_t, 3> free_{};
    std::size_t free_count_ = 0;
    double scale_;
    double tolerance_ = 0.0;
    int steps_ = 0;
};

/// Several planes; `reach_m` as in DualProblem.
void add_several_planes(std::span<const PlanePrimitive> planes, const Vec3& target,
                        double stiffness, double reach_m, int pass_cap,
                        ProxySolution& solution) noexcept {
    DualProblem problem(planes, target, stiffness, reach_m);
    solution.status = problem.solve(pass_cap) ? SolveStatus::exact : SolveStatus::capped;
    solution.work += problem.steps() * static_cast<int>(planes.size());
    solution.residual_m = problem.residual();
    solution.error_bound_m = problem.error_bound();
    solution.proxy = target + problem.displacement();
    for (std::size_t i = 0; i < planes.size(); ++i)
        solution.planes[i] = problem.outcome(i, stiffness);
}

/// As many planes as there are, and lines that do not count beside them but for their anchors: how
/// much hard planes hold that contradict each other is a matter of the whole problem's scale.
void add_planes(std::span<const PlanePrimitive> planes, std::span<const LinePrimitive> lines,
                const Vec3& target, double stiffness, int pass_cap,
                ProxySolution& solution) noexcept {
    if (planes.empty()) return;
    if (planes.size() == 1)
        return internal::add_one_plane(planes.front(), target, stiffness, solution);
    double reach_m = 0.0;
    for (const LinePrimitive& line : lines)
        if (internal::is_usable(line.anchor, glm::length(line.axis), line.strength_n / stiffness))
            reach_m = std::max(reach_m, glm::length(line.anchor - target));
    add_several_planes(planes, target, stiffness, reach_m, pass_cap, solution);
}

/// Whether all planes are across an axis.
bool all_across(std::span<const PlanePrimitive> planes, const Vec3& axis) noexcept {
    return std::all_of(planes.begin(), planes.end(), [&](const auto& plane) {
        return plane.normal == axis || plane.normal == -axis;
    });
}

} // namespace

void internal::solve_unshared(const PrimitiveSet& primitives, const Vec3& probe, double coupling,
                              int pass_cap, ProxySolution& solution) noexcept {
    const double stiffness = primitives.total_stiffness(coupling); // K
    const Vec3 target = primitives.pull(probe, coupling);          // a'
    const auto planes = primitives.planes();
    const auto lines = primitives.lines();
    const auto points = primitives.points();
    if (!primitives.has_tethers()) {
        solution.restart(primitives, target);
        solution.work = static_cast<int>(planes.size());
        add_planes(planes, lines, target, stiffness, pass_cap, solution);
        return;
    }
    const bool one_point = points.size() == 1 && lines.empty() && planes.empty();
    // A line along the planes' normals, as friction on one contact makes it, with a magnet or
    // without: each answers its own part of the way.
    const bool apart = points.empty() && lines.size() == 1 && all_across(planes, lines[0].axis);
    if (!one_point && !apart) {
        solution = internal::solve_mixed(primitives, target, stiffness, pass_cap);
        return;
    }

    solution.restart(primitives, target);
    solution.work = static_cast<int>(primitives.count());
    if (one_point) internal::add_one_point(points[0], target, stiffness, solution);
    add_planes(planes, lines, target, stiffness, pass_cap, solution);
    if (!lines.empty()) internal::add_one_line(lines[0], target, stiffness, solution);
}

void solve_proxy(const PrimitiveSet& primitives, const Vec3& probe, double coupling, int pass_cap,
                 ProxySolution& solution) noexcept {
    if (primitives.shares_strengths())
        internal::solve_shared(primitives, probe, coupling, pass_cap, solution);
    else
        internal::solve_unshared(primitives, probe, coupling, pass_cap, solution);
}

} // namespace palpate
