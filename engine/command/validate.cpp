// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/driver_trial.h>
#include <palpate/engine/command/interrupt.h>
#include <palpate/engine/text/internal/json_text.h>
#include <palpate/engine/text/internal/nearest_name.h>

namespace palpate::command {
namespace {

struct ValidateOptions {
    std::string kind;
    std::string driver;
    std::vector<std::string> only;
    double limit_s = 40.0; // more than open may take
    bool list = false;
    bool json = false;
    bool forces = false;
    std::string one; // hidden: the check that this process is for
};

constexpr std::array<const char*, 4> kOutcomes{"PASS", "FAIL", "WARN", "SKIP"};

const char* name_of(Outcome outcome) { return kOutcomes[static_cast<std::size_t>(outcome)]; }

std::vector<DriverCheck> all_checks() {
    std::vector<DriverCheck> all;
    for (const auto checks : {library_checks(), life_checks(), state_checks(), call_checks(),
                              force_checks(), end_checks()})
        all.insert(all.end(), checks.begin(), checks.end());
    // A check comes after the one that it needs.
    const auto place = [&](const char* name) {
        return std::find_if(all.begin(), all.end(), [&](const DriverCheck& check) {
            return std::string_view(check.name) == name;
        });
    };
    for (std::size_t i = 0; i < all.size(); ++i)
        while (all[i].needs != nullptr && place(all[i].needs) > all.begin() + i)
            std::rotate(all.begin() + i, place(all[i].needs), place(all[i].needs) + 1);
    return all;
}

// ---- in the check's own process ---------------------------------------------------------------

constexpr int kResult = 3; // where the outcome goes; what the plug-in prints goes nowhere

Verdict run_check(const DriverCheck& check, DriverTrial& trial) {
    try {
        return check.run(trial);
    } catch (const Verdict& verdict) {
        return verdict;
    } catch (const std::exception& error) {
        return fail(error.what());
    } catch (...) {
        return fail("an exception leaves the plug-in; catch it there");
    }
}

/// Ends the process, and calls nothing more of the plug-in's.
[[noreturn]] void run_one(const ValidateOptions& options) {
    Verdict verdict = fail("there is no such check");
    DriverTrial trial(options.driver, options.forces);
    for (const DriverCheck& check : all_checks())
        if (check.name == options.one) verdict = run_check(check, trial);
    const std::string line = fmt::format("{} {}\n", name_of(verdict.outcome), verdict.text);
    const bool is_said = write(kResult, line.data(), line.size()) > 0;
    _exit(is_said ? kDone : kInternal);
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

/// A process of this command for one check, in a group of its own; what it says comes out of a
/// pipe.
class CheckProcess {
public:
    CheckProcess(const ValidateOptions& options, const DriverCheck& check) {
        std::array<int, 2> pipe{};
        if (pipe2(pipe.data(), O_CLOEXEC) != 0)
            throw std::runtime_error("no pipe can be made; close other programs");
        said_ = pipe[0];
        std::vector<std::string> words{"palpate",      "validate", "driver",
                                       options.driver, "--one",    check.name};
        if (options.forces) words.emplace_back("--forces");
        spawn(words, pipe[1]);
        ::close(pipe[1]);
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
        int status = 0;
        ::waitpid(process_, &status, 0);
        is_waited_for_ = true;
        if (WIFSIGNALED(status))
            return fail(
                fmt::format("crashes: {}; run it in a debugger: gdb --args palpate validate "
                            "driver PLUGIN --one CHECK 3>&1",
                            strsignal(WTERMSIG(status))));
        return fail(fmt::format("ends the program with code {}; let no call exit",
                                WIFEXITED(status) ? WEXITSTATUS(status) : -1));
    }

private:
    void spawn(const std::vector<std::string>& words, int result) {
        std::vector<char*> arguments;
        arguments.reserve(words.size() + 1);
        for (const std::string& word : words)
            arguments.push_back(const_cast<char*>(word.c_str()));
        arguments.push_back(nullptr);
        std::vector<char*> variables;
        std::string preload = "LD_PRELOAD=" + call_watch();
        for (char** one = environ; *one != nullptr; ++one)
            if (!std::string_view(*one).starts_with("LD_PRELOAD=")) variables.push_back(*one);
        if (preload.back() != '=') variables.push_back(preload.data());
        variables.push_back(nullptr);

        posix_spawn_file_actions_t files;
        posix_spawn_file_actions_init(&files);
        posix_spawn_file_actions_adddup2(&files, result, kResult);
        for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
            posix_spawn_file_actions_addopen(&files, stream, "/dev/null", O_RDWR, 0);
        posix_spawnattr_t group;
        posix_spawnattr_init(&group);
        posix_spawnattr_setflags(&group, POSIX_SPAWN_SETPGROUP);
        const int error = posix_spawn(&process_, "/proc/self/exe", &files, &group, arguments.data(),
                                      variables.data());
        posix_spawn_file_actions_destroy(&files);
        posix_spawnattr_destroy(&group);
        if (error != 0)
            throw std::runtime_error(fmt::format(
                "a check cannot be started: {}; close other programs", strerror(error)));
    }

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

    pid_t process_ = 0;
    int said_ = -1;
    bool has_ended_ = false;
    bool is_waited_for_ = false;
};

struct Result {
    DriverCheck check;
    Verdict verdict;
};

/// With the checks that they need.
std::vector<DriverCheck> chosen_checks(const std::vector<std::string>& only) {
    const std::vector<DriverCheck> all = all_checks();
    if (only.empty()) return all;
    std::vector<std::string_view> names, wanted;
    names.reserve(all.size());
    wanted.reserve(all.size());
    for (const DriverCheck& check : all)
        names.emplace_back(check.name);
    for (const std::string& name : only) {
        if (std::find(names.begin(), names.end(), name) == names.end())
            throw UsageError(fmt::format("--only {}: there is no such check; {}", name,
                                         internal::remedy_for_name(name, names, "checks")));
        wanted.emplace_back(name);
    }
    std::vector<DriverCheck> chosen;
    for (std::size_t i = all.size(); i-- > 0;)
        if (std::find(wanted.begin(), wanted.end(), all[i].name) != wanted.end()) {
            chosen.insert(chosen.begin(), all[i]);
            if (all[i].needs != nullptr) wanted.emplace_back(all[i].needs);
        }
    return chosen;
}

/// A check that needs one that did not pass is skipped.
std::optional<Verdict> obstacle(const DriverCheck& check, const std::vector<Result>& results) {
    for (const Result& earlier : results) {
        if (check.needs == nullptr || std::string_view(earlier.check.name) != check.needs) continue;
        const Outcome outcome = earlier.verdict.outcome;
        if (outcome == Outcome::fail || outcome == Outcome::skip)
            return skip(fmt::format("needs {}", check.needs));
    }
    return std::nullopt;
}

std::size_t count(const std::vector<Result>& results, Outcome outcome) {
    return static_cast<std::size_t>(
        std::count_if(results.begin(), results.end(),
                      [&](const Result& result) { return result.verdict.outcome == outcome; }));
}

std::string json_of(const std::string& driver, const std::vector<Result>& results) {
    nlohmann::json checks = nlohmann::json::array();
    for (const Result& result : results)
        checks.push_back({{"name", result.check.name},
                          {"what", result.check.what},
                          {"outcome", name_of(result.verdict.outcome)},
                          {"reason", result.verdict.text}});
    return internal::json_text({{"driver", driver},
                                {"checks", std::move(checks)},
                                {"passed", count(results, Outcome::pass)},
                                {"failed", count(results, Outcome::fail)},
                                {"warned", count(results, Outcome::warn)},
                                {"skipped", count(results, Outcome::skip)}});
}

int validate_driver(const ValidateOptions& options) {
    if (options.list) {
        std::string text;
        for (const DriverCheck& check : chosen_checks(options.only))
            text += fmt::format("{:<20} {}\n", check.name, check.what);
        print(text);
        return kDone;
    }
    if (options.driver.empty())
        throw UsageError("validate driver: which one? give a plug-in's file, hand, path:FILE or "
                         "hid:ADDRESS");
    if (!options.one.empty()) run_one(options);
    DriverTrial(options.driver, options.forces); // what is wrong with its name is said here
    std::vector<Result> results;
    const std::vector<DriverCheck> checks = chosen_checks(options.only);
    results.reserve(checks.size());
    for (const DriverCheck& check : checks) {
        const std::optional<Verdict> skipped = obstacle(check, results);
        results.push_back(
            {check, skipped ? *skipped : CheckProcess(options, check).verdict(options.limit_s)});
        const Verdict& verdict = results.back().verdict;
        if (!options.json)
            print(fmt::format("{}  {:<20} {}", name_of(verdict.outcome), check.name, verdict.text));
    }
    print(options.json ? json_of(options.driver, results)
                       : fmt::format("{} passed, {} failed, {} warned, {} skipped",
                                     count(results, Outcome::pass), count(results, Outcome::fail),
                                     count(results, Outcome::warn), count(results, Outcome::skip)));
    return count(results, Outcome::fail) == 0 ? kDone : kCheckFailed;
}

} // namespace

void add_validate(CLI::App& app, Action& run) {
    const auto options = std::make_shared<ValidateOptions>();
    CLI::App* command =
        app.add_subcommand("validate", "the checks that a device plug-in has to pass");
    command->add_option("KIND", options->kind, "what to check: driver")
        ->required()
        ->check(CLI::IsMember({"driver"}));
    command->add_option("DRIVER", options->driver,
                        "a plug-in's file, with ?key=value where it takes options; or hand, "
                        "path:FILE, hid:ADDRESS");
    command->add_option("--only", options->only, "these checks, and those that they need");
    CLI::Option* list = command->add_flag("--list", options->list, "say which checks there are");
    command->add_flag("--json", options->json, "as JSON")->excludes(list);
    command->add_flag("--forces", options->forces,
                      "also forces as long as the device can hold: nobody may hold it. A simulated "
                      "device gets them anyway");
    command->add_option("--limit-s", options->limit_s, "time for one check")
        ->check(between(0.1, 3600.0));
    command->add_option("--one", options->one)->group("");
    command->callback([options, &run] { run = [options] { return validate_driver(*options); }; });
}

} // namespace palpate::command
