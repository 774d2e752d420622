// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

namespace palpate {

/// Writes `bytes` under a temporary name beside `file` and renames it, so that a half-written file
/// never has the final name. An older file of that name is replaced; on failure it stays as it was.
/// [setup] Throws std::runtime_error "FILE: what is wrong; what to do".
void write_whole_file(const std::filesystem::path& file, std::string_view bytes);

} // namespace palpate
