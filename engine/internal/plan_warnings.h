// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <palpate/engine/effect_plan.h>

namespace palpate::internal {

/// What of the effects that are on will not be felt as a scene says it: primitives beyond what an
/// evaluation has room for, forces beyond the limit. In words, a line each.             [setup]
std::vector<std::string> warnings_of(const SceneDescription& scene, const EffectPlan& plan,
                                     Extraction extraction);

} // namespace palpate::internal
