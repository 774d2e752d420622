// SPDX-License-Identifier: Apache-2.0
// Several hands in one scene. ThreadSanitizer watches these tests, too.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/record/recording_journal.h>
#include <palpate/engine/run/realtime_run.h>
#include <palpate/engine/scene/scene_file.h>

#include "tests/support/same_reports.h"
#include "tests/support/scripted_clock.h"
#include "tests/support/scripted_device.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

using testing::HasSubstr;

const std::string kBall =
    "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n[surface.s]\nvolume = \"v\"\n"
    "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n"
    "[[effect]]\ntype = \"friction\"\nsurface = \"s\"\nstatic = 0.4\n";
const std::string kOrbit = "type = \"orbit\"\nduration_s = 0.4\nturns = 1\nspeed_m_per_s = 2\n";
const std::string kPress = "type = \"hand\"\nfrom = \"patient_left\"\nduration_s = 3\nseed = 5\n";

std::shared_ptr<const Scene> scene_of(const std::string& devices, const std::string& loop = "") {
    return std::make_shared<const Scene>(parse_scene(kBall + loop + devices, "ball.toml"));
}

std::shared_ptr<const Scene> two_hands(const std::string& loop = "") {
    return scene_of(
        "[[device]]\nname = \"left\"\n" + kOrbit + "[[device]]\nname = \"right\"\n" + kPress, loop);
}

/// A scene with a mesh, so that loops share Embree's structures, too.
std::shared_ptr<const Scene> two_hands_on_a_mesh() {
    SceneDescription scene = two_hands()->description();
    scene.surfaces.at("s").contact = ContactKind::guarded;
    scene.surfaces.at("s").triangle_mesh =
        std::make_shared<const TriangleMesh>(test::icosphere(0.05, 3));
    return std::make_shared<const Scene>(scene);
}

Trace traced(const std::shared_ptr<const Scene>& scene) {
    SteadyClock clock;
    const SceneDevice device = make_device(*scene);
    return run_trace(scene, device.placed(), clock, device.states);
}

void expect_same(const Trace& a, const Trace& b) {
    ASSERT_EQ(a.frames.size(), b.frames.size());
    ASSERT_GT(a.frames.size(), 100u);
    EXPECT_TRUE(std::any_of(a.frames.begin(), a.frames.end(),
                            [](const FrameReport& frame) { return frame.contacts > 0; }));
    for (std::size_t i = 0; i < a.frames.size(); ++i)
        ASSERT_EQ(test::difference(a.frames[i], b.frames[i]), "") << i;
    EXPECT_EQ(a.touches, b.touches);
}

TEST(Hands, EachHandsFramesAreThoseOfItsDeviceAlone) {
    for (const char* loop : {"", "[loop]\nmethod = \"fixed\"\nsub_steps = 4\n"}) {
        SCOPED_TRACE(loop);
        const auto both = two_hands(loop);
        const Trace left = traced(both->of_hand("left")), right = traced(both->of_hand("right"));
        expect_same(left, traced(scene_of("[device]\n" + kOrbit, loop)));
        expect_same(right, traced(scene_of("[device]\n" + kPress, loop)));
    }
}

TEST(Hands, ASceneOfSeveralHandsAsksWhichOneIsMeant) {
    try {
        make_device(*two_hands());
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_THAT(error.what(), HasSubstr("has the hands left, right"));
    }
}

/// Presses into the ball from its side, and goes round; the first hand along y, the second along
/// -y.
void press(double side, std::size_t read, DeviceState& state) {
    const double t = 1e-3 * static_cast<double>(read);
    state.position =
        (0.052 - 0.005 * std::min(1.0, 10.0 * t)) * Vec3{std::sin(t), side * std::cos(t), 0.0};
}

