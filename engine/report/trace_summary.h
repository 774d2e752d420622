// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
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

/// One of several hands: the scene as it has it, and what came of it.
struct HandTrace {
    std::shared_ptr<const Scene> scene; ///< Scene::of_hand()
    Trace trace;                        ///< of this hand alone
};

/// summary.json of several hands: what is said of the scene and the machine once, and the rest in
/// a list, "hands", of one for each.                                                    [setup]
std::string summarize(std::span<const HandTrace> hands);

/// Such a summary as those of its hands alone, in their order; any other one as it is.   [setup]
std::vector<std::string> summaries_of_hands(const std::string& summary);

/// The hand that a summary is of; empty: the scene has one device.                       [setup]
std::string hand_of_summary(const std::string& summary);

/// Until when a run that began with a preview felt it, in a sentence.                    [setup]
std::string preview_in_words(const Trace& trace);

/// The flags of frames, a line each: in how many of them, what it means and what to do. [any]
std::vector<std::string> flags_in_words(std::span<const FrameReport> frames);

} // namespace palpate
