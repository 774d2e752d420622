// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/solver/internal/shared_strength.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace palpate::internal {
namespace {

// A sum of multipliers is the strength within this share of it.
constexpr double kAgree = 1e-12;
// Depths that are tried for one run of planes: each is exact once both ends of where it is searched
// for have the same planes that hold.
constexpr int kMostDepths = 56;
// After so many the sum seems to jump, as it does where planes contradict each other: it is halved.
constexpr int kSecants = 10;
// Runs that hold the proxy together are settled in turns.
constexpr int kMostRounds = 4;
// They are settled where none bears more or less than its strength by more than this share.
constexpr double kSettled = 1e-10;
// Contradicting planes bear anything: of that so many strengths say enough.
constexpr double kMostStrengths = 16.0;
constexpr int kLeastPasses = 4;

/// Planes [first, end) that share a strength.
struct PlaneRun {
    std::size_t first = 0;
    std::size_t end = 0;
    double strength_n = 0.0;
};

using PlaneRuns = FixedVector<PlaneRun, PrimitiveSet::kCapacity>;

PlaneRuns runs_of(const PrimitiveSet& primitives) noexcept {
    PlaneRuns runs;
    const auto planes = primitives.planes();
    for (std::size_t i = 0; i < planes.size();) {
        PlaneRun run{i, i + 1, planes[i].strength_n};
        for (; run.end < planes.size() && planes[run.end].shares; ++run.end)
            run.strength_n = std::max(run.strength_n, planes[run.end].strength_n);
        if (run.end - run.first > 1 && std::isfinite(run.strength_n)) runs.push_back(run);
        i = run.end;
    }
    return runs;
}

double borne_n(const PlaneRun& run, const ProxySolution& solution) noexcept {
    double sum_n = 0.0;
    for (std::size_t i = run.first; i < run.end; ++i)
        sum_n += solution.planes[i].multiplier_n;
    return sum_n;
}

bool bears_too_much(const PlaneRun& run, const ProxySolution& solution) noexcept {
    return borne_n(run, solution) > (1.0 + kAgree) * run.strength_n;
}

/// The planes as they were given, but those of runs that yield at their depths.
class Sharing {
public:
    Sharing(const PrimitiveSet& primitives, const Vec3& probe, double coupling,
            int pass_cap) noexcept
        : given_(primitives), sunk_(primitives), probe_(probe), coupling_(coupling),
          passes_left_(pass_cap),
          most_work_(std::int64_t{pass_cap} * static_cast<std::int64_t>(primitives.count())) {}

    /// Whether another solution is within the cap. Planes alone are solved without passes: of them
    /// what was looked at counts.
    bool may_solve() const noexcept {
        return given_.has_tethers() ? passes_left_ > 0 : work_ < most_work_;
    }

    /// Finds the depth of a run, and what it bears there.
    void settle(const PlaneRun& run, ProxySolution& solution) noexcept {
        set(run, 0.0, 0.0);
        solve(high_);
        double low_m = 0.0, high_m = depth_m(run, high_.proxy);
        double too_little_n = -run.strength_n;
        sink(run, 0.0);
        solve(low_);
        double too_much_n =
            std::min(borne_n(run, low_) - run.strength_n, kMostStrengths * run.strength_n);
        if (!(too_much_n > kAgree * run.strength_n)) return give_back(run, solution);
        int side = 0; // of the last depth
        for (int i = 0; i < kMostDepths && may_solve(); ++i) {
            const double share = i < kSecants ? too_much_n / (too_much_n - too_little_n) : 0.5;
            const double depth_m = low_m + share * (high_m - low_m);
            if (!(depth_m > low_m) || !(depth_m < high_m)) break;
            sink(run, depth_m);
            solve(solution);
            const double more_n = borne_n(run, solution) - run.strength_n;
            if (std::abs(more_n) <= kAgree * run.strength_n) return;
            const bool deeper = more_n > 0.0;
            (deeper ? low_m : high_m) = depth_m;
            (deeper ? low_ : high_) = solution;
            (deeper ? too_much_n : too_little_n) = more_n;
            // Illinois: no end may stay for ever.
            if (side == (deeper ? 1 : -1)) (deeper ? too_little_n : too_much_n) *= 0.5;
            side = deeper ? 1 : -1;
        }
        mix(run, solution);
        residual_m_ = std::max(residual_m_, high_m - low_m);
    }

    /// For runs that have not been settled together: each plane has the part of the strength that
    /// it bears of the run's load. No run bears more than its strength then, though the parts may
    /// not be the best ones.
    void divide(const PlaneRuns& runs, ProxySolution& solution) noexcept {
        for (const PlaneRun& run : runs) {
            const double sum_n = borne_n(run, solution);
            for (std::size_t i = run.first; i < run.end; ++i) {
                PlanePrimitive plane = given_.planes()[i];
                if (!(plane.strength_n > 0.0)) continue;
                plane.strength_n = sum_n > 0.0
                                       ? solution.planes[i].multiplier_n / sum_n * run.strength_n
                                       : run.strength_n / static_cast<double>(run.end - run.first);
                sunk_.set_plane(i, plane);
            }
        }
        solve(solution);
        solution.status = SolveStatus::capped;
    }

