// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/haptics/effect.h>

namespace palpate {

/// Brings a proxy to rest that goes to and fro by itself, while the probe stands still or nearly
/// so. Every frame ends where its forces balance, anchored at its start; where effects bend with
/// the way, as a streamline that slips does, the next frame's balance may be the start of the one
/// before, and so on for ever. A spring g/2 |x - x0|^2 towards the frame's start makes of the
/// frames a proximal-point iteration: its steps shorten as k / (k + g), and once g exceeds what the
/// effects bend by, each frame takes energy out. g grows with each turn back, stays while the probe
/// does, and is forgotten as the probe goes on. 0: the frame is untouched.
class Settling {
public:
    /// A new trial.                                                                     [loop]
    void restart() noexcept { *this = {}; }
    /// A frame begins: the stiffness g of the spring towards its start, N/m, >= 0.      [loop]
    double begin(const FrameContext& frame) noexcept;
    /// Whether the probe is where the frame before had it, to the bit, and the proxy where that
    /// frame left it.                                                                   [loop]
    bool held() const noexcept { return held_; }
    /// The frame ends with the proxy at `proxy`, m, scene frame.                        [loop]
    void end(const Vec3& proxy) noexcept;

private:
    bool turned_back(const Vec3& step) const noexcept;
    void look_anew(const Vec3& proxy) noexcept;

    bool begun_ = false;
    bool held_ = false;
    FrameContext frame_;
    double probe_step_m_ = 0.0; // in this frame
    Vec3 end_{0.0};             // of the last frame
    Vec3 last_step_{0.0};       // of the proxy, in the frame before
    double damping_ = 0.0;      // g

    // Since the last turn back.
    Vec3 from_{0.0};
    double way_m_ = 0.0;       // of the proxy
    double probe_way_m_ = 0.0; // of the probe
};

} // namespace palpate
