// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <nlohmann/json.hpp>

#include <palpate/engine/view/view_document.h>

namespace palpate::internal {

/// Marks as a page is told of them, docs/view_protocol.md.                                [setup]
nlohmann::json marks_for_page(const std::vector<ViewMark>& marks);

} // namespace palpate::internal
