// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace palpate::test {

/// What a run of the command left behind.
struct CommandResult {
    int exit = -1;  ///< exit code; -1 where a signal ended it
    int signal = 0; ///< that ended it, else 0
    std::string out;
    std::string err;

    std::size_t times(std::string_view words) const {
        std::size_t count = 0;
        for (std::size_t at = 0; (at = err.find(words, at)) != std::string::npos; ++at)
            ++count;
        return count;
    }
};

/// The command that this build made, started in a folder of its own with a cache of its own.
class CommandRun : public testing::Test {
    TemporaryFolder folder_;

protected:
    const std::filesystem::path& folder() const { return folder_.path(); }
    std::filesystem::path operator/(const std::string& name) const { return folder_ / name; }

    /// Starts it; the child's id.
    pid_t start(const std::vector<std::string>& arguments) {
        const pid_t child = ::fork();
        if (child != 0) return child;
        if (::chdir(folder().c_str()) != 0) ::_exit(126);
        ::setenv("PALPATE_CACHE", cache.c_str(), 1);
        ::dup2(::open(standard_out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDOUT_FILENO);
        ::dup2(::open("err.txt", O_WRONLY | O_CREAT | O_TRUNC, 0600), STDERR_FILENO);
        std::vector<char*> argv{const_cast<char*>(PALPATE_COMMAND)};
        for (const std::string& argument : arguments)
            argv.push_back(const_cast<char*>(argument.c_str()));
        argv.push_back(nullptr);
        ::execv(PALPATE_COMMAND, argv.data());
        ::_exit(127);
    }

    CommandResult end(pid_t child) {
        int status = 0;
        while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
        }
        CommandResult result;
        if (WIFEXITED(status)) result.exit = WEXITSTATUS(status);
        if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
        result.out = content_of(folder_ / "out.txt");
        result.err = content_of(folder_ / "err.txt");
        return result;
    }

    CommandResult run(const std::vector<std::string>& arguments) { return end(start(arguments)); }

    /// Waits until a file is there and has so many bytes; false after twenty seconds.
    bool has_grown(const std::filesystem::path& file, std::uintmax_t bytes) const {
        for (int i = 0; i < 2000; ++i) {
            std::error_code error;
            const std::uintmax_t size = std::filesystem::file_size(file, error);
            if (!error && size >= bytes) return true;
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        return false;
    }

    void make(const std::string& name, const std::string& text) const {
        make_file(folder_ / name, text);
    }

    std::filesystem::path cache = folder_ / "cache";
    std::string standard_out = "out.txt"; ///< where the command's stdout leads
};

} // namespace palpate::test
