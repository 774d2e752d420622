// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/command/check_suite.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/auxv.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/interrupt.h>
#include <palpate/engine/text/internal/json_text.h>
#include <palpate/engine/text/internal/nearest_name.h>

namespace palpate::command {
namespace {

constexpr std::array<const char*, 4> kOutcomes{"PASS", "FAIL", "WARN", "SKIP"};
constexpr std::string_view kNeeds = "needs ";
constexpr int kResult = 3; // where a check's line goes; what a plug-in prints goes nowhere

const char* name_of(Outcome outcome) { return kOutcomes[static_cast<std::size_t>(outcome)]; }

// ---- in the check's own process ---------------------------------------------------------------

/// Ends the process before what belongs to the command, whose threads are not in this one, is
/// taken down: for a plug-in that calls exit().
void end_now(int code, void*) { _exit(code); }

/// Nothing but the result goes anywhere.
void turn_streams_away(int result) {
    const int nowhere = open("/dev/null", O_RDWR);
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        dup2(nowhere, stream);
    if (nowhere > STDERR_FILENO) ::close(nowhere);
    if (result == kResult) return;
    dup2(result, kResult);
    ::close(result);
}

// ---- in the process that asks -----------------------------------------------------------------

/// The library of preload/call_watch.c, beside the command or where it is installed; empty: there
/// is none.
std::string call_watch() {
    const std::filesystem::path command = std::filesystem::read_symlink("/proc/self/exe");
    for (const char* place : {"palpate_call_watch.so", PALPATE_CALL_WATCH}) {
        const std::filesystem::path file = command.parent_path() / place;
        if (std::filesystem::exists(file)) return std::filesystem::canonical(file).string();
    }
    return "";
}

/// A process for one check, in a group of its own; what it says comes out of a pipe. It is a copy
/// of this one, so that it begins at once.
class CheckProcess {
public:
    CheckProcess(const CheckSuite& suite, const char* name)
        : itself_(fmt::format("{} \"{}\" --one {}", suite.kind, suite.subject, name)) {
        std::array<int, 2> pipe{};
        if (pipe2(pipe.data(), O_CLOEXEC) != 0)
            throw std::runtime_error("no pipe can be made; close other programs");
        process_ = fork();
        if (process_ == 0) {
            setpgid(0, 0);
            ::close(pipe[0]);
            turn_streams_away(pipe[1]);
            on_exit(end_now, nullptr);
            run_check_here(suite, name);
        }
        said_ = pipe[0];
        ::close(pipe[1]);
        if (process_ < 0) {
            ::close(said_);
            throw std::runtime_error(
                fmt::format("a check cannot be started: {}; close other programs",
                            std::generic_category().message(errno)));
        }
        setpgid(process_, process_); // whoever of the two comes first
    }
    ~CheckProcess() {
        ::kill(-process_, SIGKILL);
        if (!is_waited_for_) ::waitpid(process_, nullptr, 0);
        ::close(said_);
    }
    CheckProcess(const CheckProcess&) = delete;
    CheckProcess& operator=(const CheckProcess&) = delete;

