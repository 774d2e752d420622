// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/haptics/primitives.h>
#include <palpate/haptics/surface_contact.h>

namespace palpate {

/// What stays the same during a frame. Scene frame.
struct FrameContext {
    Vec3 probe{0.0};          ///< x_p: held during the frame, m
    Vec3 start{0.0};          ///< proxy at the frame's start, m: anchor of what depends on the path
    double stiffness = 500.0; ///< k_s, N/m, > 0
    double period_s = 1e-3;   ///< nominal frame period T, not the measured one
};

/// Something to feel that is not a surface with a certificate: adds primitives for the data at the
/// proxy.
class Effect {
public:
    virtual ~Effect() = default;
    /// A frame begins: anchors what depends on the path.                                [loop]
    virtual void begin(const FrameContext& frame) noexcept = 0;
    /// Adds the primitives felt at `proxy`; moves no state.                             [loop]
    virtual void gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept = 0;
    /// The solution for what was gathered last: where the frame is likely to end. Sub-steps are
    /// iterations of one problem, so an effect whose geometry bends towards that end looks there,
    /// wherever the stepping method leaves the proxy meanwhile.                         [loop]
    virtual void solved(const Vec3& end) noexcept { static_cast<void>(end); }
    /// The frame ends at `proxy`.                                                       [loop]
    virtual void commit(const Vec3& proxy) noexcept = 0;
    virtual QueryCount queries() const noexcept = 0; ///< [any]
};

} // namespace palpate
