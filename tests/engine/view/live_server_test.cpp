// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/live_server.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <future>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/haptics/stepping/clock.h>

#include "tests/engine/view/frame_columns.h"
#include "tests/engine/view/live_client.h"
#include "tests/support/same_reports.h"

namespace palpate {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

/// A server whose scene is a text, and that counts what it is asked.
class Serves : public testing::Test {
protected:
    explicit Serves(std::size_t scene_bytes = 100, double taking_s = 2.0)
        : server_(settings(taking_s), "<html>the page</html>",
                  std::make_shared<const std::string>(scene_bytes, 's'),
                  [this](const ViewCommand&) {
                      ++asked_;
                      return refuses_ ? LiveReply{"not here", true} : LiveReply{};
                  }) {}

    static LiveServerSettings settings(double taking_s) {
        LiveServerSettings settings;
        settings.taking_s = taking_s;
        return settings;
    }

    /// Reads the scene and the first state.
    static void skip_greeting(test::LiveClient& client) {
        EXPECT_FALSE(client.next().empty());
        EXPECT_THAT(client.next(), HasSubstr("\"state\""));
    }

    std::atomic<int> asked_{0};
    std::atomic<bool> refuses_{false}; ///< every command
    LiveServer server_;
};
using LiveServerTest = Serves;

/// As the others, but patient: however slow the machine is, a second is shorter than that.
class PatientServerTest : public Serves {
protected:
    PatientServerTest() : Serves(100, 60.0) {}
};

TEST_F(LiveServerTest, ServesThePageAndNothingElse) {
    EXPECT_EQ(server_.token().size(), 32u); // 128 bits
    const std::string page = "/" + server_.token() + "/";
    const std::string host = test::LiveClient(server_).host();
    EXPECT_EQ(server_.link(), "http://" + host + page);
    using Answer = std::pair<unsigned, std::string>;
    EXPECT_EQ(test::LiveClient(server_).request(page, host),
              (Answer{200, "<html>the page</html>"}));
    EXPECT_EQ(test::LiveClient(server_).request(page, "localhost:1234").first, 200u); // a tunnel
    const std::string wrong = "/" + std::string(32, '0') + "/";
    for (const std::string& target :
         {std::string("/"), wrong, page + "x", page + "../", page.substr(0, 32),
          std::string("/etc/passwd"), page + "socket"})
        EXPECT_EQ(test::LiveClient(server_).request(target, host).first, 404u) << target;
    // The name of another site, whose owner leads it here.
    EXPECT_EQ(test::LiveClient(server_).request(page, "evil.example:80").first, 404u);
    EXPECT_EQ(test::LiveClient(server_).request(page, host, test::LiveClient::Method::post).first,
              405u);
}

TEST_F(LiveServerTest, OpensTheSocketForItsOwnPageAlone) {
    const auto open = [&](const std::string& token, const std::optional<std::string>& origin) {
        return test::LiveClient(server_).socket_status(token, origin);
    };
    const std::string own = "http://" + test::LiveClient(server_).host();
    EXPECT_EQ(open(std::string(32, '0'), own), 404u);
    EXPECT_EQ(open(server_.token(), "http://evil.example"), 403u);
    EXPECT_EQ(open(server_.token(), "null"), 403u); // a page from a disk
    EXPECT_EQ(open(server_.token(), std::nullopt), 403u);
    EXPECT_EQ(open(server_.token(), own), 101u);
}

TEST_F(LiveServerTest, SendsFramesBitByBitToEveryPage) {
    const std::vector<FrameReport> frames = test::odd_frames(500);
    test::LiveClient one(server_), two(server_);
    ASSERT_TRUE(one.open(server_));
    ASSERT_TRUE(two.open(server_));
    skip_greeting(one);
    skip_greeting(two);
    for (const FrameReport& frame : frames)
        server_.add(frame);
    for (test::LiveClient* client : {&one, &two}) {
        std::size_t seen = 0;
        while (seen < frames.size()) {
            const std::string bytes = client->next();
            ASSERT_FALSE(bytes.empty());
            const test::ContainerReader read(bytes);
            EXPECT_EQ(read.document.at("frames").at("first"), seen);
            EXPECT_EQ(read.document.at("frames").at("lost"), 0);
            for (const FrameReport& frame : test::frames_in(read))
                EXPECT_TRUE(test::is_as_sent(frames.at(seen++), frame)) << seen;
        }
    }
}

std::size_t open_files() {
    const std::filesystem::directory_iterator files("/proc/self/fd");
    return static_cast<std::size_t>(std::distance(begin(files), end(files)));
}

TEST_F(LiveServerTest, AThousandReconnectsLeaveNothing) {
    const std::size_t before = open_files();
    for (int i = 0; i < 1000; ++i) {
        test::LiveClient client(server_);
        ASSERT_TRUE(client.open(server_)) << "connection " << i;
        ASSERT_FALSE(client.next().empty());
        server_.add({});
        // Every other one goes without a word.
        if (i % 2 == 0) client.close();
    }
    EXPECT_TRUE(test::becomes([&] { return server_.counts().open == 0; }));
    EXPECT_EQ(server_.counts().pages, 1000u);
    EXPECT_TRUE(test::becomes([&] { return open_files() <= before; }));
}

/// The scene is larger than what the kernel keeps of what nobody reads.
class ServesALargeScene : public Serves {
protected:
    ServesALargeScene() : Serves(32u << 20, 8.0) {}
};
using LargeSceneTest = ServesALargeScene;

TEST_F(LargeSceneTest, APageThatNeverReadsIsDroppedAndTheOthersNoticeNothing) {
    test::LiveClient deaf(server_);
    ASSERT_TRUE(deaf.open(server_));
    test::LiveClient page(server_);
    ASSERT_TRUE(page.open(server_));
    skip_greeting(page);
    const std::vector<FrameReport> frames = test::odd_frames(200);
    std::size_t seen = 0;
    for (const FrameReport& frame : frames)
        server_.add(frame);
    while (seen < frames.size())
        seen += test::frames_in(test::ContainerReader(page.next())).size();
    EXPECT_TRUE(test::becomes([&] { return server_.counts().dropped == 1; }));
    EXPECT_TRUE(test::becomes([&] { return server_.counts().open == 1; })) << "just after";
}

TEST_F(LiveServerTest, APageThatStandsStillForFiveSecondsIsToldWhatItMissed) {
    test::LiveClient page(server_);
    ASSERT_TRUE(page.open(server_));
    skip_greeting(page);
    std::uint64_t added = 0;
    const auto until = std::chrono::steady_clock::now() + 5s;
    while (std::chrono::steady_clock::now() < until) {
        for (int i = 0; i < 50; ++i, ++added)
            server_.add({});
        std::this_thread::sleep_for(50ms);
    }
    std::uint64_t told = 0;
    std::string bytes;
    while (told < added && !(bytes = page.next()).empty()) {
        const test::ContainerReader read(bytes);
        const auto& frames = read.document.at("frames");
        const auto lost = frames.at("lost").get<std::uint64_t>();
        EXPECT_EQ(frames.at("first").get<std::uint64_t>(), told + lost);
        told += lost + frames.at("count").get<std::uint64_t>();
    }
    // Five seconds of frames are more than the kernel keeps for a page: it was dropped, or has all.
    if (server_.counts().dropped == 0) {
        EXPECT_EQ(told, added);
    }
    EXPECT_GT(told, 0u);
}

TEST_F(PatientServerTest, APageThatStandsStillForASecondIsNotDroppedForWhatIsToldMeanwhile) {
    test::LiveClient page(server_);
    ASSERT_TRUE(page.open(server_));
    skip_greeting(page);
    constexpr int kTold = 200; // far more than the kernel keeps for a page
    const std::string state = R"({"marks": ")" + std::string(20'000, 'm') + "\"}";
    for (int i = 0; i < kTold; ++i)
        server_.tell(std::to_string(i), false, state);
    std::this_thread::sleep_for(1s);
    std::string said;
    while (said.find("\"199\"") == std::string::npos && !(said = page.next()).empty()) {
    }
    EXPECT_FALSE(said.empty()) << "it was dropped";
    EXPECT_EQ(server_.counts().dropped, 0u);
}

