// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/live_view.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/devices/device_factory.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/engine/view/frame_columns.h"
#include "tests/engine/view/live_client.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

using testing::HasSubstr;

/// A ball of 30 mm, and a mouse in front of it or the scene's device, felt in a thread of its own.
class Ball : public testing::Test {
protected:
    /// With more lines of the surface's table, and the lines of the device's.
    explicit Ball(const std::string& of_surface = "", const std::string& of_device = "")
        : scene_(std::make_shared<const Scene>(parse_scene(
              "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 30\n[surface.s]\n"
              "volume = \"v\"\n" +
                  of_surface + "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n" + of_device,
              "ball.toml"))) {
        if (!of_device.empty()) hand_ = make_device(*scene_);
        HapticDevice& moves = hand_ ? *hand_->device : mouse_;
        device_.emplace(moves);
        LiveViewSettings settings;
        settings.folder = folder_ / "out";
        settings.run.scheduler = Scheduler::ordinary;
        view_.emplace(scene_, view_document(*scene_, ViewMode::live),
                      LiveDevice{*device_, hand_ ? hand_->placement : DevicePlacement(),
                                 hand_ ? nullptr : &mouse_},
                      settings, "<html></html>");
        thread_ = std::thread([this] {
            RunWatch watch;
            watch.progress = [this](double, std::string_view) { return goes_on_.load(); };
            try {
                view_->run(watch);
            } catch (const std::exception& error) {
                failure_ = error.what();
            }
            is_over_ = true;
        });
        client_ = std::make_unique<test::LiveClient>(view_->server());
        EXPECT_TRUE(client_->open(view_->server()));
    }
    ~Ball() override { end(); }
    void end() {
        goes_on_ = false;
        if (thread_.joinable()) thread_.join();
        EXPECT_EQ(failure_, "");
    }

    /// Reads messages until one is what is looked for.
    template <class Function>
    bool sees(const Function& is_it) {
        for (int i = 0; i < 3000; ++i) {
            const std::string message = client_->next();
            if (message.empty()) return false;
            if (client_->is_text() ? is_it(message, nullptr) : sees_frames(message, is_it))
                return true;
        }
        return false;
    }
    bool is_told(const std::string& words) {
        return sees([&](const std::string& text, const FrameReport* frame) {
            return frame == nullptr && text.find(words) != std::string::npos;
        });
    }
    template <class Function>
    bool feels(const Function& is_felt) {
        return sees([&](const std::string&, const FrameReport* frame) {
            return frame != nullptr && is_felt(*frame);
        });
    }

    test::TemporaryFolder folder_;
    std::shared_ptr<const Scene> scene_;
    PageDevice mouse_{{0.035, 0.0, 0.0}, 1000.0};
    std::optional<SceneDevice> hand_; ///< in the mouse's place
    std::optional<SteeredDevice> device_;
    std::optional<LiveView> view_;
    std::atomic<bool> goes_on_{true};
    std::atomic<bool> is_over_{false};
    std::string failure_;
    std::thread thread_;
    std::unique_ptr<test::LiveClient> client_;

private:
    template <class Function>
    static bool sees_frames(const std::string& bytes, const Function& is_it) {
        const test::ContainerReader read(bytes);
        if (read.document.at("kind") != "frames") return false;
        for (const FrameReport& frame : test::frames_in(read))
            if (is_it(std::string(), &frame)) return true;
        return false;
    }
};
using LiveViewTest = Ball;

constexpr const char* kPress = R"({"do": "probe", "at_m": [0.026, 0, 0]})"; // 4 mm: 2 N

TEST_F(LiveViewTest, TheMouseFeelsTheBallAndGainsChangeTheForce) {
    client_->send(kPress);
    // 500 N/m over 4 mm.
    EXPECT_TRUE(feels([](const FrameReport& frame) { return frame.force.x > 1.9; }));
    EXPECT_TRUE(feels([](const FrameReport& frame) {
        return frame.surfaces_felt == 1 && std::abs(glm::length(frame.proxy) - 0.03) < 1e-4;
    }));
    client_->send(R"({"do": "gain", "effect": 0, "part": "strength", "value": 0})");
    EXPECT_TRUE(is_told("\"gains\":{\"0\":0.0}"));
    EXPECT_TRUE(feels([](const FrameReport& frame) { return glm::length(frame.force) < 0.01; }));
    client_->send(R"({"do": "gain", "effect": 7, "part": "strength", "value": 1})");
    EXPECT_TRUE(is_told("effect 7 has no gain"));
}

