// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/run/internal/servo_loop.h>

#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/scene/scene_file.h>
#include <palpate/haptics/hand/safety_chain.h>

#include "tests/support/scripted_device.h"

namespace palpate {
namespace {

using internal::ServoLoop;
using internal::ServoSettings;
using internal::SpscRing;

std::shared_ptr<const Scene> ball(const std::string& loop = "") {
    return std::make_shared<const Scene>(parse_scene(
        "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n[surface.s]\nvolume = \"v\"\n"
        "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n" +
            loop,
        "ball.toml"));
}

/// A servo loop in the test's own thread, over a clock that the device lets pass.
class Servo : public testing::Test {
protected:
    /// The frames of a run; `during` the reading of a state the test may let time pass.
    std::vector<RunFrame> run(std::size_t capacity = 4096) {
        const std::shared_ptr<const Scene> scene = ball(loop_text_);
        HapticLoop loop(scene, clock_, scene->description().loop, device_.properties());
        SpscRing<RunFrame> ring(capacity);
        SpscRing<std::uint32_t> decisions(decision_capacity_);
        settings_.takes_force = device_.force_n > 0.0;
        const DevicePlacement placement;
        ServoLoop servo(loop, device_, placement, clock_, settings_, ring,
                        keeps_decisions_ ? &decisions : nullptr);
        servo_ = &servo;
        servo.run();
        dropped_ = servo.dropped();
        std::vector<RunFrame> frames;
        RunFrame frame;
        while (ring.pop(frame))
            frames.push_back(frame);
        decision_count_ = 0;
        std::uint32_t decision = 0;
        while (decisions.pop(decision))
            ++decision_count_;
        return frames;
    }
    /// From 10 mm above the ball to `depth` into it within 100 ms, and held there.
    void press(double depth) {
        device_.on_read = [depth](std::size_t read, DeviceState& state) {
            const double share = std::min(1.0, static_cast<double>(read) / 100.0);
            state.position = {0.0, 0.0, 0.06 - share * (0.01 + depth)};
        };
    }

