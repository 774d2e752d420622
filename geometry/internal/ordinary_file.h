// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>

namespace palpate::internal {

/// Whether to open a file would wait for whoever writes to it, maybe for ever: a named pipe. What a
/// shell opens for a program, /dev/stdin or <(...), has a writer.                        [setup]
inline bool is_named_pipe(const std::filesystem::path& file) {
    std::error_code ignored;
    const std::string path = file.string();
    return !path.starts_with("/dev/") && !path.starts_with("/proc/") &&
           std::filesystem::is_fifo(file, ignored);
}

/// Throws std::runtime_error where a file is a named pipe, or a device, which may have no end as
/// /dev/zero has none.                                                                  [setup]
inline void refuse_pipe_or_device(const std::filesystem::path& file) {
    if (is_named_pipe(file))
        throw std::runtime_error(
            file.string() +
            ": is a named pipe; copy what comes out of it to a file, and name that");
    std::error_code ignored;
    if (std::filesystem::is_character_file(file, ignored) ||
        std::filesystem::is_block_file(file, ignored))
        throw std::runtime_error(file.string() + ": is a device and no file; name a file");
}

} // namespace palpate::internal
