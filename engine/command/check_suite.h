// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// What `palpate validate driver` and `palpate validate effect` have in common: checks with names,
/// each in a process of its own, and a table of what came of them.
namespace palpate::command {

/// What a check comes to.
enum class Outcome : std::uint8_t {
    pass,
    fail,
    warn, ///< allowed, and not good
    skip  ///< cannot be checked with this one, or not without a check that failed
};

/// An outcome with one line: the reason, and after a semicolon what to do.
struct Verdict {
    Outcome outcome = Outcome::pass;
    std::string text;
};

Verdict pass(std::string text);
Verdict fail(std::string text);
Verdict warn(std::string text);
Verdict skip(std::string text);

/// One check, but for what it does.
struct CheckName {
    const char* name;  ///< as --only takes it
    const char* needs; ///< the check that has to pass before it; null: none
    const char* what;  ///< that is checked, in words
};

/// One check of a Trial: of what is checked, as one process sees it.
template <class Trial>
struct Check {
    const char* name;
    const char* needs;
    const char* what;
    Verdict (*run)(Trial&);
};

/// Checks of one thing.
struct CheckSuite {
    std::string kind;              ///< "driver" or "effect"
    std::string subject;           ///< what is checked, as the command was given it
    std::vector<CheckName> checks; ///< each after the one that it needs
    std::function<Verdict(std::string_view name)> run; ///< one of them, in a process for it alone
};

/// How a suite is run.
struct CheckChoice {
    std::vector<std::string> only; ///< these checks and those that they need; empty: all
    double limit_s = 40.0;         ///< time for one check
    bool json = false;             ///< one JSON object instead of a table
};

/// Lists of checks as one, each check after the one that it needs.
template <class Trial>
std::vector<Check<Trial>> checks_in_order(std::span<const std::span<const Check<Trial>>> lists);

/// The names of checks.
template <class Trial>
std::vector<CheckName> names_of(std::span<const Check<Trial>> checks);

/// Runs one check; what it throws is its verdict.
template <class Trial>
Verdict verdict_of(const Check<Trial>& check, Trial& trial);

/// What an exception that is being handled says of a check.
Verdict verdict_of_exception();

/// A line for each check, with what it is about.
std::string list_of_checks(const CheckSuite& suite, const std::vector<std::string>& only);

/// Runs one check here, as for a debugger: its line goes to descriptor 3 where that is open, else
/// to stdout. Ends the process.
[[noreturn]] void run_check_here(const CheckSuite& suite, std::string_view name);

/// Runs the checks, each in a process of its own, prints what they come to, and returns the
/// command's exit code. Throws UsageError where there is no check of a name that is asked for.
int run_checks(const CheckSuite& suite, const CheckChoice& choice);

/// From here on the C library's functions that are watched (preload/call_watch.c) are: the command
/// begins anew with them preloaded, where it has not yet. It returns where they are, or where this
/// build has none.
void begin_with_call_watch();

/// What one thread did between two instants.
struct Watched {
    std::uint64_t allocations = 0;
    std::uint64_t locks = 0;     ///< how often it took one
    double longest_lock_s = 0.0; ///< longest wait for one
};

/// Whether allocations and locks are counted in this process.
bool can_watch();
/// Why not, and what to do.
Verdict unwatched();
void begin_watch();
Watched end_watch();

/// The same numbers each time, so that what a check finds is found again.
std::mt19937_64 random_numbers(std::uint64_t seed);

/// CLOCK_MONOTONIC, s.
double monotonic_s();
/// The processor time of this thread, s.
double thread_cpu_s();

// ---- templates --------------------------------------------------------------------------------

/// Puts each after the one that it needs: the order, as indices.
std::vector<std::size_t> order_of(const std::vector<CheckName>& checks);

template <class Trial>
std::vector<CheckName> names_of(std::span<const Check<Trial>> checks) {
    std::vector<CheckName> names;
    names.reserve(checks.size());
    for (const Check<Trial>& check : checks)
        names.push_back({check.name, check.needs, check.what});
    return names;
}

template <class Trial>
std::vector<Check<Trial>> checks_in_order(std::span<const std::span<const Check<Trial>>> lists) {
    std::vector<Check<Trial>> all, ordered;
    for (const std::span<const Check<Trial>>& list : lists)
        all.insert(all.end(), list.begin(), list.end());
    ordered.reserve(all.size());
    for (const std::size_t index : order_of(names_of(std::span<const Check<Trial>>(all))))
        ordered.push_back(all[index]);
    return ordered;
}

template <class Trial>
Verdict verdict_of(const Check<Trial>& check, Trial& trial) {
    try {
        return check.run(trial);
    } catch (...) {
        return verdict_of_exception();
    }
}

} // namespace palpate::command
