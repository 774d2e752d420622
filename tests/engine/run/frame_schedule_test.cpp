// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/run/frame_schedule.h>

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace palpate {
namespace {

// Times are whole us and exact in double.
constexpr double kPeriod = 1000.0;
constexpr double kStart = 5.0e9;

double tick(int n) { return kStart + kPeriod * n; }

TEST(FrameSchedule, FramesInTimeMissNothing) {
    FrameSchedule schedule(kPeriod, kStart);
    for (int i = 1; i <= 1000; ++i) {
        ASSERT_EQ(schedule.deadline_us(), tick(i));
        const FrameSchedule::Begin begun = schedule.begin(tick(i) + 30.0);
        EXPECT_EQ(begun.late_us, 30.0);
        EXPECT_EQ(begun.periods, 1u);
        const FrameSchedule::End ended = schedule.end(tick(i) + 900.0);
        EXPECT_EQ(ended.missed, 0u);
        EXPECT_EQ(ended.overrun, Overrun::none);
    }
}

TEST(FrameSchedule, AFrameThatIsTooLongIsItsOwnWork) {
    FrameSchedule schedule(kPeriod, kStart);
    schedule.begin(tick(1));
    const FrameSchedule::End ended = schedule.end(tick(1) + 2500.0);
    EXPECT_EQ(ended.missed, 2u) << "ticks 2 and 3";
    EXPECT_EQ(ended.overrun, Overrun::own_work);
    EXPECT_EQ(schedule.deadline_us(), tick(4)) << "nothing is caught up with";
    EXPECT_EQ(schedule.begin(tick(4)).periods, 3u) << "of the device's time since tick 1";
    EXPECT_EQ(schedule.end(tick(4) + 1.0).missed, 0u);
}

TEST(FrameSchedule, AFrameThatIsWokenLateIsTheSystemsFault) {
    FrameSchedule schedule(kPeriod, kStart);
    // Whole periods, and then in time.
    const FrameSchedule::Begin begun = schedule.begin(tick(1) + 3300.0);
    EXPECT_EQ(begun.late_us, 3300.0);
    EXPECT_EQ(begun.periods, 4u);
    FrameSchedule::End ended = schedule.end(tick(1) + 3400.0);
    EXPECT_EQ(ended.missed, 3u) << "ticks 1 to 3: it is the frame of tick 4";
    EXPECT_EQ(ended.overrun, Overrun::woken_late);
    EXPECT_EQ(schedule.deadline_us(), tick(5));
    // Less than a period, but too much for a frame that would have fitted.
    schedule.begin(tick(5) + 300.0);
    ended = schedule.end(tick(5) + 300.0 + 800.0);
    EXPECT_EQ(ended.missed, 1u);
    EXPECT_EQ(ended.overrun, Overrun::woken_late);
    EXPECT_EQ(schedule.deadline_us(), tick(7));
}

TEST(FrameSchedule, LateAndTooLongIsOneOverrunOfItsOwnWork) {
    FrameSchedule schedule(kPeriod, kStart);
    schedule.begin(tick(1) + 2100.0);
    const FrameSchedule::End ended = schedule.end(tick(1) + 2100.0 + 1500.0);
    EXPECT_EQ(ended.missed, 2u + 1u) << "ticks 1 and 2 before, 4 after";
    EXPECT_EQ(ended.overrun, Overrun::own_work);
    EXPECT_EQ(schedule.deadline_us(), tick(5));
}

TEST(FrameSchedule, FramesThatAreTooLongLeaveTheSystemItsRest) {
    FrameSchedule schedule(kPeriod, kStart);
    schedule.begin(tick(1));
    EXPECT_EQ(schedule.end(tick(2) - 61.0).missed, 0u) << "just more than 6 % for others";
    schedule.begin(tick(2));
    EXPECT_EQ(schedule.end(tick(3) - 59.0).missed, 1u);
    EXPECT_EQ(schedule.deadline_us(), tick(4));
    schedule.begin(tick(4));
    schedule.end(tick(7) - 100.0);
    EXPECT_EQ(schedule.deadline_us(), tick(8)) << "2900 us of work leave 185 us, not 100";
}

// Whatever a clock does: each tick is a frame's or missed, deadlines lie ahead of the frame's end,
// and sustained duty stays below what is allowed.
TEST(FrameSchedule, EveryTickIsEitherAFramesOrMissed) {
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
        SCOPED_TRACE(seed);
        std::mt19937_64 random(seed);
        std::exponential_distribution<double> delay(1.0 / 400.0);
        FrameSchedule schedule(kPeriod, kStart);
        std::uint64_t frames = 0, missed = 0;
        double now = kStart, busy = 0.0;
        for (int i = 0; i < 20000; ++i) {
            now = std::max(now, schedule.deadline_us()) + delay(random);
            const double began = now;
            schedule.begin(now);
            now += delay(random) + 500.0 * static_cast<double>(seed);
            busy += now - began;
            missed += schedule.end(now).missed;
            ++frames;
            ASSERT_GE(schedule.deadline_us(), now);
        }
        const double periods = (schedule.deadline_us() - kStart) / kPeriod;
        EXPECT_EQ(static_cast<double>(frames + missed), periods - 1.0);
        EXPECT_LE(busy, (1.0 - FrameSchedule::kRest) * (schedule.deadline_us() - kStart));
    }
}

} // namespace
} // namespace palpate
