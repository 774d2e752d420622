// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/run/realtime_run.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <new>
#include <stdexcept>

#include <gtest/gtest.h>

#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/scene/scene_file.h>

#include "tests/support/scripted_device.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

std::shared_ptr<const Scene> ball(const std::string& loop = "") {
    return std::make_shared<const Scene>(parse_scene(
        "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n[surface.s]\nvolume = \"v\"\n"
        "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n" +
            loop,
        "ball.toml"));
}

/// Goes into the ball and round in it.
void go_round(std::size_t read, DeviceState& state) {
    const double t = 1e-3 * static_cast<double>(read);
    state.position =
        (0.052 - 0.005 * std::min(1.0, 10.0 * t)) * Vec3{std::cos(2.0 * t), std::sin(2.0 * t), 0.0};
}

RealtimeSettings frames(std::uint64_t most) {
    RealtimeSettings settings;
    settings.most_frames = most;
    return settings;
}

bool same_bits(const Vec3& a, const Vec3& b) {
    for (int i = 0; i < 3; ++i)
        if (std::bit_cast<std::uint64_t>(a[i]) != std::bit_cast<std::uint64_t>(b[i])) return false;
    return true;
}

TEST(RealtimeRun, MakesProgressHereAndEndsWithAStoppedDevice) {
    test::ScriptedDevice device;
    device.on_read = go_round;
    const Trace trace = run_realtime(ball(), {device, {}}, frames(300));
    ASSERT_TRUE(trace.realtime.has_value());
    EXPECT_GE(trace.frames.size(), 300u);
    EXPECT_EQ(trace.inputs.size(), trace.frames.size());
    double largest_n = 0.0;
    for (const FrameReport& frame : trace.frames)
        largest_n = std::max(largest_n, glm::length(frame.force));
    // A machine that is so busy that the loop was late must not push: then no force is right, too.
    if (trace.realtime->silent_loop == 0) {
        EXPECT_GT(largest_n, 0.5);
    }
    EXPECT_EQ(trace.device.name, "scripted");
    EXPECT_EQ(device.calls, (std::vector<std::string>{"open", "start", "stop", "close"}));
    EXPECT_EQ(device.forces.back(), Vec3(0.0));
}

TEST(RealtimeRun, AReplayOfItsRecordingHasItsBits) {
    test::TemporaryFolder folder;
    for (const char* loop : {"", "[loop]\nmethod = \"paper\"\nbudget_us = 200\n"}) {
        SCOPED_TRACE(loop);
        test::ScriptedDevice device;
        device.on_read = [](std::size_t read, DeviceState& state) {
            go_round(read, state);
            state.velocity = {0.01, 0.02, 0.03};
            state.buttons = static_cast<std::uint32_t>(read / 50 % 2);
            if (read > 100 && read < 120) state.freshness = Freshness::stale;
        };
        const auto scene = ball(loop);
        const Trace trace =
            run_realtime(scene, {device, DevicePlacement(DevicePlacementSettings{})}, frames(300));
        ASSERT_EQ(trace.realtime->dropped, 0u);
        write_recording(folder / "r.h5", recorded(*scene, {}, trace));

        const Recording recording = read_recording(folder / "r.h5");
        const auto again = recorded_scene(recording, "r.h5", {});
        const Trace replayed = run_again(again, recording);
        ASSERT_EQ(replayed.frames.size(), trace.frames.size());
        for (std::size_t i = 0; i < trace.frames.size(); ++i) {
            ASSERT_TRUE(same_bits(replayed.frames[i].proxy, trace.frames[i].proxy)) << i;
            ASSERT_TRUE(same_bits(replayed.frames[i].force, trace.frames[i].force)) << i;
            ASSERT_EQ(replayed.frames[i].flags, trace.frames[i].flags) << i;
            ASSERT_EQ(replayed.frames[i].evaluations, trace.frames[i].evaluations) << i;
        }
        EXPECT_EQ(recording.touches, trace.touches);
        EXPECT_EQ(replayed.touches, trace.touches);
        EXPECT_GT(trace.touches.size(), 50u);
        EXPECT_EQ(recording.inputs[60].buttons, trace.inputs[60].buttons);
        EXPECT_EQ(recording.inputs[110].freshness, trace.inputs[110].freshness);
    }
}

TEST(RealtimeRun, AnAuditComputesTheSameFrames) {
    test::ScriptedDevice device;
    device.on_read = go_round;
    const auto scene = ball();
    Trace trace = run_realtime(scene, {device, {}}, frames(300));
    EXPECT_TRUE(trace.audits.empty());
    audit(scene, trace);
    ASSERT_EQ(trace.audits.size(), 1u);
    EXPECT_GT(trace.audits.front().level_distance_m().size(), 100u);

    trace.audits.clear();
    trace.realtime->dropped = 1;
    audit(scene, trace);
    EXPECT_TRUE(trace.audits.empty()) << "frames are missing: no audit rather than a wrong one";
}

