// SPDX-License-Identifier: Apache-2.0
// Hard labels of one volume that are all that is felt, and felt alike: they have no groove between
// them, and do not stop the proxy.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <palpate/engine/baking/baking.h>
#include <palpate/engine/scene/soft_surfaces.h>

#include "tests/stability/random/invariants.h"

namespace palpate::stability {
namespace {

/// The proxy slides along the borders of labels that touch and over them: frames that stall do not
/// go on and on before it is where it should be. Not with too few evaluations in a frame to look
/// round an obstacle (docs/paper.md); nor where voxels are larger than 1 cm, beside which the
/// certificate is thin.
class GoesOn final : public Invariant {
public:
    explicit GoesOn(const LoopDescription& loop) : tolerance_m_(1e-6 * loop.tolerance_um) {}
    static bool looks(const LoopDescription& loop, const ScalarField& field) {
        constexpr int kEnough = 8;
        constexpr double kLargest_m = 0.01;
        return field.feature_size_m() < kLargest_m &&
               (loop.method == SteppingMethod::paper ||
                (loop.method == SteppingMethod::fixed && loop.sub_steps >= kEnough) ||
                (loop.method == SteppingMethod::adaptive && loop.evaluation_cap >= kEnough));
    }
    const char* name() const override { return "goes on"; }
    std::optional<std::string> check(const SeenFrame& seen) override {
        constexpr int kMostStalled = 5; // in a row, as TouchingLabels.* has it
        ++checks_;
        const bool stalled =
            (seen.report.flags & kStalled) != 0 && seen.report.residual_m > tolerance_m_;
        stalled_ = stalled ? stalled_ + 1 : 0;
        if (stalled_ <= kMostStalled) return std::nullopt;
        return fmt::format("stalled in {} frames in a row, {} m from where it should be", stalled_,
                           seen.report.residual_m);
    }

private:
    double tolerance_m_;
    int stalled_ = 0;
};

/// They are felt as the one label that they would be together.
class AsOne final : public Invariant {
public:
    explicit AsOne(const SceneDescription& scene) {
        const auto& [name, first] = *scene.surfaces.begin();
        SceneDescription one = scene;
        std::vector<std::string>& labels = one.surfaces.at(name).labels;
        for (const auto& [other, surface] : scene.surfaces)
            if (other != name)
                labels.insert(labels.end(), surface.labels.begin(), surface.labels.end());
        std::erase_if(one.effects, [&, name = name](const EffectDescription& effect) {
            return surface_of(effect) != name;
        });
        const BakedSurface baked = bake_surface(one, name, {});
        field_ = baked.field;
        sampler_ = field_->make_sampler();
        level_ = baked.level;
        const double slope = field_->typical_slope(level_); // U/m
        const double voxel_m = field_->feature_size_m();
        in_front_ = kInFront * voxel_m * slope;
        deepest_ = (kDeepest * voxel_m + LevelSettings{}.certificate_m) * slope;
    }
    const char* name() const override { return "as one"; }
    std::optional<std::string> check(const SeenFrame& seen) override {
        if (seen.begins_trial) armed_ = false;
        for (const Vec3& corner : seen.path) {
            const double depth = sampler_->value(corner) - level_;
            armed_ = armed_ || depth < -in_front_;
            if (!armed_) continue;
            ++checks_;
            if (depth > deepest_)
                return fmt::format(
                    "{:.3g} of what is allowed behind the level of all labels as one",
                    depth / deepest_);
        }
        return std::nullopt;
    }

private:
    static constexpr double kInFront = 0.5; // voxels
    static constexpr double kDeepest = 0.2; // voxels; without what joins them it is a whole one
    std::shared_ptr<const ScalarField> field_;
    std::unique_ptr<FieldSampler> sampler_;
    double level_ = 0.0, in_front_ = 0.0, deepest_ = 0.0;
    bool armed_ = false; // the proxy has been in front of all since the trial began
};

bool are_alike(const Watched& watched) {
    const SceneDescription& scene = watched.scene.description();
    const auto is_detour = [](const FileEvent& event) {
        return event.event.kind == CaseEvent::Kind::detour;
    };
    const auto is_alike = [&](const auto& named) {
        const SurfaceDescription& surface = named.second;
        return surface.volume == scene.surfaces.begin()->second.volume && !surface.labels.empty() &&
               surface.contact == ContactKind::volume && !surface.moves &&
               !std::isfinite(surface.strength_n) && !is_soft(scene, surface) &&
               surface.keep.kind == ComponentPolicy::Kind::all && !surface.smooth_voxels;
    };
    // Each surface is felt once, and nothing else is.
    return !scene.surfaces.empty() && scene.effects.size() == scene.surfaces.size() &&
           std::all_of(scene.effects.begin(), scene.effects.end(),
                       [](const EffectDescription& effect) {
                           return palpate::name(effect) == "surface";
                       }) &&
           std::all_of(scene.surfaces.begin(), scene.surfaces.end(), is_alike) &&
           std::all_of(watched.events.begin(), watched.events.end(), is_detour);
}

} // namespace

void add_label_invariants(const Watched& watched, std::vector<std::unique_ptr<Invariant>>& to) {
    if (!are_alike(watched)) return;
    const SceneDescription& scene = watched.scene.description();
    if (GoesOn::looks(scene.loop, *watched.scene.surfaces().front().baked.field))
        to.push_back(std::make_unique<GoesOn>(scene.loop));
    to.push_back(std::make_unique<AsOne>(scene));
}

} // namespace palpate::stability
