// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/study.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/scene/scene_place.h>
#include <palpate/engine/scene/soft_surfaces.h>
#include <palpate/engine/study/converged_proxy.h>
#include <palpate/engine/study/internal/baseline_contestant.h>
#include <palpate/engine/truth/certified_proxy.h>
#include <palpate/engine/truth/frame_truth.h>

namespace palpate {
namespace {

constexpr int kMostShares = 1024; // of method fixed
constexpr std::array kBudgets_us{10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 900.0};
constexpr std::array kTolerances_um{100.0, 10.0, 1.0, 0.1, 0.01, 0.001};

bool same_setting(const LoopDescription& a, const LoopDescription& b) {
    if (a.method != b.method) return false;
    switch (a.method) {
    case SteppingMethod::single:
        return true;
    case SteppingMethod::fixed:
        return a.sub_steps == b.sub_steps;
    case SteppingMethod::paper:
        return budget_of(a) == budget_of(b);
    case SteppingMethod::adaptive:
        return a.tolerance_um == b.tolerance_um;
    }
    return false;
}

} // namespace

std::vector<LoopDescription> study_settings(const Scene& scene) {
    std::vector<LoopDescription> settings = study_settings(scene.description().loop);
    if (has_soft_layers(scene))
        std::erase_if(settings, [](const LoopDescription& loop) {
            return loop.method != SteppingMethod::adaptive;
        });
    return settings;
}

std::vector<LoopDescription> study_settings(const LoopDescription& own) {
    std::vector<LoopDescription> settings;
    const auto with = [&](SteppingMethod method) {
        LoopDescription loop = own;
        loop.method = method;
        return loop;
    };
    settings.push_back(with(SteppingMethod::single));

    const LoopDescription fixed = with(SteppingMethod::fixed);
    settings.push_back(fixed);
    for (int shares = 1; shares <= kMostShares; shares *= 2) {
        settings.push_back(fixed);
        settings.back().sub_steps = shares;
    }
    const LoopDescription paper = with(SteppingMethod::paper);
    settings.push_back(paper);
    for (const double budget_us : kBudgets_us) {
        if (budget_us > 0.9e6 / own.rate_hz * (1.0 + 1e-9)) break;
        settings.push_back(paper);
        settings.back().budget_us = budget_us;
    }
    const LoopDescription adaptive = with(SteppingMethod::adaptive);
    settings.push_back(adaptive);
    for (const double tolerance_um : kTolerances_um) {
        settings.push_back(adaptive);
        settings.back().tolerance_um = tolerance_um;
    }

    // In the order of what they cost; a setting of the range that is the scene's own is there once.
    std::stable_sort(settings.begin(), settings.end(),
                     [](const LoopDescription& a, const LoopDescription& b) {
                         const auto rank = [](const LoopDescription& loop) {
                             switch (loop.method) {
                             case SteppingMethod::single:
                                 return std::pair{0, 0.0};
                             case SteppingMethod::fixed:
                                 return std::pair{1, 1.0 * loop.sub_steps};
                             case SteppingMethod::paper:
                                 return std::pair{2, budget_of(loop)};
                             case SteppingMethod::adaptive:
                                 break;
                             }
                             return std::pair{3, -loop.tolerance_um};
                         };
                         return rank(a) < rank(b);
                     });
    settings.erase(std::unique(settings.begin(), settings.end(), same_setting), settings.end());
    return settings;
}

void check_study(const Scene& scene) {
    const auto& effects = scene.plan().effects;
    if (std::any_of(effects.begin(), effects.end(), [](const auto& effect) { return effect.on; }))
        return;
    std::string place = place_of_scene(scene.description());
    std::string why = "the scene has no [[effect]]";
    if (!effects.empty()) {
        place = place_of_effect(scene.description(), effects.front().effect);
        why = "no [[effect]] is felt, as of this one " + effects.front().reason;
    }
    throw std::runtime_error(fmt::format("{}: nothing to study: {}; add one with type = "
                                         "\"surface\" or \"gradient_surface\"",
                                         place, why));
}

Study run_study(std::shared_ptr<const Scene> scene, std::span<const DeviceState> inputs,
                const std::vector<LoopDescription>& settings, Clock& clock,
                const Progress& progress, const StudyExtent& extent) {
    Study study;
    study.sphere = FrameTruth(*scene).sphere();
    for (const DeviceState& input : inputs)
        study.time_s.push_back(input.time_s);
    const std::vector<Vec3> certified = certified_proxies(*scene, inputs);
    std::optional<ConvergedProxies> converged;
    if (extent.converged) {
        converged = converged_proxies(scene, inputs, progress);
        study.reference = converged->reference;
    }
    const ConvergedProxies* reference = converged ? &*converged : nullptr;

    std::vector<internal::StudyEntry> entries;
    entries.reserve(settings.size() + kBaselines.size() + 1);
    for (const LoopDescription& loop : settings)
        entries.push_back({scene, loop, {}, inputs, nullptr, certified, reference});
    const LoopDescription& own = scene->description().loop;
    if (extent.baselines)
        internal::add_baselines({scene, own, {}, inputs, nullptr, certified, reference},
                                internal::mesh_to_walk_on(*scene, extent.resources, reference),
                                entries);
    study.runs = internal::run_interleaved(entries, extent.repetitions, clock, "studying", progress,
                                           extent.most_repeated_us);
    for (StudyRun& run : study.runs) {
        if (run.baseline) continue;
        LoopDescription scenes = own;
        scenes.method = run.loop.method;
        run.is_the_scenes = same_setting(run.loop, scenes);
        if (run.loop.method == SteppingMethod::adaptive) run.note = scene->plan().uncertified;
    }
    if (progress) progress(1.0, "studying");
    return study;
}

} // namespace palpate
