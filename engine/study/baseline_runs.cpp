// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <functional>
#include <optional>
#include <stdexcept>

#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/study/internal/study_tally.h>
#include <palpate/engine/study/study.h>
#include <palpate/engine/truth/certified_proxy.h>
#include <palpate/engine/truth/frame_truth.h>

namespace palpate {
namespace {

constexpr std::size_t kFramesPerReport = 500; // between two calls of progress

/// The one level that is felt in a scene, if it is one.
std::optional<FeltLevel> the_felt_level(const Scene& scene) {
    std::vector<FeltLevel> levels = felt_levels(scene);
    // A mesh without a volume beside it is felt as well.
    for (const SceneSurface& surface : scene.surfaces())
        if (!surface.baked.field) return {};
    if (levels.size() != 1) return {};
    return std::move(levels.front());
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
                      std::span<const DeviceState> inputs, std::span<const Vec3> certified,
                      Clock& clock, const std::function<void(std::size_t frame)>& tick) {
    const LoopDescription& loop = scene.description().loop;
    const auto baseline = make_baseline(kind, felt.field, felt.settings.level);
    FrameTruth truth(scene, FrameTruth::Measure::levels);
    internal::StudyTally tally;
    Vec3 proxy{0.0};
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        if (i == 0 || inputs[i].trial != inputs[i - 1].trial) {
            proxy = inputs[i].position;
            baseline->restart(proxy);
        }
        const FrameReport frame = report_of(*baseline, inputs[i], clock);
        tally.add(frame, std::array{proxy, frame.proxy}, loop);
        tally.add_truth(truth.of(frame));
        if (!certified.empty()) tally.add_certified(frame, certified[i]);
        proxy = frame.proxy;
        if (i % kFramesPerReport == 0) tick(i);
    }
    StudyRun run = std::move(tally).conclude(loop);
    run.baseline = kind;
    run.is_the_scenes = false;
    return run;
}

} // namespace

std::vector<StudyRun> run_baselines(const Scene& scene, std::span<const DeviceState> inputs,
                                    Clock& clock, const Progress& progress) {
    std::vector<StudyRun> runs;
    const std::optional<FeltLevel> felt = the_felt_level(scene);
    if (!felt) return runs;
    const std::vector<Vec3> certified = certified_proxies(scene, inputs);
    const auto report = [&](double done) {
        if (progress && !progress(done / static_cast<double>(kBaselines.size()), "comparing"))
            throw std::runtime_error("cancelled");
    };
    for (const BaselineKind kind : kBaselines)
        runs.push_back(
            run_baseline(scene, *felt, kind, inputs, certified, clock, [&](std::size_t frame) {
                report(static_cast<double>(runs.size()) +
                       static_cast<double>(frame) / static_cast<double>(inputs.size()));
            }));
    report(static_cast<double>(kBaselines.size()));
    return runs;
}

} // namespace palpate
