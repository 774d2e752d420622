// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/internal/baseline_contestant.h>

#include <array>

#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/truth/certified_proxy.h>

namespace palpate {
namespace internal {
namespace {

/// One baseline's frames as a loop would report them.
class BaselineContestant final : public Contestant {
public:
    BaselineContestant(BaselineKind kind, const FeltLevel& felt, Clock& clock)
        : baseline_(make_baseline(kind, felt.field, felt.settings.level)), clock_(clock) {}

    FrameReport frame(const DeviceState& input) noexcept override {
        if (is_first_ || input.trial != trial_) {
            path_[1] = input.position;
            baseline_->restart(input.position);
        }
        is_first_ = false;
        trial_ = input.trial;
        FrameReport report;
        report.trial = input.trial;
        report.time_s = input.time_s;
        report.probe = input.position;
        const std::uint64_t samples = baseline_->samples();
        const double began_us = clock_.now_us();
        const Baseline::Step step = baseline_->move(input.position);
        report.spent_us = clock_.now_us() - began_us;
        report.proxy = step.proxy;
        report.contacts = step.touches ? 1 : 0;
        report.surfaces_felt = step.touches ? 1 : 0; // the scene's only one, where it is a surface
        report.evaluations = static_cast<std::uint32_t>(baseline_->samples() - samples);
        report.field_samples = report.evaluations;
        report.sub_steps = 1;
        path_ = {path_[1], step.proxy};
        return report;
    }
    std::span<const Vec3> path() const noexcept override { return path_; }

private:
    std::unique_ptr<Baseline> baseline_;
    Clock& clock_;
    std::array<Vec3, 2> path_{};
    std::uint32_t trial_ = 0;
    bool is_first_ = true;
};

} // namespace

std::optional<FeltLevel> the_felt_level(const Scene& scene) {
    std::vector<FeltLevel> levels = felt_levels(scene);
    // A mesh without a volume beside it is felt as well.
    for (const SceneSurface& surface : scene.surfaces())
        if (!surface.baked.field) return {};
    if (levels.size() != 1) return {};
    return std::move(levels.front());
}

std::unique_ptr<Contestant> make_baseline_contestant(const StudyEntry& entry, Clock& clock) {
    return std::make_unique<BaselineContestant>(*entry.baseline, *the_felt_level(*entry.scene),
                                                clock);
}

} // namespace internal

std::vector<StudyRun> run_baselines(const Scene& scene, std::span<const DeviceState> inputs,
                                    Clock& clock, const Progress& progress) {
    if (!internal::the_felt_level(scene)) return {};
    const std::vector<Vec3> certified = certified_proxies(scene, inputs);
    // The caller's scene outlives the call: nobody owns it here.
    const std::shared_ptr<const Scene> borrowed(&scene, [](const Scene*) {});
    std::vector<internal::StudyEntry> entries;
    entries.reserve(std::size(kBaselines));
    for (const BaselineKind kind : kBaselines)
        entries.push_back({borrowed, scene.description().loop, kind, inputs, nullptr, certified});
    return internal::run_interleaved(entries, 1, clock, "comparing", progress);
}

} // namespace palpate
