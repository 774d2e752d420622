// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/run/internal/loop_thread.h>

#include <thread>

#include <gtest/gtest.h>

namespace palpate {
namespace {

// A device starts its threads there: under the ordinary scheduler they would starve beside the
// loop. Where the system does not permit it, all stay as they were.
TEST(LoopThread, ThreadsThatAreStartedMeanwhileInheritTheScheduler) {
    const int before = sched_getscheduler(0);
    int meanwhile = -1, inherited = -1;
    {
        const internal::ScheduledAs scheduled(Scheduler::fifo);
        meanwhile = sched_getscheduler(0);
        std::thread([&] { inherited = sched_getscheduler(0); }).join();
    }
    EXPECT_TRUE(meanwhile == SCHED_FIFO || meanwhile == before);
    EXPECT_EQ(inherited, meanwhile);
    EXPECT_EQ(sched_getscheduler(0), before);
}

} // namespace
} // namespace palpate
