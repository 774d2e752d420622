// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <palpate/engine/loop/haptic_loop.h>

#include "tests/stability/random/invariants.h"
#include "tests/stability/random/run_case.h"

#include "tests/support/scripted_clock.h"

namespace palpate::stability {

/// What a program has done to the scene up to a frame.
struct Moved {
    bool gains = false, bodies = false;
};

/// A hand's loop on a scene, and every invariant of invariants.h on each of its frames.
class WatchedLoop {
public:
    /// `events` outlive the loop.
    WatchedLoop(std::shared_ptr<const Scene> scene, const std::vector<FileEvent>& events,
                const std::vector<CaseStep>& steps, double clock_us);
    WatchedLoop(const WatchedLoop&) = delete; // invariants know the scene and the events by address
    WatchedLoop& operator=(const WatchedLoop&) = delete;

    int frames() const { return static_cast<int>(states_.size()); }
    const DeviceState& state(int frame) const { return states_[static_cast<std::size_t>(frame)]; }
    HapticLoop& loop() { return loop_; }
    const Watched& watched() const { return watched_; }

    /// Goes on by a frame; the invariants see it as `options.spoil_first` leaves it. What is wrong
    /// with it; nothing where all hold.
    std::optional<Failure> go(int frame, const Moved& moved, const RunOptions& options);
    /// The last frame as it was, and as the invariants have seen it.
    const FrameReport& own() const { return own_; }
    const FrameReport& seen() const { return seen_; }
    /// Adds how many frames each invariant had something to look at.
    void count(Outcome& outcome) const;

private:
    std::shared_ptr<const Scene> scene_;
    std::vector<DeviceState> states_;
    test::ScriptedClock clock_;
    HapticLoop loop_;
    Watched watched_;
    std::vector<std::unique_ptr<Invariant>> invariants_;
    std::vector<RigidPose> poses_;
    FrameReport own_, seen_;
    bool begins_ = false;
};

} // namespace palpate::stability
