// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace palpate {

/// White space by the C locale.                                                         [any]
bool is_blank(char c) noexcept;

/// The part of `text` without blanks around it.                                         [any]
std::string_view trimmed(std::string_view text) noexcept;

/// The text with '?' for what is not UTF-8 or not printable, without blanks around it: names go to
/// reports and terminals.                                                                 [any]
std::string printable(const std::string& text);

} // namespace palpate
