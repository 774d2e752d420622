// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <any>
#include <cstddef>
#include <cstdint>

#include <palpate/haptics/contact/surface_contact.h>
#include <palpate/haptics/solver/primitives.h>

namespace palpate {

/// What stays the same during a frame. Scene frame.
struct FrameContext {
    Vec3 probe{0.0};          ///< x_p: held during the frame, m
    Vec3 start{0.0};          ///< proxy at the frame's start, m: anchor of what depends on the path
    double stiffness = 500.0; ///< k_s, N/m, > 0
    double period_s = 1e-3;   ///< nominal frame period T, not the measured one
    double force_limit_n = 5.0; ///< the longest force that the device is sent, N, > 0
    bool after_silence = false; ///< frames without a device's state came before this one: the probe
                                ///< came here in more than a period
    bool held = false;  ///< Subdivision's: the probe is where it was in the frame before, to the
                        ///< bit, and the proxy where that frame left it
    bool looks = false; ///< Subdivision's: so held, the first evaluation moves nothing. What bends
                        ///< is gathered where the proxy is, to see whether it rests
    bool rests = false; ///< Subdivision's: so held, it has all but stopped and keeps its bits
};

/// How a frame ended.
struct FrameOutcome {
    Vec3 proxy{0.0};        ///< m
    std::uint64_t felt = 0; ///< bit i: surface i (canonical order, up to 64) pushed back at the end
};

/// Something to feel that is not a surface with a certificate: adds primitives for the data at the
/// proxy. Adding one's own is to implement this and hand it to the loop (docs/architecture.md).
/// What it adds is scaled by its gain outside; while that is 0, nothing here is called, and
/// restart() comes first where it goes on.
class Effect {
public:
    virtual ~Effect() = default;
    /// A new trial, or it was switched off: the proxy is at a new place.                 [loop]
    virtual void restart(const Vec3& proxy) noexcept { static_cast<void>(proxy); }
    /// A frame begins: anchors what depends on the path.                                [loop]
    virtual void begin(const FrameContext& frame) noexcept = 0;
    /// Adds the primitives felt at `proxy`. Moves nothing but counters and the iteration memory of
    /// a frame, as CurveGuide, VectorFollow, VectorSheet and WorkspaceSphere have one, which
    /// begin() starts anew. [loop]
    virtual void gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept = 0;
    /// The solution for what was gathered last: where the frame is likely to end. Sub-steps are
    /// iterations of one problem, so an effect whose geometry bends towards that end looks there,
    /// wherever the stepping method leaves the proxy meanwhile.                         [loop]
    virtual void solved(const Vec3& end) noexcept { static_cast<void>(end); }
    /// Where a frame at `wanted` (m, scene frame) may end: there, or at the nearest place that the
    /// effect, as gathered last, never lets the proxy leave.                            [loop]
    virtual Vec3 within(const Vec3& wanted) const noexcept { return wanted; }
    /// The frame has ended.                                                             [loop]
    virtual void commit(const FrameOutcome& outcome) noexcept { static_cast<void>(outcome); }
    /// Force on the device beside the coupling's, N, scene frame, of the frame just committed: what
    /// a hand feels whatever holds the proxy.                                           [loop]
    virtual Vec3 device_force_n() const noexcept { return Vec3{0.0}; }
    /// The longest force that it may exert in these frames on a hand that holds still and has not
    /// pressed, N, >= 0, at gain 1: a push, a weight; what has a rest position that the hand may go
    /// to, as a spring, does not count. A device with motors is sent no force until little is
    /// wanted, and this is what is taken for little: an effect that pushes and says 0 here is never
    /// felt on one.                                                                      [loop]
    virtual double unasked_force_n() const noexcept { return 0.0; }
    /// Whether it may move a hand that has put in no energy, or shake one: draws it from a
    /// distance, rings. On a device with motors some power is then allowed. What pushes unasked is
    /// active anyway. [loop]
    virtual bool is_active() const noexcept { return false; }
    /// How many planes, lines and points it adds in an evaluation at most; forces and springs need
    /// no room.                                                                          [setup]
    virtual std::size_t most_primitives() const noexcept { return 1; }
    virtual QueryCount queries() const noexcept = 0; ///< [any]

    // The state of a loop is a value (HapticLoop::save(), restore()), and what an effect remembers
    // from one frame to the next is a part of it. One that remembers nothing, or nothing but what
    // begin() takes anew, has nothing to write here. One that does keeps it in a struct, say State
    // now_, and writes
    //   std::any save_state() const override { return now_; }
    //   void restore_state(const std::any& state) override {
    //       now_ = std::any_cast<const State&>(state);
    //   }
    // That nothing else is remembered is the effect's promise, and nobody checks it: one that
    // remembers without saying so goes on after a restore() from where it is, not from where it
    // was, and the frames are not those that followed the save().

    /// A copy of all that it remembers between frames, but for queries(); empty where that is
    /// nothing. Between frames.                                                         [setup]
    virtual std::any save_state() const { return {}; }
    /// From here on it remembers what save_state() gave, of itself or of an effect that was made
    /// alike. Between frames; need not allocate. May throw, and then the loop has to be restored
    /// again, from another state.                                                       [setup]
    virtual void restore_state(const std::any& state) { static_cast<void>(state); }
};

} // namespace palpate
