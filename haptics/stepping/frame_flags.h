// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace palpate {

/// What may happen in a frame: bits of FrameReport::flags. No flag reads a clock. What the clock
/// decided for method `paper` is recorded, so a replay has the same flags.
enum FrameFlag : std::uint32_t {
    kProbeNotFinite = 1u << 0,
    kEvaluationCap = 1u << 1,
    kStalled = 1u << 2,
    kInsideAtStart = 1u << 3,
    kForceClamped = 1u << 4,
    kForceSlewed = 1u << 5,
    kSolverCap = 1u << 6,
    kPrimitivesFull = 1u << 7,
    kForceNotFinite = 1u << 8,
    kLiveGain = 1u << 9,
    kDeviceStale = 1u << 10,
    kProbeJumped = 1u << 11,
    kWaitsForSmallForce = 1u << 12,
    kRampsIn = 1u << 13,
    kEnergyBounded = 1u << 14,
    kEnergyExceeded = 1u << 15,
    kSoftened = 1u << 16,
    kCalmed = 1u << 17,
    kBodyMoved = 1u << 18,
    kBodyHeldBack = 1u << 19,
    kSceneAdopted = 1u << 20,
};

/// A flag with its name in files, what it means and what to do about it.
struct FrameFlagText {
    FrameFlag flag;      ///< one bit
    const char* name;    ///< as summaries, recordings and messages spell it
    const char* meaning; ///< one line: what it means; what to do
};

/// Every flag, in the order of their bits.
inline constexpr std::array<FrameFlagText, 21> kFrameFlagTexts{{
    {kProbeNotFinite, "probe_not_finite",
     "the device gave a position that is not a number, or 1000 km away and more: proxy held, force "
     "to zero; check the device or path"},
    {kEvaluationCap, "evaluation_cap",
     "the proxy is certified but not at its end yet and goes on in the next frame; move slower, "
     "raise the cap, or use fewer effects in one place"},
    {kStalled, "stalled",
     "no certified step was left towards the probe: the proxy stays; where it lasts, lead the "
     "probe "
     "out of the groove or smooth the volume more"},
    {kInsideAtStart, "inside_at_start",
     "the trial began inside a surface, which is not felt until the proxy has left it; begin in "
     "free space"},
    {kForceClamped, "force_clamped",
     "the coupling's force exceeded limits.force_n and was shortened to it; press less deep, lower "
     "the stiffness or raise the limit"},
    {kForceSlewed, "force_slewed",
     "the force changed faster than limits.slew_n_per_s and was held back; move slower or raise "
     "the "
     "limit"},
    {kSolverCap, "solver_cap",
     "the solver ran into its iteration cap: forces may not balance in this frame, the certificate "
     "still holds; where it lasts, use fewer effects in one place"},
    {kPrimitivesFull, "primitives_full",
     "more haptic primitives than the fixed capacity: the last ones were left out; use fewer "
     "effects at one place"},
    {kForceNotFinite, "force_not_finite",
     "a force, a place or a primitive was not a number: the force was led to zero; check effects "
     "of your own, else report it"},
    {kLiveGain, "live_gain",
     "an effect was weaker, stronger or off, as its gain had been changed while the loop ran: such "
     "a run cannot be replayed; leave the gains at 1 where it must be"},
    {kDeviceStale, "device_stale",
     "the device was silent, or the loop late, for longer than may be, or the run was ending: "
     "force "
     "to zero; check cable and load, then move to where little force is wanted"},
    {kProbeJumped, "probe_jumped",
     "the probe moved faster than a hand can: force to zero; check the device's encoders and "
     "calibration"},
    {kWaitsForSmallForce, "waits_for_small_force",
     "after the start or a fault no force is sent before little is wanted; move the probe out of "
     "what it is in"},
    {kRampsIn, "ramps_in", "after the start or a fault the force comes back by and by; go on"},
    {kEnergyBounded, "energy_bounded",
     "the force would have given the hand more energy than it has put in: what pushed along with "
     "the movement was taken away; where it lasts, lower the stiffness"},
    {kEnergyExceeded, "energy_exceeded",
     "the hand got more energy than the bound and its reserve: force to zero; lower the stiffness, "
     "or declare the device's delay"},
    {kSoftened, "softened",
     "the coupling was softer than the scene says, as it had given too much energy; lower the "
     "stiffness, or declare the device's damping and delay"},
    {kCalmed, "calmed",
     "the proxy went to and fro by itself, though the probe hardly moved: it was slowed down until "
     "it rests, which may be before the forces balance; where it lasts, press less deep, weaken "
     "one "
     "of the effects that hold it, or try another method"},
    {kBodyMoved, "body_moved",
     "a body was not where the scene has it, as its pose had been set while the loop ran: such a "
     "run cannot be replayed; leave the bodies in their places where it must be"},
    {kBodyHeldBack, "body_held_back",
     "a body did not reach the pose that was set, as the proxy had no place left between it and "
     "another surface: it is felt where it could go to, and goes on in the next frame; let the "
     "hand "
     "give way, or move the bodies apart"},
    {kSceneAdopted, "scene_adopted",
     "from this frame on another scene is felt: such a run cannot be replayed; record a run for "
     "each scene where it must be"},
}};

/// Whether a frame with these flags looked for surfaces. In one without a place of the hand, or a
/// late one, nothing is felt wherever the hand is, and the proxy stays. [any]
constexpr bool is_computed(std::uint32_t flags) noexcept {
    return (flags & (kDeviceStale | kProbeNotFinite)) == 0;
}

/// What a frame says that felt something else than its scene and its inputs tell: it cannot be
/// computed again from these. [any]
inline constexpr std::uint32_t kNotRepeatable = kLiveGain | kBodyMoved | kSceneAdopted;

} // namespace palpate
