// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <any>
#include <cstddef>
#include <cstdint>

#include <palpate/haptics/contact/query_count.h>
#include <palpate/haptics/solver/primitives.h>

namespace palpate {

/// What stays the same during a frame. Scene frame.
struct FrameContext {
    Vec3 probe{0.0};          ///< x_p: held during the frame, m
    Vec3 start{0.0};          ///< proxy at the frame's start, m: anchor of what depends on the path
    double stiffness = 500.0; ///< k_s, N/m, > 0
    double period_s = 1e-3;   ///< nominal frame period T, not the measured one
    double force_limit_n = 5.0; ///< the longest force that the device is sent, N, > 0
    bool after_silence = false; ///< the frames before had no state of the device: the probe took
                                ///< more than one period to come here
    double gain = 1.0; ///< what the loop multiplies the effect's strengths and forces with in this
                       ///< frame, (0, 10]
    // Set by Subdivision.
    bool held = false;  ///< probe and proxy are where the last frame left them, to the bit
    bool looks = false; ///< held, and the first evaluation moves nothing: an effect that bends with
                        ///< the way is gathered at the proxy, to see whether the proxy rests
    bool rests = false; ///< held, and the proxy has nearly stopped: it keeps its bits
};

/// Surfaces that the bits of a frame tell apart, in canonical order; those behind them are felt,
/// and not told apart.
inline constexpr std::size_t kFeltBits = 64;
/// The bit of a surface; 0 behind the last.                                              [any]
constexpr std::uint64_t felt_bit(std::size_t surface) noexcept {
    return surface < kFeltBits ? std::uint64_t{1} << surface : 0;
}

/// How a frame ended.
struct FrameOutcome {
    Vec3 proxy{0.0};        ///< m
    std::uint64_t felt = 0; ///< felt_bit(i): surface i pushed back at the end
};

/// Something to feel that is not a surface with a certificate. It adds primitives for the data at
/// the proxy. To add an effect of your own, implement this class and give the effect to the loop
/// (docs/architecture.md). The loop scales what it adds by its gain. At gain 0 the loop calls only
/// restart(), queries(), and what saves its state. As the gain rises again, restart() comes first.
class Effect {
public:
    virtual ~Effect() = default;
    /// A new trial begins, or the effect is switched on again, with the proxy at `proxy`. [loop]
    virtual void restart(const Vec3& proxy) noexcept { static_cast<void>(proxy); }
    /// A frame begins: anchors what depends on the path.                                [loop]
    virtual void begin(const FrameContext& frame) noexcept = 0;
    /// Adds the primitives felt at `proxy`. May change only counters and what begin() resets: the
    /// memory from one evaluation of a frame to the next, as CurveGuide has it.         [loop]
    virtual void gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept = 0;
    /// `end` is the solution for what was gathered last: the frame will probably end there.
    /// Sub-steps are iterations of one problem. So an effect whose geometry bends along the way
    /// should look at `end`, and not at where the stepping method has put the proxy.     [loop]
    virtual void solved(const Vec3& end) noexcept { static_cast<void>(end); }
    /// Where a frame that wants to end at `wanted` may end, m, scene frame: there, or at the
    /// nearest point of a region that this effect, as gathered last, never lets the proxy leave.
    /// [loop]
    virtual Vec3 within(const Vec3& wanted) const noexcept { return wanted; }
    /// The frame has ended.                                                             [loop]
    virtual void commit(const FrameOutcome& outcome) noexcept { static_cast<void>(outcome); }
    /// Force on the device beside the coupling's, N, scene frame, of the frame just committed: what
    /// a hand feels whatever holds the proxy.                                           [loop]
    virtual Vec3 device_force_n() const noexcept { return Vec3{0.0}; }
    /// The longest force with which the effect pushes by itself: on a hand that holds still and has
    /// not pressed, N, >= 0, at gain 1. A push or a weight counts. A spring does not, because the
    /// hand can go to where it rests. A device with motors gets no force until the wanted force is
    /// small. This number raises the limit of "small" (SafetyChain::expect). An effect that pushes
    /// all the time with more than 0.2 N and says 0 here keeps the device waiting for ever. [loop]
    virtual double unasked_force_n() const noexcept { return 0.0; }
    /// Whether the effect may move or shake a hand that has put in no energy: it draws from a
    /// distance, or it rings. A device with motors then allows it some power. An effect that pushes
    /// by itself gets that power anyway. If an effect is active and also pushes by itself, the loop
    /// takes it for one that moves, as a pulse does, and calms no frame (Calming).       [loop]
    virtual bool is_active() const noexcept { return false; }
    /// Whether all that it does to the proxy is to push it with one force, the same wherever the
    /// frame ends, or nothing. No is always right, and may cost more (docs/palpation.md). [any]
    virtual bool only_pushes() const noexcept { return false; }
    /// The highest tone that it gives the device, Hz, >= 0: a loop needs more than two frames for
    /// each of its periods, else another tone is felt; it refuses the effect there.      [any]
    virtual double highest_tone_hz() const noexcept { return 0.0; }
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
