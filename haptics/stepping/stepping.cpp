// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/stepping/stepping.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include <palpate/geometry/range.h>

namespace palpate {
namespace {

// Within this many tolerances the residual is trusted to go on falling as it did; further out, data
// have kinks.
constexpr double kNearTolerances = 5.0;
// Damping of tangential steps while the residual does not fall (contact.md 1.2, step 5).
constexpr double kResidualMustFallTo = 0.9;
constexpr double kStrongestDamping = 1.0 / 16.0;

using Method = std::variant<SingleStep, FixedSteps, PaperSteps, AdaptiveSteps>;

Method method_of(const SteppingSettings& settings, Clock& clock) {
    switch (settings.method) {
    case SteppingMethod::single:
        return SingleStep();
    case SteppingMethod::fixed:
        return FixedSteps(settings.sub_steps);
    case SteppingMethod::paper:
        return PaperSteps(settings.budget_us, clock);
    case SteppingMethod::adaptive:
        break;
    }
    return AdaptiveSteps(settings.tolerance_m, settings.evaluation_cap);
}

/// The settings, once every one has been checked: also those of other methods.
const SteppingSettings& checked(const SteppingSettings& settings) {
    require("subdivision: budget_us", settings.budget_us, kPositive);
    const auto in_range = [](int n) { return n >= 1 && n <= Stepping::kMostEvaluations; };
    if (!in_range(settings.sub_steps) || !in_range(settings.evaluation_cap))
        throw std::invalid_argument(
            "subdivision: sub_steps = " + std::to_string(settings.sub_steps) +
            " or evaluation_cap = " + std::to_string(settings.evaluation_cap) +
            " is out of range; give integers in [1, " + std::to_string(Stepping::kMostEvaluations) +
            "]");
    require("subdivision: tolerance_m", settings.tolerance_m, kPositive);
    return settings;
}

} // namespace

int PaperSteps::most_evaluations() const noexcept { return Stepping::kMostEvaluations; }

void PaperSteps::begin_frame(std::span<const std::uint32_t> replayed) noexcept {
    replayed_ = replayed;
    began_us_ = last_us_ = clock_->now_us();
}

int PaperSteps::steps_left(const EvaluationOutcome&, const FrameBudget& budget) noexcept {
    if (!replayed_.empty()) {
        const std::size_t index = budget.evaluations - 1;
        return index < replayed_.size() ? static_cast<int>(replayed_[index]) : 0;
    }
    const double now_us = clock_->now_us(); // t_n
    estimator_.observe(now_us - last_us_);  // (10)
    last_us_ = now_us;
    const double affordable = (budget_us_ - (now_us - began_us_)) / estimator_.estimate_us();
    return static_cast<int>(
        std::clamp(std::floor(affordable), 0.0, 1.0 * Stepping::kMostEvaluations)); // (8)
}

void AdaptiveSteps::begin_approach() noexcept {
    converged_ = false;
    damping_ = 1.0;
    residual_before_m_ = std::numeric_limits<double>::infinity();
}

int AdaptiveSteps::steps_left(const EvaluationOutcome& outcome,
                              const FrameBudget& budget) noexcept {
    residual_m_ = outcome.residual_m;
    // Newton steps square what is left, so to expect the last ratio once more is to expect too
    // much. Flat planes are met at once, but the next may be other ones: there nothing is expected.
    const double ratio = std::min(1.0, residual_m_ / residual_before_m_);
    const bool near =
        std::isfinite(residual_before_m_) && residual_m_ < kNearTolerances * tolerance_m_;
    const double expected_m = near ? ratio * residual_m_ : residual_m_;
    converged_ = expected_m < (outcome.facets_only ? Stepping::kNoMovement_m : tolerance_m_);
    return converged_ ? 0 : affordable(budget);
}

int AdaptiveSteps::affordable(const FrameBudget& budget) const noexcept {
    if (budget.work_left <= 0) return 0;
    return cap_ + std::min(budget.bends, Stepping::kMostBends) -
           static_cast<int>(budget.evaluations);
}

double AdaptiveSteps::damp() noexcept {
    damping_ = residual_m_ > kResidualMustFallTo * residual_before_m_
                   ? std::max(0.5 * damping_, kStrongestDamping)
                   : std::min(2.0 * damping_, 1.0);
    residual_before_m_ = residual_m_;
    return damping_;
}

Stepping::Stepping(const SteppingSettings& settings, Clock& clock)
    : method_(method_of(checked(settings), clock)) {}

int Stepping::most_evaluations() const noexcept {
    return std::visit([](const auto& method) { return method.most_evaluations(); }, method_);
}

double Stepping::estimate_us() const noexcept {
    const PaperSteps* paper = std::get_if<PaperSteps>(&method_);
    return paper ? paper->estimate_us() : 0.0;
}

Stepping::State Stepping::save_state() const noexcept {
    const PaperSteps* paper = std::get_if<PaperSteps>(&method_);
    return paper ? State(paper->save_state()) : std::nullopt;
}

void Stepping::restore_state(const State& state) noexcept {
    PaperSteps* paper = std::get_if<PaperSteps>(&method_);
    if (paper && state) paper->restore_state(*state);
}

void Stepping::begin_frame(std::span<const std::uint32_t> replayed) noexcept {
    if (PaperSteps* paper = std::get_if<PaperSteps>(&method_)) paper->begin_frame(replayed);
}

void Stepping::begin_approach() noexcept {
    if (adaptive()) adaptive()->begin_approach();
}

std::uint32_t Stepping::count_steps_left(const EvaluationOutcome& outcome,
                                         const FrameBudget& budget) noexcept {
    const int left =
        std::visit([&](auto& method) { return method.steps_left(outcome, budget); }, method_);
    const int most = std::max(0, kMostEvaluations - static_cast<int>(budget.evaluations));
    steps_left_ = static_cast<std::uint32_t>(std::clamp(left, 0, most));
    return steps_left_;
}

} // namespace palpate
