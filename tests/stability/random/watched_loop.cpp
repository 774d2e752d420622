// SPDX-License-Identifier: Apache-2.0
#include "tests/stability/random/watched_loop.h"

#include <utility>

#include <palpate/engine/devices/probe_path.h>

namespace palpate::stability {
namespace {

std::vector<DeviceState> states_of(const std::vector<CaseStep>& steps, double rate_hz) {
    ProbeSteps rows(rate_hz);
    std::vector<DeviceState> states;
    states.reserve(steps.size());
    for (std::size_t i = 0; i < steps.size(); ++i) {
        if (i > 0 && steps[i].begins_trial) rows.begin_trial();
        states.push_back(rows.next(steps[i].probe));
    }
    return states;
}

} // namespace

WatchedLoop::WatchedLoop(std::shared_ptr<const Scene> scene, const std::vector<FileEvent>& events,
                         const std::vector<CaseStep>& steps, double clock_us)
    : scene_(std::move(scene)), states_(states_of(steps, scene_->description().loop.rate_hz)),
      clock_(clock_us), loop_(scene_, clock_), watched_{*scene_, events},
      poses_(scene_->surfaces().size()) {
    add_frame_invariants(watched_, invariants_);
    add_label_invariants(watched_, invariants_);
    add_certificates(watched_, invariants_);
    add_mesh_invariants(watched_, invariants_);
    add_press_invariant(watched_, invariants_);
    add_path_invariant(invariants_);
}

std::optional<Failure> WatchedLoop::go(int frame, const Moved& moved, const RunOptions& options) {
    const auto at = static_cast<std::size_t>(frame);
    const DeviceState& state = states_[at];
    own_ = loop_.frame(state);
    seen_ = own_;
    std::vector<Vec3> path(loop_.path().begin(), loop_.path().end());
    if (options.spoil_first) options.spoil_first(seen_, path);
    for (std::size_t i = 0; i < poses_.size(); ++i)
        poses_[i] = loop_.pose(i);
    // A trial begins with the first place that is one.
    begins_ = begins_ || frame == 0 || state.trial != states_[at - 1].trial;
    const bool placed = (own_.flags & kProbeNotFinite) == 0;
    const SeenFrame seen{frame, state,  begins_ && placed, seen_,
                         path,  poses_, moved.gains,       moved.bodies};
    if (placed) begins_ = false;
    for (const auto& invariant : invariants_)
        if (auto wrong = invariant->check(seen))
            return Failure{invariant->name(), frame, std::move(*wrong)};
    return std::nullopt;
}

void WatchedLoop::count(Outcome& outcome) const {
    for (const auto& invariant : invariants_)
        outcome.checks[invariant->name()] += invariant->checks();
}

} // namespace palpate::stability
