// SPDX-License-Identifier: Apache-2.0
// What the hand feels of a soft surface is the law that the scene says of it (docs/palpation.md),
// by a law of our own: probe, front and tip of a report.
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <palpate/engine/scene/soft_surfaces.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/stability/random/invariants.h"

namespace palpate::stability {
namespace {

constexpr double kRounding = 1e-9;

/// F_h(press), its slopes at most k: pair by pair, each of which keeps its force.
double felt_n(const Softness& softness, double k, double press_m) {
    double from_m = 0.0, from_n = 0.0;
    for (std::size_t i = 0; i < softness.count; ++i) {
        const Softness::Knot before = i == 0 ? Softness::Knot{} : softness.knots[i - 1];
        const double rise_n = softness.knots[i].force_n - before.force_n;
        const double slope = std::min(k, rise_n / (softness.knots[i].press_m - before.press_m));
        const double width_m = slope < k ? softness.knots[i].press_m - before.press_m : rise_n / k;
        if (i + 1 == softness.count || press_m < from_m + width_m)
            return from_n + slope * (press_m - from_m);
        from_m += width_m;
        from_n += rise_n;
    }
    return 0.0;
}

/// Nothing that is soft is felt as stiffer than the coupling. Where it is alone, elastic and as the
/// scene says, the force over the press is its law; without lumps it is along the press.
class PressIsTheLaw final : public Invariant {
public:
    explicit PressIsTheLaw(const Scene& scene)
        : scene_(scene), k_(scene.description().coupling.stiffness_n_per_m),
          follows_(is_soft_and_alone(scene)) {
        for (const EffectDescription& effect : scene.description().effects)
            for (const char* pushes : {"constant_force", "gravity_compensation"})
                if (palpate::name(effect) == pushes) follows_ = false;
    }
    const char* name() const override { return "press"; }

    std::optional<std::string> check(const SeenFrame& seen) override {
        const FrameReport& report = seen.report;
        if (!(report.indentation_m > 0.0) || (report.flags & kProbeNotFinite)) return std::nullopt;
        ++checks_;
        if (!(report.stiffness_n_per_m >= 0.0) || report.stiffness_n_per_m > k_ * (1.0 + kRounding))
            return fmt::format("{} N/m is felt behind a coupling of {}", report.stiffness_n_per_m,
                               k_);
        const SceneSurface& surface = scene_.surfaces()[report.pressed_surface];
        const Softness& softness = scene_.description().surfaces.at(surface.name).softness;
        if (!follows_ || seen.gains_moved || softness.damping > 0.0) return std::nullopt;

        const Vec3 press = report.front - seen.state.position;
        const double press_m = glm::length(press);
        const Vec3 n = press / press_m, spring = k_ * (report.proxy - seen.state.position);
        const auto& map = surface.baked.stiffness.map;
        // Over lumps all of the law is as much stiffer, until its steepest piece is the coupling's.
        const double ratio =
            map ? std::min(map->sample(report.front).ratio, k_ / std::min(k_, softness.steepest()))
                : 1.0;
        const double law_n = ratio * felt_n(softness, k_, press_m);
        const double off_n =
            map ? std::abs(glm::dot(spring, n) - law_n) : glm::length(spring - law_n * n);
        // Differences of places: as exact as these.
        const double rounding_n =
            kRounding * k_ * press_m +
            16.0 * std::numeric_limits<double>::epsilon() * k_ * glm::length(seen.state.position);
        if (off_n <= rounding_n) return std::nullopt;
        return fmt::format("pressed by {} m it is off its law, {} N, by {} N", press_m, law_n,
                           off_n);
    }

private:
    const Scene& scene_;
    double k_;
    bool follows_;
};

} // namespace

void add_press_invariant(const Watched& watched, std::vector<std::unique_ptr<Invariant>>& to) {
    to.push_back(std::make_unique<PressIsTheLaw>(watched.scene));
}

} // namespace palpate::stability
