// SPDX-License-Identifier: Apache-2.0
// Checks of `palpate validate driver`: file, table, and the device from open to close.
#include <palpate/engine/command/driver_trial.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <tuple>

#include <linux/filter.h>
#include <linux/seccomp.h>
#include <malloc.h>
#include <sys/prctl.h>
#include <sys/syscall.h>

#include <fmt/format.h>

#include <palpate/drivers/internal/plugin_library.h>

namespace palpate::command {
namespace {

constexpr double kTouch_n = 0.02; // a force that nobody is hurt by

// ---- the library ------------------------------------------------------------------------------

Verdict file(DriverTrial& trial) {
    if (trial.is_own()) return pass("a driver of Palpate's own");
    internal::load_plugin_file(trial.path());
    return pass("the library loads, and all that it needs is there");
}

const palpate_device_plugin& table_of(DriverTrial& trial) {
    if (trial.is_own()) return trial.plugin();
    return *internal::plugin_entry(internal::load_plugin_file(trial.path()), trial.path());
}

Verdict entry(DriverTrial& trial) {
    table_of(trial);
    return pass("palpate_device_plugin_entry() is exported and returns a table");
}

Verdict version(DriverTrial& trial) {
    internal::check_plugin_version(table_of(trial), trial.path());
    return pass(fmt::format("abi {}", PALPATE_DEVICE_PLUGIN_ABI));
}

Verdict size(DriverTrial& trial) {
    internal::check_plugin_size(table_of(trial), trial.path());
    return pass(fmt::format("{} bytes", table_of(trial).size));
}

Verdict functions(DriverTrial& trial) {
    internal::check_plugin_functions(table_of(trial), trial.path());
    return pass(fmt::format("{} {}: none is NULL", table_of(trial).name, table_of(trial).version));
}

constexpr std::array<DriverCheck, 5> kLibrary{{
    {"file", nullptr, "the library loads", file},
    {"entry", "file", "it exports the entry function", entry},
    {"version", "entry", "it was compiled for this version", version},
    {"size", "version", "its table is whole", size},
    {"functions", "size", "no function and no name is missing", functions},
}};

// ---- opening ----------------------------------------------------------------------------------

/// One line, not too long, and not empty.
Verdict reason_is_fit(const std::string& reason, const char* when) {
    if (reason.empty())
        return fail(
            fmt::format("{}, and reason(NULL) is empty; say what is wrong and what to do", when));
    if (reason.size() > 500 || reason.find('\n') != std::string::npos)
        return fail(
            fmt::format("{}, and the reason has {} bytes or more than one line; one line of "
                        "at most 500 bytes",
                        when, reason.size()));
    return pass(fmt::format("{}: \"{}\"", when, reason));
}

Verdict unknown_option(DriverTrial& trial) {
    std::string reason;
    if (trial.try_open("palpate_asks", reason) != nullptr)
        return fail(
            "an option \"palpate_asks\" that it cannot know is accepted; refuse it, so that "
            "a misspelt option is noticed");
    return reason_is_fit(reason, "refused");
}

/// Does something that may take so long and no longer: a run gives the device up then.
template <class Act>
Verdict in_time(const char* function, double longest_s, const Act& act) {
    const double began_s = monotonic_s();
    act();
    const std::string seen = fmt::format("{} takes {:.3g} s", function, monotonic_s() - began_s);
    if (monotonic_s() - began_s > longest_s)
        return fail(fmt::format("{}; {:g} s at most", seen, longest_s));
    return pass(seen);
}

Verdict open(DriverTrial& trial) {
    std::string reason;
    void* device = nullptr;
    const Verdict verdict = in_time("open", 30.0, [&] { device = trial.try_open("", reason); });
    return device != nullptr ? verdict : fail(reason_is_fit(reason, "does not open").text);
}

/// From here on no file, device or connection can be opened by this process (EACCES).
bool hide_system() {
    constexpr unsigned hidden[] = {
#ifdef SYS_open
        SYS_open,
#endif
        SYS_openat, SYS_socket, SYS_connect, SYS_bind};
    constexpr std::size_t count = std::size(hidden);
    sock_filter rules[count + 3] = {BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr))};
    for (std::size_t i = 0; i < count; ++i)
        rules[i + 1] = BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, hidden[i],
                                static_cast<unsigned char>(count - i), 0);
    rules[count + 1] = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
    rules[count + 2] = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EACCES);
    const sock_fprog program{static_cast<unsigned short>(std::size(rules)), rules};
    return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
           prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

