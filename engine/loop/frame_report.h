// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include <palpate/geometry/vec.h>
#include <palpate/haptics/stepping/frame_flags.h>

namespace palpate {

/// All that a frame tells: recorder, benchmarks, command and tests read this one struct. Scene
/// frame, SI.
struct FrameReport {
    std::uint64_t frame = 0; ///< from 0
    std::uint32_t trial = 0; ///< from 0; a trial begins with the proxy at the probe
    double time_s = 0.0;     ///< the device's time of this frame
    Vec3 probe{0.0};         ///< m, as the device gave it
    Vec3 proxy{0.0};         ///< m, after the frame
    Vec3 force{0.0};         ///< N, as it is sent: after the limits

    std::uint32_t sub_steps = 0;     ///< movements of the proxy that were accepted
    std::uint32_t evaluations = 0;   ///< gatherings of primitives with one solution each
    std::uint32_t contacts = 0;      ///< primitives with a multiplier > 0 in the last solution,
                                     ///< without the lines of friction
    double residual_m = 0.0;         ///< length of the last movement that the solver asked for
    std::uint32_t flags = 0;         ///< FrameFlag bits
    std::uint64_t surfaces_felt = 0; ///< bit i: Scene::surfaces()[i], up to 64, pushed back at the
                                     ///< end
    std::uint64_t surfaces_open = 0; ///< bit i: it did not hold at its own level, as the proxy was
                                     ///< inside or it yielded; not recorded
    std::uint64_t surfaces_guarded = 0; ///< bit i: its mesh held back what its volume would have
                                        ///< let through; not recorded

    std::uint32_t field_samples = 0;   ///< values or gradients read from fields
    std::uint32_t surface_queries = 0; ///< Embree rays and closest points
    std::uint32_t root_queries = 0;    ///< exact first roots
    std::uint32_t work = 0;   ///< what evaluations and solvers spent of the frame's budget, in
                              ///< Subdivision::kWorkOfSolvers' units; not recorded
    double spent_us = 0.0;    ///< around frame(); not deterministic
    double estimate_us = 0.0; ///< of a sub-step, eq. (10); 0 where the method needs none
    double late_us = 0.0;     ///< start of the frame after its deadline; 0 at asap pace

    // Of a soft surface (docs/palpation.md), where one is pressed: then the proxy is the tip.
    double indentation_m = 0.0; ///< how far the tip is behind the surface, m; 0: none is pressed;
                                ///< also where the tip has left a tissue that comes back slowly
    double stiffness_n_per_m = 0.0;    ///< that the hand feels there, N/m
    std::uint32_t pressed_surface = 0; ///< Scene::surfaces()[pressed_surface]: of several the one
                                       ///< that is pressed in farthest
    Vec3 front{0.0};                   ///< m: the place of the surface from which it is pressed in
};

/// Where the proxy of a frame is on the surface, m: the front of one that is soft.      [any]
inline const Vec3& place_on_surface(const FrameReport& frame) noexcept {
    return frame.indentation_m > 0.0 ? frame.front : frame.proxy;
}

/// Whether a soft surface is pressed in any of these frames.                            [any]
inline bool presses_a_soft_surface(std::span<const FrameReport> frames) noexcept {
    return std::any_of(frames.begin(), frames.end(),
                       [](const FrameReport& frame) { return frame.indentation_m > 0.0; });
}

} // namespace palpate
