// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/internal/child_process.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <thread>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

namespace palpate::internal {
namespace {

constexpr std::chrono::milliseconds kLook{50}; // between two looks whether somebody wants to stop

/// What posix_spawn() is told. Its functions fail for want of memory alone.
class SpawnPlan {
public:
    SpawnPlan() {
        posix_spawn_file_actions_init(&files_);
        posix_spawnattr_init(&how_);
        posix_spawnattr_setflags(&how_, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF |
                                            POSIX_SPAWN_SETSIGMASK);
        sigset_t signals;
        sigemptyset(&signals);
        posix_spawnattr_setsigmask(&how_, &signals);
        for (const int signal : {SIGPIPE, SIGINT, SIGTERM, SIGHUP, SIGXFSZ})
            sigaddset(&signals, signal);
        posix_spawnattr_setsigdefault(&how_, &signals);
    }
    ~SpawnPlan() {
        posix_spawn_file_actions_destroy(&files_);
        posix_spawnattr_destroy(&how_);
    }
    SpawnPlan(const SpawnPlan&) = delete;
    SpawnPlan& operator=(const SpawnPlan&) = delete;

    void lead(int from, int to) { posix_spawn_file_actions_adddup2(&files_, from, to); }
    void open(int number, const char* file, int flags) {
        constexpr mode_t own = 0600;
        posix_spawn_file_actions_addopen(&files_, number, file, flags, own);
    }
    int start(pid_t& process, const std::filesystem::path& program,
              std::vector<std::string> arguments, std::vector<std::string> environment) {
        return posix_spawn(&process, program.c_str(), &files_, &how_, pointers(arguments).data(),
                           pointers(environment).data());
    }

private:
    /// As C has them, while the words live.
    static std::vector<char*> pointers(std::vector<std::string>& words) {
        std::vector<char*> found;
        found.reserve(words.size() + 1);
        for (std::string& word : words)
            found.push_back(word.data());
        found.push_back(nullptr);
        return found;
    }

    posix_spawn_file_actions_t files_{};
    posix_spawnattr_t how_{};
};

/// Ours, with another folder for temporary files.
std::vector<std::string> environment_with(const std::filesystem::path& folder) {
    constexpr std::string_view kName = "TMPDIR=";
    std::vector<std::string> found{std::string(kName) + folder.string()};
    for (char** entry = environ; *entry != nullptr; ++entry)
        if (!std::string_view(*entry).starts_with(kName)) found.emplace_back(*entry);
    return found;
}

[[noreturn]] void fail(const std::filesystem::path& program, int error) {
    throw std::runtime_error(fmt::format("{}: cannot be started ({}); name another one",
                                         program.string(), std::generic_category().message(error)));
}

} // namespace

ChildProcess::ChildProcess(const std::filesystem::path& program,
                           const std::vector<std::string>& arguments,
                           const std::vector<int>& sockets, const std::filesystem::path& folder)
    : says_(folder / (program.stem().string() + ".txt")) {
    std::array<int, 2> pair{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair.data()) != 0)
        fail(program, errno);
    socket_ = pair[0];
    // Above the numbers that the program knows, so that none of them is overwritten before its
    // turn.
    constexpr int above = 10;
    const int theirs = ::fcntl(pair[1], F_DUPFD_CLOEXEC, above);
    ::close(pair[1]);
    SpawnPlan plan;
    plan.open(STDIN_FILENO, "/dev/null", O_RDONLY);
    plan.open(STDOUT_FILENO, says_.c_str(), O_WRONLY | O_CREAT | O_APPEND);
    plan.lead(STDOUT_FILENO, STDERR_FILENO);
    for (const int number : sockets)
        plan.lead(theirs, number);
    std::vector<std::string> words{program.string()};
    words.insert(words.end(), arguments.begin(), arguments.end());
    const int error =
        theirs < 0 ? errno : plan.start(process_, program, words, environment_with(folder));
    if (theirs >= 0) ::close(theirs);
    if (error == 0) return;
    ::close(socket_);
    fail(program, error);
}