Verdict open_without_device(DriverTrial& trial) {
    trial.plugin();
    if (!hide_system()) return skip("this kernel cannot hide files and sockets");
    std::string reason;
    if (trial.try_open("", reason) != nullptr)
        return pass("opens without a file, device or connection: it needs none");
    return reason_is_fit(reason, "without files and sockets it says");
}

Verdict properties(DriverTrial& trial) {
    const std::string fault = internal::fault_of(trial.properties());
    if (!fault.empty()) return fail(fault + "; correct what properties fills in");
    const palpate_plugin_properties& said = trial.properties();
    return pass(fmt::format("{}: {:.6g} Hz, {:.3g} N, {} buttons, silent after {:.3g} s", said.name,
                            said.rate_hz, said.force_n, said.buttons, said.stale_after_s));
}

/// All that a plug-in says of its device.
auto members(const palpate_plugin_properties& p) {
    return std::make_tuple(std::to_array(p.name), p.rate_hz, p.longest_call_s, p.stale_after_s,
                           p.force_n, p.stiffness_n_per_m, p.damping_n_s_per_m, p.position_step_m,
                           p.delay_s, std::to_array(p.workspace_lower_m),
                           std::to_array(p.workspace_upper_m), p.buttons, p.measures_velocity,
                           p.is_simulated);
}

Verdict properties_stay(DriverTrial& trial) {
    const palpate_plugin_properties before = trial.properties();
    trial.started();
    palpate_plugin_properties after = internal::unknown_properties();
    if (trial.plugin().properties(trial.opened(), &after) != PALPATE_PLUGIN_OK)
        return fail("properties fails after start; it is allowed from open to close");
    if (members(before) != members(after))
        return fail("properties are others after start; Palpate asks once, so let them stay");
    return pass("the same before and after start");
}

Verdict open_twice(DriverTrial& trial) {
    trial.opened();
    std::string reason;
    if (trial.try_open("", reason) != nullptr) {
        trial.first_state();
        return pass("a second device opens beside the first");
    }
    Verdict verdict = reason_is_fit(reason, "a second one is refused");
    trial.first_state();
    return verdict;
}

/// What the motors hold in a state; negative where the plug-in does not say.
double held_n(const palpate_plugin_state& state) {
    const double* f = state.held_force_n;
    const double length = std::hypot(f[0], f[1], f[2]);
    return std::isnan(length) ? -1.0 : length;
}

Verdict before_start(DriverTrial& trial) {
    trial.properties();
    const Exchange first = trial.exchange({kTouch_n, 0.0, 0.0});
    const Exchange second = trial.exchange({kTouch_n, 0.0, 0.0});
    for (const Exchange& one : {first, second})
        if (one.read == PALPATE_PLUGIN_OK && internal::fault_of(one.state) != nullptr)
            return fail(fmt::format("read before start returns PALPATE_PLUGIN_OK, and {}; fail, or "
                                    "give a state",
                                    internal::fault_of(one.state)));
    if (held_n(second.state) > 0.0)
        return fail("write before start holds a force; hold none until start");
    return pass("read and write before start do no harm");
}

Verdict start(DriverTrial& trial) {
    trial.properties();
    return in_time("start", 10.0, [&] { trial.started(); });
}

Verdict first_state(DriverTrial& trial) {
    trial.started();
    const double began_s = monotonic_s();
    trial.first_state();
    return pass(fmt::format("the first state comes after {:.3g} s", monotonic_s() - began_s));
}

constexpr std::array<DriverCheck, 9> kLife{{
    {"unknown_option", "open", "an option that it does not know is refused", unknown_option},
    {"open", "functions", "it opens", open},
    {"open_without_device", "open", "without its device it says why", open_without_device},
    {"properties", "open", "what it says of itself is in range", properties},
    {"properties_stay", "start", "and stays the same", properties_stay},
    {"open_twice", "first_state", "a second open gives a device or a reason", open_twice},
    {"before_start", "properties", "read and write before start do no harm", before_start},
    {"start", "properties", "it starts", start},
    {"first_state", "start", "a state comes", first_state},
}};

