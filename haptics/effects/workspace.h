// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/effects/local_strength.h>

namespace palpate {

// Limits of the proxy's place, for hands and devices that must not leave a region. Both come after
// all effects that draw by forces and springs: the pull that they see must be the frame's. A proxy
// that starts outside is drawn in at once, by at most their strength.

/// The proxy stays in a ball around `center`: s max(0, |x' - c| - R). (composition.md 1)
/// One plane touches the ball where it is nearest to what pulls, which is exact whatever the
/// jump, in one evaluation, as long as nothing but forces and springs acts beside it. Where
/// surfaces or guides push the proxy along that plane, further ones touch the ball where the
/// solutions lead: with an infinite strength up to kCuts of them at once, each of which the ball
/// satisfies, so that a step ends outside by at most e^2 / (2 R), e its length: less than a
/// picometre where a frame converges. What would be more than a nanometre, as where
/// curved walls and a jump use the frame up (kEvaluationCap) or its method has too few sub-steps,
/// is taken back where the frame ends, to the ball or to where its way left it: what starts a frame
/// inside ends it inside, if a surface is not in the way back, as it may be where the proxy was
/// deep in its band. Of a finite strength the last plane alone, lest strengths add up.
class WorkspaceSphere final : public Effect {
public:
    static constexpr std::size_t kCuts = 4;

    /// Center in m, scene frame; radius in m, > 0; strength in N, >= 0, may be infinite. Throws
    /// std::invalid_argument on what is not finite or out of range.                    [setup]
    WorkspaceSphere(const Vec3& center, double radius_m, LocalStrength strength);
    WorkspaceSphere(const Vec3& center, double radius_m, double strength_n)
        : WorkspaceSphere(center, radius_m, LocalStrength(strength_n)) {}

    void restart(const Vec3&) noexcept override { strength_.restart(); }
    void begin(const FrameContext& frame) noexcept override;
    void gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept override;
    void solved(const Vec3& end) noexcept override {
        if (!looked_) end_ = end;
        looked_ = false;
    }
    std::size_t most_primitives() const noexcept override {
        return std::isinf(strength_.now()) ? kCuts : 1;
    }
    Vec3 within(const Vec3& wanted) const noexcept override;
    QueryCount queries() const noexcept override { return {strength_.samples(), 0, 0}; }
    std::any save_state() const override { return strength_.save_state(); }
    void restore_state(const std::any& state) override {
        strength_.restore_state(std::any_cast<const LocalStrength::State&>(state));
    }

private:
    void cut_towards(const Vec3& point) noexcept;

    Vec3 center_;
    double radius_m_;
    LocalStrength strength_; // N

    // Of one frame.
    FrameContext frame_;
    Vec3 end_{0.0};                    // where the frame is likely to end
    std::array<Vec3, kCuts> normal_{}; // inwards
    std::size_t cuts_ = 0;             // made so far; the last kCuts of them count
    bool looks_ = false, looked_ = false;
    bool never_left_ = false; // with the gain of the last gather()
};

/// The proxy stays in a box along the scene's axes: s max(0, depth behind it) for each face.
/// composition.md 1. Exact in one evaluation, in edges and corners too, but beside curved surfaces:
/// there what starts a frame inside ends it inside, as with the ball. Each face yields by itself.
class WorkspaceBox final : public Effect {
public:
    /// Box in m, scene frame, not empty; strength in N, >= 0, may be infinite. Throws
    /// std::invalid_argument on what is not finite or out of range.                    [setup]
    WorkspaceBox(const Box& box, LocalStrength strength);
    WorkspaceBox(const Box& box, double strength_n)
        : WorkspaceBox(box, LocalStrength(strength_n)) {}

    void restart(const Vec3&) noexcept override { strength_.restart(); }
    void begin(const FrameContext& frame) noexcept override {
        frame_ = frame;
        strength_.at(frame);
    }
    void gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept override;
    std::size_t most_primitives() const noexcept override { return 6; } // a plane for each side
    Vec3 within(const Vec3& wanted) const noexcept override;
    QueryCount queries() const noexcept override { return {strength_.samples(), 0, 0}; }
    std::any save_state() const override { return strength_.save_state(); }
    void restore_state(const std::any& state) override {
        strength_.restore_state(std::any_cast<const LocalStrength::State&>(state));
    }

private:
    Box box_;
    LocalStrength strength_; // N
    FrameContext frame_;
    bool never_left_ = false; // with the gain of the last gather()
};

} // namespace palpate
