// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/text/whole_file.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

#include <fmt/format.h>

namespace palpate {
namespace {

constexpr int kMostTries = 100; // names of temporary files

[[noreturn]] void fail(const std::filesystem::path& file, int error) {
    const std::string reason = std::generic_category().message(error);
    throw std::runtime_error(fmt::format(
        "{}: cannot be written ({}); check that its folder exists, is writable and has room",
        file.string(), reason));
}

/// Into a file that is not there yet. 0, or the errno of what went wrong.
int write_bytes(const std::filesystem::path& file, std::string_view bytes) {
    constexpr mode_t kMode = 0666; // and what the process' mask leaves of it
    const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kMode);
    if (descriptor < 0) return errno;
    std::FILE* stream = ::fdopen(descriptor, "wb");
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
    // The process id and the count keep two runs with the same output folder, and two threads, from
    // writing into one temporary; what somebody else has put there under that name is left alone.
    static std::atomic<unsigned> count{0};
    std::filesystem::path temporary;
    int error = EEXIST;
    for (int tries = 0; error == EEXIST && tries < kMostTries; ++tries) {
        temporary = file;
        temporary += fmt::format(".part{}-{}", ::getpid(), count++);
        error = write_bytes(temporary, bytes);
    }
    if (error == EEXIST) fail(file, error);
    if (error == 0 && std::rename(temporary.c_str(), file.c_str()) != 0) error = errno;
    if (error == 0) return;

    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    fail(file, error);
}

} // namespace palpate
