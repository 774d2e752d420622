// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/run/realtime_run.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <exception>
#include <future>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/report/trace_summary.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/support/scripted_device.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_meshes.h"

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

    RunWatch watch;
    watch.loop = [](HapticLoop* loop) {
        if (loop != nullptr) {
            EXPECT_TRUE(loop->set_gain(0, 0.5));
        }
    };
    trace = run_realtime(scene, {device, {}}, frames(300), watch);
    audit(scene, trace);
    EXPECT_TRUE(trace.audits.empty()) << "nor of what was felt more weakly than the scene says";
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

/// The ball by its formula, and with a mesh of it: what a preview is, and what follows it.
std::shared_ptr<const Scene> ball_with(ContactKind contact) {
    SceneDescription scene;
    scene.volumes["v"].analytic = "solid_sphere";
    scene.volumes["v"].parameters["radius_mm"] = 50.0;
    SurfaceDescription& surface = scene.surfaces["s"];
    surface.volume = "v";
    surface.contact = contact;
    if (contact != ContactKind::volume)
        surface.triangle_mesh = std::make_shared<const TriangleMesh>(test::icosphere(0.05, 4));
    scene.effects.push_back(effects::Surface{.surface = "s"});
    return std::make_shared<const Scene>(scene);
}

RealtimeSettings frames_before(std::uint64_t most, std::shared_ptr<const Scene> next) {
    RealtimeSettings settings = frames(most);
    std::promise<std::shared_ptr<const Scene>> promise;
    promise.set_value(std::move(next));
    settings.next = promise.get_future().share();
    return settings;
}

// A busy machine makes the other scene later: the hand stays out until it is there.
TEST(RealtimeRun, AnotherSceneTakesOverWhileNothingIsFelt) {
    constexpr std::size_t kSeen = 400;
    std::atomic<bool> has_taken_over = false; // the device's thread reads it
    test::ScriptedDevice device;
    device.on_read = [&](std::size_t read, DeviceState& state) {
        // In contact before it has been free for long enough, then free, then again.
        const bool out = read < 20 || (read >= 200 && !has_taken_over);
        state.position = {out ? 0.06 : 0.049, 0.0, 0.0};
    };
    RunWatch watch;
    std::size_t seen = 0; // frames from the first of the scene itself on
    watch.frame = [&](const RunFrame& run) {
        if (has_taken_over || (run.frame.flags & kSceneAdopted) != 0) ++seen;
        has_taken_over = seen > 0;
    };
    watch.progress = [&](double, std::string_view) { return seen < kSeen; };
    const auto preview = ball_with(ContactKind::volume);
    const auto scene = ball_with(ContactKind::mesh); // which does not go on from a volume
    Trace trace = run_realtime(preview, {device, {}}, frames_before(60000, scene), watch);
    ASSERT_EQ(trace.before, preview);
    std::size_t adopted = 0, at = 0;
    for (std::size_t i = 0; i < trace.frames.size(); ++i)
        if (trace.frames[i].flags & kSceneAdopted) {
            ++adopted;
            at = i;
        }
    ASSERT_EQ(adopted, 1u);
    EXPECT_FALSE(trace.frames[at].flags & kInsideAtStart);
    EXPECT_EQ(trace.frames[at].surfaces_felt, 0u);
    for (std::size_t i = at >= 20 ? at - 20 : 0; i < at; ++i)
        EXPECT_EQ(trace.frames[i].surfaces_felt, 0u) << i;
    // The mesh is asked from there on, and was not before.
    const auto asks = [](const FrameReport& frame) { return frame.surface_queries > 0; };
    const auto from = trace.frames.begin() + static_cast<std::ptrdiff_t>(at);
    EXPECT_TRUE(std::none_of(trace.frames.begin(), from, asks));
    EXPECT_TRUE(std::any_of(from, trace.frames.end(), asks));
    EXPECT_EQ(trace.frames.back().frame + 1, trace.frames.size()) << "no frame is lost";

    audit(scene, trace);
    EXPECT_TRUE(trace.audits.empty()) << "one scene's audit of two scenes' frames would be wrong";
    const auto summary = nlohmann::json::parse(summarize(*scene, trace));
    EXPECT_EQ(summary.at("contact"), "mesh");
    EXPECT_EQ(summary.at("preview").at("contact"), "volume");
    EXPECT_EQ(summary.at("preview").at("frames"), at);
    const Recording recording = recorded(*scene, {}, trace);
    EXPECT_THROW(recorded_scene(recording, "r.h5", scene->description(), {}), std::runtime_error);
}

TEST(RealtimeRun, ASilentDeviceIsNoFreeHand) {
    test::ScriptedDevice device;
    device.on_read = [](std::size_t read, DeviceState& state) {
        state.position = {read < 20 ? 0.06 : 0.049, 0.0, 0.0};
        if (read >= 200 && read < 400) state.freshness = Freshness::stale;
    };
    const auto preview = ball_with(ContactKind::volume);
    const auto scene = ball_with(ContactKind::mesh); // which waits for a free hand
    EXPECT_EQ(run_realtime(preview, {device, {}}, frames_before(1000, scene)).before, nullptr);
}