    test::StandingClock clock_;
    test::ScriptedDevice device_;
    ServoSettings settings_;
    ServoLoop* servo_ = nullptr;
    std::string loop_text_;
    bool keeps_decisions_ = false;
    std::size_t decision_capacity_ = 1u << 16;
    std::size_t decision_count_ = 0;
    std::uint64_t dropped_ = 0;
};

TEST_F(Servo, RunsAtItsDeadlinesUntilThePathEnds) {
    device_.force_n = 0.0;
    device_.states = 200;
    press(0.005);
    const double began_us = clock_.now_us();
    const std::vector<RunFrame> frames = run();
    ASSERT_EQ(frames.size(), 200u);
    EXPECT_EQ(clock_.now_us() - began_us, 201e3) << "the last wait finds the path's end";
    for (std::size_t i = 0; i < frames.size(); ++i) {
        EXPECT_EQ(frames[i].frame.frame, i);
        EXPECT_EQ(frames[i].frame.late_us, 0.0);
        EXPECT_EQ(frames[i].missed, 0u);
    }
    EXPECT_GT(glm::length(frames.back().frame.force), 1.0) << "it was in contact";
    ASSERT_EQ(device_.forces.size(), 201u);
    EXPECT_EQ(device_.forces[150], frames[150].frame.force);
    EXPECT_EQ(device_.forces.back(), Vec3(0.0)) << "the last thing that a device gets";
}

TEST_F(Servo, WhereStatesEndUnderAForceItIsLedToZero) {
    device_.states = 400;
    press(0.005);
    const std::vector<RunFrame> frames = run();
    ASSERT_GT(frames.size(), 400u);
    EXPECT_GT(glm::length(frames[399].frame.force), 2.0);
    EXPECT_EQ(frames.back().frame.force, Vec3(0.0));
    constexpr double kSlew_n = 2.0; // a frame
    for (std::size_t i = 1; i < device_.forces.size(); ++i)
        EXPECT_LE(glm::distance(device_.forces[i], device_.forces[i - 1]), kSlew_n + 1e-9) << i;
    for (std::size_t i = 0; i < frames.size(); ++i)
        EXPECT_EQ(frames[i].silence, i < 400 ? Silence::none : Silence::ending) << i;
}

TEST_F(Servo, ASlowLoopIsNotSilent) {
    device_.force_n = 0.0;
    device_.states = 60;
    device_.on_read = [&](std::size_t read, DeviceState&) {
        if (read % 10 == 0) clock_.wake_late(50.0);
    };
    for (const double rate_hz : {50.0, 100.0}) {
        device_.reads = 0;
        settings_.period_us = 1e6 / rate_hz;
        loop_text_ = "[loop]\nrate_hz = " + std::to_string(rate_hz) + "\n";
        const std::vector<RunFrame> frames = run();
        EXPECT_GT(frames.size(), 50u);
        for (const RunFrame& frame : frames)
            EXPECT_EQ(frame.silence, Silence::none) << rate_hz;
    }
}

// A driver holds no force for longer than 20 ms: after a tick that was missed at 60 Hz it has sent
// zero, and the force begins anew, without a step.
TEST_F(Servo, ASlowLoopWithMotorsIsSilentWhereItsDriverIs) {
    device_.force_n = 5.0;
    device_.states = 60;
    device_.on_read = [&](std::size_t read, DeviceState&) {
        if (read % 20 == 10) clock_.wake_late(16'000.0);
    };
    settings_.period_us = 1e6 / 60.0;
    settings_.takes_force = true;
    loop_text_ = "[loop]\nrate_hz = 60\n";
    std::size_t silent = 0;
    for (const RunFrame& frame : run())
        silent += frame.silence == Silence::loop ? 1 : 0;
    EXPECT_EQ(silent, 3u);
}

TEST_F(Servo, APathGoesOnWhileTheLoopIsLate) {
    device_.force_n = 0.0;
    device_.states = 100;
    device_.on_read = [&](std::size_t read, DeviceState&) {
        if (read == 10) clock_.wake_late(3300.0); // of the frame after this one
    };
    const std::vector<RunFrame> frames = run();
    ASSERT_EQ(frames.size(), 97u) << "three rows were left out";
    EXPECT_EQ(frames[11].frame.late_us, 3300.0);
    EXPECT_EQ(frames[11].missed, 3u);
    EXPECT_EQ(frames[11].overrun, Overrun::woken_late);
    EXPECT_NEAR(frames[11].frame.time_s, 14e-3, 1e-12) << "the row of the clock, not the next one";
    EXPECT_EQ(frames[12].missed, 0u);
    EXPECT_NEAR(frames[12].frame.time_s, 15e-3, 1e-12);
}

TEST_F(Servo, ADeviceThatKeepsTheLoopWaitingIsItsOwnWork) {
    device_.force_n = 0.0;
    device_.states = 50;
    device_.on_read = [&](std::size_t read, DeviceState&) {
        if (read == 20) clock_.pass(1700.0);
    };
    const std::vector<RunFrame> frames = run();
    EXPECT_EQ(frames[20].overrun, Overrun::own_work);
    EXPECT_EQ(frames[20].missed, 1u);
    EXPECT_EQ(frames.size(), 49u);
}

TEST_F(Servo, AfterALongPauseTheInputIsStaleForOneFrame) {
    settings_.most_frames = 60;
    press(0.002);
    bool was_paused = false;
    const auto press_it = device_.on_read;
    device_.on_read = [&](std::size_t read, DeviceState& state) {
        press_it(read, state);
        if (read == 20 && !was_paused) {
            was_paused = true;
            clock_.wake_late(ServoLoop::kLongestGap_us);
        }
    };
    const std::vector<RunFrame> frames = run();
    EXPECT_EQ(frames[20].silence, Silence::none);
    EXPECT_EQ(frames[21].silence, Silence::loop);
    EXPECT_EQ(frames[21].input.freshness, Freshness::stale) << "a replay sees it, too";
    EXPECT_EQ(frames[22].silence, Silence::none);
    EXPECT_EQ(frames[22].input.freshness, Freshness::fresh);
}

/// A pause of half a second under a force, from the state `at` on, which `pause` makes.
class ServoAfterAPause : public Servo {
protected:
    std::vector<RunFrame> run_with(std::size_t at, const std::function<void()>& pause) {
        settings_.most_frames = 400;
        press(0.005);
        const auto press_it = device_.on_read;
        device_.on_read = [=, is_over = false](std::size_t read, DeviceState& state) mutable {
            press_it(read, state);
            if (read == at && !std::exchange(is_over, true)) pause();
        };
        return run();
    }
};

// The motors had nothing for 480 ms. The frame after it faded from the force before: a kick of
// 3 N or more.
TEST_F(ServoAfterAPause, AForceThatItsDriverHasLetGoOfIsNotBegunAgain) {
    constexpr std::size_t kAt = 300;
    const std::vector<RunFrame> frames = run_with(kAt, [&] { clock_.wake_late(500e3); });
    ASSERT_GT(frames.size(), kAt + 10);
    ASSERT_GT(glm::length(device_.forces[kAt]), 2.0) << "it was in contact";
    EXPECT_EQ(frames[kAt + 1].silence, Silence::loop);
    EXPECT_NE(frames[kAt + 1].frame.force, Vec3(0.0)) << "the chain fades it";
    for (std::size_t i = kAt + 1; i < device_.forces.size(); ++i) // it waits for a small force
        ASSERT_EQ(device_.forces[i], Vec3(0.0)) << i;
}

TEST_F(ServoAfterAPause, WithinAFrameItIsNotSentEither) {
    constexpr std::size_t kAt = 300;
    const std::vector<RunFrame> frames = run_with(kAt, [&] { clock_.pass(500e3); });
    ASSERT_GT(frames.size(), kAt + 10);
    EXPECT_GT(glm::length(device_.forces[kAt - 1]), 2.0);
    EXPECT_GT(glm::length(frames[kAt].frame.force), 2.0) << "it was computed in time";
    for (std::size_t i = kAt; i < device_.forces.size(); ++i)
        ASSERT_EQ(device_.forces[i], Vec3(0.0)) << i;
}

TEST_F(Servo, AShortPauseLeavesTheInputFresh) {
    device_.force_n = 0.0;
    device_.states = 60;
    device_.on_read = [&](std::size_t read, DeviceState&) {
        if (read == 20) clock_.wake_late(ServoLoop::kLongestGap_us - 1000.0);
    };
    for (const RunFrame& frame : run())
        EXPECT_EQ(frame.input.freshness, Freshness::fresh);
}

TEST_F(Servo, ASilentDeviceIsStale) {
    device_.force_n = 0.0;
    device_.states = 60;
    device_.on_read = [&](std::size_t read, DeviceState& state) {
        if (read >= 20 && read < 30) state.freshness = Freshness::stale;
    };
    const std::vector<RunFrame> frames = run();
    for (std::size_t i = 0; i < frames.size(); ++i)
        EXPECT_EQ(frames[i].silence, i >= 20 && i < 30 ? Silence::device : Silence::none) << i;
}

TEST_F(Servo, ASilentDeviceIsSentNoForceWithinTenMilliseconds) {
    settings_.most_frames = 500;
    press(0.005);
    const auto press_it = device_.on_read;
    device_.on_read = [&](std::size_t read, DeviceState& state) {
        press_it(read, state);
        if (read >= 400) state.freshness = Freshness::stale;
    };
    const std::vector<RunFrame> frames = run();
    EXPECT_GT(glm::length(frames[399].frame.force), 1.0);
    for (std::size_t i = 404; i < frames.size(); ++i)
        EXPECT_EQ(frames[i].frame.force, Vec3(0.0)) << i;
}

TEST_F(Servo, StopsWhereItIsAskedToAndLeavesNoForce) {
    press(0.005);
    const auto press_it = device_.on_read;
    device_.on_read = [&](std::size_t read, DeviceState& state) {
        press_it(read, state);
        if (read == 300) servo_->ask_to_stop();
    };
    const std::vector<RunFrame> frames = run();
    ASSERT_GE(frames.size(), 302u);
    EXPECT_EQ(frames[300].silence, Silence::none);
    EXPECT_GT(glm::length(frames[300].frame.force), 1.0);
    for (std::size_t i = 301; i < frames.size(); ++i) {
        EXPECT_EQ(frames[i].silence, Silence::ending);
        EXPECT_EQ(frames[i].input.freshness, Freshness::stale);
        EXPECT_EQ(frames[i].frame.force == Vec3(0.0), i + 1 == frames.size());
    }
    EXPECT_LE(frames.size(), 301u + 4u) << "SafetySettings::fade_s";
    EXPECT_EQ(device_.forces.back(), Vec3(0.0));
}

TEST_F(Servo, ALimitEndsARunAsARequestDoes) {
    press(0.005);
    settings_.most_frames = 200;
    std::vector<RunFrame> frames = run();
    ASSERT_GE(frames.size(), 200u);
    EXPECT_EQ(frames[199].silence, Silence::none);
    EXPECT_LE(frames.size(), 204u);
    EXPECT_EQ(device_.forces.back(), Vec3(0.0));

    // A device that takes no force has none to be taken away.
    device_ = test::ScriptedDevice{};
    device_.force_n = 0.0;
    EXPECT_EQ(run().size(), 200u);
    device_ = test::ScriptedDevice{};
    device_.force_n = 0.0;
    settings_ = ServoSettings{};
    settings_.longest_us = 80e3;
    EXPECT_EQ(run().size(), 80u);
}

TEST_F(Servo, ARecorderThatDoesNotKeepUpLosesFramesAndNotTheLoop) {
    device_.force_n = 0.0;
    device_.states = 100;
    const std::vector<RunFrame> frames = run(/*capacity=*/64);
    EXPECT_EQ(frames.size(), 64u);
    EXPECT_EQ(dropped_, 36u);
    EXPECT_EQ(device_.forces.size(), 101u) << "every frame was felt";
}

TEST_F(Servo, PeriodsThatADroppedFrameMissedAreToldWithTheNextOne) {
    device_.force_n = 0.0;
    device_.states = 100;
    std::uint64_t all = 0;
    for (const std::size_t capacity : {std::size_t{4096}, std::size_t{16}}) {
        device_.reads = 0;
        SpscRing<RunFrame> ring(capacity);
        std::uint64_t missed = 0;
        const auto take = [&] {
            for (RunFrame frame; ring.pop(frame);)
                missed += frame.missed;
        };
        device_.on_read = [&](std::size_t read, DeviceState&) {
            if (read == 40) clock_.wake_late(5500.0); // while the small ring is full
            if (read == 80) take();
        };
        const std::shared_ptr<const Scene> scene = ball(loop_text_);
        HapticLoop loop(scene, clock_, scene->description().loop, device_.properties());
        const DevicePlacement placement;
        ServoLoop servo(loop, device_, placement, clock_, settings_, ring, nullptr);
        servo.run();
        take();
        EXPECT_EQ(servo.dropped() > 0, capacity == 16);
        EXPECT_GT(missed, 0u);
        if (capacity == 4096) all = missed;
        EXPECT_EQ(missed, all);
    }
}

TEST_F(Servo, AFrameAndItsDecisionsAreKeptOrDroppedTogether) {
    device_.force_n = 0.0;
    device_.states = 40;
    loop_text_ = "[loop]\nmethod = \"paper\"\nbudget_us = 20\n";
    keeps_decisions_ = true;
    press(0.001);
    // The clock moves a little at each reading, or the paper's method would never be done.
    class TickingClock final : public PacedClock {
    public:
        double now_us() noexcept override { return now_us_ += 1.0; }
        void sleep_until(double deadline_us) noexcept override {
            now_us_ = std::max(now_us_, deadline_us);
        }

    private:
        double now_us_ = 0.0;
    } clock;
    const std::shared_ptr<const Scene> scene = ball(loop_text_);
    for (const std::size_t capacity : {std::size_t{64}, std::size_t{1} << 16}) {
        device_.reads = 0;
        HapticLoop loop(scene, clock);
        SpscRing<RunFrame> ring(4096);
        SpscRing<std::uint32_t> decisions(capacity);
        const DevicePlacement placement;
        ServoLoop servo(loop, device_, placement, clock, settings_, ring, &decisions);
        servo.run();
        std::size_t evaluations = 0, frames = 0, kept = 0;
        RunFrame frame;
        for (; ring.pop(frame); ++frames)
            evaluations += frame.frame.evaluations;
        std::uint32_t decision = 0;
        for (; decisions.pop(decision);)
            ++kept;
        EXPECT_EQ(kept, evaluations);
        EXPECT_GT(evaluations, 0u);
        EXPECT_EQ(frames + servo.dropped(), 40u);
        EXPECT_EQ(servo.dropped() > 0, capacity == 64) << capacity;
    }
}

TEST_F(Servo, AFrameAndItsTouchesAreKeptOrDroppedTogether) {
    press(0.002);
    settings_.most_frames = 200;
    const std::shared_ptr<const Scene> scene = ball();
    for (const std::size_t capacity : {std::size_t{16}, std::size_t{1024}}) {
        SCOPED_TRACE(capacity);
        device_.reads = 0;
        HapticLoop loop(scene, clock_);
        SpscRing<RunFrame> ring(4096);
        SpscRing<RecordedTouch> touches(capacity);
        const DevicePlacement placement;
        ServoLoop servo(loop, device_, placement, clock_, settings_, ring, nullptr, &touches);
        servo.run();
        RunFrame run;
        std::size_t frames = 0, touched = 0;
        for (; ring.pop(run); ++frames) {
            EXPECT_EQ(run.touches, run.frame.contacts) << "none ends: each is a contact";
            for (std::uint32_t i = 0; i < run.touches; ++i, ++touched) {
                RecordedTouch touch;
                ASSERT_TRUE(touches.pop(touch));
                EXPECT_EQ(touch.frame, run.frame.frame);
            }
        }
        RecordedTouch left;
        EXPECT_FALSE(touches.pop(left));
        EXPECT_GE(touched, 16u);
        EXPECT_EQ(frames + servo.dropped(), 200u);
        EXPECT_EQ(servo.dropped() > 0, capacity == 16);
    }
}

} // namespace
} // namespace palpate
