// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace palpate {

/// Base 64 (RFC 4648, with padding).                                                    [any]
std::string base64(std::string_view bytes);

} // namespace palpate
