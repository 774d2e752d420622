// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include <palpate/geometry/range.h>

namespace palpate::internal {

/// A key of a table in scene files, as the scene's reference describes it.
struct SceneKey {
    std::string_view name;
    std::string_view unit = "";      ///< of its numbers: "N"; empty: none, or no numbers
    std::optional<Range> range = {}; ///< of its numbers, in that unit
    std::string_view fallback = "";  ///< what stands for it where it is missing; "required"
    std::string_view sentence = "";  ///< what it says: one sentence
};

} // namespace palpate::internal
