// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace palpate {

/// Base 64 (RFC 4648, with padding).                                                    [any]
std::string base64(std::string_view bytes);

/// The bytes that a text stands for.                                                    [any]
/// Throws std::invalid_argument where it is not in base 64.
std::string bytes_of_base64(std::string_view text);

} // namespace palpate
