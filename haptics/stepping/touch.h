// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <palpate/geometry/vec.h>

namespace palpate {

/// One contact of the proxy with a surface, as the last solution of a frame has it. Scene frame.
///
/// A surface holds the proxy by planes: one on smooth ground, up to three in a groove or a corner.
/// Each plane that pushes is one contact. A mesh that alone holds the proxy is one contact also in
/// a groove: then normal and force are of what all its facets do together.
struct Touch {
    /// What a contact is to the frame before.
    enum class Phase : std::uint8_t {
        began,   ///< the surface did not push in the frame before
        goes_on, ///< it pushed in the frame before, too
        ended,   ///< it pushed in the frame before, and does not any more: once for each surface
    };
    std::uint32_t surface = 0;  ///< Scene::surfaces()[surface]
    Phase phase = Phase::began; ///< of the contact with this surface
    Vec3 point{0.0};  ///< m: of the contact's plane, nearest to the proxy; ended: where the proxy
                      ///< was in the frame before
    Vec3 normal{0.0}; ///< unit, out of the surface, to the side of the proxy; ended: of the
                      ///< strongest contact in the frame before
    /// N: what the surface puts on the proxy here, by its strength along the normal and by its
    /// friction across it; ended: 0. All contacts, magnets and effects together balance the
    /// coupling's spring: their forces have the sum k (x* - x_p), with x* the proxy of that
    /// solution and x_p the probe. The frame's proxy is no farther from x* than what the solution
    /// left of its way (FrameReport::residual_m and the step that followed), unless the frame has a
    /// flag that says that it is unfinished (evaluation_cap, stalled), or calmed.
    Vec3 force{0.0};

    friend bool operator==(const Touch&, const Touch&) = default;
};

} // namespace palpate