TEST_F(LiveViewTest, FrozenTheProbeStays) {
    client_->send(R"({"do": "freeze", "on": true})");
    EXPECT_TRUE(is_told("\"frozen\":true"));
    client_->send(kPress);
    Vec3 probe{0.0};
    for (int i = 0; i < 3; ++i)
        feels([&](const FrameReport& frame) {
            probe = frame.probe;
            return true;
        });
    EXPECT_EQ(probe, Vec3(0.035, 0.0, 0.0));
    client_->send(R"({"do": "freeze", "on": false})");
    EXPECT_TRUE(feels([](const FrameReport& frame) { return frame.force.x > 1.9; }));
}

TEST_F(LiveViewTest, ARecordingIsWrittenWithItsMarksAndReplaysBitForBit) {
    client_->send(kPress);
    double time_s = 0.0;
    ASSERT_TRUE(feels([&](const FrameReport& frame) {
        time_s = frame.time_s;
        return frame.force.x > 1.9;
    }));
    client_->send(R"({"do": "record", "on": true})");
    ASSERT_TRUE(is_told("\"recording\":true"));
    // Frames of the run before may still be on their way: the time begins anew with the recording.
    ASSERT_TRUE(feels([&](const FrameReport& frame) { return frame.time_s < time_s; }));
    ASSERT_TRUE(feels([](const FrameReport& frame) { return frame.force.x > 1.9; }));
    client_->send(R"({"do": "mark", "name": "top"})");
    ASSERT_TRUE(is_told("mark top"));
    // Beside the journal, too: a program that is killed keeps them.
    const std::filesystem::path kept = marks_file(folder_ / "out/recording-001.h5.part");
    EXPECT_TRUE(test::becomes([&] { return std::filesystem::exists(kept); }));
    client_->send(R"({"do": "record", "on": false})");
    ASSERT_TRUE(is_told("written: "));
    end();

    const std::filesystem::path file = folder_ / "out/recording-001.h5";
    const Recording recording = read_recording(file);
    // A frame that comes late on a busy machine may have no force: the last one may be such.
    EXPECT_TRUE(std::ranges::any_of(recording.frames,
                                    [](const FrameReport& frame) { return frame.force.x > 1.9; }));
    const Trace again = run_again(scene_, recording);
    if (recording.frames.back().frame + 1 == recording.frames.size()) { // none was dropped
        EXPECT_EQ(difference(recording, again).frames, 0u);
    }
    const std::vector<ViewMark> marks = read_marks(marks_file(file));
    ASSERT_EQ(marks.size(), 1u);
    EXPECT_EQ(marks[0].name, "top");
    const auto marked = std::ranges::find(recording.frames, marks[0].time_s, &FrameReport::time_s);
    if (marked != recording.frames.end()) {                          // it was not dropped
        EXPECT_LT(glm::distance(marks[0].at, marked->proxy), 1e-12); // the file has mm
        EXPECT_EQ(marks[0].felt, marked->surfaces_felt == 1 ? "s" : "");
    }
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out/recording-001.h5.part"));
}

