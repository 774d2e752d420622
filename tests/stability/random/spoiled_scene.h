// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <palpate/engine/scene/scene.h>

namespace palpate::stability {

/// Makes the scene again in code, each time with one value of its description that no scene may
/// have: which of these was taken, though it must be refused; nothing where none was.
std::optional<std::string> spoiled_value_that_is_taken(const SceneDescription& description,
                                                       const SceneResources& resources);

} // namespace palpate::stability