TEST_F(LiveServerTest, GarbageIsAnsweredAHundredTimesAndNoMore) {
    test::LiveClient client(server_);
    ASSERT_TRUE(client.open(server_));
    skip_greeting(client);
    for (int i = 0; i < 99; ++i) {
        if (i % 2 == 0)
            client.send("no command");
        else
            client.send_bytes("\xff\xfe");
        EXPECT_THAT(client.next(), HasSubstr("\"error\""));
    }
    EXPECT_EQ(server_.counts().open, 1u);
    client.send(R"({"do": "restart"})");
    EXPECT_TRUE(test::becomes([&] { return asked_ == 1; }));
    client.send("and once more");
    while (!client.next().empty()) {
    }
    EXPECT_EQ(server_.counts().errors, 100u);
    EXPECT_EQ(server_.counts().dropped, 1u);
}

TEST_F(LiveServerTest, WhatIsRefusedHoweverOftenDropsNoPage) {
    test::LiveClient client(server_);
    ASSERT_TRUE(client.open(server_));
    skip_greeting(client);
    refuses_ = true;
    for (int i = 0; i < 110; ++i) {
        client.send(R"({"do": "gain", "effect": 0, "part": "strength", "value": 0.5})");
        ASSERT_THAT(client.next(), HasSubstr("not here")) << "command " << i;
    }
    EXPECT_EQ(server_.counts().errors, 110u);
    EXPECT_EQ(server_.counts().dropped, 0u);
    EXPECT_EQ(server_.counts().open, 1u);
}

