// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <optional>

#include <palpate/engine/internal/frame_truth.h>
#include <palpate/engine/internal/study_tally.h>
#include <palpate/engine/study.h>

namespace palpate {
namespace {

/// What the baselines are rendered over.
struct FeltLevel {
    std::shared_ptr<const ScalarField> field;
    double level = 0.0;
};

/// The one level that is felt in a scene, if it is one: a surface of a volume, or the zero of a
/// formula that a gradient_surface uses.
std::optional<FeltLevel> the_felt_level(const Scene& scene) {
    std::vector<FeltLevel> levels;
    for (const SceneSurface& surface : scene.surfaces()) {
        if (surface.is_felt_by_mesh()) return {};
        levels.push_back({surface.baked.field, surface.level.level});
    }
    for (const PlannedEffect& planned : scene.plan().effects) {
        const EffectDescription& effect = scene.description().effects[planned.effect];
        if (!planned.on || effect.kind != EffectKind::gradient_surface) continue;
        if (scene.description().volumes.at(effect.volume).analytic.empty()) return {};
        levels.push_back({scene.effect_field(effect.volume), 0.0});
    }
    if (levels.size() != 1) return {};
    return levels.front();
}

/// One frame of a baseline as a loop would report it.
FrameReport report_of(Baseline& baseline, const DeviceState& input, Clock& clock) noexcept {
    FrameReport report;
    report.trial = input.trial;
    report.time_s = input.time_s;
    report.probe = input.position;
    const std::uint64_t samples = baseline.samples();
    const double began_us = clock.now_us();
    const Baseline::Step step = baseline.move(input.position);
    report.spent_us = clock.now_us() - began_us;
    report.proxy = step.proxy;
    report.contacts = step.touches ? 1 : 0;
    report.surfaces_felt = step.touches ? 1 : 0; // the scene's only one, where it is a surface
    report.evaluations = static_cast<std::uint32_t>(baseline.samples() - samples);
    report.sub_steps = 1;
    return report;
}

StudyRun run_baseline(const Scene& scene, const FeltLevel& felt, BaselineKind kind,
                      std::span<const DeviceState> inputs, Clock& clock) {
    const LoopDescription& loop = scene.description().loop;
    const auto baseline = make_baseline(kind, *felt.field, felt.level);
    internal::FrameTruth truth(scene);
    internal::StudyTally tally;
    std::optional<DeviceState> last;
    Vec3 proxy{0.0};
    for (const DeviceState& input : inputs) {
        if (!last || last->trial != input.trial) {
            proxy = input.position;
            baseline->restart(proxy);
        }
        const FrameReport frame = report_of(*baseline, input, clock);
        tally.add(frame, std::array{proxy, frame.proxy}, loop);
        tally.add_error(truth.of(frame));
        proxy = frame.proxy;
        last = input;
    }
    StudyRun run = std::move(tally).conclude(loop);
    run.baseline = kind;
    run.is_the_scenes = false;
    return run;
}

} // namespace

std::vector<StudyRun> run_baselines(const Scene& scene, std::span<const DeviceState> inputs,
                                    Clock& clock) {
    std::vector<StudyRun> runs;
    const std::optional<FeltLevel> felt = the_felt_level(scene);
    if (!felt) return runs;
    for (const BaselineKind kind : kBaselines)
        runs.push_back(run_baseline(scene, *felt, kind, inputs, clock));
    return runs;
}

} // namespace palpate
