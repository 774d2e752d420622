// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace palpate {

/// A text without control characters, on one line: what a file, a device or an argument says may
/// hold anything, and a terminal obeys it. Each becomes a '?'.                            [any]
std::string plain_text(std::string_view text);

} // namespace palpate
