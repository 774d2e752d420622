// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/text/text_file.h>

#include <cerrno>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <system_error>

#include <fmt/format.h>

#include <palpate/geometry/internal/ordinary_file.h>

namespace palpate {

std::string read_text_file(const std::filesystem::path& file, std::string_view kind) {
    // Opening a folder succeeds; only reading it would fail, without a word.
    std::error_code ignored;
    if (std::filesystem::is_directory(file, ignored))
        throw std::runtime_error(fmt::format("{}: is a folder; name {}", file.string(), kind));
    internal::refuse_pipe_or_device(file);
    errno = 0;
    std::ifstream stream(file, std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    if (!stream.is_open() || stream.bad())
        throw std::runtime_error(fmt::format("{}: cannot be read ({}); check the path",
                                             file.string(),
                                             std::generic_category().message(errno)));
    return text;
}

} // namespace palpate
