// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace palpate {

/// White space by the C locale.                                                         [any]
bool is_blank(char c) noexcept;

/// The text without blanks around it.                                                   [any]
std::string trimmed(const std::string& text);

/// The text with '?' for what is not UTF-8 or not printable, without blanks around it: names go to
/// reports and terminals.                                                                 [any]
std::string printable(const std::string& text);

} // namespace palpate
