// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/text/whole_file.h>

#include <cerrno>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <system_error>

#include <unistd.h>

#include <fmt/format.h>

namespace palpate {
namespace {

[[noreturn]] void fail(const std::filesystem::path& file, int error) {
    const std::string reason = std::generic_category().message(error);
    throw std::runtime_error(fmt::format(
        "{}: cannot be written ({}); check that its folder exists, is writable and has room",
        file.string(), reason));
}

/// 0, or the errno of what went wrong.
int write_bytes(const std::filesystem::path& file, std::string_view bytes) {
    std::FILE* stream = std::fopen(file.c_str(), "wb");
    if (stream == nullptr) return errno;
    const bool written = std::fwrite(bytes.data(), 1, bytes.size(), stream) == bytes.size();
    const int write_error = written ? 0 : errno;
    // A full disk may show only when the last buffer is flushed.
    const bool closed = std::fclose(stream) == 0;
    if (!written) return write_error;
    return closed ? 0 : errno;
}

} // namespace

void write_whole_file(const std::filesystem::path& file, std::string_view bytes) {
    // The process id keeps two runs with the same output folder from writing into one temporary.
    std::filesystem::path temporary = file;
    temporary += fmt::format(".part{}", ::getpid());

    int error = write_bytes(temporary, bytes);
    if (error == 0 && std::rename(temporary.c_str(), file.c_str()) != 0) error = errno;
    if (error == 0) return;

    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    fail(file, error);
}

} // namespace palpate