/// Two devices over one scene, as run_realtime() takes them.
struct TwoHands {
    explicit TwoHands(const std::shared_ptr<const Scene>& of) : scene(of) {
        left.on_read = [](std::size_t read, DeviceState& state) { press(1.0, read, state); };
        right.on_read = [](std::size_t read, DeviceState& state) { press(-1.0, read, state); };
        for (auto [name, device] : {std::pair{"left", &left}, std::pair{"right", &right}})
            hands.push_back({scene->of_hand(name), {*device, {}}, {}, {}});
    }

    std::shared_ptr<const Scene> scene;
    test::ScriptedDevice left, right;
    std::vector<RealtimeHand> hands;
};

void expect_stopped(const test::ScriptedDevice& device) {
    EXPECT_EQ(device.calls, (std::vector<std::string>{"open", "start", "stop", "close"}));
    ASSERT_FALSE(device.forces.empty());
    EXPECT_EQ(device.forces.back(), Vec3(0.0));
}

TEST(Hands, InRealTimeBothRunAndBothRecordingsReplay) {
    test::TemporaryFolder folder;
    const std::filesystem::path file = folder / "two.h5";
    for (const auto& scene :
         {two_hands(), two_hands("[loop]\nmethod = \"paper\"\n"), two_hands_on_a_mesh()}) {
        TwoHands two(scene);
        for (RealtimeHand& hand : two.hands)
            hand.settings.most_frames = 300;
        std::vector<std::uint64_t> told(2);
        for (std::size_t i = 0; i < 2; ++i)
            two.hands[i].watch.frame = [&told, i](const RunFrame&) { ++told[i]; };
        const std::vector<Trace> traces = run_realtime(two.hands);
        ASSERT_EQ(traces.size(), 2u);
        std::vector<Recording> recordings;
        for (std::size_t i = 0; i < 2; ++i) {
            const Trace& trace = traces[i];
            ASSERT_TRUE(trace.realtime.has_value());
            ASSERT_EQ(trace.realtime->dropped, 0u);
            EXPECT_GE(trace.frames.size(), 300u);
            EXPECT_EQ(told[i], trace.frames.size());
            EXPECT_GT(trace.frames[50].probe.y * (i == 0 ? 1.0 : -1.0), 0.0) << "its own device";
            recordings.push_back(recorded(*two.hands[i].scene, {}, trace));
        }
        expect_stopped(two.left);
        expect_stopped(two.right);

        write_recordings(file, recordings);
        const std::vector<Recording> read = read_recordings(file);
        ASSERT_EQ(read.size(), 2u);
        for (std::size_t i = 0; i < 2; ++i) {
            EXPECT_EQ(read[i].hand, i == 0 ? "left" : "right");
            // With a mesh in memory the program gives the scene, as it was.
            const auto again = read[i].scene_text.empty()
                                   ? recorded_scene(read[i], file, scene->description(), {})
                                   : recorded_scene(read[i], file, {});
            EXPECT_EQ(again->description().device.name, read[i].hand);
            EXPECT_EQ(difference(read[i], run_again(again, read[i])).frames, 0u);
        }
    }
}

TEST(Hands, AHandThatEndsLeavesTheOthersAlone) {
    TwoHands two(two_hands());
    two.left.states = 40;
    two.hands[1].settings.most_frames = 250;
    const std::vector<Trace> traces = run_realtime(two.hands);
    EXPECT_LE(traces[0].frames.size(), 40u);
    EXPECT_GE(traces[1].frames.size(), 250u);
    expect_stopped(two.left);
    expect_stopped(two.right);
}

TEST(Hands, WhoeverWantsAnEndEndsAll) {
    bool is_led = false; // a machine that stands still in these 50 ms cuts the force off
    for (int trial = 0; trial < 3 && !is_led; ++trial) {
        TwoHands two(two_hands());
        std::uint64_t frames = 0;
        two.hands[1].watch.frame = [&](const RunFrame&) { ++frames; };
        two.hands[1].watch.progress = [&](double, std::string_view) { return frames < 100; };
        const std::vector<Trace> traces = run_realtime(two.hands);
        is_led = std::all_of(traces.begin(), traces.end(), [](const Trace& trace) {
            return !trace.frames.empty() && trace.frames.back().force == Vec3(0.0);
        });
        expect_stopped(two.left);
        expect_stopped(two.right);
    }
    EXPECT_TRUE(is_led) << "to zero";
}

