// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/loop/internal/loop_state_parts.h>
#include <palpate/engine/loop/internal/surface_identity.h>
#include <palpate/engine/loop/internal/surface_statuses.h>
#include <palpate/engine/scene/internal/plan_warnings.h>
#include <palpate/engine/scene/loop_parts.h>
#include <palpate/haptics/hand/safety_chain.h>
#include <palpate/haptics/hand/velocity_estimator.h>
#include <palpate/haptics/stepping/subdivision.h>

namespace palpate::internal {

using CustomEffects = std::vector<std::shared_ptr<Effect>>;

/// The loop over one scene: contacts, effects, subdivision, safety, and what moves between frames.
/// A HapticLoop has one that runs, and hands its work over to the next when a scene is adopted. Its
/// functions mean what HapticLoop's of the same name do.
class SceneLoop {
public:
    /// The custom effects are shared by the loops of all scenes of one hand. Throws
    /// std::invalid_argument that names what is wrong of the description, the device or the
    /// effects.                                                                         [setup]
    SceneLoop(std::shared_ptr<const Scene> scene, Clock& clock, const LoopDescription& loop,
              const DeviceProperties& device, const CustomEffects& custom);

    /// Takes the place of `before` between two frames.                                   [loop]
    void go_on_from(SceneLoop& before) noexcept;
    /// Of custom effects in another scene's loop: where they were set to go.             [setup]
    void take_gains_of_custom(const SceneLoop& of) noexcept;
    LoopMake make() const;

    FrameReport frame(const DeviceState& device, std::span<const std::uint32_t> steps_left,
                      double began_us) noexcept;
    Vec3 release() noexcept;
    std::vector<std::string> warnings() const;
    bool set_gain(std::size_t effect, double gain) noexcept;
    bool set_pose(std::size_t surface, const RigidPose& pose) noexcept;
    RigidPose pose(std::size_t surface) const noexcept;
    Wrench wrench(std::size_t surface) const noexcept;
    LoopState save() const;
    void restore(const LoopState& state);

    void observe(SubStepObserver* observer) noexcept { subdivision_->observe(observer); }

    const VirtualCoupling& coupling() const noexcept { return coupling_; }
    const Subdivision& subdivision() const noexcept { return *subdivision_; }
    std::span<const Vec3> path() const noexcept {
        return computed_ ? subdivision_->path() : std::span<const Vec3>();
    }
    std::span<const std::uint32_t> steps_left() const noexcept {
        return computed_ ? subdivision_->steps_left() : std::span<const std::uint32_t>();
    }
    std::span<const Touch> touches() noexcept;
    std::span<const SurfaceStatus> surface_states() noexcept;
    std::size_t effect_count() const noexcept { return gains_.size(); }

private:
    MovingSurface* body_of(std::size_t surface) const noexcept;
    std::size_t effects_before_limits() const;
    std::vector<FeltEffect> named_effects() const;
    bool keeps_from_surfaces(std::size_t effect) const noexcept;
    std::vector<GainRamp*> gains_of_effects() const;
    void move_proxy(const DeviceState& device, std::span<const std::uint32_t> steps_left,
                    FrameReport& report) noexcept;
    void report_pressed(FrameReport& report) const noexcept;
    Vec3 release(std::uint32_t& flags) noexcept;
    Vec3 wanted_force(const DeviceState& device, const Vec3& velocity,
                      std::span<const std::uint32_t> steps_left, FrameReport& report) noexcept;
    Vec3 velocity(const DeviceState& device) noexcept;
    QueryCount queries() const noexcept;

    std::shared_ptr<const Scene> scene_;
    LoopDescription loop_;
    Clock& clock_;
    LoopParts felt_;
    CustomEffects custom_;
    std::vector<Effect*> effects_; // all, in the order in which they are gathered
    std::unique_ptr<Subdivision> subdivision_;
    bool has_softness_ = false;    // of it
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
    bool silent_ = false;   // since the last frame that the device had a place for
    bool unbroken_ = false; // proxy_ is where the last frame's way ended
    std::uint32_t trial_ = 0;
    Vec3 proxy_{0.0};

    bool computed_ = false; // the last frame had a place to go to: subdivision_ has its path
    bool moved_ = false;    // and it got to one: subdivision_ has its touches
    TouchList touches_;     // as they were asked for last
    SurfaceStatuses statuses_;

    // Of a scene that takes another's place.
    std::vector<SurfaceIdentity> identities_; // of the surfaces
    std::vector<std::size_t> surfaces_after_; // room for Subdivision::Heritage
    std::vector<std::size_t> effects_after_;
    std::uint32_t flags_of_adoption_ = 0; // for the next report
};

} // namespace palpate::internal
