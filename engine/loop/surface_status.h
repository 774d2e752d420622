// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace palpate {

/// How the proxy stands with one surface at the end of a frame.
struct SurfaceStatus {
    /// What the surface does to the proxy.
    enum class Standing : std::uint8_t {
        out,          ///< in front of it, or beside it: the surface does not push
        touched,      ///< it pushes, and holds at its own level
        yielding,     ///< it was pressed above its strength: it holds deeper, or gives way now
        open,         ///< not felt until the proxy has left it: a membrane that opened, or a
                      ///< surface that was switched off with the proxy in it
        began_inside, ///< not felt until the proxy has left it: the trial began inside
        off,          ///< not felt: its gain is 0
    };
    Standing standing = Standing::out; ///< what the surface does to the proxy
    /// Its mesh held back what its volume would have let through (contact guarded).
    bool guarded = false;
    /// How far the proxy, not the probe, is behind the surface's own level, m; < 0: in front of
    /// it. Own level: where the scene has it, whatever it yielded, without a texture. Of a volume:
    /// to the level of the field as interpolated, by steps along its slope and then across it, as
    /// foot_on_level() finds it. Of a mesh alone: to its nearest point. Not a number where
    /// neither leads to the surface: farther than kDepthReach_m, where the field is flat, or a mesh
    /// that is off.
    double depth_m = 0.0;

    /// How far from the proxy a level is looked for, m.
    static constexpr double kDepthReach_m = 20e-3;
};

} // namespace palpate
