// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <palpate/geometry/vec.h>
#include <palpate/haptics/contact/contact_set.h>
#include <palpate/haptics/solver/primitives.h>
#include <palpate/haptics/solver/proxy_solver.h>

namespace palpate {

/// One evaluation and the move after it, as they were: for pictures and for those who look for a
/// fault. Places in m, forces in N, scene frame. References are valid during the call alone.
struct SubStep {
    /// How the proxy went on.
    enum class Kind : std::uint8_t {
        none,   ///< it is where it has to be, or the frame's work is spent: it stays
        look,   ///< not yet: primitives are gathered again with this solution known
        chord,  ///< straight to `wanted`, as far as every certificate holds
        slide,  ///< along the surface that alone holds it, drawn to `wanted`
        settle, ///< no evaluation of its own: the frame ends unfinished, or outside of what an
                ///< effect never lets the proxy leave; straight to `wanted`, as a chord
    };
    /// What ended a move before `wanted`: the surface whose certificate holds for the shortest part
    /// of the way.
    struct Stop {
        /// Why it ended.
        enum class By : std::uint8_t {
            nothing,     ///< it went all the way
            contact,     ///< there it met a surface that was not felt before
            edge,        ///< the way goes on round an edge of the mesh that it follows
            certificate, ///< beyond, a surface that is felt has no certificate for it
            leash,       ///< beyond, it would be farther behind a mesh than the leash is long
        };
        By by = By::nothing;     ///< why it ended
        std::size_t surface = 0; ///< whose, in canonical order
        double share = 1.0;      ///< of the way that is certified, [0, 1]
        Vec3 at{0.0}; ///< where that ends, m. The proxy may have been left nearer: a move that is
                      ///< blocked is shortened to 1/2, 1/4, 1/8 or 1/16
    };
    /// The leash of a surface that has a volume and a mesh on guard (docs/contact.md, 4).
    struct Leash {
        std::size_t surface = 0; ///< whose, in canonical order
        Vec3 guard{0.0};         ///< the mesh's own proxy, m, scene frame
        double length_m = 0.0;   ///< how far from it a chord may end, m, > 0
        bool offered = false;    ///< the last plane of that surface is the leash's
    };
    /// Friction at a plane: a line across which it draws the proxy back (composition.md 3.1).
    struct Friction {
        std::size_t plane = 0;    ///< of the contacts, and of the primitives
        std::size_t line = 0;     ///< of the primitives
        double coefficient = 0.0; ///< mu in this frame: static until it slides, then dynamic
    };
    Kind kind = Kind::none; ///< how it went on
    Vec3 from{0.0};         ///< where primitives were gathered (6)
    Vec3 candidate{0.0};    ///< where their forces balance the coupling's (7)
    Vec3 wanted{0.0};       ///< a share of the way there (9), or a step that follows the curvature
    Vec3 to{0.0};           ///< as far as it came
    Stop stop;              ///< of a chord, or of the last leg of a slide
    Vec3 probe{0.0};        ///< that the coupling draws to
    double stiffness_n_per_m = 0.0;     ///< of the coupling
    std::span<const Vec3> way;          ///< corners of the move: `from` to `to`
    std::span<const Leash> leashes;     ///< of the first surfaces that have one, at most 32
    std::span<const Friction> friction; ///< in the order of the planes
    const ContactSet& contacts;         ///< planes of surfaces, then of magnets
    const PrimitiveSet& primitives;     ///< these, and what effects and friction add
    const ProxySolution& solution;      ///< of the primitives; `proxy` is the candidate
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
