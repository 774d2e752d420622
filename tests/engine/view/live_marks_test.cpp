// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/live_view.h>

#include <atomic>
#include <memory>
#include <optional>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/record/recording.h>
#include <palpate/engine/scene/scene_file.h>

#include "tests/engine/view/live_client.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

/// A ball of 30 mm that a probe rests 2 mm deep in, felt in a thread of its own until this ends.
class HeldBall {
public:
    explicit HeldBall(bool button_marks = true) {
        LiveViewSettings settings;
        settings.folder = folder / "out";
        settings.run.scheduler = Scheduler::ordinary;
        settings.button_marks = button_marks;
        const auto scene = std::make_shared<const Scene>(
            parse_scene("[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 30\n[surface.s]\n"
                        "volume = \"v\"\n[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n",
                        "ball.toml"));
        mouse_.aim_at({0.028, 0.0, 0.0});
        view_.emplace(scene, view_document(*scene, ViewMode::live),
                      LiveDevice{device_, {}, &mouse_}, settings, "<html></html>");
        thread_ = std::thread([this] {
            RunWatch watch;
            watch.progress = [this](double, std::string_view) { return goes_on_.load(); };
            view_->run(watch);
        });
    }
    ~HeldBall() { end(); }
    HeldBall(const HeldBall&) = delete;
    HeldBall& operator=(const HeldBall&) = delete;

    void end() {
        goes_on_ = false;
        if (thread_.joinable()) thread_.join();
    }
    const LiveServer& server() const { return view_->server(); }

    test::TemporaryFolder folder;

private:
    PageDevice mouse_{{0.035, 0.0, 0.0}, 1000.0};
    SteeredDevice device_{mouse_};
    std::optional<LiveView> view_;
    std::atomic<bool> goes_on_{true};
    std::thread thread_;
};

/// A page that is open.
class Visitor {
public:
    explicit Visitor(const HeldBall& ball) : client_(ball.server()) {
        EXPECT_TRUE(client_.open(ball.server()));
    }
    void send(const std::string& command) { client_.send(command); }
    /// The next text whose state is as wanted; null where none comes.
    template <class Function>
    nlohmann::json told(const Function& is_it) {
        for (int i = 0; i < 3000; ++i) {
            const std::string message = client_.next();
            if (message.empty()) break;
            if (!client_.is_text()) continue;
            nlohmann::json text = nlohmann::json::parse(message);
            if (is_it(text)) return text;
        }
        return {};
    }
    /// The list of marks, once there are so many.
    nlohmann::json marks(std::size_t count) {
        const nlohmann::json text = told([count](const nlohmann::json& one) {
            return one.at("state").at("marks").size() == count;
        });
        return text.is_null() ? text : text.at("state").at("marks");
    }
    /// Lets the loop go on: by more frames than may be under way already.
    void wait() {
        constexpr int kBatches = 20;
        for (int batches = 0; batches < kBatches; batches += client_.is_text() ? 0 : 1)
            if (client_.next().empty()) return;
    }

private:
    test::LiveClient client_;
};

constexpr const char* kDown = R"({"do": "button", "on": true})";
constexpr const char* kUp = R"({"do": "button", "on": false})";

TEST(LiveMarks, EveryPageIsToldThemAllAlsoOneThatComesLater) {
    const HeldBall ball;
    Visitor one(ball);
    nlohmann::json marks;
    std::size_t count = 0;
    do { // until the ball is felt
        one.wait();
        one.send(R"({"do": "mark", "name": "here"})");
        marks = one.marks(++count);
        ASSERT_FALSE(marks.is_null());
    } while (count < 200 && marks.back().at("felt") != "s");
    EXPECT_EQ(marks.back().at("name"), "here");
    EXPECT_GT(marks.back().at("time_s"), 0.0);
    EXPECT_NEAR(marks.back().at("at_m").at(0).get<double>(), 0.03, 1e-4);

    Visitor late(ball);
    EXPECT_EQ(late.marks(count), marks);
}

TEST(LiveMarks, APressOfTheDevicesButtonDropsOneAndIsInTheRecording) {
    HeldBall ball;
    Visitor page(ball);
    page.send(R"({"do": "record", "on": true})");
    ASSERT_FALSE(
        page.told([](const nlohmann::json& one) { return one.at("state").at("recording") == true; })
            .is_null());
    for (const std::size_t press : {1u, 2u}) { // one for each, however long it is held
        page.send(kDown);
        const nlohmann::json marks = page.marks(press);
        ASSERT_FALSE(marks.is_null());
        EXPECT_EQ(marks.back().at("name"), "button " + std::to_string(press));
        page.wait();
        page.send(kUp);
        page.wait();
    }
    page.send(R"({"do": "record", "on": false})");
    ASSERT_FALSE(page.told([](const nlohmann::json& one) {
                         return one.at("say").get<std::string>().starts_with("written");
                     })
                     .is_null());
    ball.end();

    const std::filesystem::path file = ball.folder / "out/recording-001.h5";
    EXPECT_EQ(read_marks(marks_file(file)).size(), 2u);
    const Recording recording = read_recording(file);
    int presses = 0;
    bool was_down = false;
    for (const DeviceState& input : recording.inputs) {
        const bool is_down = (input.buttons & 1u) != 0;
        presses += is_down && !was_down ? 1 : 0;
        was_down = is_down;
    }
    EXPECT_EQ(presses, 2);
    for (const FrameReport& frame : recording.frames)
        EXPECT_EQ(frame.trial, recording.frames.front().trial); // no other effect
}

TEST(LiveMarks, AButtonIsUpAgainOnceItsPageIsGone) {
    const HeldBall ball;
    {
        Visitor gone(ball);
        gone.send(kDown);
        ASSERT_FALSE(gone.marks(1).is_null());
    }
    Visitor next(ball);
    next.wait();
    next.send(kDown);
    EXPECT_FALSE(next.marks(2).is_null());
    // One that goes does not lift it for another that holds it.
    {
        Visitor third(ball);
        third.send(kDown);
        third.wait();
    }
    next.wait();
    next.send(R"({"do": "mark", "name": "held"})");
    ASSERT_FALSE(next.marks(3).is_null());
    next.send(kDown); // down already: no press
    next.wait();
    next.send(R"({"do": "mark", "name": "still"})");
    EXPECT_FALSE(next.marks(4).is_null());
}

TEST(LiveMarks, AButtonDropsNoneWhereThatIsNotWanted) {
    const HeldBall ball(false);
    Visitor page(ball);
    page.send(kDown);
    page.wait();
    page.send(R"({"do": "mark", "name": "by hand"})");
    const nlohmann::json marks = page.marks(1);
    ASSERT_FALSE(marks.is_null());
    EXPECT_EQ(marks[0].at("name"), "by hand");
}

} // namespace
} // namespace palpate
