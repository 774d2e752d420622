// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include <palpate/engine/loop/frame_report.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene.h>

namespace palpate {

/// summary.json of a trace: counts, percentiles, truth, flags with their meaning, effects with
/// their price.   [setup]
std::string summarize(const Scene& scene, const Trace& trace);

/// Until when a run that began with a preview felt it, in a sentence.                    [setup]
std::string preview_in_words(const Trace& trace);

/// The flags of frames, a line each: in how many of them, what it means and what to do. [any]
std::vector<std::string> flags_in_words(std::span<const FrameReport> frames);

} // namespace palpate
