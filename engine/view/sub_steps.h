// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <palpate/engine/loop/run.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/geometry/isosurface.h>
#include <palpate/haptics/stepping/sub_step.h>

namespace palpate {

/// A plane that held the proxy, or could have.
struct ViewPlane {
    Vec3 at{0.0};            ///< a point of it, m, scene frame
    Vec3 normal{0.0};        ///< unit, towards free space
    double strength_n = 0.0; ///< at which it yields, N, >= 0; infinite: never
    int structure = -1;      ///< Scene::surfaces()[structure]; -1: of a magnet or an effect
    bool active = false;     ///< it pushes in this sub-step's solution
};

/// A sub-step to be drawn: an evaluation and the move after it (SubStep). m, scene frame.
struct ViewSubStep {
    SubStep::Kind kind = SubStep::Kind::none; ///< how the proxy went on
    Vec3 from{0.0};                           ///< the proxy before
    Vec3 candidate{0.0};                      ///< where the forces of all primitives balance
    Vec3 wanted{0.0};                         ///< where the method led it
    Vec3 to{0.0};                             ///< the proxy after
    std::vector<ViewPlane> planes;            ///< of surfaces and magnets, then of effects
};

/// The sub-steps of one frame.
struct ViewFrameSteps {
    std::uint64_t frame = 0;        ///< FrameReport::frame
    std::vector<ViewSubStep> steps; ///< in their order
};

/// The sub-steps of some frames of a run, which is computed again up to the last of them. `frames`:
/// FrameReport::frame of each, in any order; those that the run does not have are left out.
/// [setup]
/// Throws std::runtime_error when cancelled.
std::vector<ViewFrameSteps> sub_steps_of(std::shared_ptr<const Scene> scene, const Run& run,
                                         std::span<const std::uint64_t> frames,
                                         const Progress& progress = {});

/// The hardest frames of a run, at most `most`, in their order: first those with a flag that says
/// that a frame was not solved to its end, or that a proxy or a body was held back; then those with
/// the most evaluations. Of equals, the earlier ones.                                       [setup]
std::vector<std::uint64_t> hard_frames(const Run& run, std::size_t most);

} // namespace palpate
