// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <palpate/engine/loop/frame_report.h>

namespace palpate::stability {

/// What did not hold, and where.
struct Failure {
    std::string invariant; ///< Invariant::name(), or one of run_case()'s own
    int frame = 0;
    std::string words;
};

/// What became of a case.
struct Outcome {
    std::string refused; ///< why the scene was; empty where it ran
    std::optional<Failure> failure;
    long frames = 0;         ///< of the first loop
    long touched = 0;        ///< of them: a surface pushed
    bool restless = false;   ///< a held proxy still moved at the end: flags said why, or it crept
    std::uint32_t flags = 0; ///< all that were seen
    /// By invariant: frames it had something to look at; "second hand": its frames.
    std::map<std::string, long> checks;
};

/// What a run may be told besides.
struct RunOptions {
    /// Controls change here what is seen of the loop, of its twin, and of the frame that is
    /// compared with the one beside.
    std::function<void(FrameReport&, std::vector<Vec3>& path)> spoil_first;
    std::function<void(FrameReport&)> spoil_twin, spoil_beside;
    std::function<void(FrameReport&, std::vector<Vec3>& path)> spoil_second; ///< the second hand's
    std::function<void(const char* phase)> phase; ///< "set-up", "frames": for a watchdog
};

/// Runs a case that write_case() wrote, frame by frame, in two loops on one scene, and in a third
/// one where there is a second hand, and checks every invariant until one fails. Besides those of
/// invariants.h:
///   same bits  the twin, which is told the first loop's decisions, has another clock and makes the
///              detours, says the same to the last bit; where a second hand is in the scene, the
///              twin is alone in a scene of its own
///   code       made again in code, with a value that no scene may have, the scene is refused
///   rest       a probe that is held for kHeldFrames at the end comes to rest and then keeps its
///              bits; or flags say in each frame why not, or it goes by less than 1 nm a frame,
///              or by less in each frame than in the one before: Outcome::restless
///   smooth     a probe that is 1 um beside has a proxy that is no farther beside than a smooth
///              level allows: for spheres, rings and plates alone
Outcome run_case(const std::filesystem::path& folder, const RunOptions& options = {});

} // namespace palpate::stability
