// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/study/study_run.h>

namespace palpate {

/// Where the proxy of a scene is, frame by frame, when its stepping has converged: the truth for
/// positions where no formula gives the nearest point.
struct ConvergedProxies {
    std::vector<Vec3> proxies;            ///< m, scene frame
    std::vector<std::uint8_t> in_contact; ///< 1 where the proxy of the frame is held
    StudyReference reference;             ///< how it was made, and what it is known to
};

/// Method `adaptive` to 1e-6 um with as many evaluations as there may be, and to 1e-2 um for its
/// own error; where nothing that is felt has a level, `fixed` with 2048 and 1024 sub-steps: its
/// error falls as one over their number, so that their difference is that of the finer one.
/// `rate_hz` of the inputs, or 0: the scene's. No clock decides. [setup] Throws std::runtime_error
/// when cancelled.
ConvergedProxies converged_proxies(std::shared_ptr<const Scene> scene,
                                   std::span<const DeviceState> inputs,
                                   const Progress& progress = {}, double rate_hz = 0.0);

/// The same with settings of the caller's, and nothing said of their error.               [setup]
/// A clock decides with method `paper` alone. Throws std::runtime_error when cancelled.
ConvergedProxies proxies_with(std::shared_ptr<const Scene> scene,
                              std::span<const DeviceState> inputs, const LoopDescription& settings,
                              const Progress& progress = {});

/// Distances between two converged proxies over the frames in which both are in contact, um.
/// [setup]
StudyRun::Error distance_between(const ConvergedProxies& a, const ConvergedProxies& b);

} // namespace palpate
