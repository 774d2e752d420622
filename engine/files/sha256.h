// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace palpate {

/// SHA-256 of a file's bytes, hexadecimal; throws std::runtime_error when it cannot be read.
/// [setup]
std::string sha256_of_file(const std::filesystem::path& file);
/// SHA-256 of a string, hexadecimal.                                                    [any]
std::string sha256_of_text(std::string_view text);

} // namespace palpate
