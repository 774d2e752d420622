// SPDX-License-Identifier: Apache-2.0
// Checks of `palpate validate effect`: what its frames take, and what it leaves behind.
#include <palpate/engine/command/effect_trial.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstddef>
#include <filesystem>
#include <iterator>

#include <linux/filter.h>
#include <linux/seccomp.h>
#include <malloc.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

namespace palpate::command {
namespace {

constexpr int kFrames = 600;

DeviceState state_at(EffectTrial& trial, int frame) {
    DeviceState state;
    state.time_s = 1e-3 * frame;
    state.position = trial.way()[static_cast<std::size_t>(frame) % trial.way().size()];
    return state;
}

/// The processor time of a frame, us: the median.
double median_us(EffectTrial& trial, HapticLoop& loop) {
    constexpr int kTimed = 201;
    std::vector<double> spent_us;
    spent_us.reserve(kTimed);
    for (int frame = 0; frame < kTimed; ++frame) {
        const double began_s = thread_cpu_s();
        loop.frame(state_at(trial, frame));
        spent_us.push_back(1e6 * (thread_cpu_s() - began_s));
    }
    std::nth_element(spent_us.begin(), spent_us.begin() + kTimed / 2, spent_us.end());
    return spent_us[kTimed / 2];
}

Verdict cost(EffectTrial& trial) {
    const double without_us = median_us(trial, *trial.loop_without());
    const double with_us = median_us(trial, *trial.loop());
    const double budget_us = budget_of(trial.scene()->description().loop);
    const std::string seen =
        fmt::format("{:.3g} us of the processor a frame, {:.3g} without it", with_us, without_us);
    if (with_us > budget_us)
        return fail(
            fmt::format("{}, and a frame has {:.3g}; compute it once a frame in begin(), or "
                        "when it is made",
                        seen, budget_us));
    if (with_us > without_us + 0.1 * budget_us)
        return warn(fmt::format("{}: it takes a tenth of a frame; compute it once a frame", seen));
    return pass(seen);
}

Watched watched_frames(EffectTrial& trial) {
    const auto loop = trial.loop();
    for (int frame = 0; frame < 20; ++frame) // the first ones may be a library's
        loop->frame(state_at(trial, frame));
    begin_watch();
    for (int frame = 20; frame < kFrames; ++frame)
        loop->frame(state_at(trial, frame));
    return end_watch();
}

Verdict allocation(EffectTrial& trial) {
    if (!can_watch()) return unwatched();
    const Watched seen = watched_frames(trial);
    if (seen.allocations > 0)
        return fail(fmt::format("{} allocations in {} frames; allocate where it is made",
                                seen.allocations, kFrames));
    return pass("frames allocate nothing");
}

Verdict locks(EffectTrial& trial) {
    if (!can_watch()) return unwatched();
    const Watched seen = watched_frames(trial);
    if (seen.locks > 0)
        return fail(fmt::format("{} locks are taken in {} frames; hand numbers over by atomics",
                                seen.locks, kFrames));
    return pass("frames take no lock");
}

/// From here on this process may only end or ask for the time, which a frame does: where the
/// processor's counter is not trusted, the kernel tells it. Anything else kills it.
bool forbid_system_calls() {
    sock_filter rules[] = {
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_exit_group, 2, 0),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_clock_gettime, 1, 0),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
    };
    const sock_fprog program{static_cast<unsigned short>(std::size(rules)), rules};
    return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
           prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

Verdict system_calls(EffectTrial& trial) {
    if (!can_watch()) return unwatched(); // a sanitizer makes system calls of its own
    constexpr int kNoFilter = 7;
    const auto loop = trial.loop();
    for (int frame = 0; frame < 20; ++frame)
        loop->frame(state_at(trial, frame));
    const pid_t child = fork();
    if (child == 0) {
        if (!forbid_system_calls()) _exit(kNoFilter);
        for (int frame = 20; frame < kFrames; ++frame)
            loop->frame(state_at(trial, frame));
        _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGSYS)
        return fail("a frame calls the system: it sleeps, reads or prints; do that elsewhere");
    if (!WIFEXITED(status)) return fail("frames end the process");
    if (WEXITSTATUS(status) == kNoFilter) return skip("this kernel has no filter of system calls");
    return pass("frames call nothing of the system");
}

std::size_t threads_listed() {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator("/proc/self/task"), {}));
}

/// A thread is listed until a moment after it was joined.
std::size_t threads_now() {
    constexpr double kMoment_s = 0.02;
    std::size_t fewest = threads_listed();
    for (const double began_s = monotonic_s(); monotonic_s() - began_s < kMoment_s;)
        fewest = std::min(fewest, threads_listed());
    return fewest;
}

/// With blocks that the C library maps alone, as they are large.
std::size_t allocated_bytes() {
    const auto info = mallinfo2();
    return info.uordblks + info.hblkhd;
}

Verdict memory(EffectTrial& trial) {
    constexpr std::size_t kRuns = 8, kSmall = 256;
    for (int i = 0; i < 2; ++i)
        trial.loop()->frame(state_at(trial, 0));
    const std::size_t bytes = allocated_bytes(), threads = threads_now();
    for (std::size_t i = 0; i < kRuns; ++i)
        trial.loop()->frame(state_at(trial, 0));
    const std::size_t bytes_after = allocated_bytes(), threads_after = threads_now();
    if (threads_after > threads)
        return fail(
            fmt::format("{} threads go on after it was destroyed {} times; end and join them",
                        threads_after - threads, kRuns));
    if (bytes_after > bytes + kRuns * kSmall)
        return fail(
            fmt::format("{} bytes stay allocated after it was destroyed {} times; free them",
                        bytes_after - bytes, kRuns));
    return pass("what it allocates is freed again");
}

constexpr std::array<EffectCheck, 5> kCost{{
    {"cost", "make", "a frame keeps within its budget", cost},
    {"allocation", "felt", "frames allocate nothing", allocation},
    {"locks", "felt", "frames take no lock", locks},
    {"system_calls", "felt", "frames call nothing of the system", system_calls},
    {"memory", "make", "what it allocates is freed", memory},
}};

} // namespace

std::span<const EffectCheck> effect_cost_checks() { return kCost; }

} // namespace palpate::command