    /// What the solution says of itself, once every run is settled.
    void report(const PlaneRuns& runs, ProxySolution& solution) const noexcept {
        solution.work = work_;
        solution.passes = passes_;
        solution.residual_m = std::max(solution.residual_m, residual_m_);
        if (residual_m_ > kAgree * glm::length(solution.proxy - probe_))
            solution.status = SolveStatus::capped;
        for (const PlaneRun& run : runs)
            for (std::size_t i = run.first; i < run.end; ++i)
                if (std::isinf(sunk_.planes()[i].strength_n) &&
                    solution.planes[i].state == MultiplierState::active)
                    solution.planes[i].state = MultiplierState::saturated;
    }

    void count(const ProxySolution& solution) noexcept {
        work_ += solution.work;
        passes_ += solution.passes;
    }

private:
    /// Of the cap: of planes alone, as may_solve() counts them.
    int passes_left() const noexcept {
        if (given_.has_tethers()) return passes_left_;
        const auto count = static_cast<std::int64_t>(given_.count());
        return static_cast<int>((most_work_ - work_) / count);
    }

    void solve(ProxySolution& solution) noexcept {
        solve_unshared(sunk_, probe_, coupling_, std::max(passes_left(), kLeastPasses), solution);
        passes_left_ -= solution.passes;
        count(solution);
    }

    void set(const PlaneRun& run, double depth_m, double strength_n) noexcept {
        for (std::size_t i = run.first; i < run.end; ++i) {
            PlanePrimitive plane = given_.planes()[i];
            plane.anchor -= depth_m * plane.normal;
            plane.strength_n = plane.strength_n > 0.0 ? strength_n : 0.0;
            sunk_.set_plane(i, plane);
        }
    }
    void sink(const PlaneRun& run, double depth_m) noexcept {
        set(run, depth_m, std::numeric_limits<double>::infinity());
    }
    /// It does not yield after all, now that others have.
    void give_back(const PlaneRun& run, ProxySolution& solution) noexcept {
        set(run, 0.0, run.strength_n);
        solve(solution);
    }

    double depth_m(const PlaneRun& run, const Vec3& point) const noexcept {
        double deepest_m = 0.0;
        for (std::size_t i = run.first; i < run.end; ++i) {
            const PlanePrimitive& plane = given_.planes()[i];
            if (plane.strength_n > 0.0)
                deepest_m = std::max(deepest_m, glm::dot(plane.normal, plane.anchor - point));
        }
        return deepest_m;
    }

    /// Between the two last depths, which are next to each other: that share of both solutions in
    /// which the run bears its strength.
    void mix(const PlaneRun& run, ProxySolution& solution) const noexcept {
        const double low_n = borne_n(run, low_), high_n = borne_n(run, high_);
        const double t = std::clamp((low_n - run.strength_n) / (low_n - high_n), 0.0, 1.0);
        const auto between = [t](const auto& a, const auto& b) { return (1.0 - t) * a + t * b; };
        solution = high_;
        solution.proxy = between(low_.proxy, high_.proxy);
        for (std::size_t i = 0; i < solution.planes.size(); ++i) {
            solution.planes[i].multiplier_n =
                between(low_.planes[i].multiplier_n, high_.planes[i].multiplier_n);
            if (low_.planes[i].state != MultiplierState::released && t < 1.0)
                solution.planes[i].state = low_.planes[i].state;
        }
        for (std::size_t i = 0; i < solution.lines.size(); ++i)
            solution.lines[i].force_n = between(low_.lines[i].force_n, high_.lines[i].force_n);
        for (std::size_t i = 0; i < solution.points.size(); ++i)
            solution.points[i].force_n = between(low_.points[i].force_n, high_.points[i].force_n);
    }

    const PrimitiveSet& given_;
    PrimitiveSet sunk_;
    ProxySolution low_, high_; // at both ends of where a depth is searched for
    Vec3 probe_;
    double coupling_;
    int passes_left_;
    std::int64_t most_work_;
    int work_ = 0;
    int passes_ = 0;
    double residual_m_ = 0.0;
};

} // namespace

void solve_shared(const PrimitiveSet& primitives, const Vec3& probe, double coupling, int pass_cap,
                  ProxySolution& solution) noexcept {
    solve_unshared(primitives, probe, coupling, pass_cap, solution);
    const PlaneRuns runs = runs_of(primitives);
    const auto any_too_much = [&] {
        return std::any_of(runs.begin(), runs.end(),
                           [&](const PlaneRun& run) { return bears_too_much(run, solution); });
    };
    if (!any_too_much()) return;
    Sharing sharing(primitives, probe, coupling, pass_cap);
    sharing.count(solution);
    FixedVector<bool, PrimitiveSet::kCapacity> yields(runs.size(), false);
    bool settled = false;
    for (int round = 0; round < kMostRounds && !settled && sharing.may_solve(); ++round) {
        for (std::size_t r = 0; r < runs.size(); ++r) {
            if (!yields[r] && !bears_too_much(runs[r], solution)) continue;
            yields[r] = true;
            sharing.settle(runs[r], solution);
        }
        settled = true; // one alone is, at once
        for (std::size_t r = 0; r < runs.size(); ++r) {
            const double more_n = borne_n(runs[r], solution) - runs[r].strength_n;
            const double agree_n = kSettled * runs[r].strength_n;
            settled = settled && more_n <= agree_n && (!yields[r] || more_n >= -agree_n);
        }
    }
    if (!settled) sharing.divide(runs, solution);
    sharing.report(runs, solution);
}

} // namespace palpate::internal
