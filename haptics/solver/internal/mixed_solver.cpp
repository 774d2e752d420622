// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/solver/internal/mixed_solver.h>

#include <algorithm>
#include <cmath>

#include <palpate/haptics/solver/internal/smoothed_problem.h>
#include <palpate/haptics/solver/internal/solver_limits.h>

namespace palpate::internal {
namespace {

// A natural residual of this many scales is a solution (numerics 1.4).
constexpr double kExact = 1e-12;
// A multiplier's length is its bound within this share of it.
constexpr double kAtBound = 1e-12;

/// Fills a solution from multipliers and the offsets that the proxy has with them.
class Report {
public:
    Report(const PrimitiveSet& given, const Vec3& proxy, const MixedPrimitives& primitives,
           const Multipliers& multipliers, const Offsets& offsets, double stiffness) noexcept
        : stiffness_(stiffness), primitives_(primitives),
          size_(primitives.scale + primitives.sum_of_lengths(multipliers)), result_(given, proxy) {
        for (std::size_t i = 0; i < primitives.hinges.size(); ++i)
            add(primitives.hinges[i], multipliers.lambda[i], offsets.gap[i]);
        for (std::size_t j = 0; j < primitives.tethers.size(); ++j)
            add(j, multipliers.pull[j], offsets.way[j]);
        result_.error_bound_m = std::sqrt(std::max(0.0, gap_m2_));
        result_.status = result_.residual_m <= kExact * primitives.scale ? SolveStatus::exact
                                                                         : SolveStatus::capped;
    }

    const ProxySolution& solution() const noexcept { return result_; }

private:
    void add(const Hinge& hinge, double lambda, double gap) noexcept {
        const double projected = std::clamp(lambda - gap, 0.0, hinge.bound);
        add_residual(std::abs(lambda - projected));
        add_gap(hinge.bound, std::max(0.0, -gap), lambda * gap);
        const bool saturated = hinge.yields && lambda >= hinge.bound;
        result_.planes[hinge.index] = {stiffness_ * lambda, lambda <= 0.0
                                                                ? MultiplierState::released
                                                            : saturated ? MultiplierState::saturated
                                                                        : MultiplierState::active};
    }

    void add(std::size_t j, const Vec3& pull, const Vec3& way) noexcept {
        const Tether& tether = primitives_.tethers[j];
        const double distance = glm::length(way);
        const Vec3 wish = pull - way;
        const double length = glm::length(wish);
        const Vec3 projected = length > tether.bound ? (tether.bound / length) * wish : wish;
        add_residual(glm::length(pull - projected));
        add_gap(tether.bound, distance, glm::dot(pull, way));

        const double held = kAbsoluteGap + kRelativeGap * primitives_.scale;
        const bool slips = distance > held && glm::length(pull) >= (1.0 - kAtBound) * tether.bound;
        const TetherState state = slips ? TetherState::slipping : TetherState::held;
        auto& felt = j < primitives_.line_count ? result_.lines : result_.points;
        felt[tether.index] = {stiffness_ * (tether.across * pull), state};
    }

    void add_residual(double residual_m) noexcept {
        result_.residual_m = std::max(result_.residual_m, residual_m);
    }
    void add_gap(double bound, double distance, double product) noexcept {
        gap_m2_ += bound * (distance + kGapRounding * size_) + product;
    }

    double stiffness_;
    const MixedPrimitives& primitives_;
    double size_; // m, of what is summed
    double gap_m2_ = 0.0;
    ProxySolution result_;
};

/// The only tether: draws a' along `way`, which leads from it to a', by at most its bound.
struct OneTether {
    Vec3 pull{0.0}; // m
    TetherState state = TetherState::released;
};

OneTether solve_one(const Vec3& way, double bound) noexcept {
    const double distance = glm::length(way);
    if (distance <= bound) return {-way, TetherState::held};
    return {-(bound / distance) * way, TetherState::slipping};
}

} // namespace

void add_one_line(const LinePrimitive& line, const Vec3& target, double stiffness,
                  ProxySolution& solution) noexcept {
    const double length = glm::length(line.axis);
    if (!is_usable(line.anchor, length, line.strength_n)) return;
    const Mat3 across = across_of(line.axis / length);
    const Vec3 way = across * ((target - line.anchor) * across);
    const OneTether tether = solve_one(way, line.strength_n / stiffness);
    solution.proxy += tether.pull;
    solution.lines[0] = {stiffness * tether.pull, tether.state};
}

void add_one_point(const PointPrimitive& point, const Vec3& target, double stiffness,
                   ProxySolution& solution) noexcept {
    if (!is_usable(point.anchor, 1.0, point.strength_n)) return;
    const OneTether tether = solve_one(target - point.anchor, point.strength_n / stiffness);
    solution.proxy = tether.state == TetherState::held ? point.anchor : target + tether.pull;
    solution.points[0] = {stiffness * tether.pull, tether.state};
}

ProxySolution solve_mixed(const PrimitiveSet& primitives, const Vec3& target, double stiffness,
                          int pass_cap) noexcept {
    const MixedPrimitives mixed(primitives, target, stiffness);
    SmoothedProblem problem(mixed);
    problem.solve(pass_cap);

    const Iterate& end = problem.iterate();
    const auto solution_of = [&](const Multipliers& multipliers) {
        const Vec3 y = mixed.sum(multipliers); // not end.y, so that the forces balance
        const Offsets offsets = mixed.moved(end.offsets, y - end.y);
        ProxySolution solution =
            Report(primitives, target + y, mixed, multipliers, offsets, stiffness).solution();
        solution.passes = problem.passes();
        solution.work = solution.passes * static_cast<int>(primitives.count());
        return solution;
    };
    ProxySolution found = solution_of(end.multipliers);
    if (found.status == SolveStatus::exact) return found;
    // Cut short in the middle of a stage: the stage before may have ended nearer.
    const ProxySolution anchored = solution_of(problem.anchors());
    return anchored.residual_m < found.residual_m ? anchored : found;
}

} // namespace palpate::internal
