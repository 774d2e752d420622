// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include <palpate/haptics/contact/surface_contact.h>
#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/effects/surface_magnets.h>
#include <palpate/volume/fields/shared_samples.h>

namespace palpate {

/// What one loop feels, with the state of it: surfaces by name, their finish, effects in
/// Scene::effect_order(). Who of them samples the same field at the same point shares the sample.
struct LoopParts {
    std::vector<std::unique_ptr<SurfaceContact>> contacts;
    std::vector<SurfaceFinish> finish; ///< of each of them
    std::vector<std::unique_ptr<Effect>> effects;
    SharedFields fields; ///< whose samples they share
};

} // namespace palpate
