// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/loop/frame_report.h>
#include <palpate/engine/loop/loop_state.h>
#include <palpate/engine/loop/surface_status.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/geometry/rigid_pose.h>
#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/hand/virtual_coupling.h>
#include <palpate/haptics/stepping/clock.h>
#include <palpate/haptics/stepping/touch.h>

namespace palpate {

class SubStepObserver;
namespace internal {
struct LoopMake;
}

/// A force on a body and its torque about the body's origin, RigidPose::position. Scene frame.
struct Wrench {
    Vec3 force{0.0};  ///< N
    Vec3 torque{0.0}; ///< N m
};

/// All mutable state of one haptic loop over a shared scene. frame() is an ordinary function: call
/// it from whichever thread you like, one at a time. Below it there is no allocation, lock,
/// exception or unbounded loop.
class HapticLoop {
public:
    // All throw std::invalid_argument that names the field where a loop, a device or an effect is
    // missing or out of range (validate()).

    /// Builds contacts, effects and buffers. The clock must outlive the loop. `custom`: your own
    /// effects, none of them null. They come after the scene's effects, but before its workspaces,
    /// which must see the pull of all others.
    /// [setup]
    HapticLoop(std::shared_ptr<const Scene> scene, Clock& clock,
               std::vector<std::unique_ptr<Effect>> custom = {});
    /// The same with another method, budget or rate than the scene's own.               [setup]
    HapticLoop(std::shared_ptr<const Scene> scene, Clock& clock, const LoopDescription& loop,
               std::vector<std::unique_ptr<Effect>> custom = {});
    /// The same for a device: one that takes forces gets the whole SafetyChain and the coupling of
    /// safe_coupling(), whose warning the caller shows.                                 [setup]
    HapticLoop(std::shared_ptr<const Scene> scene, Clock& clock, const LoopDescription& loop,
               const DeviceProperties& device, std::vector<std::unique_ptr<Effect>> custom = {});
    ~HapticLoop();
    HapticLoop(const HapticLoop&) = delete;
    HapticLoop& operator=(const HapticLoop&) = delete;

    /// One haptic frame: probe in, force out (FrameReport::force, N, scene frame).       [loop]
    /// If the probe is not finite, is beyond 1e6 m or is stale, the proxy stays and the force goes
    /// to zero (SafetyChain::fade()).
    FrameReport frame(const DeviceState& device) noexcept;

    /// The same with the clock's decisions of an earlier run (see steps_left()).         [loop]
    FrameReport frame(const DeviceState& device,
                      std::span<const std::uint32_t> steps_left) noexcept;

    /// Call it frame by frame when a run ends. Returns the next force on its way to zero, N, scene
    /// frame, without looking at the device. Zero is reached within SafetySettings::fade_s (without
    /// motors: at the slew limit). frame() may follow; with motors it then waits for a small force.
    /// [loop]
    Vec3 release() noexcept;

    /// Goes on with another scene: it is built here, while frames go on in another thread, and the
    /// next frame takes it over. What the loop was made with stays: method, rate, device, custom
    /// effects with their gains. The proxy stays where it is. A surface of the same name, data,
    /// level and contact, or guarded after volume, goes on with its pose, however strong it is; any
    /// other is felt as from a new trial's beginning, so one that holds the proxy inside is not
    /// felt until the proxy has left it (inside_at_start). Effects of the scene begin anew. Gains
    /// are 1. The force follows within the slew limit. The frame has the flag scene_adopted. From
    /// here on set_gain(), set_pose() and effect_count() are about the new scene; what describes
    /// the last frame is about the old one until the next frame, or save(), restore() or
    /// warnings(). Of two calls before a frame the second counts, and what was set for the first
    /// one is gone. What another thread sets during the call may be lost: it was set in the old
    /// scene. The scene that was left lives until the next adopt(), or as long as the loop. Throws,
    /// and changes nothing, what the constructor does; and std::invalid_argument if coupling or
    /// limits differ from the loop's. They belong to the hand and its device: make another loop.
    /// From any thread but the one in frame().       [setup]
    void adopt(std::shared_ptr<const Scene> scene);

    /// Its whole state between two frames: of contacts, effects and gains, of the hand's safety and
    /// of the frames' count.                                                            [setup]
    LoopState save() const;
    /// From here on the same inputs give the same reports as they gave after that save(), bit for
    /// bit; with method paper as long as the clock's decisions are the same, and but for spent_us.
    /// That is, if custom effects keep their promise (Effect::save_state()). Gains are the state's,
    /// too; path(), steps_left() and touches() are empty until the next frame, whose touches begin
    /// and end as they did. The force jumps from the last one that was sent to the state's,
    /// whatever the slew limit: on a device with motors, restore only where release() has come to
    /// zero in both. Needs no memory, unless a custom effect does. [setup]
    /// Throws std::invalid_argument that says what differs, and changes nothing, where the state's
    /// loop was made of another Scene, LoopDescription, kind of device or custom effects; and
    /// whatever a custom effect's restore_state() throws: then restore again from another state.
    void restore(const LoopState& state);