TEST_F(LiveServerTest, AMessageOfAHundredMegabytesIsNotTaken) {
    test::LiveClient client(server_);
    ASSERT_TRUE(client.open(server_));
    skip_greeting(client);
    client.try_send(std::string(100u << 20, 'x')); // fails once the server is gone
    EXPECT_TRUE(test::becomes([&] { return server_.counts().open == 0; }));
    EXPECT_EQ(asked_, 0);
    test::LiveClient next(server_);
    EXPECT_TRUE(next.open(server_));
}

TEST_F(LiveServerTest, AFloodOfCommandsIsObeyedAndHoldsNobodyUp) {
    test::LiveClient flood(server_), page(server_);
    ASSERT_TRUE(flood.open(server_));
    ASSERT_TRUE(page.open(server_));
    skip_greeting(page);
    constexpr int kCommands = 5000;
    std::thread sends([&] {
        for (int i = 0; i < kCommands; ++i)
            flood.send(R"({"do": "probe", "at_m": [0.01, 0.02, 0.03]})");
    });
    server_.add({});
    EXPECT_EQ(test::frames_in(test::ContainerReader(page.next())).size(), 1u);
    EXPECT_LT(asked_, kCommands); // it was not first in a queue behind the flood
    sends.join();
    EXPECT_TRUE(test::becomes([&] { return asked_ == kCommands; }));
}

TEST_F(LiveServerTest, TheNinthPageIsRefused) {
    std::vector<std::unique_ptr<test::LiveClient>> clients;
    for (int i = 0; i < 8; ++i) {
        clients.push_back(std::make_unique<test::LiveClient>(server_));
        ASSERT_TRUE(clients.back()->open(server_));
        skip_greeting(*clients.back());
    }
    test::LiveClient ninth(server_);
    EXPECT_TRUE(ninth.open(server_));
    EXPECT_EQ(ninth.next(), "");
    EXPECT_TRUE(ninth.is_told_to_try_later());
}

TEST_F(LiveServerTest, APortThatIsTakenIsNamedWithTheRemedy) {
    LiveServerSettings same;
    same.port = server_.port();
    const auto message = [&] {
        try {
            const LiveServer other(same, "", std::make_shared<const std::string>(), {});
        } catch (const std::runtime_error& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_THAT(message(), HasSubstr("port " + std::to_string(same.port)));
    EXPECT_THAT(message(), HasSubstr("another program has it; give another one"));
    same.address = "nowhere";
    EXPECT_THAT(message(), HasSubstr("is no address"));
}

TEST_F(LiveServerTest, ARunHasTheSameBitsWithPagesAndWithout) {
    const auto scene = std::make_shared<const Scene>(
        parse_scene("[volume.v]\nanalytic = \"bumpy_cavity\"\nradius_mm = 40\namplitude_mm = "
                    "2\nwavelength_mm = "
                    "20\n[surface.s]\nvolume = \"v\"\n[[effect]]\ntype = \"surface\"\nsurface = "
                    "\"s\"\n[device]\n"
                    "type = \"orbit\"\nduration_s = 5\n",
                    "cavity.toml"));
    const auto run = [&](const RunWatch& watch) {
        SteadyClock clock;
        const SceneDevice device = make_device(*scene);
        return run_trace(scene, device.placed(), clock, 5000, watch);
    };
    const Trace alone = run({});
    ASSERT_GT(alone.frames.size(), 1000u);

    test::LiveClient deaf(server_), loud(server_);
    ASSERT_TRUE(deaf.open(server_));
    ASSERT_TRUE(loud.open(server_));
    std::atomic<bool> goes_on{true};
    std::thread shouts([&] {
        while (goes_on && loud.try_send(std::string(3000, '{'))) {
        }
    });
    RunWatch watch;
    watch.frame = [this](const RunFrame& frame) { server_.add(frame.frame); };
    const Trace shown = run(watch);
    goes_on = false;
    loud.shut_down();
    shouts.join();
    ASSERT_EQ(shown.frames.size(), alone.frames.size());
    for (std::size_t i = 0; i < alone.frames.size(); ++i)
        ASSERT_EQ(test::difference(alone.frames[i], shown.frames[i]), "") << "frame " << i;
}

TEST(LiveServer, ASecondMeshBesideTheOneThatIsMadeIsAnError) {
    std::promise<void> promise;
    const std::shared_future<void> may_end = promise.get_future().share();
    LiveServer server({}, "<html></html>", std::make_shared<const std::string>("s"),
                      [may_end](const ViewCommand&) {
                          LiveReply reply;
                          reply.later = [may_end](const Progress&) {
                              may_end.wait();
                              return std::make_shared<const std::string>("mesh");
                          };
                          return reply;
                      });
    test::LiveClient client(server);
    ASSERT_TRUE(client.open(server));
    client.next(); // the scene
    client.next(); // the state
    for (int i = 0; i < 2; ++i)
        client.send(R"({"do": "level", "structure": 0, "facets": 1000})");
    const std::string said = client.next();
    EXPECT_THAT(said, HasSubstr("one mesh after the other"));
    EXPECT_THAT(said, HasSubstr("\"error\""));
    promise.set_value();
    EXPECT_EQ(client.next(), "mesh");
}

} // namespace
} // namespace palpate
