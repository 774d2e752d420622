// SPDX-License-Identifier: Apache-2.0
// What a check is made of: verdicts, clocks, and what a thread did.
#include <palpate/engine/command/check_suite.h>

#include <exception>
#include <utility>

#include <dlfcn.h>
#include <time.h>

namespace palpate::command {
namespace {

double seconds_on(clockid_t clock) {
    timespec now{};
    clock_gettime(clock, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// The preloaded functions of preload/call_watch.c.
struct Watch {
    void (*begin)() = reinterpret_cast<void (*)()>(dlsym(RTLD_DEFAULT, "palpate_watch_begin"));
    void (*end)(std::uint64_t*, std::uint64_t*, double*) =
        reinterpret_cast<void (*)(std::uint64_t*, std::uint64_t*, double*)>(
            dlsym(RTLD_DEFAULT, "palpate_watch_end"));
};

const Watch& watch() {
    static const Watch one;
    return one;
}

} // namespace

Verdict pass(std::string text) { return {Outcome::pass, std::move(text)}; }
Verdict fail(std::string text) { return {Outcome::fail, std::move(text)}; }
Verdict warn(std::string text) { return {Outcome::warn, std::move(text)}; }
Verdict skip(std::string text) { return {Outcome::skip, std::move(text)}; }

std::mt19937_64 random_numbers(std::uint64_t seed) { return std::mt19937_64(seed); }

double monotonic_s() { return seconds_on(CLOCK_MONOTONIC); }
double thread_cpu_s() { return seconds_on(CLOCK_THREAD_CPUTIME_ID); }

Verdict verdict_of_exception() {
    try {
        throw;
    } catch (const Verdict& verdict) {
        return verdict;
    } catch (const std::exception& error) {
        return fail(error.what());
    } catch (...) {
        return fail("an exception leaves the plug-in; catch it there");
    }
}

bool can_watch() { return watch().begin != nullptr; }
Verdict unwatched() {
    return skip("calls cannot be counted here: palpate_call_watch.so is not beside the command, a "
                "sanitizer is in it, or setcap gave it capabilities, with which nothing is "
                "preloaded; a copy beside it has none");
}
void begin_watch() {
    if (can_watch()) watch().begin();
}
Watched end_watch() {
    Watched seen;
    if (can_watch()) watch().end(&seen.allocations, &seen.locks, &seen.longest_lock_s);
    return seen;
}

} // namespace palpate::command