    Verdict verdict(double limit_s) {
        const std::string line = line_within(limit_s);
        for (std::size_t i = 0; i < kOutcomes.size(); ++i)
            if (line.starts_with(kOutcomes[i])) return {static_cast<Outcome>(i), line.substr(5)};
        if (!has_ended_)
            return fail(fmt::format("does not return within {:.3g} s; let no call wait without an "
                                    "end",
                                    limit_s));
        // One that has closed the pipe may live on: it would be waited for without an end.
        ::kill(-process_, SIGKILL);
        int status = 0;
        ::waitpid(process_, &status, 0);
        is_waited_for_ = true;
        if (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL)
            return fail("closes files that are not its own, or is killed; close only what it has "
                        "opened");
        if (WIFSIGNALED(status))
            return fail(fmt::format("crashes: {}; run it in a debugger: gdb --args palpate "
                                    "validate {}",
                                    sigdescr_np(WTERMSIG(status)), itself_));
        return fail(fmt::format("ends the program with code {}; let no call exit",
                                WIFEXITED(status) ? WEXITSTATUS(status) : -1));
    }

private:
    /// What it says, up to the line's end; less where it ends, or the time does.
    std::string line_within(double limit_s) {
        constexpr int kLook_ms = 100;
        const double ends_s = monotonic_s() + limit_s;
        std::string said;
        while (monotonic_s() < ends_s && !has_ended_) {
            if (stop_wanted()) throw std::runtime_error("stopped");
            pollfd ready{said_, POLLIN, 0};
            if (poll(&ready, 1, kLook_ms) <= 0) continue;
            std::array<char, 1024> bytes{};
            const ssize_t count = ::read(said_, bytes.data(), bytes.size());
            if (count > 0) said.append(bytes.data(), static_cast<std::size_t>(count));
            if (said.ends_with('\n')) return said.substr(0, said.size() - 1);
            has_ended_ = count <= 0;
        }
        return "";
    }

