// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

namespace palpate::internal {

/// A program that was started, with one socket that it reads and writes. It is in a process group
/// of its own, so that a Ctrl-C comes to Palpate alone, and is ended with it, at the latest by the
/// destructor.
class ChildProcess {
public:
    using Clock = std::chrono::steady_clock;
    using GoOn = std::function<bool()>; ///< false: somebody wants to stop

    /// `sockets` are the numbers that the program knows the socket by. What it says on stdout and
    /// stderr, and its temporary files, go to `folder`.                                   [setup]
    /// Throws std::runtime_error where it cannot be started.
    ChildProcess(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                 const std::vector<int>& sockets, const std::filesystem::path& folder);
    ~ChildProcess();
    ChildProcess(const ChildProcess&) = delete;
    ChildProcess& operator=(const ChildProcess&) = delete;

    /// Writes all of it, waiting until `until` for a reader. False: nobody reads any more, or not
    /// in time, or `go_on` said so.                                                      [setup]
    bool write(std::string_view bytes, Clock::time_point until, const GoOn& go_on);
    /// Appends what has come, waiting for it as above. False as above.                    [setup]
    bool read(std::string& bytes, Clock::time_point until, const GoOn& go_on);
    /// Ends what the program reads.                                                       [setup]
    void end_input() noexcept;
    /// Waits for its end: its exit status, as a shell has it (128 and the signal), or nothing.
    /// [setup]
    std::optional<int> wait(Clock::time_point until, const GoOn& go_on);

    /// What it said in its last line, or in the one that it died of; for an error.        [setup]
    std::string last_words() const;

private:
    bool is_ready(short events, Clock::time_point until, const GoOn& go_on) const;

    std::filesystem::path says_;
    pid_t process_ = -1; // -1: it has ended, and that was seen
    int socket_ = -1;
};

/// The first of the programs that there is: a path as it is, a name in the folders of $PATH. Empty:
/// none of them.                                                                         [setup]
std::filesystem::path found_program(const std::vector<std::string>& names);

/// A folder of one's own among the temporary ones; gone with everything in it when this is.
class TemporaryFolder {
public:
    /// In `where`. [setup] Throws std::runtime_error where it cannot be made.
    explicit TemporaryFolder(const std::filesystem::path& where);
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    const std::filesystem::path& path() const noexcept { return path_; } ///< [any]

private:
    std::filesystem::path path_;
};

} // namespace palpate::internal
