// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/scene/scene_description.h>
#include <palpate/haptics/hand/safety_chain.h>
#include <palpate/haptics/hand/velocity_estimator.h>
#include <palpate/haptics/hand/virtual_coupling.h>

namespace palpate {

/// A coupling that a device can hold without giving energy away, and what was changed for it.
struct SafeCoupling {
    VirtualCoupling coupling; ///< the one to use: N/m, N s/m
    std::string warning;      ///< one line of what was lowered and why; empty: nothing was
};

/// The coupling of a scene as far as the device's own damping b pays for it:                [setup]
///   k T/2 + k_d <= b                                            (Colgate & Schenkel 1997)
/// k_d gets half of b at most, k what is left, and no more than the device says it is made for. A
/// device that declares no damping has that alone checked, one that takes no force nothing. What
/// the hand damps is not counted on, and what a delay takes is the safety chain's matter, which
/// softens what proves to give energy.
SafeCoupling safe_coupling(const CouplingDescription& wanted, double rate_hz,
                           const DeviceProperties& device);

/// Settings of the safety chain for a scene's limits on a device, with the stiffness that is used,
/// N/m: the smaller of both forces. Energies, powers and speeds that are allowed are the hand's:
/// in the scene they are `device.scale` times as large. What effects push of themselves, the loop
/// tells the chain frame by frame (SafetyChain::expect). [setup]
SafetySettings safety_settings(const LimitsDescription& limits, double rate_hz,
                               double stiffness_n_per_m, const DeviceProperties& device);

} // namespace palpate
