// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <palpate/engine/scene/baked_surface.h>

namespace palpate::internal {

/// The inverse of baked_as_json(): everything but field, grid and key.                  [setup]
/// Throws what nlohmann's parser throws on other text.
BakedSurface baked_from_json(const std::string& text);

} // namespace palpate::internal
