// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <palpate/haptics/coulomb_friction.h>
#include <palpate/haptics/effect.h>
#include <palpate/haptics/guide_capture.h>
#include <palpate/haptics/surface_contact.h>

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
};

/// The magnets of the surfaces of one loop:
///   sum over surfaces  s_m max(0, -D(x))                                      composition.md 1
/// with D the depth below the surface's own level: the same plane seen from behind, of strength
/// s_m. So a hand that pulls straight off takes the proxy along from h = s_m / k on, and the proxy
/// is at max(0, h - s_m / k). The plane is the one that the surface has found for its contact, and
/// bends the other way. When a magnet has the proxy, GuideCapture says. Friction goes by how the
/// hand presses the proxy on; a magnet that holds does not add to it. Not for two threads at once.
class SurfaceMagnets {
public:
    /// Of each surface, in canonical order; throws std::invalid_argument on settings out of range.
    /// [setup]
    explicit SurfaceMagnets(std::vector<SurfaceMagnet> of_surfaces);

    /// A new trial: no magnet has the proxy.                                              [loop]
    void restart() noexcept;
    /// From the next find() on, its strength is `gain` times its own, [0, 10]; 0: off.  [loop]
    void set_gain(std::size_t surface, double gain) noexcept { gains_[surface] = gain; }
    /// A frame begins: its strengths are those there, and its first find() decides which magnets
    /// have the proxy.                                                                   [loop]
    void begin(const FrameContext& frame) noexcept;
    /// Finds the planes of the surfaces that draw the proxy, before these offer theirs. `pull`:
    /// where the coupling, the forces and the springs draw it, m.                         [loop]
    void find(const Vec3& proxy, const Vec3& pull,
              std::span<SurfaceContact* const> surfaces) noexcept;
    /// Adds them.                                                                         [loop]
    void gather(ContactSet& contacts) const noexcept;
    /// Whether a surface's magnet has the proxy in this frame.                            [loop]
    bool holds(std::size_t surface) const noexcept { return captures_[surface].holds(); }
    /// Whether any could draw the proxy in this frame.                                   [loop]
    bool any_is_on() const noexcept {
        for (std::size_t i = 0; i < captures_.size(); ++i)
            if (is_on(i)) return true;
        return false;
    }
    std::uint64_t samples() const noexcept; ///< of fields that strengths depend on       [any]

private:
    /// Whether it could draw in this frame.
    bool is_on(std::size_t surface) const noexcept {
        return gains_[surface] != 0.0 && captures_[surface].strength_n() > 0.0;
    }

    std::vector<double> gains_;
    std::vector<GuideCapture> captures_;
    std::vector<std::optional<ContactPlane>> found_; // front planes
    bool begins_ = false;
};

} // namespace palpate
