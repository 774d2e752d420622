// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <variant>

#include <palpate/geometry/vec.h>
#include <palpate/haptics/stepping/clock.h>
#include <palpate/haptics/stepping/step_time_estimator.h>
#include <palpate/haptics/stepping/stepping_settings.h>

namespace palpate {

/// What a frame has spent of what bounds it.
struct FrameBudget {
    std::uint32_t evaluations = 0; ///< made so far
    int work_left = 0; ///< in the unit of Subdivision::kWorkOfSolvers; <= 0: all is spent
    int legs_left = 0; ///< pieces of way: Subdivision::kMostLegs
    int bends = 0;     ///< evaluations spent at edges of meshes; the cap does not count them
};

/// What an evaluation has come to.
struct EvaluationOutcome {
    double residual_m = 0.0;  ///< length of the movement that the solver asks for, >= 0
    bool facets_only = false; ///< there are planes, and all of them are flat facets
};

/// Method `single`: one evaluation, and the whole movement.
class SingleStep {
public:
    int most_evaluations() const noexcept { return 1; } ///< of a frame [any]
    /// N_steps of eq. (8).                                                                [loop]
    int steps_left(const EvaluationOutcome&, const FrameBudget&) const noexcept { return 0; }
};

/// Method `fixed`: a given number of evaluations.
class FixedSteps {
public:
    /// `count` in [1, Stepping::kMostEvaluations].                                       [setup]
    explicit FixedSteps(int count) noexcept : count_(count) {}

    int most_evaluations() const noexcept { return count_; } ///< of a frame [any]
    /// N_steps of eq. (8), before it is bounded.                                         [loop]
    int steps_left(const EvaluationOutcome&, const FrameBudget& budget) noexcept {
        return count_ - static_cast<int>(budget.evaluations);
    }

private:
    int count_;
};

/// Method `paper`: as many evaluations as the clock allows.
class PaperSteps {
public:
    /// Throws std::invalid_argument on a budget that is not > 0, us. The clock must outlive this.
    /// [setup]
    PaperSteps(double budget_us, Clock& clock)
        : clock_(&clock), budget_us_(budget_us), estimator_(budget_us) {}

    int most_evaluations() const noexcept; ///< of a frame [any]
    /// A frame begins: t_0. `replayed`: N_steps of an earlier run after each evaluation; where
    /// there are none the clock decides. [loop]
    void begin_frame(std::span<const std::uint32_t> replayed) noexcept;
    /// N_steps of eq. (8), before it is bounded; learns from the last step by eq. (10).  [loop]
    int steps_left(const EvaluationOutcome&, const FrameBudget& budget) noexcept;
    /// Of a sub-step, eq. (10), us.                                                      [any]
    double estimate_us() const noexcept { return estimator_.estimate_us(); }
    /// All that it remembers from frame to frame.                                        [setup]
    const StepTimeEstimator& save_state() const noexcept { return estimator_; }
    /// Of one of the same budget.                                                        [setup]
    void restore_state(const StepTimeEstimator& state) noexcept { estimator_ = state; }

private:
    Clock* clock_;
    double budget_us_;
    StepTimeEstimator estimator_;
    double began_us_ = 0.0; // t_0
    double last_us_ = 0.0;  // t_n
    std::span<const std::uint32_t> replayed_;
};

/// Method `adaptive`: Newton steps until what is left of the way is below a tolerance.
class AdaptiveSteps {
public:
    /// `tolerance_m` > 0; `cap` in [1, Stepping::kMostEvaluations].                      [setup]
    AdaptiveSteps(double tolerance_m, int cap) noexcept : tolerance_m_(tolerance_m), cap_(cap) {}

    int most_evaluations() const noexcept { return cap_; }       ///< of a frame [any]
    double tolerance_m() const noexcept { return tolerance_m_; } ///< [any]

    /// The way to a balance begins, or begins anew with other primitives.                [loop]
    void begin_approach() noexcept;
    /// N_steps of eq. (8), before it is bounded; expects convergence or not.             [loop]
    int steps_left(const EvaluationOutcome& outcome, const FrameBudget& budget) noexcept;
    /// Evaluations that the budget still allows, whether converged or not.               [loop]
    int affordable(const FrameBudget& budget) const noexcept;
    /// The factor for the next step along the surface, (0,1]. Each call updates it: it is halved
    /// while the residual does not fall (contact.md 1.2, step 5).                        [loop]
    double damp() noexcept;

