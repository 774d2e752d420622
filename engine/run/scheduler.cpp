// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/run/scheduler.h>

#include <pthread.h>
#include <sched.h>

namespace palpate {

bool enter(Scheduler scheduler) noexcept {
    sched_param parameters{};
    if (scheduler == Scheduler::fifo) parameters.sched_priority = kLoopPriority;
    return pthread_setschedparam(pthread_self(),
                                 scheduler == Scheduler::fifo ? SCHED_FIFO : SCHED_OTHER,
                                 &parameters) == 0;
}

} // namespace palpate
