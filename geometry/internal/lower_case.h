// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <string>

namespace palpate::internal {

/// The text with small letters for the capital ones of ASCII.                           [any]
inline std::string lower_case(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return text;
}

/// A file's ending in small letters, as ".ply"; empty where it has none.                [any]
inline std::string lower_case_ending(const std::filesystem::path& file) {
    return lower_case(file.extension().string());
}

} // namespace palpate::internal
