// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

/// What a scene chooses of contacts, effects and stepping by a word, apart from the classes that do
/// it: a scene's description needs these alone.
namespace palpate {

/// What a surface does when it is pressed harder than its strength (composition.md 2.3).
enum class Yielding : std::uint8_t {
    holds, ///< it gives way with the strength's force, and holds where it was pushed to (play)
    opens, ///< it holds up to its strength, then opens like a membrane until it has been left
};

/// Patterns fill space, fixed in the scene's frame, so that a surface of any shape has them without
/// a parametrisation: h = H/(2 n) sum over n waves (1 - cos(2 pi u.x / wavelength)).
enum class TexturePattern {
    bumps,   ///< three waves, along the scene's axes: crests on a cubic lattice
    grating, ///< one wave, along a direction: grooves across it
};

/// What a polyline does beyond its first and last point.
enum class PolylineEnds {
    open,    ///< it ends there
    closed,  ///< it goes on from the last point to the first
    endless, ///< its first and last piece go on for ever
};

/// What guides the proxy within a frame.
enum class FollowGuide {
    tangent,    ///< the vector at the current proxy, through it: the paper's line, which drifts off
                ///< by a share of each step's square; subdivision divides the drift
    midpoint,   ///< the streamline through the frame's start, by midpoint steps
    streamline, ///< the same by Runge-Kutta steps
};

/// How a frame's movement of the proxy is cut into sub-steps.
enum class SteppingMethod {
    single,   ///< one evaluation: the state before the paper
    paper,    ///< eqs (6)-(10): as many shares as the clock allows
    fixed,    ///< eqs (6), (7), (9) with a given number of shares
    adaptive, ///< full steps with curvature until the residual is below the tolerance
};

} // namespace palpate
