// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <sched.h>

#include <palpate/engine/run/scheduler.h>

namespace palpate::internal {

/// Puts the calling thread under a scheduler for as long as it lives, where the system permits it:
/// threads that are started meanwhile inherit it.
class ScheduledAs {
public:
    explicit ScheduledAs(Scheduler scheduler) noexcept;
    ~ScheduledAs();
    ScheduledAs(const ScheduledAs&) = delete;
    ScheduledAs& operator=(const ScheduledAs&) = delete;

private:
    bool entered_ = false;
    int policy_ = 0; // before
    sched_param parameters_{};
};

/// What a loop's thread asks of the system.
struct LoopThreadSettings {
    Scheduler scheduler = Scheduler::fifo;
    std::optional<int> cpu; ///< the one it stays on, from 0; empty: any
};

/// What it was given.
struct LoopThreadGrants {
    bool scheduler = false;
    bool cpu = false;
    bool memory = false; ///< nothing that is there now can be paged out
};

/// Asks for all of it, in the calling thread: scheduler, processor, every page that the process has
/// now kept in memory, a stack that is there already, and to be woken when it is time. What is
/// refused stays as it was.
LoopThreadGrants prepare_loop_thread(const LoopThreadSettings& settings) noexcept;

/// Gives back what concerns the whole process: its memory may be paged out again.
void release_memory() noexcept;

/// What was refused, what that means and how it is granted; a line each.                [setup]
std::vector<std::string> refusals(const LoopThreadSettings& settings,
                                  const LoopThreadGrants& grants);

} // namespace palpate::internal
