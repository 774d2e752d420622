// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <any>
#include <memory>

#include <palpate/geometry/rigid_pose.h>
#include <palpate/haptics/contact/surface_contact.h>
#include <palpate/haptics/effects/effect.h>

namespace palpate {

/// An effect that moves along with a rigid body: an effect of any kind, which stays in the body's
/// own frame and knows nothing of the pose, seen from the scene. What it remembers of its path is a
/// place in the body, and a frame starts where the body has carried the last one's proxy to: so a
/// medium that moves carries a hand along, as far as the longest force stretches the coupling. What
/// it adds yields at that force: things of several bodies that never yield could contradict each
/// other, and meet nowhere near the hand. [loop] but for its constructor.
class MovingEffect final : public Effect {
public:
    /// `effect`: in the body's frame, which is the scene's as long as no pose is set. `body` has
    /// the pose, and must outlive this. Throws std::invalid_argument where there is no effect.
    /// [setup]
    MovingEffect(std::unique_ptr<Effect> effect, const MovingSurface& body);

    void restart(const Vec3& proxy) noexcept override;
    void begin(const FrameContext& frame) noexcept override;
    void gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept override;
    void solved(const Vec3& end) noexcept override;
    // Not within(): it yields at the longest force, so the proxy may end anywhere.
    void commit(const FrameOutcome& outcome) noexcept override;
    Vec3 device_force_n() const noexcept override {
        return map_.direction(effect_->device_force_n());
    }
    double unasked_force_n() const noexcept override { return effect_->unasked_force_n(); }
    bool is_active() const noexcept override { return effect_->is_active(); }
    bool only_pushes() const noexcept override { return effect_->only_pushes(); }
    double highest_tone_hz() const noexcept override { return effect_->highest_tone_hz(); }
    std::size_t most_primitives() const noexcept override { return effect_->most_primitives(); }
    QueryCount queries() const noexcept override { return effect_->queries(); }
    std::any save_state() const override;
    void restore_state(const std::any& state) override;

private:
    /// What it remembers from frame to frame.
    struct State {
        std::any effect;
        Vec3 proxy{0.0};
    };

    std::unique_ptr<Effect> effect_;
    const MovingSurface* body_;
    RigidMap map_;        // of the body, in this frame
    Vec3 proxy_{0.0};     // at the end of the last frame, m, body's frame
    double most_n_ = 0.0; // FrameContext::force_limit_n

    // Of one frame, m, body's frame.
    Vec3 behind_{0.0}; // what the proxy still lacks of where the body has carried it
    Vec3 at_{0.0};     // where it was at the last evaluation
    Vec3 end_{0.0};    // and where that one's solution is
};

} // namespace palpate
