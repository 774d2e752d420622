// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <memory>
#include <span>
#include <vector>

#include <palpate/engine/study/converged_proxy.h>
#include <palpate/engine/study/sweep.h>
#include <palpate/geometry/surface_scene.h>

namespace palpate::internal {

/// One value of a sweep, with all that its rows refer to.
struct SweepPoint {
    SweepRow row;                             ///< value, contact and size, or why there is no run
    std::shared_ptr<const Scene> scene;       ///< null: it cannot be built
    std::shared_ptr<const Scene> truth;       ///< what errors are measured against
    std::vector<DeviceState> inputs;          ///< the path
    double rate_hz = 0.0;                     ///< of the frames
    bool has_baselines = false;               ///< those over a level say something at this value
    std::shared_ptr<const SurfaceScene> mesh; ///< that finger_proxy goes on; or null
    ConvergedProxies converged = {};          ///< the reference, once it is made
};

/// The values of a sweep, each built or with the reason why it is not.                     [setup]
/// Throws std::runtime_error when cancelled.
std::deque<SweepPoint> sweep_points(SweepKind kind, std::shared_ptr<const Scene> scene,
                                    std::span<const DeviceState> inputs,
                                    const SceneResources& resources, const Progress& progress);

} // namespace palpate::internal
