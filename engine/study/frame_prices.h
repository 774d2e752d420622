// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/study/study_run.h>
#include <palpate/haptics/stepping/clock.h>

namespace palpate {

/// What one effect or one certificate adds to a frame: the scene with it and without it, in turns.
struct FramePrice {
    std::string what;         ///< "effect friction on wall"; "contact guarded instead of volume"
    double with_us = 0.0;     ///< median of a frame with it
    double without_us = 0.0;  ///< and without
    double price_us = 0.0;    ///< median over the repetitions of the difference; may be < 0
    StudyRun::Range range_us; ///< of the difference over the repetitions
    std::string why_not;      ///< why it is not known, without a comma; empty where it is
};

/// Of each effect that is on: the scene as it is against the scene without it. Of each soft
/// surface: against the scene where it is hard, and where nothing lies beneath it. Of each contact
/// that the one surface could have instead of its own: that contact against the scene's. Of the
/// frames in which the scene's converged proxy is in contact, whatever the variant feels there.
/// [setup] Throws std::runtime_error when cancelled.
std::vector<FramePrice> frame_prices(std::shared_ptr<const Scene> scene,
                                     std::span<const DeviceState> inputs,
                                     const SceneResources& resources, int repetitions, Clock& clock,
                                     const Progress& progress = {});

/// The prices as plain text.                                                              [setup]
std::string frame_price_table(std::span<const FramePrice> prices);

/// The prices as prices.csv has them: a header and a line each; nothing where not known.   [setup]
std::string frame_price_csv(std::span<const FramePrice> prices);

} // namespace palpate
