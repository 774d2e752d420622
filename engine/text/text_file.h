// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace palpate {

/// All bytes of a file; `kind` says in messages what was expected, as "a scene file (TOML)".
/// [setup] Throws std::runtime_error "FILE: what is wrong; what to do".
std::string read_text_file(const std::filesystem::path& file, std::string_view kind);

} // namespace palpate
