// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <palpate/haptics/choices.h>

namespace palpate {

/// Where the proxy stands with one surface: one table for all contacts.
///
///     state       what is felt              becomes at a frame's end
///     free        its own level, from       in_contact: it pushed back
///                 free_m in front of it     yielded:    pressed above its strength ("holds")
///     in_contact  its own level             free:       it did not push back any more
///                                           yielded:    pressed above its strength ("holds")
///                                           inside:     pressed above its strength ("opens")
///     yielded     the level where it holds  free, in_contact: the proxy is in front of its own
///                                           level again, from whichever side
///     inside      nothing                   free:       the proxy has left it by free_m, on
///                                           whichever side
///
/// A surface of a volume in which a trial begins is `inside` from the start. A mesh holds from
/// within. One that is switched off (gain 0) is `inside` as long as it is. Nothing chatters: play
/// has no threshold to cross, and what has opened closes only a distance away.
enum class SurfaceState : std::uint8_t { free, in_contact, yielded, inside };

/// What a frame came to, seen from one surface.
struct FrameEnd {
    bool felt = false;     ///< its multiplier was above 0 in the last solution
    bool yielded = false;  ///< it reached the strength there, and the surface is one that holds
    bool in_front = false; ///< the proxy is in front of the surface's own level
    bool left = false;     ///< by more than free_m
};

/// The table.                                                                           [any]
constexpr SurfaceState next_state(SurfaceState now, const FrameEnd& end) noexcept {
    if (now == SurfaceState::inside) return end.left ? SurfaceState::free : SurfaceState::inside;
    if (end.yielded) return SurfaceState::yielded;
    if (now == SurfaceState::yielded && !end.in_front) return SurfaceState::yielded;
    return end.felt ? SurfaceState::in_contact : SurfaceState::free;
}

} // namespace palpate
