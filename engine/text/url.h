// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace palpate {

/// A path as an address has it (RFC 3986): all but letters, digits, "-._~" and "/" as %XX.   [any]
std::string percent_encoded(std::string_view path);

} // namespace palpate
