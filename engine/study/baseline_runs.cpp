// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/internal/baseline_contestant.h>

#include <array>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/study/internal/finger_proxy.h>
#include <palpate/engine/study/internal/scene_variants.h>
#include <palpate/engine/truth/certified_proxy.h>

namespace palpate {
namespace internal {
namespace {

/// One baseline's frames as a loop would report them.
class BaselineContestant final : public Contestant {
public:
    /// of_surface: what it feels is the scene's only surface, else a gradient_surface.
    BaselineContestant(std::unique_ptr<Baseline> baseline, bool asks_mesh, bool of_surface,
                       Clock& clock)
        : baseline_(std::move(baseline)), clock_(clock), asks_mesh_(asks_mesh),
          of_surface_(of_surface) {}

    FrameReport frame(const DeviceState& input) noexcept override {
        FrameReport report;
        report.trial = input.trial;
        report.time_s = input.time_s;
        report.probe = input.position;
        const bool is_place = SurfaceScene::answers_at(input.position);
        if (!is_place || input.freshness == Freshness::stale) {
            // As the loop and the certified proxy do: nothing moves, and nothing is felt.
            report.flags = is_place ? kDeviceStale : kProbeNotFinite;
            report.proxy = path_[0] = path_[1];
            return report;
        }
        if (is_first_ || input.trial != trial_) {
            path_[1] = input.position;
            baseline_->restart(input.position);
        }
        is_first_ = false;
        trial_ = input.trial;
        const std::uint64_t samples = baseline_->samples();
        const double began_us = clock_.now_us();
        const Baseline::Step step = baseline_->move(input.position);
        report.spent_us = clock_.now_us() - began_us;
        report.proxy = step.proxy;
        report.contacts = step.touches ? 1 : 0;
        report.surfaces_felt = step.touches && of_surface_ ? 1 : 0;
        report.evaluations = static_cast<std::uint32_t>(baseline_->samples() - samples);
        (asks_mesh_ ? report.surface_queries : report.field_samples) = report.evaluations;
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
    bool asks_mesh_;
    bool of_surface_;
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

std::shared_ptr<const SurfaceScene> mesh_to_walk_on(const Scene& scene,
                                                    const SceneResources* resources,
                                                    const ConvergedProxies* converged) {
    if (scene.surfaces().size() != 1) return nullptr;
    if (const auto& own = scene.surfaces().front().mesh.scene) return own;
    if (!resources || !resources->extract || !converged) return nullptr;
    const SceneVariants variants(scene, *resources);
    if (!variants.why_not().empty() || !variants.is_formula()) return nullptr;
    try {
        return std::make_shared<const SurfaceScene>(
            variants.mesh_of(*variants.by_volume(), *converged, variants.facets()));
    } catch (const std::runtime_error& error) {
        if (error.what() == std::string_view("cancelled")) throw;
        return nullptr; // a surface that has no mesh, as it was not touched
    }
}

void add_baselines(const StudyEntry& like, std::shared_ptr<const SurfaceScene> mesh,
                   std::vector<StudyEntry>& entries) {
    StudyEntry entry = like;
    if (the_felt_level(*like.scene))
        for (const BaselineKind kind : kBaselines) {
            entry.baseline = kind;
            entries.push_back(entry);
        }
    if (mesh) add_finger_proxy(like, std::move(mesh), entries);
}

void add_finger_proxy(const StudyEntry& like, std::shared_ptr<const SurfaceScene> mesh,
                      std::vector<StudyEntry>& entries) {
    entries.push_back(like);
    entries.back().baseline = BaselineKind::finger_proxy;
    entries.back().mesh = std::move(mesh);
}

std::unique_ptr<Contestant> make_baseline_contestant(const StudyEntry& entry, Clock& clock) {
    const BaselineKind kind = *entry.baseline;
    if (kind == BaselineKind::finger_proxy)
        return std::make_unique<BaselineContestant>(make_finger_proxy(entry.mesh), true, true,
                                                    clock);
    const FeltLevel felt = *the_felt_level(*entry.scene);
    return std::make_unique<BaselineContestant>(
        make_baseline(kind, felt.field, felt.settings.level), false, felt.surface != nullptr,
        clock);
}

} // namespace internal

std::vector<StudyRun> run_baselines(const Scene& scene, std::span<const DeviceState> inputs,
                                    Clock& clock, const Progress& progress) {
    const std::shared_ptr<const SurfaceScene> mesh =
        internal::mesh_to_walk_on(scene, nullptr, nullptr);
    if (!mesh && !internal::the_felt_level(scene)) return {};
    const std::vector<Vec3> certified = certified_proxies(scene, inputs);
    // The caller's scene outlives the call: nobody owns it here.
    const std::shared_ptr<const Scene> borrowed(&scene, [](const Scene*) {});
    std::vector<internal::StudyEntry> entries;
    internal::add_baselines({borrowed, scene.description().loop, {}, inputs, nullptr, certified},
                            mesh, entries);
    return internal::run_interleaved(entries, 1, clock, "comparing", progress);
}

} // namespace palpate