ChildProcess::~ChildProcess() {
    ::close(socket_);
    if (process_ < 0) return;
    ::kill(-process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
}

bool ChildProcess::is_ready(short events, Clock::time_point until, const GoOn& go_on) const {
    while (go_on()) {
        pollfd socket{socket_, events, 0};
        const int found = ::poll(&socket, 1, static_cast<int>(kLook.count()));
        if (found > 0) return true;
        if (found < 0 && errno != EINTR) return false;
        if (Clock::now() >= until) return false;
    }
    return false;
}

bool ChildProcess::write(std::string_view bytes, Clock::time_point until, const GoOn& go_on) {
    while (!bytes.empty()) {
        if (!is_ready(POLLOUT, until, go_on)) return false;
        const ssize_t sent =
            ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
        if (sent > 0) bytes.remove_prefix(static_cast<std::size_t>(sent));
        if (sent < 0 && errno != EAGAIN && errno != EINTR) return false;
    }
    return true;
}

bool ChildProcess::read(std::string& bytes, Clock::time_point until, const GoOn& go_on) {
    if (!is_ready(POLLIN, until, go_on)) return false;
    std::array<char, 1 << 16> part{};
    const ssize_t found = ::recv(socket_, part.data(), part.size(), MSG_DONTWAIT);
    if (found > 0) bytes.append(part.data(), static_cast<std::size_t>(found));
    return found > 0 || (found < 0 && (errno == EAGAIN || errno == EINTR));
}

void ChildProcess::end_input() noexcept { ::shutdown(socket_, SHUT_WR); }

std::optional<int> ChildProcess::wait(Clock::time_point until, const GoOn& go_on) {
    constexpr int signalled = 128;
    for (;;) {
        int status = 0;
        const pid_t ended = ::waitpid(process_, &status, WNOHANG);
        if (ended == process_) {
            ::kill(-process_, SIGKILL); // what it has started
            process_ = -1;
            return WIFEXITED(status) ? WEXITSTATUS(status) : signalled + WTERMSIG(status);
        }
        if (!go_on() || Clock::now() >= until) return std::nullopt;
        std::this_thread::sleep_for(kLook / 10);
    }
}

std::string ChildProcess::last_words() const {
    std::ifstream file(says_);
    std::string line, last;
    while (last.find(":FATAL:") == std::string::npos && std::getline(file, line))
        if (!line.empty()) last = line;
    // "[pid:thread:date/time:FATAL:file] words" of Chromium, "[part @ 0x55..] words" of FFmpeg.
    if (last.starts_with('[')) last.erase(0, std::min(last.find("] "), last.size() - 2) + 2);
    return last;
}

std::filesystem::path found_program(const std::vector<std::string>& names) {
    const char* const path = std::getenv("PATH");
    for (const std::string& name : names) {
        std::string_view folders = name.find('/') != std::string::npos || !path ? "" : path;
        do {
            const std::size_t end = std::min(folders.find(':'), folders.size());
            const std::filesystem::path file = std::filesystem::path(folders.substr(0, end)) / name;
            std::error_code ignored;
            if (std::filesystem::is_regular_file(file, ignored) &&
                ::access(file.c_str(), X_OK) == 0)
                return std::filesystem::absolute(file);
            folders.remove_prefix(std::min(end + 1, folders.size()));
        } while (!folders.empty());
    }
    return {};
}

TemporaryFolder::TemporaryFolder(const std::filesystem::path& where) {
    std::string name = (where / "palpate-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr)
        throw std::runtime_error(fmt::format("{}: no folder can be made in it ({}); make room, or "
                                             "name another one with TMPDIR",
                                             where.string(),
                                             std::generic_category().message(errno)));
    path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
    // A process that was just ended may still be making its last file.
    constexpr int tries = 40;
    for (int i = 0; i < tries; ++i) {
        std::error_code error;
        std::filesystem::remove_all(path_, error);
        if (!error) return;
        std::this_thread::sleep_for(kLook);
    }
}

} // namespace palpate::internal