// `guarded` goes on from `volume`: it does not wait for the hand. A busy machine makes it later,
// and holds frames up; what is felt in them is tested in Adopt.
TEST(RealtimeRun, AnotherSceneTakesOverUnderAHandThatPresses) {
    constexpr std::size_t kReady = 100, kSeen = 50;
    const auto scene = ball_with(ContactKind::guarded);
    std::promise<std::shared_ptr<const Scene>> promise;
    test::ScriptedDevice device;
    device.on_read = [&](std::size_t read, DeviceState& state) {
        const double r = read < 20 ? 0.06 : 0.049; // in contact from here on, and never out of it
        state.position = {r, 0.0, 0.0};
    };
    RealtimeSettings settings = frames(60000);
    settings.next = promise.get_future().share();
    RunWatch watch;
    std::size_t count = 0, seen = 0; // frames, and those from the first of the scene itself on
    watch.frame = [&](const RunFrame& run) {
        if (++count == kReady) promise.set_value(scene);
        if (seen > 0 || (run.frame.flags & kSceneAdopted) != 0) ++seen;
    };
    watch.progress = [&](double, std::string_view) { return seen < kSeen; };
    const auto preview = ball_with(ContactKind::volume);
    const Trace trace = run_realtime(preview, {device, {}}, settings, watch);
    ASSERT_EQ(trace.before, preview);
    const auto adopted =
        std::find_if(trace.frames.begin(), trace.frames.end(),
                     [](const FrameReport& frame) { return (frame.flags & kSceneAdopted) != 0; });
    ASSERT_NE(adopted, trace.frames.end());
    ASSERT_GE(adopted - trace.frames.begin(), 40);
    EXPECT_FALSE(adopted->flags & kInsideAtStart);
    EXPECT_TRUE(std::any_of(adopted - 40, adopted, [](const FrameReport& frame) {
        return frame.surfaces_felt != 0;
    })) << "the hand was not free for 50 frames";
    EXPECT_TRUE(std::any_of(adopted, trace.frames.end(), [](const FrameReport& frame) {
        return frame.surfaces_felt != 0 && frame.surface_queries > 0;
    }));
}

TEST(RealtimeRun, ASceneThatCannotBeMadeLeavesThePreview) {
    test::ScriptedDevice device;
    device.on_read = [](std::size_t, DeviceState& state) { state.position = {0.06, 0.0, 0.0}; };
    RealtimeSettings settings = frames(300);
    std::promise<std::shared_ptr<const Scene>> promise;
    promise.set_exception(std::make_exception_ptr(std::runtime_error("no mesh")));
    settings.next = promise.get_future().share();
    std::vector<std::string> warnings;
    RunWatch watch;
    watch.warning = [&](const std::string& warning) { warnings.push_back(warning); };
    const Trace trace = run_realtime(ball_with(ContactKind::volume), {device, {}}, settings, watch);
    EXPECT_EQ(trace.before, nullptr);
    EXPECT_GE(trace.frames.size(), 300u);
    EXPECT_EQ(std::count(warnings.begin(), warnings.end(), "what is felt stays a preview: no mesh"),
              1);
}

TEST(RealtimeRun, ASceneThatIsNoneLeavesThePreview) {
    test::ScriptedDevice device;
    device.on_read = [](std::size_t, DeviceState& state) { state.position = {0.06, 0.0, 0.0}; };
    std::vector<std::string> warnings;
    RunWatch watch;
    watch.warning = [&](const std::string& warning) { warnings.push_back(warning); };
    const Trace trace = run_realtime(ball_with(ContactKind::volume), {device, {}},
                                     frames_before(300, nullptr), watch);
    EXPECT_EQ(trace.before, nullptr);
    EXPECT_EQ(std::count(warnings.begin(), warnings.end(),
                         "what is felt stays a preview: the scene that is to follow is null; give "
                         "a scene"),
              1);
}

TEST(RealtimeRun, ASceneThatNobodyWouldMakeIsRefused) {
    test::ScriptedDevice device;
    device.on_read = go_round;
    RealtimeSettings settings = frames(300);
    settings.next = std::async(std::launch::deferred, [] { return ball(); }).share();
    EXPECT_THROW(run_realtime(ball(), {device, {}}, settings, {}), std::invalid_argument);
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

// Drivers hold a force for 20 ms: with fewer frames it would end before it is renewed.
TEST(RealtimeRun, MotorsNeedSixtyFramesASecond) {
    for (const auto& [rate_hz, force_n, is_refused] :
         {std::tuple{59, 5.0, true}, {60, 5.0, false}, {50, 0.0, false}}) {
        test::ScriptedDevice device;
        device.force_n = force_n;
        const auto scene = ball("[loop]\nrate_hz = " + std::to_string(rate_hz) + "\n");
        try {
            run_realtime(scene, {device, {}}, frames(3));
            EXPECT_FALSE(is_refused) << rate_hz;
        } catch (const std::invalid_argument& error) {
            EXPECT_TRUE(is_refused) << error.what();
            EXPECT_EQ(std::string(error.what()).rfind("rate_hz = 59: in real time", 0), 0u)
                << error.what();
            EXPECT_EQ(device.calls.back(), "close");
        }
    }
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