    /// Whether the proxy is where it has to be, or is expected to be after this step.     [loop]
    bool has_converged() const noexcept { return converged_; }
    void set_converged(bool converged) noexcept { converged_ = converged; } ///< [loop]

private:
    double tolerance_m_;
    int cap_;
    bool converged_ = false;
    double damping_ = 1.0;
    double residual_m_ = 0.0;                                            // of the last evaluation
    double residual_before_m_ = std::numeric_limits<double>::infinity(); // of the last step
};

/// How the frames of one loop go on after each evaluation: how many follow, eq. (8), and which
/// share of the way is made, eq. (9). Knows the methods, and no geometry. Not for two threads at
/// once.
class Stepping {
public:
    /// The most evaluations that a method may ask for in a frame, even if its clock stands still.
    static constexpr int kMostEvaluations = 4096;
    /// Edges that a frame goes over beyond its cap: as many as a stroke of 5 m/s crosses on two
    /// meshes of 330 000 facets.
    static constexpr int kMostBends = 64;
    /// A movement below this is rounding: the proxy keeps its bits, m (numerics 5, case 17).
    static constexpr double kNoMovement_m = 1e-13;

    /// Throws std::invalid_argument on settings out of range. The clock must outlive this. [setup]
    Stepping(const SteppingSettings& settings, Clock& clock);

    /// The most evaluations of a frame in which nothing gives way. Its work budget grows with
    /// them.                                                                               [any]
    int most_evaluations() const noexcept;
    /// Of a sub-step, eq. (10), us; 0 where the method needs no clock.                     [any]
    double estimate_us() const noexcept;
    /// What it remembers from frame to frame: of a method that needs no clock, nothing. [setup]
    using State = std::optional<StepTimeEstimator>;
    State save_state() const noexcept;
    /// Of one with the same settings.                                                    [setup]
    void restore_state(const State& state) noexcept;
    /// True for `adaptive`: a frame goes on until its forces balance. False for the others: a frame
    /// makes a number of shares.                                                           [any]
    bool seeks_balance() const noexcept { return adaptive() != nullptr; }
    /// The part of its way that an adaptive frame may leave, m; 0 for other methods.       [any]
    double tolerance_m() const noexcept { return adaptive() ? adaptive()->tolerance_m() : 0.0; }

    /// A frame begins: t_0. `replayed`: N_steps of an earlier run after each evaluation; where
    /// there are none the clock decides, if the method has one. [loop]
    void begin_frame(std::span<const std::uint32_t> replayed) noexcept;
    /// The way to a balance begins, or begins anew with other primitives.                  [loop]
    void begin_approach() noexcept;
    /// N_steps of eq. (8): how many evaluations may follow this one. steps_left() then has it.
    /// [loop]
    std::uint32_t count_steps_left(const EvaluationOutcome& outcome,
                                   const FrameBudget& budget) noexcept;
    std::uint32_t steps_left() const noexcept { return steps_left_; } ///< [loop]
    /// Eq. (9): where a share of the way from -> to ends, m.                               [loop]
    Vec3 share(const Vec3& from, const Vec3& to) const noexcept {
        return from + (to - from) / (steps_left_ + 1.0);
    }
    /// AdaptiveSteps::damp(); 1 where shares are made.                                     [loop]
    double damp() noexcept { return adaptive() ? adaptive()->damp() : 1.0; }

    /// The proxy is where the forces balance.                                              [loop]
    void arrive() noexcept { set_converged(true); }
    /// The last step ended before it should.                                               [loop]
    void cut_short() noexcept { set_converged(false); }
    /// Whether the balance that was sought is found, or is expected to be by this step.    [loop]
    bool has_converged() const noexcept { return adaptive() && adaptive()->has_converged(); }
    /// Whether it is sought, and not found.                                                [loop]
    bool is_unfinished() const noexcept { return adaptive() && !adaptive()->has_converged(); }
    /// Whether another evaluation follows the step just made.                              [loop]
    bool goes_on(const FrameBudget& budget) const noexcept {
        return adaptive() ? is_unfinished() && adaptive()->affordable(budget) > 0 : steps_left_ > 0;
    }

private:
    const AdaptiveSteps* adaptive() const noexcept { return std::get_if<AdaptiveSteps>(&method_); }
    AdaptiveSteps* adaptive() noexcept { return std::get_if<AdaptiveSteps>(&method_); }
    void set_converged(bool converged) noexcept {
        if (adaptive()) adaptive()->set_converged(converged);
    }

    std::variant<SingleStep, FixedSteps, PaperSteps, AdaptiveSteps> method_;
    std::uint32_t steps_left_ = 0; // N_steps of the last evaluation
};

} // namespace palpate
