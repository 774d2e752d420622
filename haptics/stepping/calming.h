// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <palpate/haptics/effects/effect.h>

namespace palpate {

/// Brings a proxy to rest that goes to and fro by itself, while the probe stands still or nearly
/// so. Every frame ends where its forces balance, anchored at its start; where effects bend with
/// the way, as a streamline that slips does, the next frame's balance may be the start of the one
/// before, and so on for ever. A spring g/2 |x - x0|^2 towards the frame's start makes of the
/// frames a proximal-point iteration: its steps shorten as k / (k + g), and once g exceeds what the
/// effects bend by, each frame takes energy out. g grows with each turn back, and then with each
/// frame that the probe stands still; it is forgotten as the probe goes on. With g = 0 the frame is
/// solved as it is. A frame whose sub-steps go to and fro without getting on counts as a turn back,
/// too: a method that does not seek the balance may end each of its frames a little farther on.
///
/// A proxy that has all but stopped under a held probe keeps its bits from then on, until what is
/// asked of it there changes. It then goes on, and may come to rest elsewhere. Where it has come
/// back to where it has been several times, it stays until the probe moves.
class Calming {
public:
    /// `tolerance_m`: what the loop may leave of a way, m, > 0.                         [setup]
    explicit Calming(double tolerance_m) noexcept : tolerance_m_(tolerance_m) {}

    /// A new trial.                                                                     [loop]
    void restart() noexcept { *this = Calming(tolerance_m_); }
    /// A frame begins: takes its measures for it.                                       [loop]
    void begin(const FrameContext& frame) noexcept;
    /// For what is calmed under a held probe alone. Returns whether the probe is where it was: then
    /// the frame is to begin(). Else all but the probe is forgotten, at next to no cost. [loop]
    bool follow_probe(const Vec3& probe) noexcept {
        if (probe == frame_.probe) return true;
        if (begun_) restart();
        frame_.probe = probe;
        return false;
    }
    /// Whether the frame has begun: then it is to be ended.                             [loop]
    bool begun() const noexcept { return begun_; }
    /// The stiffness g of the frame's spring towards its start, N/m, >= 0.              [loop]
    double spring_n_per_m() const noexcept { return spring_n_per_m_; }
    /// Whether the probe is where the frame before had it, to the bit, and the proxy where that
    /// frame left it.                                                                   [loop]
    bool held() const noexcept { return held_; }
    /// Whether it has all but stopped, so that rests() is likely.                       [loop]
    bool stopped() const noexcept;
    /// Whether the proxy is at rest, and the frame over, though its first evaluation asks for
    /// `asked` (m, scene frame): nothing that the probe's standing still has not asked for before,
    /// within the tolerance; or it has come back too often.                               [loop]
    bool rests(const Vec3& asked) noexcept;
    /// What has all but stopped is reached in this frame by what will ask more of it, as a tissue
    /// that comes back: its rest is taken anew.                                          [loop]
    void stir() noexcept {
        if (stopped() && !has_come_back_too_often()) wake();
    }
    /// Whether it stays for that, whatever is asked, until the probe moves.             [loop]
    bool has_come_back_too_often() const noexcept;
    /// The frame ends with the proxy at `proxy`, m, scene frame, after a walk of `walked_m` (m, >=
    /// 0; 0 where the frame has found its balance; taken note of while held() alone); `slowness` >=
    /// 1: how many times shorter its media made its way. [loop]
    void end(const Vec3& proxy, double walked_m, double slowness) noexcept;

private:
    bool turned_back(const Vec3& step) const noexcept;
    void wake() noexcept;
    void look_anew(const Vec3& proxy) noexcept;

    double tolerance_m_;
    bool begun_ = false;
    bool held_ = false;
    FrameContext frame_;
    double probe_step_m_ = 0.0;   // in this frame
    Vec3 end_{0.0};               // of the last frame
    Vec3 last_step_{0.0};         // of the proxy, where it moved last
    double probe_since_m_ = 0.0;  // the probe's way since then
    double damping_ = 0.0;        // g, as the next frame begins with it
    double spring_n_per_m_ = 0.0; // g in this frame
    int still_ = 0;               // frames in a row that hardly moved the proxy
    int in_vain_ = 0;             // held frames in a row that walked and got nowhere
    int rested_ = 0;              // frames of the rest
    Vec3 asked_{0.0};             // in its second frame, when all is as the first has left it

    // Since the probe is held.
    std::optional<Vec3> first_rest_; // where the proxy rested first, and went on
    double farthest_m_ = 0.0;        // how far from there it has rested since
    int returns_ = 0;                // how often it has rested no farther away, and went on

    // Since the last turn back.
    Vec3 from_{0.0};
    double way_m_ = 0.0;       // of the proxy
    double probe_way_m_ = 0.0; // of the probe
};

} // namespace palpate