    std::string itself_; ///< how it is run alone
    pid_t process_ = 0;
    int said_ = -1;
    bool has_ended_ = false;
    bool is_waited_for_ = false;
};

struct Result {
    CheckName check;
    Verdict verdict;
};

/// With the checks that they need.
std::vector<CheckName> chosen_checks(const std::vector<CheckName>& all,
                                     const std::vector<std::string>& only) {
    if (only.empty()) return all;
    std::vector<std::string_view> names, wanted;
    names.reserve(all.size());
    wanted.reserve(2 * all.size());
    for (const CheckName& check : all)
        names.emplace_back(check.name);
    for (const std::string& name : only) {
        if (std::find(names.begin(), names.end(), name) == names.end())
            throw UsageError(fmt::format("--only {}: there is no such check; {}", name,
                                         internal::remedy_for_name(name, names, "checks")));
        wanted.emplace_back(name);
    }
    std::vector<CheckName> chosen;
    for (std::size_t i = all.size(); i-- > 0;)
        if (std::find(wanted.begin(), wanted.end(), all[i].name) != wanted.end()) {
            chosen.insert(chosen.begin(), all[i]);
            if (all[i].needs != nullptr) wanted.emplace_back(all[i].needs);
        }
    return chosen;
}

/// A check that needs one that failed is skipped, and so is one that needs that; where the other
/// one is skipped because there is nothing to look at, this one looks for itself.
std::optional<Verdict> obstacle(const CheckName& check, const std::vector<Result>& results) {
    for (const Result& earlier : results) {
        if (check.needs == nullptr || std::string_view(earlier.check.name) != check.needs) continue;
        const Outcome outcome = earlier.verdict.outcome;
        if (outcome == Outcome::fail ||
            (outcome == Outcome::skip && earlier.verdict.text.starts_with(kNeeds)))
            return skip(fmt::format("{}{}", kNeeds, check.needs));
    }
    return std::nullopt;
}

std::size_t count(const std::vector<Result>& results, Outcome outcome) {
    return static_cast<std::size_t>(
        std::count_if(results.begin(), results.end(),
                      [&](const Result& result) { return result.verdict.outcome == outcome; }));
}

std::string json_of(const CheckSuite& suite, const std::vector<Result>& results) {
    nlohmann::json checks = nlohmann::json::array();
    for (const Result& result : results)
        checks.push_back({{"name", result.check.name},
                          {"what", result.check.what},
                          {"outcome", name_of(result.verdict.outcome)},
                          {"reason", result.verdict.text}});
    return internal::json_text({{suite.kind, suite.subject},
                                {"checks", std::move(checks)},
                                {"passed", count(results, Outcome::pass)},
                                {"failed", count(results, Outcome::fail)},
                                {"warned", count(results, Outcome::warn)},
                                {"skipped", count(results, Outcome::skip)}});
}

} // namespace

std::vector<std::size_t> order_of(const std::vector<CheckName>& checks) {
    std::vector<std::size_t> order(checks.size());
    for (std::size_t i = 0; i < order.size(); ++i)
        order[i] = i;
    const auto place = [&](const char* name) {
        return std::find_if(order.begin(), order.end(), [&](std::size_t index) {
            return std::string_view(checks[index].name) == name;
        });
    };
    for (auto at = order.begin(); at != order.end(); ++at)
        while (checks[*at].needs != nullptr && place(checks[*at].needs) > at) {
            const auto needed = place(checks[*at].needs);
            std::rotate(at, needed, needed + 1);
        }
    return order;
}

std::string list_of_checks(const CheckSuite& suite, const std::vector<std::string>& only) {
    std::string text;
    for (const CheckName& check : chosen_checks(suite.checks, only))
        text += fmt::format("{:<20} {}\n", check.name, check.what);
    return text;
}

void run_check_here(const CheckSuite& suite, std::string_view name) {
    const Verdict verdict = suite.run(name);
    std::string line = fmt::format("{} {}", name_of(verdict.outcome), verdict.text);
    std::replace(line.begin(), line.end(), '\n', ' ');
    line += '\n';
    const int result = fcntl(kResult, F_GETFD) >= 0 ? kResult : STDOUT_FILENO;
    const bool is_said = write(result, line.data(), line.size()) > 0;
    _exit(is_said ? kDone : kInternal); // and nothing more of the plug-in's is called
}

int run_checks(const CheckSuite& suite, const CheckChoice& choice) {
    const std::vector<CheckName> checks = chosen_checks(suite.checks, choice.only);
    std::vector<Result> results;
    results.reserve(checks.size());
    for (const CheckName& check : checks) {
        const std::optional<Verdict> skipped = obstacle(check, results);
        results.push_back(
            {check, skipped ? *skipped : CheckProcess(suite, check.name).verdict(choice.limit_s)});
        const Verdict& verdict = results.back().verdict;
        if (!choice.json)
            print(fmt::format("{}  {:<20} {}", name_of(verdict.outcome), check.name, verdict.text));
    }
    print(choice.json ? json_of(suite, results)
                      : fmt::format("{} passed, {} failed, {} warned, {} skipped",
                                    count(results, Outcome::pass), count(results, Outcome::fail),
                                    count(results, Outcome::warn), count(results, Outcome::skip)));
    return count(results, Outcome::fail) == 0 ? kDone : kCheckFailed;
}

void begin_with_call_watch() {
    const std::string library = call_watch();
    if (library.empty() || can_watch()) return;
    // To a program with capabilities, as of setcap, the loader gives no LD_PRELOAD: it would begin
    // anew for ever.
    if (::getauxval(AT_SECURE) != 0) return;
    const char* preloaded = std::getenv("LD_PRELOAD");
    if (preloaded != nullptr && std::string_view(preloaded) == library) return; // it did not help
    std::ifstream file("/proc/self/cmdline", std::ios::binary);
    std::string words(std::istreambuf_iterator<char>(file), {});
    std::vector<char*> arguments;
    arguments.reserve(static_cast<std::size_t>(std::count(words.begin(), words.end(), '\0')) + 1);
    for (std::size_t at = 0; at < words.size(); at = words.find('\0', at) + 1)
        arguments.push_back(words.data() + at);
    arguments.push_back(nullptr);
    std::string preload = "LD_PRELOAD=" + library;
    std::vector<char*> variables{preload.data()};
    for (char** one = environ; *one != nullptr; ++one)
        if (!std::string_view(*one).starts_with("LD_PRELOAD=")) variables.push_back(*one);
    variables.push_back(nullptr);
    execve("/proc/self/exe", arguments.data(), variables.data());
}

} // namespace palpate::command
