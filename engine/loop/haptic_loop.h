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
#include <palpate/engine/scene/scene.h>
#include <palpate/haptics/hand/safety_chain.h>
#include <palpate/haptics/hand/velocity_estimator.h>
#include <palpate/haptics/hand/virtual_coupling.h>
#include <palpate/haptics/stepping/subdivision.h>

namespace palpate {

namespace internal {
struct LoopMake;
}

/// All mutable state of one haptic loop over a shared scene. frame() is an ordinary function: call
/// it from whichever thread you like, one at a time. Below it there is no allocation, lock,
/// exception or unbounded loop.
class HapticLoop {
public:
    // All throw std::invalid_argument that names the field where a loop, a device or an effect is
    // missing or out of range (validate()).

    /// Builds contacts, effects and buffers; the clock must outlive the loop. `custom` are effects
    /// of the embedder's own beside the scene's, none of them null; they are felt after those, but
    /// before workspaces, which limit what all others draw.
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
    /// A probe that is not finite, or beyond 1e6 m, or stale holds the proxy and takes the force to
    /// zero (SafetyChain::fade()).
    FrameReport frame(const DeviceState& device) noexcept;

    /// The same with the clock's decisions of an earlier run (see steps_left()).         [loop]
    FrameReport frame(const DeviceState& device,
                      std::span<const std::uint32_t> steps_left) noexcept;

    /// The next force on the way out, N, scene frame: towards zero, which is reached within
    /// SafetySettings::fade_s without a look at the device (no motors: at the slew limit). frame()
    /// may follow, and waits for a small force then.                                    [loop]
    Vec3 release() noexcept;

    /// Its whole state between two frames: of contacts, effects and gains, of the hand's safety and
    /// of the frames' count.                                                            [setup]
    LoopState save() const;
    /// From here on the same inputs give the same reports as they gave after that save(), bit for
    /// bit; with method paper as long as the clock's decisions are the same, and but for spent_us.
    /// That is, if custom effects keep their promise (Effect::save_state()). Gains are the state's,
    /// too; path() and steps_left() are empty until the next frame. The force jumps from the last
    /// one that was sent to the state's, whatever the slew limit: on a device with motors, restore
    /// only where release() has come to zero in both. Needs no memory, unless a custom effect does.
    /// [setup]
    /// Throws std::invalid_argument that says what differs, and changes nothing, where the state's
    /// loop was made of another Scene, LoopDescription, kind of device or custom effects; and
    /// whatever a custom effect's restore_state() throws: then restore again from another state.
    void restore(const LoopState& state);

    /// What will not be felt as it is meant, of the scene's effects and of custom ones: forces
    /// beyond the limit, primitives beyond the room of an evaluation. In words, a line each.
    /// [setup]
    std::vector<std::string> warnings() const;

    /// What couples probe and proxy.                                                      [any]
    const VirtualCoupling& coupling() const noexcept { return coupling_; }

    /// The proxy's corners in the last frame.                                            [loop]
    std::span<const Vec3> path() const noexcept { return subdivision_->path(); }
    /// N_steps of eq. (8) after each evaluation of the last frame.                        [loop]
    std::span<const std::uint32_t> steps_left() const noexcept {
        return subdivision_->steps_left();
    }

    /// How many effects set_gain() knows: the scene's, on or left out, and then the custom ones.
    /// [any]
    std::size_t effect_count() const noexcept { return gains_.size(); }

    /// Scales what an effect does while the loop runs, from any thread, also while frame() runs:
    /// strengths, forces, damping, heights, a membrane's opening strength. `effect` counts the
    /// scene's effects from 0 in their order (SceneDescription::effects), and then the custom ones;
    /// `gain` in [0, 10]: 0 switches it off, 1 is as the scene says. Frames follow within 50 ms per
    /// unit, linearly, the first of a trial at once (GainRamp). False, and nothing changes, where
    /// there is no such effect, the plan left it out, or the gain is out of range; or where a
    /// workspace would yield because of which the plan left a surface out.                  [any]
    bool set_gain(std::size_t effect, double gain) noexcept;

private:
    std::size_t effects_before_limits() const;
    bool keeps_from_surfaces(std::size_t effect) const noexcept;
    std::vector<GainRamp*> gains_of_effects(std::size_t custom_count) const;
    void move_proxy(const DeviceState& device, std::span<const std::uint32_t> steps_left,
                    FrameReport& report) noexcept;
    Vec3 release(std::uint32_t& flags) noexcept;
    Vec3 wanted_force(const DeviceState& device, const Vec3& velocity,
                      std::span<const std::uint32_t> steps_left, FrameReport& report) noexcept;
    Vec3 velocity(const DeviceState& device) noexcept;
    QueryCount queries() const noexcept;
    internal::LoopMake make() const;

    std::shared_ptr<const Scene> scene_;
    LoopDescription loop_;
    Clock& clock_;
    LoopParts parts_;
    std::unique_ptr<Subdivision> subdivision_;
    std::vector<GainRamp*> gains_; // of each effect of the scene, then of the custom ones; null:
                                   // the plan left it out
    VirtualCoupling coupling_;
    SafetyChain safety_;
    bool has_motors_;
    bool estimates_velocity_;
    VelocityEstimator velocity_estimator_;
    double period_s_;

    std::uint64_t frames_ = 0;
    QueryCount counted_; // up to the last frame's end
    bool started_ = false;
    bool silent_ = false; // since the last frame that the device had a place for
    std::uint32_t trial_ = 0;
    Vec3 proxy_{0.0};
};

} // namespace palpate