TEST(RealtimeRun, ThePathsEndEndsIt) {
    test::ScriptedDevice device;
    device.states = 100;
    device.force_n = 0.0;
    const Trace trace = run_realtime(ball(), {device, {}}, {});
    // All of it was read, each state at most once: after a late frame, several at a time.
    EXPECT_EQ(device.reads, 100u);
    EXPECT_LE(trace.frames.size(), 100u);
    EXPECT_GE(trace.frames.size(), 1u);
    EXPECT_EQ(device.calls.back(), "close");
}

TEST(RealtimeRun, ProgressEndsItAndWhatWasRecordedStays) {
    test::ScriptedDevice device;
    device.on_read = go_round;
    RunWatch watch;
    std::size_t told = 0;
    watch.frame = [&](const RunFrame& run) { EXPECT_EQ(run.frame.frame, told++); };
    watch.progress = [&](double, std::string_view) { return told < 200; };
    const Trace trace = run_realtime(ball(), {device, {}}, {}, watch);
    EXPECT_GE(trace.frames.size(), 200u);
    EXPECT_EQ(told, trace.frames.size());
    EXPECT_EQ(device.forces.back(), Vec3(0.0));
    EXPECT_EQ(device.calls, (std::vector<std::string>{"open", "start", "stop", "close"}));
}

TEST(RealtimeRun, AnExceptionLeavesAStoppedDeviceWithoutForce) {
    test::ScriptedDevice device;
    device.on_read = go_round;
    RunWatch watch;
    watch.frame = [](const RunFrame& run) {
        if (run.frame.frame == 150) throw std::bad_alloc();
    };
    EXPECT_THROW(run_realtime(ball(), {device, {}}, {}, watch), std::bad_alloc);
    EXPECT_EQ(device.forces.back(), Vec3(0.0));
    EXPECT_EQ(device.calls, (std::vector<std::string>{"open", "start", "stop", "close"}));

    // Before the first frame as well.
    device = test::ScriptedDevice{};
    RealtimeSettings settings;
    settings.cpu = 1 << 20; // no machine has it
    watch = {};
    watch.warning = [](const std::string& warning) { throw std::runtime_error(warning); };
    EXPECT_THROW(run_realtime(ball(), {device, {}}, settings, watch), std::runtime_error);
    EXPECT_EQ(device.forces.back(), Vec3(0.0));
    EXPECT_EQ(device.calls.back(), "close");
}

TEST(RealtimeRun, ADeviceThatCannotBeOpenedSaysWhyAndIsClosed) {
    test::ScriptedDevice device;
    device.refusal = "hid:3: no permission; install the udev rule";
    try {
        run_realtime(ball(), {device, {}}, {});
        FAIL() << "it was started";
    } catch (const DeviceError& error) {
        EXPECT_EQ(error.what(), device.refusal);
    }
    EXPECT_EQ(device.calls, (std::vector<std::string>{"open", "stop", "close"}));
    EXPECT_EQ(device.reads, 0u);
}

TEST(RealtimeRun, WhatTheSystemRefusesIsSaidOnceWithTheRemedy) {
    test::ScriptedDevice device;
    device.states = 20;
    RealtimeSettings settings;
    settings.cpu = 1 << 20; // no machine has it
    std::vector<std::string> warnings;
    RunWatch watch;
    watch.warning = [&](const std::string& warning) {
        EXPECT_EQ(device.reads, 0u) << "before the first frame";
        warnings.push_back(warning);
    };
    run_realtime(ball(), {device, {}}, settings, watch);
    std::size_t about_processors = 0;
    for (const std::string& warning : warnings) {
        EXPECT_EQ(warning.find('\n'), std::string::npos);
        about_processors += warning.find("no processor 1048576") != std::string::npos ? 1 : 0;
    }
    EXPECT_EQ(about_processors, 1u);
    EXPECT_LE(warnings.size(), 3u);
}

TEST(RealtimeRun, ABudgetThatLeavesLessThanATenthIsRefused) {
    LoopDescription loop;
    for (const double rate_hz : {50.0, 700.0, 1000.0, 3000.0, 20000.0}) {
        loop.rate_hz = rate_hz;
        loop.budget_us = 0.9e6 / rate_hz;
        EXPECT_NO_THROW(check_duty(loop)) << rate_hz;
        loop.budget_us = 0.91e6 / rate_hz;
        EXPECT_THROW(check_duty(loop), std::invalid_argument) << rate_hz;
    }
    test::ScriptedDevice device;
    EXPECT_THROW(run_realtime(ball("[loop]\nbudget_us = 950\n"), {device, {}}, {}),
                 std::invalid_argument);
    EXPECT_TRUE(device.calls.empty());
}

} // namespace
} // namespace palpate
