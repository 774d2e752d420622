// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <palpate/haptics/effects/gradient_surface.h>
#include <palpate/haptics/stepping/subdivision.h>

#include "tests/support/contact_loop.h"

/// Every stepping method over the same case.
namespace palpate::test {

inline constexpr SteppingMethod kEveryMethod[] = {SteppingMethod::single, SteppingMethod::fixed,
                                                  SteppingMethod::paper, SteppingMethod::adaptive};
/// Of `fixed`, and about as many as the clock of `paper` allows.
inline constexpr int kShares = 8;
/// The scripted clock advances by this at each reading, us.
inline constexpr double kReading_us = 10.0;

inline std::string name_of(SteppingMethod method) {
    return method == SteppingMethod::single  ? "single"
           : method == SteppingMethod::fixed ? "fixed"
           : method == SteppingMethod::paper ? "paper"
                                             : "adaptive";
}

inline SteppingSettings stepping_of(SteppingMethod method) {
    SteppingSettings settings;
    settings.method = method;
    settings.sub_steps = kShares;
    settings.budget_us = (kShares + 1) * kReading_us; // the first estimate is small: one to learn
    return settings;
}

using Surfaces = std::vector<std::unique_ptr<SurfaceContact>>;
using Effects = std::vector<std::unique_ptr<Effect>>;

inline std::unique_ptr<ContactLoop> loop_of(const SteppingSettings& settings, Surfaces surfaces,
                                            Effects effects = {}) {
    return std::make_unique<ContactLoop>(settings, std::move(surfaces), std::move(effects),
                                         kReading_us);
}

/// The paper's own surface mode, which remembers no level.
inline Effects memoryless(std::shared_ptr<const ScalarField> field,
                          const TransferFunction& strength) {
    Effects effects;
    effects.push_back(std::make_unique<GradientSurface>(std::move(field), strength));
    return effects;
}

/// Hard wherever there is a gradient: holds a proxy that begins on a surface.
inline TransferFunction hard_everywhere() {
    return TransferFunction::constant(std::numeric_limits<double>::infinity());
}

/// As good as hard at the level 0 and beyond, nothing 1 nm (of a distance) in front of it.
inline TransferFunction hard_from_zero() { return {{{{-1e-9, 0.0}, {0.0, 1e6}}}, 2}; }

} // namespace palpate::test
