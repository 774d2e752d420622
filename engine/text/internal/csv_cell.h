// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace palpate::internal {

/// A text as one cell of a CSV file, in quotes where it needs them (RFC 4180).            [setup]
inline std::string csv_cell(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string cell = "\"";
    for (const char letter : text) {
        if (letter == '"') cell += '"';
        cell += letter;
    }
    return cell + "\"";
}

} // namespace palpate::internal
