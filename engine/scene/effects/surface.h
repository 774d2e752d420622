// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <palpate/engine/scene/effects/kind.h>

namespace palpate::effects {

/// A surface of the scene is felt: up to its strength, with the contact that it has.
struct Surface {
    std::string surface = {}; ///< key of SceneDescription::surfaces

    static const internal::EffectRoom<Surface> room;
};

} // namespace palpate::effects
