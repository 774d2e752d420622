// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include <palpate/engine/study/paced_run.h>

#include "tests/engine/study/study_fixture.h"

/// Baselines, and runs in real time.
namespace palpate {
namespace {

using namespace test::study;

TEST(Baselines, AreMeasuredAgainstTheSameTruth) {
    test::ScriptedClock clock(1.0);
    for (const auto& scene : {gradient_cavity(kHard), surface_cavity()}) {
        const std::vector<StudyRun> runs = run_baselines(*scene, along_the_wall(1e-4), clock);
        ASSERT_EQ(runs.size(), kBaselines.size());
        for (const StudyRun& run : runs) {
            EXPECT_GE(run.level.frames, kFrames - 3) << title(run) << ": 0.1 mm is one row";
            EXPECT_EQ(*run.lost_contact, 0u) << title(run);
            EXPECT_EQ(run.position.frames, run.level.frames) << title(run) << ": it is a sphere";
            const BaselineKind kind = *run.baseline;
            const bool drifts = kind == BaselineKind::linear || kind == BaselineKind::primitives ||
                                kind == BaselineKind::subdivided;
            if (drifts) continue; // by how much, the tests of baselines say
            if (kind == BaselineKind::local_tetrahedra) {
                // Linear along an edge of sqrt(3) mm, and the nudge.
                EXPECT_LT(run.level.max_um, 1e6 * 3e-6 / (8.0 * kRadius_m) + 1.1);
                continue;
            }
            EXPECT_NEAR(run.level.max_um, kind == BaselineKind::virtual_proxy ? 1000.0 : 0.0, 5.0)
                << title(run);
        }
    }
}

// A device that fails for a frame gives no place. Each method holds, as the loop does.
TEST(Baselines, AProbeThatIsNoNumberMovesNothing) {
    test::ScriptedClock clock(1.0);
    const auto scene = surface_cavity();
    const auto sound = along_the_wall(1e-4);
    auto gaps = sound;
    for (std::size_t i = 50; i < 71; ++i)
        gaps[i].position = Vec3(std::numeric_limits<double>::quiet_NaN());
    const std::vector<StudyRun> whole = run_baselines(*scene, sound, clock);
    const std::vector<StudyRun> runs = run_baselines(*scene, gaps, clock);
    ASSERT_EQ(runs.size(), whole.size());
    for (std::size_t i = 0; i < runs.size(); ++i) {
        const StudyRun& run = runs[i];
        EXPECT_EQ(run.frames_in_contact + 21, whole[i].frames_in_contact) << title(run);
        EXPECT_TRUE(std::isfinite(run.level.rms_um) && std::isfinite(run.level.max_um))
            << title(run);
        // 21 frames of 0.2 mm are caught up in one, by steps that drift with the square of the way.
        EXPECT_LT(run.level.max_um, whole[i].level.max_um + 400.0) << title(run);
    }
}

TEST(Baselines, NeedOneLevel) {
    test::ScriptedClock clock(1.0);
    const Scene empty(parse_scene("", "empty.toml"));
    EXPECT_TRUE(run_baselines(empty, along_the_wall(), clock).empty());
}

TEST(Baselines, StopWhenAskedTo) {
    test::ScriptedClock clock(1.0);
    EXPECT_THROW(run_baselines(*surface_cavity(), along_the_wall(), clock,
                               [](double, std::string_view) { return false; }),
                 std::runtime_error);
}

TEST(PacedRun, EndsSoonWhenAskedTo) {
    // A minute of path: who waits for its end fails by the test's own time.
    std::vector<DeviceState> inputs(60000);
    const auto began = std::chrono::steady_clock::now();
    for (const Pace pace : {Pace::locked, Pace::released})
        EXPECT_THROW(run_at_pace(gradient_cavity(kHard), inputs, fixed(1), pace,
                                 Scheduler::ordinary,
                                 [](double, std::string_view) { return false; }),
                     std::runtime_error);
    EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(30));
}

TEST(PacedRun, BeginsATrialWithTheProxyAtTheProbe) {
    // Without trials the second half would be a leap into the wall, and held there; a trial that
    // begins inside feels nothing. It is long, as a busy machine may leave out 100 ms of a run.
    std::vector<DeviceState> inputs(530);
    for (std::size_t i = 30; i < inputs.size(); ++i) {
        inputs[i].position = {2.0 * kRadius_m, 0.0, 0.0};
        inputs[i].trial = 1;
    }
    const StudyRun run =
        run_at_pace(surface_cavity(), inputs, fixed(1), Pace::locked, Scheduler::ordinary);
    EXPECT_EQ(run.frames_in_contact, 0u);
    for (DeviceState& input : inputs)
        input.trial = 0;
    EXPECT_GT(run_at_pace(surface_cavity(), inputs, fixed(1), Pace::locked, Scheduler::ordinary)
                  .frames_in_contact,
              0u);
}

TEST(PacedRun, RunsAPathInRealTimeOrSaysThatItMayNot) {
    const std::vector<DeviceState> inputs = along_the_wall(); // 200 ms: see the trial above
    for (const Pace pace : {Pace::locked, Pace::released})
        for (const Scheduler scheduler : {Scheduler::ordinary, Scheduler::fifo}) {
            const StudyRun run =
                run_at_pace(gradient_cavity(kHard), inputs, fixed(1), pace, scheduler);
            if (run.pace.ends_with("not permitted")) {
                EXPECT_EQ(scheduler, Scheduler::fifo);
                EXPECT_EQ(run.frames_in_contact, 0u);
                continue;
            }
            EXPECT_GE(run.frames_in_contact, 1u);
            EXPECT_LE(run.frames_in_contact, inputs.size() + 1) << "one per period at most";
            EXPECT_GE(run.late_p99_us, 0.0);
            EXPECT_GT(run.level.frames, 0u);
        }
}

TEST(PacedRun, ReleasedFramesAreShorterThanAPeriod) {
    std::vector<DeviceState> inputs = along_the_wall();
    inputs.resize(60);
    const StudyRun run =
        run_at_pace(gradient_cavity(kHard), inputs, fixed(1), Pace::released, Scheduler::ordinary);
    // 0.19 mm is the way of one period; thousands of frames share it wherever this thread runs.
    EXPECT_LT(run.step_mean_um, 100.0);
    EXPECT_EQ(run.pace, "released SCHED_OTHER");
}

} // namespace
} // namespace palpate
