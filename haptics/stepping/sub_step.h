// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <palpate/geometry/vec.h>
#include <palpate/haptics/contact/contact_set.h>
#include <palpate/haptics/contact/surface_contact.h>
#include <palpate/haptics/effects/coulomb_friction.h>
#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/solver/primitives.h>
#include <palpate/haptics/solver/proxy_solver.h>
#include <palpate/haptics/stepping/loop_surface.h>

namespace palpate {

/// One evaluation and the move after it, as they were: for pictures and for those who look for a
/// fault. Places in m, forces in N, scene frame. References are valid during the call alone.
struct SubStep {
    /// How the proxy went on.
    enum class Kind : std::uint8_t {
        none,   ///< it is where it has to be
        look,   ///< not yet: primitives are gathered again with this solution known
        chord,  ///< straight to `wanted`, as far as every certificate holds
        slide,  ///< along the surface that alone holds it, drawn to `wanted`
        settle, ///< no evaluation of its own: the frame ends unfinished, or outside of what an
                ///< effect never lets the proxy leave; straight to `wanted`, as a chord
    };
    /// What ended a move before `wanted`: the surface whose certificate holds for the shortest part
    /// of the way.
    struct Stop {
        std::size_t surface = ContactSet::kNoSurface; ///< in canonical order; kNoSurface: nothing
        Chord chord;  ///< what the surface said; its share is of the way `from` to `to`
        Vec3 at{0.0}; ///< where the certificate ends. The proxy may have been left nearer: a move
                      ///< that is blocked is shortened to 1/2, 1/4, 1/8 or 1/16
    };
    Kind kind = Kind::none; ///< how it went on
    Vec3 from{0.0};         ///< where primitives were gathered (6)
    Vec3 candidate{0.0};    ///< where their forces balance the coupling's (7)
    Vec3 wanted{0.0};       ///< a share of the way there (9), or a step that follows the curvature
    Vec3 to{0.0};           ///< as far as it came
    Stop stop;              ///< of a chord, or of the last leg of a slide
    std::span<const Vec3> way;             ///< corners of the move: `from` to `to`
    const ContactSet& contacts;            ///< planes of surfaces, then of magnets
    const PrimitiveSet& primitives;        ///< these, and what effects and friction add
    const ProxySolution& solution;         ///< of the primitives; `proxy` is the candidate
    const FrameContext& frame;             ///< the probe and the coupling's stiffness
    std::span<const LoopSurface> surfaces; ///< in canonical order
    const CoulombFriction& friction;       ///< its lines are the last ones of the primitives
};

/// Is told every sub-step of every frame, within HapticLoop::frame() and in its thread. What it
/// does there takes the frame's time: so it is for runs that are computed again, not for a hand.
class SubStepObserver {
public:
    virtual ~SubStepObserver() = default;
    /// Must not change the loop.                                                         [loop]
    virtual void sub_step(const SubStep& step) noexcept = 0;
};

} // namespace palpate