// ---- the end ----------------------------------------------------------------------------------

Verdict zero_at_stop(DriverTrial& trial) {
    if (trial.properties().force_n <= 0.0) return skip("the device takes no force");
    trial.first_state();
    const Exchange before = trial.exchange({kTouch_n, 0.0, 0.0});
    trial.wait_for_next();
    if (held_n(trial.exchange({kTouch_n, 0.0, 0.0}).state) < 0.0 && held_n(before.state) < 0.0)
        return skip(kUnseen);
    trial.stop();
    palpate_plugin_state state = internal::unknown_state();
    trial.plugin().read(trial.opened(), &state);
    if (held_n(state) > 0.0)
        return fail(fmt::format("{:.3g} N are held after stop; send a zero force before stop "
                                "returns",
                                held_n(state)));
    trial.exchange({kTouch_n, 0.0, 0.0});
    if (held_n(trial.exchange({kTouch_n, 0.0, 0.0}).state) > 0.0)
        return fail("write after stop holds a force; hold none until start");
    if (held_n(state) < 0.0) { // it does not say: what it held is seen once it is started
        trial.started();
        state = internal::unknown_state();
        trial.plugin().read(trial.opened(), &state); // what is held is said with nothing new, too
        if (held_n(state) < 0.0) state = trial.first_state().state;
        if (held_n(state) > 0.0)
            return fail(fmt::format("{:.3g} N are held when it is started again; let stop send a "
                                    "zero force",
                                    held_n(state)));
        if (held_n(state) < 0.0) return skip(kUnseen);
    }
    return pass("no force is held after stop");
}

Verdict stop_twice(DriverTrial& trial) {
    trial.first_state();
    Verdict first = in_time("stop", 1.0, [&] { trial.stop(); });
    if (first.outcome != Outcome::pass) return first;
    trial.stop();
    return pass(first.text + ", and a second one does no harm");
}

/// Whether a state comes within two seconds that is later than that, and a force is taken.
bool goes_on(DriverTrial& trial, double after_s) {
    constexpr double kLongest_s = 2.0;
    constexpr int kLateLooks = 50; // after a stall of this process
    const double began_s = monotonic_s();
    for (int late = 0; monotonic_s() - began_s < kLongest_s || ++late <= kLateLooks;) {
        const Exchange one = trial.exchange({0.0, 0.0, 0.0});
        if (one.read == PALPATE_PLUGIN_OK && one.write == PALPATE_PLUGIN_OK &&
            one.state.time_s > after_s)
            return true;
        trial.wait_for_next();
    }
    return false;
}

Verdict restart(DriverTrial& trial) {
    trial.first_state();
    trial.stop();
    if (!goes_on(trial, trial.first_state().state.time_s))
        return fail("started again, no later state comes for 2 s, or write fails; let it go on");
    return pass("after stop it starts again, and states come");
}

Verdict close(DriverTrial& trial) {
    trial.first_state();
    trial.stop();
    return in_time("close", 5.0, [&] { trial.close(); });
}

Verdict close_unstarted(DriverTrial& trial) {
    trial.opened();
    trial.close();
    return pass("it can be closed without having been started");
}

Verdict reopen(DriverTrial& trial) {
    for (int i = 0; i < 3; ++i) {
        trial.first_state();
        trial.stop();
        trial.close();
    }
    return pass("opened, started, stopped and closed three times");
}

