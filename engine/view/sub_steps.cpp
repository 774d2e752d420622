// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/sub_steps.h>

#include <algorithm>
#include <unordered_set>
#include <utility>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/run/trace.h>
#include <palpate/haptics/stepping/frame_flags.h>

namespace palpate {
namespace {

constexpr std::uint32_t kHard = kEvaluationCap | kStalled | kInsideAtStart | kSolverCap |
                                kPrimitivesFull | kForceNotFinite | kCalmed | kBodyHeldBack;

/// The planes of an evaluation. Those of surfaces and magnets come first among the primitives, in
/// the order of the contacts.
std::vector<ViewPlane> planes_of(const SubStep& step) {
    std::vector<ViewPlane> planes;
    const auto primitives = step.primitives.planes();
    for (std::size_t i = 0; i < primitives.size(); ++i) {
        ViewPlane plane{primitives[i].anchor, primitives[i].normal, primitives[i].strength_n};
        if (i < step.contacts.size() && step.contacts[i].surface != ContactSet::kNoSurface)
            plane.structure = static_cast<int>(step.contacts[i].surface);
        plane.active = i < step.solution.planes.size() &&
                       step.solution.planes[i].state != MultiplierState::released;
        planes.push_back(plane);
    }
    return planes;
}

ViewStop stop_of(const SubStep::Stop& stop) {
    if (stop.by == SubStep::Stop::By::nothing) return {};
    return {stop.by, static_cast<int>(stop.surface), stop.at};
}

std::vector<ViewLeash> leashes_of(const SubStep& step) {
    std::vector<ViewLeash> leashes;
    leashes.reserve(step.leashes.size());
    for (const SubStep::Leash& leash : step.leashes) {
        ViewLeash view{static_cast<int>(leash.surface), leash.guard, leash.length_m};
        for (std::size_t c = 0; leash.offered && c < step.contacts.size(); ++c)
            if (step.contacts[c].surface == leash.surface) view.plane = static_cast<int>(c);
        leashes.push_back(view);
    }
    return leashes;
}

std::vector<ViewFriction> friction_of(const SubStep& step) {
    std::vector<ViewFriction> found;
    found.reserve(step.friction.size());
    for (const SubStep::Friction& at : step.friction) {
        const PlanePrimitive& plane = step.primitives.planes()[at.plane];
        const LinePrimitive& line = step.primitives.lines()[at.line];
        const TetherOutcome& outcome = step.solution.lines[at.line];
        const Vec3& n = plane.normal;
        found.push_back({at.plane, line.anchor + glm::dot(n, plane.anchor - line.anchor) * n, n,
                         at.coefficient, step.solution.planes[at.plane].multiplier_n,
                         line.strength_n, glm::length(outcome.force_n),
                         outcome.state == TetherState::held});
    }
    return found;
}

/// Keeps the sub-steps of the frame that is computed.
class Keeper final : public SubStepObserver {
public:
    void sub_step(const SubStep& step) noexcept override {
        steps_.push_back({step.kind,
                          step.from,
                          step.candidate,
                          step.wanted,
                          step.to,
                          planes_of(step),
                          step.primitives.pull(step.probe, step.stiffness_n_per_m),
                          step.primitives.total_stiffness(step.stiffness_n_per_m),
                          {step.way.begin(), step.way.end()},
                          stop_of(step.stop),
                          leashes_of(step),
                          friction_of(step)});
    }
    std::vector<ViewSubStep> take() { return std::exchange(steps_, {}); }

private:
    std::vector<ViewSubStep> steps_;
};

} // namespace

std::vector<ViewFrameSteps> sub_steps_of(std::shared_ptr<const Scene> scene, const Run& run,
                                         std::span<const std::uint64_t> frames,
                                         const Progress& progress) {
    const std::unordered_set<std::uint64_t> wanted(frames.begin(), frames.end());
    std::size_t count = 0; // up to the last that is wanted
    for (std::size_t i = 0; i < run.frames.size(); ++i)
        if (wanted.contains(run.frames[i].frame)) count = i + 1;
    if (count == 0) return {};
    Run part = run;
    part.inputs.resize(std::min(count, part.inputs.size()));

    std::vector<ViewFrameSteps> found;
    Keeper keeper;
    RunWatch watch;
    watch.progress = progress;
    watch.loop = [&](HapticLoop* loop) {
        if (loop) loop->observe(&keeper);
    };
    std::size_t at = 0;
    watch.frame = [&](const RunFrame&) {
        std::vector<ViewSubStep> steps = keeper.take();
        const std::uint64_t frame = run.frames[at++].frame;
        // A frame that was not computed has none.
        if (wanted.contains(frame) && !steps.empty()) found.push_back({frame, std::move(steps)});
    };
    run_again(std::move(scene), part, watch);
    return found;
}

std::vector<std::uint64_t> hard_frames(const Run& run, std::size_t most) {
    std::vector<const FrameReport*> frames;
    for (const FrameReport& frame : run.frames)
        if (frame.evaluations > 0) frames.push_back(&frame);
    const auto rank = [](const FrameReport* frame) {
        return std::pair((frame->flags & kHard) != 0, frame->evaluations);
    };
    std::ranges::stable_sort(
        frames, [&](const FrameReport* a, const FrameReport* b) { return rank(a) > rank(b); });
    frames.resize(std::min(frames.size(), most));
    std::vector<std::uint64_t> numbers;
    numbers.reserve(frames.size());
    for (const FrameReport* frame : frames)
        numbers.push_back(frame->frame);
    std::ranges::sort(numbers);
    return numbers;
}

} // namespace palpate
