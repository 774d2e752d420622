// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>

#include <palpate/haptics/contact/softness.h>
#include <palpate/haptics/contact/surface_contact.h>
#include <palpate/haptics/effects/coulomb_friction.h>
#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/effects/guide_capture.h>
#include <palpate/haptics/solver/gain.h>
#include <palpate/volume/fields/stiffness_map.h>

namespace palpate {

/// How a surface draws the proxy onto itself from in front.
struct SurfaceMagnet {
    double strength_n = 0.0; ///< s_m: N, >= 0, finite; 0: none
    double capture_m = 1e-3; ///< it snaps on when the proxy is this near at a frame's start, m, > 0
    StrengthOverField over = {}; ///< with a field: the strength by place, instead of strength_n

    bool none() const noexcept { return strength_n == 0.0; }
};

/// What a surface is like to the touch, beyond its shape and its own strength.
struct SurfaceFinish {
    FrictionCoefficients friction;
    SurfaceMagnet magnet;
    StrengthOverField strength{}; ///< with a field: the surface's by place, N, > 0, no more than
                                  ///< its own and finite
    Softness softness{};          ///< how it gives way below its strength
    std::shared_ptr<const StiffnessMap> stiffness{}; ///< of what is soft, by place: what lies
                                                     ///< beneath it; null: the same everywhere
    double strength_n = std::numeric_limits<double>::infinity(); ///< its own, N, > 0: asked for
                                                                 ///< where it is soft
};

/// The magnet of one surface, as a loop feels it:
///   s_m max(0, -D(x))                                                          composition.md 1
/// with D the depth below the surface's own level: the same plane seen from behind, of strength
/// s_m. So a hand that pulls straight off takes the proxy along from h = s_m / k on, and the proxy
/// is at max(0, h - s_m / k). The plane is the one that the surface has found for its contact, and
/// bends the other way. When a magnet has the proxy, GuideCapture says. Friction goes by how the
/// hand presses the proxy on; a magnet that holds does not add to it. Not for two threads at once.
class LoopMagnet {
public:
    /// Throws std::invalid_argument on settings out of range.                             [setup]
    explicit LoopMagnet(const SurfaceMagnet& magnet);

    /// What it remembers from frame to frame.
    struct State {
        Gain gain;
        GuideCapture::State capture;
    };
    State save_state() const noexcept { return {gain_, capture_.save_state()}; } ///< [setup]
    void restore_state(const State& state) noexcept {                            ///< [setup]
        gain_ = state.gain;
        capture_.restore_state(state.capture);
    }

    /// A new trial: it does not have the proxy.                                           [loop]
    void restart() noexcept { capture_.restart(); }
    /// From the next offer() on, its strength is its own with this gain.                  [loop]
    void set_gain(const Gain& gain) noexcept { gain_ = gain; }
    /// A frame begins: its strength is the one there, and its first offer() decides whether it has
    /// the proxy.                                                                         [loop]
    void begin(const FrameContext& frame) noexcept;
    /// The surface offers its planes at `proxy`, and with them finds the magnet's, if that draws
    /// the proxy. `pull`: where the coupling, the forces and the springs draw it, m.       [loop]
    void offer(const Vec3& proxy, const Vec3& pull, SurfaceContact& surface,
               ContactSet& contacts) noexcept;
    /// Adds its own plane. [loop]
    void gather(ContactSet& contacts) const noexcept;
    /// Whether it has the proxy in this frame.                                            [loop]
    bool holds() const noexcept { return capture_.holds(); }
    /// Whether it could draw the proxy in this frame.                                     [loop]
    bool is_on() const noexcept { return !gain_.off() && capture_.strength_n() > 0.0; }
    std::uint64_t samples() const noexcept { return capture_.samples(); } ///< of its field [any]

private:
    Gain gain_;
    GuideCapture capture_;
    std::optional<ContactPlane> found_; // the front plane
    bool begins_ = false;               // nothing found in this frame yet
};

} // namespace palpate
