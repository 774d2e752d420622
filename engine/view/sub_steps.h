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

/// What ended a move before the place that was wanted.
struct ViewStop {
    using By = SubStep::Stop::By; ///< the loop's own reasons
    By by = By::nothing;          ///< why it ended
    int structure = -1;           ///< whose, as ViewPlane::structure
    Vec3 at{0.0};                 ///< up to where the way was certified, m, scene frame
};

/// The leash of a surface that has both a volume and a mesh.
struct ViewLeash {
    int structure = -1;    ///< whose, as ViewPlane::structure
    Vec3 guard{0.0};       ///< the mesh's own proxy, m, scene frame
    double length_m = 0.0; ///< how far from it a chord may end, m
    int plane = -1;        ///< ViewSubStep::planes[plane] is its plane; -1: it has none here
};

/// Friction at a plane, as the solver has it: a line through the place where the frame found the
/// proxy on the surface. It draws the proxy back with at most `most_n`. So the proxy stays there
/// as long as what draws it lies within the cone from `apex` about -`axis` of the half-angle
/// atan(most_n / normal_n).
struct ViewFriction {
    std::size_t plane = 0;    ///< ViewSubStep::planes[plane] is rubbed at
    Vec3 apex{0.0};           ///< where the line meets that plane, m, scene frame
    Vec3 axis{0.0};           ///< of the line: the plane's normal, unit
    double coefficient = 0.0; ///< mu in this frame: the static or the dynamic one
    double normal_n = 0.0;    ///< the plane's force in this solution, N, >= 0
    double most_n = 0.0;      ///< the line's strength in this solution, N, >= 0
    double force_n = 0.0;     ///< what it bears, N, >= 0
    bool holds = false;       ///< it holds the proxy; false: it slips, or nothing presses
};

/// A sub-step to be drawn: an evaluation and the move after it (SubStep). m, scene frame.
struct ViewSubStep {
    SubStep::Kind kind = SubStep::Kind::none; ///< how the proxy went on
    Vec3 from{0.0};                           ///< the proxy before
    Vec3 candidate{0.0};                      ///< where the forces of all primitives balance
    Vec3 wanted{0.0};                         ///< where the method led it
    Vec3 to{0.0};                             ///< the proxy after
    std::vector<ViewPlane> planes;            ///< of surfaces and magnets, then of effects
    Vec3 pull{0.0};                           ///< where coupling, forces and springs draw it
    double stiffness_n_per_m = 0.0;           ///< of all of these together
    std::vector<Vec3> way;                    ///< corners of the move, `from` to `to`
    ViewStop stop;                            ///< what ended it
    std::vector<ViewLeash> leashes;           ///< of surfaces in their order
    std::vector<ViewFriction> friction;       ///< of planes in their order
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
