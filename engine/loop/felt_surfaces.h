// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <palpate/engine/loop/frame_report.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/haptics/effects/effect.h>

namespace palpate {

/// The surfaces that the bits of FrameReport::surfaces_felt stand for: entry i is bit i. [setup]
std::vector<std::string> felt_names(const Scene& scene);

/// "a+b": the names of the bits that are set, in their order; empty where none is.       [any]
std::string felt_in_words(std::uint64_t felt, std::span<const std::string> names);

/// How a surface was felt in a run.
struct FeltSurface {
    std::string name;          ///< of the surface, in the scene
    std::uint64_t frames = 0;  ///< in which it was felt
    double contact_s = 0.0;    ///< device's time of these frames
    double force_mean_n = 0.0; ///< of these frames: of all that was felt then
    double force_max_n = 0.0;  ///< the same
    double path_m = 0.0;       ///< way of the proxy between such frames that follow each other
};

/// One for each name, in their order. A frame lasts from the one before it in its trial, or
/// period_s, s, where there is none.                                                     [setup]
std::vector<FeltSurface> felt_surfaces(std::span<const std::string> names,
                                       std::span<const FrameReport> frames, double period_s);

/// What to warn of: surfaces that have no bit. Empty where all have one.                 [setup]
std::string felt_warning(const Scene& scene);

} // namespace palpate