    /// What will not be felt as it is meant, of the scene's effects and of custom ones: forces
    /// beyond the limit, primitives beyond the room of an evaluation. In words, a line each.
    /// [setup]
    std::vector<std::string> warnings() const;

    /// From the next frame on `observer` is told every sub-step; null: nobody is. Frames keep their
    /// bits and take longer: for runs that are computed again, as recorded ones. It must outlive
    /// the loop, or be taken away before (haptics/stepping/sub_step.h). [setup]
    void observe(SubStepObserver* observer) noexcept;

    /// What couples probe and proxy.                                                      [any]
    const VirtualCoupling& coupling() const noexcept;

    /// The proxy's corners in the last frame, from where bodies have carried it to, m. Empty after
    /// a frame whose probe was stale or no place.                                        [loop]
    std::span<const Vec3> path() const noexcept;
    /// N_steps of eq. (8) after each evaluation of the last frame; with them a run is
    /// replayed. [loop]
    std::span<const std::uint32_t> steps_left() const noexcept;

    /// What the last frame touched, surface by surface in the order of Scene::surfaces(); of one
    /// that let go, one entry with Phase::ended. All contacts are in it: where an evaluation has
    /// more planes than the solver has room for, the last ones count neither for the frame nor here
    /// (flag primitives_full). Empty after a frame that did not move the proxy, as its probe was
    /// stale or no place; the next one goes on from the frame before. Nothing is computed
    /// unless it is asked for. Valid until the next call of it, frame() or restore().     [loop]
    std::span<const Touch> touches() const noexcept;
    /// How the proxy stands with each surface of Scene::surfaces() after the last frame. A depth
    /// costs some 50 samples of a field (500 where it is noise), or a closest point of a mesh: many
    /// microseconds, so ask when you show it rather than in each frame. It counts in no report.
    /// Empty before the first frame. Valid until the next call.                          [loop]
    std::span<const SurfaceStatus> surface_states() const noexcept;

    /// How many effects set_gain() knows: the scene's, on or left out, and then the custom ones.
    /// [any]
    std::size_t effect_count() const noexcept;

    /// Scales what an effect does while the loop runs, from any thread, also while frame() runs:
    /// strengths, forces, damping, heights, a membrane's opening strength. `effect` counts the
    /// scene's effects from 0 in their order (SceneDescription::effects), and then the custom ones;
    /// `gain` in [0, 10]: 0 switches it off, 1 is as the scene says. The gain moves by 1 in 50 ms;
    /// a new trial takes it at once (GainRamp). Returns false and changes nothing if there is no
    /// such effect, if the plan left it out, or if the gain is out of range. The plan may have left
    /// out a surface because a workspace keeps the proxy of trials that begin in it away from it.
    /// Then a gain below 1 for a workspace is refused, too.                                 [any]
    bool set_gain(std::size_t effect, double gain) noexcept;

    /// Moves the body of a surface that `moves` (SurfaceDescription), Scene::surfaces()[surface],
    /// from any thread, also while frame() runs; but each surface from one thread at a time. The
    /// next frame begins with the body there. `pose` is where the frame of the scene's own data
    /// then lies; {} is where the scene has it. Position within 1e6 m, orientation of any length
    /// above 0, which is made 1. A new trial begins with the pose that was set last. Between two
    /// frames a body goes straight and turns by the shorter way; a proxy that it touches goes
    /// along, and one that it comes onto is pushed. Where no room is left for the proxy, the body
    /// waits (flag body_held_back). Returns false and changes nothing if there is no such surface,
    /// if it does not move, or if the pose is out of range. [any]
    bool set_pose(std::size_t surface, const RigidPose& pose) noexcept;
    /// Where the body of a surface was in the last frame; {} where it does not move.     [loop]
    RigidPose pose(std::size_t surface) const noexcept;
    /// What the last frame's contacts with a surface put on its body: the opposite of the forces of
    /// touches(), without its magnet. Zero where it is not touched.                      [loop]
    Wrench wrench(std::size_t surface) const noexcept;

private:
    class Loops; // the one over the scene that runs, and the one over the scene that is to follow
    std::unique_ptr<Loops> loops_;
};

} // namespace palpate
