// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include <palpate/engine/loop/loop_state.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/haptics/hand/safety_chain.h>
#include <palpate/haptics/hand/velocity_estimator.h>
#include <palpate/haptics/hand/virtual_coupling.h>
#include <palpate/haptics/stepping/subdivision.h>
#include <palpate/volume/fields/shared_samples.h>

namespace palpate::internal {

/// What a loop is made of, and never changes. In a loop that was made of something else a state
/// would mean something else: facets, levels and pieces of curves are the scene's, limits the
/// device's.
struct LoopMake {
    std::shared_ptr<const Scene> scene;
    LoopDescription loop;
    VirtualCoupling coupling;
    SafetySettings safety;
    VelocitySettings velocity;
    bool has_motors = false;
    bool estimates_velocity = false;
};

/// Throws std::invalid_argument that says what differs.                                [setup]
void require_same_make(const LoopMake& state, const LoopMake& loop);

/// What a LoopState holds: what its loop was made of, and all that moves from frame to frame.
struct LoopStateParts {
    LoopMake make;

    Subdivision::State subdivision;
    SharedFields::State fields;
    SafetyChain safety;
    VelocityEstimator velocity_estimator;

    std::uint64_t frames = 0;
    QueryCount uncounted; ///< made since the last frame's end: the next one's report has them
    bool started = false;
    bool silent = false;
    bool unbroken = false;
    std::uint32_t trial = 0;
    Vec3 proxy{0.0};                     ///< m, scene frame
    std::uint32_t flags_of_adoption = 0; ///< for the next report
};

} // namespace palpate::internal