// A device is silent: its own force goes to zero, and the other hand feels on.
TEST(Hands, ASilentDeviceTakesOnlyItsOwnForce) {
    TwoHands two(two_hands());
    two.left.on_read = [](std::size_t read, DeviceState& state) {
        press(1.0, read, state);
        if (read > 50) state.freshness = Freshness::stale;
    };
    for (RealtimeHand& hand : two.hands)
        hand.settings.most_frames = 400;
    const std::vector<Trace> traces = run_realtime(two.hands);
    EXPECT_GT(traces[0].realtime->silent_device, 200u);
    EXPECT_EQ(traces[1].realtime->silent_device, 0u);
    const std::size_t late = 350;
    ASSERT_GT(traces[0].frames.size(), late);
    ASSERT_GT(traces[1].frames.size(), late);
    EXPECT_EQ(traces[0].frames[late].force, Vec3(0.0));
    // A machine that is so busy that a loop was late must not push.
    if (traces[1].realtime->silent_loop == 0) {
        EXPECT_GT(glm::length(traces[1].frames[late].force), 0.5);
    }
}

TEST(Hands, ADeviceThatCannotBeOpenedStartsNoLoopAndStopsTheOthers) {
    TwoHands two(two_hands());
    two.right.refusal = "nobody is there";
    EXPECT_THROW(run_realtime(two.hands), DeviceError);
    EXPECT_EQ(two.left.calls, (std::vector<std::string>{"open", "start", "stop", "close"}));
    EXPECT_EQ(two.left.reads, 0u);
    for (const Vec3& force : two.left.forces)
        EXPECT_EQ(force, Vec3(0.0));
}

TEST(Hands, WhoWatchesAndThrowsEndsAllHands) {
    TwoHands two(two_hands());
    two.hands[0].watch.frame = [](const RunFrame& run) {
        if (run.frame.frame == 30) throw std::runtime_error("the disk is full");
    };
    EXPECT_THROW(run_realtime(two.hands), std::runtime_error);
    expect_stopped(two.left);
    expect_stopped(two.right);
}

TEST(Hands, AJournalKeepsAllOfThem) {
    test::TemporaryFolder folder;
    TwoHands two(two_hands());
    std::vector<Recording> begun;
    for (const RealtimeHand& hand : two.hands)
        begun.push_back(recorded(*hand.scene, {}, {}));
    RecordingJournal journal(folder / "r.h5", std::move(begun));
    std::vector<std::size_t> kept(2);
    for (std::size_t i = 0; i < 2; ++i) {
        two.hands[i].settings.most_frames = 300;
        two.hands[i].watch.frame = [](const RunFrame&) {};
        two.hands[i].watch.kept = [&, i](const Trace& so_far) {
            EXPECT_TRUE(journal.add(so_far, i));
            kept[i] = so_far.frames.size();
        };
    }
    const std::vector<Trace> traces = run_realtime(two.hands);
    const std::vector<Recording> read = read_recordings(folder / "r.h5"); // which is not there yet
    ASSERT_EQ(read.size(), 2u);
    for (const Recording& hand : read) {
        const std::size_t i = hand.hand == "left" ? 0 : 1;
        EXPECT_EQ(hand.frames.size(), kept[i]);
        EXPECT_EQ(hand.frames.size(), traces[i].frames.size());
        EXPECT_EQ(hand.touches, traces[i].touches);
        const auto scene = recorded_scene(hand, "r.h5", {});
        EXPECT_EQ(difference(hand, run_again(scene, hand)).frames, 0u);
    }
}

} // namespace
} // namespace palpate