std::size_t entries_in(const char* folder) {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

/// With blocks that the C library maps alone, as they are large.
std::size_t allocated_bytes() {
    const auto info = mallinfo2();
    return info.uordblks + info.hblkhd;
}

/// A thread is listed until a moment after it was joined.
std::size_t threads_now() {
    constexpr double kMoment_s = 0.02;
    std::size_t fewest = entries_in("/proc/self/task");
    for (const double began_s = monotonic_s(); monotonic_s() - began_s < kMoment_s;)
        fewest = std::min(fewest, entries_in("/proc/self/task"));
    return fewest;
}

/// What is left over after some runs, beyond what the first one left.
template <class Count>
std::ptrdiff_t left_over(DriverTrial& trial, int runs, Count count) {
    std::ptrdiff_t after_first = 0;
    for (int i = 0; i <= runs; ++i) {
        trial.first_state();
        trial.stop();
        trial.close();
        if (i == 0) after_first = static_cast<std::ptrdiff_t>(count());
    }
    return static_cast<std::ptrdiff_t>(count()) - after_first;
}

Verdict descriptors(DriverTrial& trial) {
    const auto left = left_over(trial, 4, [] { return entries_in("/proc/self/fd"); });
    if (left > 0)
        return fail(
            fmt::format("{} files or sockets stay open after 4 times; close them in close", left));
    return pass("every file is closed again");
}

Verdict threads(DriverTrial& trial) {
    const auto left = left_over(trial, 4, threads_now);
    if (left > 0)
        return fail(
            fmt::format("{} threads go on after close, 4 times; end and join them in close", left));
    return pass("every thread is ended again");
}

Verdict memory(DriverTrial& trial) {
    constexpr int runs = 8;
    const auto left = left_over(trial, runs, allocated_bytes);
    constexpr std::ptrdiff_t most_left = std::ptrdiff_t{1024} * runs;
    if (left > most_left)
        return fail(
            fmt::format("{} bytes stay allocated after {} times; free them in close", left, runs));
    return pass("what is allocated is freed again");
}

Verdict signals(DriverTrial& trial) {
    constexpr std::array<int, 6> looked_at{SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGSEGV, SIGABRT};
    std::array<struct sigaction, looked_at.size()> before{}, after{};
    for (std::size_t i = 0; i < looked_at.size(); ++i)
        sigaction(looked_at[i], nullptr, &before[i]);
    trial.first_state();
    for (std::size_t i = 0; i < looked_at.size(); ++i) {
        sigaction(looked_at[i], nullptr, &after[i]);
        if (before[i].sa_handler != after[i].sa_handler)
            return fail(
                fmt::format("the handler of {} is another one; leave signals to the program",
                            sigdescr_np(looked_at[i])));
    }
    return pass("signal handlers are as they were");
}

Verdict endurance(DriverTrial& trial) {
    double newest_s = trial.first_state().state.time_s;
    const double began_s = monotonic_s();
    long long calls = 0;
    for (; calls < trial.frames() && monotonic_s() - began_s < trial.longest_s(); ++calls) {
        const Exchange one = trial.exchange({0.0, 0.0, 0.0});
        if (one.read == PALPATE_PLUGIN_OK) newest_s = std::max(newest_s, one.state.time_s);
    }
    // A path ends, and begins again once it is opened again.
    const auto begins_again = [&] {
        trial.stop();
        trial.close();
        return goes_on(trial, trial.first_state().state.time_s);
    };
    if (!goes_on(trial, newest_s) && !(trial.is_own() && begins_again()))
        return fail(fmt::format("after {} frames no state comes for 2 s, or write fails; let it go "
                                "on, or be there again",
                                calls));
    return pass(fmt::format("{} frames without a pause", calls));
}

constexpr std::array<DriverCheck, 11> kEnd{{
    {"zero_at_stop", "first_state", "stop leaves no force", zero_at_stop},
    {"stop_twice", "first_state", "it stops, and a second stop does no harm", stop_twice},
    {"restart", "first_state", "after stop it starts again", restart},
    {"signals", "first_state", "signal handlers stay as they are", signals},
    {"endurance", "first_state",
     "--frames frames without a pause, or 30 s of them; it still answers", endurance},
    {"close_unstarted", "open", "it closes without having been started", close_unstarted},
    {"close", "first_state", "it closes", close},
    {"reopen", "close", "it opens again", reopen},
    {"descriptors", "reopen", "no file stays open", descriptors},
    {"threads", "reopen", "no thread goes on", threads},
    {"memory", "threads", "no memory stays allocated", memory},
}};

} // namespace

std::span<const DriverCheck> library_checks() { return kLibrary; }
std::span<const DriverCheck> life_checks() { return kLife; }
std::span<const DriverCheck> end_checks() { return kEnd; }

} // namespace palpate::command