TEST_F(LiveViewTest, ARecordingThatIsEndedAndAskedForAgainAtOnceEndsNothing) {
    client_->send(R"({"do": "record", "on": true})");
    ASSERT_TRUE(is_told("recording to "));
    // A run looks at the wish now and then, and what it has recorded takes a moment to be written:
    // some of these come between.
    for (const int gap_ms : {10, 20, 30, 40, 60, 80}) {
        std::this_thread::sleep_for(std::chrono::milliseconds(150));
        client_->send(R"({"do": "record", "on": false})");
        std::this_thread::sleep_for(std::chrono::milliseconds(gap_ms));
        client_->send(R"({"do": "record", "on": true})");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    EXPECT_FALSE(is_over_);
}

TEST_F(LiveViewTest, WhereNothingCanBeRecordedTheViewGoesOn) {
    std::ofstream(folder_ / "out") << "a file where the folder should be\n";
    client_->send(R"({"do": "record", "on": true})");
    ASSERT_TRUE(is_told("nothing is recorded: "));
    client_->send(kPress);
    EXPECT_TRUE(feels([](const FrameReport& frame) { return frame.force.x > 1.9; }));
}

TEST_F(LiveViewTest, ATrialThatBeginsAnewWhileTheHandPressesIsFelt) {
    client_->send(kPress);
    ASSERT_TRUE(feels([](const FrameReport& frame) { return frame.force.x > 1.9; }));
    client_->send(R"({"do": "restart"})");
    ASSERT_TRUE(is_told("a new trial"));
    ASSERT_TRUE(feels([](const FrameReport& frame) { return frame.surfaces_felt == 0; }));
    EXPECT_TRUE(feels([](const FrameReport& frame) { return frame.force.x > 1.9; }));
}

/// A surface that a hand gets behind: a trial that begun there would begin inside.
class GivesWay : public Ball, public testing::WithParamInterface<const char*> {
protected:
    GivesWay() : Ball(GetParam()) {}
};
using LiveViewOfWhatGivesWay = GivesWay;

TEST_P(LiveViewOfWhatGivesWay, WhatBeginsAnewBeginsInFrontAndIsFelt) {
    std::uint32_t flags = 0; // of all frames that were looked at
    FrameReport last;
    const auto looks_at = [&](const FrameReport& frame) {
        flags |= frame.flags;
        last = frame;
    };
    const auto is_pressed = [&](const FrameReport& frame) {
        looks_at(frame);
        return frame.force.x > 0.7; // soft: 0.8 N over 4 mm; with a strength: 1 N
    };
    const auto begins_anew = [&](const FrameReport& frame) {
        const bool is_new = frame.trial > last.trial || frame.time_s < last.time_s;
        looks_at(frame);
        return is_new;
    };
    client_->send(kPress);
    ASSERT_TRUE(feels(is_pressed));
    // A recording's run begins anew, and so does the one after it. Restarts do not lead nearer and
    // nearer to the surface.
    constexpr const char* kRestart = R"({"do": "restart"})";
    for (const char* command : {kRestart, kRestart, kRestart, R"({"do": "record", "on": true})",
                                R"({"do": "record", "on": false})", kRestart}) {
        client_->send(command);
        ASSERT_TRUE(feels(begins_anew)) << command;
        EXPECT_GT(glm::length(last.probe), 0.03) << command;
        ASSERT_EQ(flags & kInsideAtStart, 0u) << command;
        ASSERT_TRUE(feels(is_pressed)) << command;
        EXPECT_EQ(flags & kInsideAtStart, 0u) << command;
    }
}

INSTANTIATE_TEST_SUITE_P(Surfaces, LiveViewOfWhatGivesWay,
                         testing::Values("stiffness_n_per_mm = 0.2\n", "strength_n = 1\n"),
                         [](const auto& surface) {
                             return std::string(surface.index == 0 ? "Soft" : "Yields");
                         });

class SlowTissue : public Ball {
protected:
    SlowTissue() : Ball("stiffness_n_per_mm = 0.05\npress_damping_n_s_per_m = 100\n") {}
};
using LiveViewOfASlowTissue = SlowTissue;

// In the dent nothing is felt: it began inside, and felt nothing of the surface.
TEST_F(LiveViewOfASlowTissue, WhatBeginsAnewInTheDentBeginsInFront) {
    client_->send(kPress);
    ASSERT_TRUE(feels([](const FrameReport& f) { return f.force.x > 0.19 && f.force.x < 0.21; }));
    client_->send(R"({"do": "probe", "at_m": [0.0285, 0, 0]})");
    ASSERT_TRUE(feels(
        [](const FrameReport& f) { return f.surfaces_felt == 0 && glm::length(f.probe) < 0.029; }));
    client_->send(R"({"do": "restart"})");
    client_->send(kPress);
    std::uint32_t flags = 0;
    EXPECT_TRUE(feels([&](const FrameReport& f) {
        flags |= f.flags;
        return f.force.x > 0.19;
    }));
    EXPECT_EQ(flags & kInsideAtStart, 0u);
}

/// A magnet holds the proxy at the surface while the hand is in front.
class HeldInFront : public Ball {
protected:
    HeldInFront()
        : Ball("[[effect]]\ntype = \"magnet\"\nsurface = \"s\"\nstrength_n = 5\n"
               "capture_mm = 10\n") {}
};
using LiveViewOfAMagnet = HeldInFront;

TEST_F(LiveViewOfAMagnet, ATrialBeginsAnewInFront) {
    const auto is_held = [](const FrameReport& frame) {
        return frame.force.x < -0.5 && frame.probe.x > 0.032;
    };
    ASSERT_TRUE(feels(is_held));
    client_->send(R"({"do": "restart"})");
    ASSERT_TRUE(is_told("a new trial"));
    std::uint32_t flags = 0;
    ASSERT_TRUE(feels([&](const FrameReport& frame) {
        flags |= frame.flags;
        return frame.trial > 0 && is_held(frame);
    }));
    EXPECT_EQ(flags & kInsideAtStart, 0u);
}

/// The shortest time that a simulated hand may have.
class HandThatEnds : public Ball {
protected:
    HandThatEnds() : Ball("", "[device]\ntype = \"hand\"\nduration_s = 3\n") {}
};
using LiveViewOfAHandTest = HandThatEnds;

TEST_F(LiveViewOfAHandTest, PagesAreToldOnceThatTheDeviceHasEnded) {
    ASSERT_TRUE(is_told("the device has ended"));
    // Neither with later frames nor with another run, of which there is one with a recording.
    client_->send(R"({"do": "record", "on": true})");
    ASSERT_TRUE(is_told("recording to "));
    for (int i = 0; i < 20; ++i)
        ASSERT_TRUE(feels([](const FrameReport&) { return true; }));
    client_->send(R"({"do": "mark", "name": "last"})");
    int told_again = 0;
    EXPECT_TRUE(sees([&](const std::string& text, const FrameReport* frame) {
        told_again += frame == nullptr && text.find("has ended") != std::string::npos ? 1 : 0;
        return frame == nullptr && text.find("mark last") != std::string::npos;
    }));
    EXPECT_EQ(told_again, 0);
}

TEST_F(LiveViewTest, AFinerMeshComesOnRequest) {
    client_->send(R"({"do": "level", "structure": 0, "facets": 1000000})");
    bool is_mesh = false;
    for (int i = 0; i < 3000 && !is_mesh; ++i) {
        const std::string message = client_->next();
        ASSERT_FALSE(message.empty());
        if (client_->is_text()) continue;
        const test::ContainerReader read(message);
        if (read.document.at("kind") != "mesh") continue;
        is_mesh = true;
        const auto& structure = read.document.at("structures").at(0);
        EXPECT_EQ(structure.at("levels").at(0).at("facets"), structure.at("facets_most"));
    }
    EXPECT_TRUE(is_mesh);
}

TEST_F(LiveViewTest, ARefusalSaysWhetherItIsAboutAMesh) {
    const auto is_about_a_mesh = [&](const char* command) {
        client_->send(command);
        bool is_about = false;
        EXPECT_TRUE(sees([&](const std::string& text, const FrameReport* frame) {
            if (frame != nullptr || text.find("\"error\"") == std::string::npos) return false;
            is_about = text.find(R"("about":"mesh")") != std::string::npos;
            return true;
        })) << command;
        return is_about;
    };
    EXPECT_TRUE(is_about_a_mesh(R"({"do": "level", "structure": 5, "facets": 1000})"));
    EXPECT_FALSE(
        is_about_a_mesh(R"({"do": "gain", "effect": 900, "part": "strength", "value": 1})"));
}

TEST_F(LiveViewTest, WhatCouldNotBeKeptIsNotSaidToBe) {
    client_->send(R"({"do": "record", "on": true})");
    ASSERT_TRUE(is_told("recording to "));
    std::filesystem::rename(folder_ / "out", folder_ / "gone"); // and its place is taken
    std::ofstream(folder_ / "out") << "a file where the folder was\n";
    client_->send(R"({"do": "record", "on": false})");
    EXPECT_TRUE(is_told("nothing of it is kept"));
}

} // namespace
} // namespace palpate
