// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include <palpate/haptics/contact/softness.h>
#include <palpate/volume/scalar_field.h>

#include "tests/support/contact_loop.h"

/// One soft surface that is alone, and a probe on it.
namespace palpate::test {

inline SurfaceFinish soft(double stiffness_n_per_m, double damping = 0.0, double mu = 0.0) {
    SurfaceFinish finish;
    finish.friction = {mu, mu};
    finish.softness = Softness::linear(stiffness_n_per_m);
    finish.softness.damping = damping;
    return finish;
}

inline SurfaceFinish soft(const std::vector<Softness::Knot>& knots) {
    SurfaceFinish finish;
    for (const Softness::Knot& knot : knots)
        finish.softness.knots[finish.softness.count++] = knot;
    return finish;
}

/// Frames that go on until a step is below `tolerance_m`.
inline SteppingSettings precise(SteppingMethod method = SteppingMethod::adaptive,
                                double tolerance_m = 1e-12) {
    SteppingSettings settings;
    settings.method = method;
    settings.tolerance_m = tolerance_m;
    settings.evaluation_cap = 60;
    return settings;
}

/// A loop over one surface; the strength is the contact's and the finish's.
inline ContactLoop on(std::shared_ptr<const ScalarField> field, SurfaceFinish finish,
                      const SteppingSettings& settings = precise(), const LevelSettings& level = {},
                      std::vector<std::unique_ptr<Effect>> effects = {}) {
    finish.strength_n = level.strength_n;
    return {settings, one_surface(std::move(field), level), std::move(effects), 10.0, {finish}};
}

/// On the hand, N.
inline Vec3 force(const ContactLoop& loop, const Vec3& probe) {
    return ContactLoop::kStiffness * (loop.proxy() - probe);
}

} // namespace palpate::test
