// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/run/internal/loop_thread.h>

#include <array>
#include <cstddef>

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>

#include <fmt/format.h>

namespace palpate::internal {
namespace {

bool pin(int cpu) noexcept {
    if (cpu < 0 || cpu >= CPU_SETSIZE) return false;
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(static_cast<unsigned>(cpu), &set);
    return pthread_setaffinity_np(pthread_self(), sizeof(set), &set) == 0;
}

/// Writes to every page of a stack deeper than a frame needs, so that none is missing later.
void touch_stack() noexcept {
    constexpr std::size_t kStack = 262144; // bytes
    constexpr std::size_t kPage = 4096;    // bytes, the smallest there is
    std::array<char, kStack> stack;
    volatile char* bytes = stack.data();
    for (std::size_t i = 0; i < kStack; i += kPage)
        bytes[i] = 0;
}

} // namespace

ScheduledAs::ScheduledAs(Scheduler scheduler) noexcept {
    entered_ =
        pthread_getschedparam(pthread_self(), &policy_, &parameters_) == 0 && enter(scheduler);
}

ScheduledAs::~ScheduledAs() {
    if (entered_) pthread_setschedparam(pthread_self(), policy_, &parameters_);
}

LoopThreadGrants prepare_loop_thread(const LoopThreadSettings& settings) noexcept {
    LoopThreadGrants grants;
    grants.cpu = !settings.cpu || pin(*settings.cpu);
    touch_stack();
    // The kernel may wake an ordinary thread 50 us late to save energy; not this one.
    prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0);
    // Not what comes later: the recorder's memory grows, and need not stay.
    grants.memory = mlockall(MCL_CURRENT) == 0;
    grants.scheduler = enter(settings.scheduler);
    return grants;
}

void release_memory() noexcept { munlockall(); }

std::vector<std::string> refusals(const LoopThreadSettings& settings,
                                  const LoopThreadGrants& grants) {
    std::vector<std::string> lines;
    if (!grants.scheduler)
        lines.push_back(fmt::format(
            "the loop runs without SCHED_FIFO and will be late at times: the system does not "
            "permit it; in the shell `ulimit -r {0}` after a line \"@realtime - rtprio {0}\" in "
            "/etc/security/limits.conf and membership of that group, or once `sudo setcap "
            "cap_sys_nice,cap_ipc_lock+ep` on the program",
            kLoopPriority));
    if (!grants.memory)
        lines.push_back("the loop's memory may be paged out, and it waits then: the system does "
                        "not permit to lock it; a line \"@realtime - memlock unlimited\" in "
                        "/etc/security/limits.conf, or `setcap` as above");
    if (!grants.cpu)
        lines.push_back(
            fmt::format("the loop runs on any processor: there is no processor {} for it; see "
                        "/sys/devices/system/cpu/online",
                        settings.cpu.value_or(0)));
    return lines;
}

} // namespace palpate::internal
