// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <sstream>
#include <string>
#include <thread>

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/geometry/vec.h>

#include "tests/command/check_outcomes.h"
#include "tests/command/command_run.h"
#include "tests/command/frame_table.h"

namespace palpate::test {
namespace {

using testing::HasSubstr;

/// A box of 10 mm that is in the middle of no axis, so that no axis can be taken for another one,
/// felt by its mesh; a path presses into its top, and lifts off again.
class ServeCommand : public CommandRun {
protected:
    void SetUp() override {
        make("box.ply", box());
        make("probe.csv", path());
        make("scene.toml", scene("path\"\nfile = \"probe.csv"));
    }

    static std::string scene(const std::string& device) {
        return "[surface.box]\nmesh = \"box.ply\"\nmesh_unit = \"mm\"\nmesh_frame = \"LPS\"\n"
               "[[effect]]\ntype = \"surface\"\nsurface = \"box\"\n[device]\ntype = \"" +
               device + "\"\n";
    }

    static std::string box() {
        std::string text = "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty "
                           "float y\nproperty float z\nelement face 12\nproperty list uchar int "
                           "vertex_indices\nend_header\n";
        for (int i = 0; i < 8; ++i)
            text += fmt::format("{} {} {}\n", i & 1 ? 20 : 10, i & 2 ? 40 : 30, i & 4 ? 60 : 50);
        for (const char* face : {"0 2 3", "0 3 1", "4 5 7", "4 7 6", "0 1 5", "0 5 4", "2 6 7",
                                 "2 7 3", "0 4 6", "0 6 2", "1 3 7", "1 7 5"})
            text += std::string("3 ") + face + "\n";
        return text;
    }

    /// Half a second at 1 kHz above the middle of the box's top, from 2 mm outside to 3 mm inside.
    static std::string path() {
        std::string text = "t_s,x_m,y_m,z_m\n";
        for (int i = 0; i < 500; ++i) {
            const double share = i < 250 ? i / 250.0 : (500 - i) / 250.0;
            text += fmt::format("{:.17g},{:.17g},0.035,{:.17g}\n", 1e-3 * i, 0.015 + 2e-6 * i,
                                0.062 - 0.005 * share);
        }
        return text;
    }

    /// The port that the command says that it has; 0 where it ends without.
    int port() const {
        for (int i = 0; i < 6000; ++i) {
            const std::string out = content_of(folder() / "out.txt");
            const std::size_t at = out.find(" port ");
            if (at != std::string::npos && out.find('\n', at) != std::string::npos)
                return std::stoi(out.substr(at + 6));
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        return 0;
    }

    /// Runs the client, which shares no code with us; what it says where something is wrong.
    std::string client(const std::string& arguments) const {
        const std::filesystem::path said = folder() / "client.txt";
        const int status =
            std::system(fmt::format("cd '{}' && '{}' -B '{}' {} > '{}' 2>&1", folder().string(),
                                    PALPATE_PYTHON, PALPATE_IGTL_CLIENT, arguments, said.string())
                            .c_str());
        return status == 0 ? "" : "wrong: " + content_of(said);
    }
};

// As `palpate serve ... | head -1` does it.
TEST_F(ServeCommand, WhereNobodyReadsItsWordsAnyMoreWhatWasFeltIsWrittenAllTheSame) {
    standard_out = "read_once";
    ASSERT_EQ(::mkfifo((*this / standard_out).c_str(), 0600), 0);
    const int reader = ::open((*this / standard_out).c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    ASSERT_GE(reader, 0);
    const pid_t child =
        start({"serve", "scene.toml", "--igtl", "0", "--out", "run", "--seconds", "5"});
    pollfd words{reader, POLLIN, 0};
    char first = 0;
    EXPECT_EQ(::poll(&words, 1, 60000), 1);
    EXPECT_EQ(::read(reader, &first, 1), 1);
    ::close(reader);
    const CommandResult result = end(child);
    EXPECT_EQ(result.exit, 3) << result.err;
    EXPECT_THAT(result.err, HasSubstr("stdout: what was found cannot be written there"));
    EXPECT_TRUE(std::filesystem::exists(*this / "run/frames.csv"));
    EXPECT_FALSE(std::filesystem::exists(*this / "run/recording.h5.part"));
    standard_out = "out.txt";
    const CommandResult replayed = run({"replay", "run/recording.h5", "--check"});
    EXPECT_EQ(replayed.exit, 0) << replayed.err;
}

TEST_F(ServeCommand, TheClientOnThePageShowsProbeProxyAndForce) {
    const std::string page = content_of(PALPATE_SLICER_PAGE);
    const std::size_t begin = page.find("import socket\n");
    ASSERT_NE(begin, std::string::npos) << "the page has no client";
    make("client.py", page.substr(begin, page.find("```", begin) - begin));
    const pid_t child = start({"serve", "scene.toml", "--igtl", "0", "--out", "run"});
    const int at = port();
    ASSERT_NE(at, 0);
    const std::string command = fmt::format("cd '{}' && '{}' client.py {} > shown.txt 2>&1",
                                            folder().string(), PALPATE_PYTHON, at);
    EXPECT_EQ(std::system(command.c_str()), 0) << content_of(folder() / "shown.txt");
    ::kill(child, SIGINT);
    end(child);
    const std::string shown = content_of(folder() / "shown.txt");
    for (const char* name : {"Stylus ", "StylusVelocity ", "Buttons ", "Force ", "Proxy "})
        EXPECT_THAT(shown, HasSubstr(name));
    // A place that it shows is one of a frame: x and y turn their sign from LPS to RAS.
    const std::size_t line = shown.find("Stylus ");
    std::istringstream numbers(shown.substr(line + 15, shown.find('\n', line) - line - 15));
    Vec3 ras_mm;
    ASSERT_TRUE(numbers >> ras_mm.x >> ras_mm.y >> ras_mm.z) << shown;
    auto table = test::frame_table(folder() / "run/frames.csv");
    double nearest_mm = 1e9;
    for (std::size_t n = 0; n < table["time_s"].size(); ++n)
        nearest_mm = std::min(
            nearest_mm, glm::distance(1e3 * Vec3(-table["probe_x_m"][n], -table["probe_y_m"][n],
                                                 table["probe_z_m"][n]),
                                      ras_mm));
    EXPECT_LT(nearest_mm, 1.8e-3) << "printed with 3 digits and sent with 24 bits";
}

TEST_F(ServeCommand, ClientsOfBothVersionsGetSurfacesAndFramesOfTheRecording) {
    const pid_t child = start({"serve", "scene.toml", "--igtl", "0", "--out", "run"});
    const int at = port();
    ASSERT_NE(at, 0);
    EXPECT_EQ(client(fmt::format("session {} 2 60 two.json", at)), "");
    EXPECT_EQ(client(fmt::format("session {} 1 30 one.json", at)), "");
    EXPECT_EQ(client(fmt::format("faults {}", at)), "");
    EXPECT_EQ(client(fmt::format("session {} 2 10 after.json", at)), "");
    ::kill(child, SIGINT);
    const CommandResult result = end(child);
    EXPECT_EQ(result.signal, SIGINT) << result.err;
    EXPECT_THAT(result.out, HasSubstr("written to run: frames.csv recording.h5"));
    EXPECT_THAT(result.out, HasSubstr("dropped: 6"));
    EXPECT_EQ(client("compare run/frames.csv two.json one.json after.json"), "");
    // The box, in RAS and mm, in the colour of a first surface.
    const std::string surface = content_of(folder() / "two.json");
    EXPECT_THAT(surface, HasSubstr("\"name\": \"box\", \"points\": 8, \"triangles\": 12"));
    EXPECT_THAT(surface, HasSubstr("[[-20.0, -10.0], [-40.0, -30.0], [50.0, 60.0]]"));
    EXPECT_THAT(surface, HasSubstr("\"rgba\": [0.890196"));
    EXPECT_EQ(run({"replay", "run/recording.h5", "--check", "--out", "again"}).exit, 0);
}

// It ended as if it had been felt.
TEST_F(ServeCommand, AToolThatNeverCameIsAFailedRun) {
    const CommandResult served = run({"serve", "scene.toml", "--igtl", "0", "--device", "igtl:Tool",
                                      "--seconds", "2", "--out", "run"});
    EXPECT_EQ(served.exit, 4) << served.err;
    EXPECT_THAT(served.err, HasSubstr("Tool never came"));
    EXPECT_TRUE(std::filesystem::exists(folder() / "run/recording.h5"));
}

TEST_F(ServeCommand, AToolOfAClientMovesTheProbe) {
    const pid_t child = start({"serve", "scene.toml", "--igtl", "0", "--device", "igtl:Tool"});
    const int at = port();
    ASSERT_NE(at, 0);
    EXPECT_EQ(client(fmt::format("tool {} Tool", at)), "");
    ::kill(child, SIGTERM);
    const CommandResult result = end(child);
    EXPECT_EQ(result.signal, SIGTERM);
    EXPECT_EQ(result.times("warning"), 0u) << result.err;
}

TEST_F(ServeCommand, ASecondCommandFollowsTheFirstOne) {
    const pid_t child = start({"serve", "scene.toml", "--igtl", "0"});
    const int at = port();
    ASSERT_NE(at, 0);
    make("follow.toml", scene(fmt::format("igtl:Stylus@127.0.0.1:{}", at)));
    standard_out = "follow.txt";
    const CommandResult follow =
        run({"trace", "follow.toml", "--pace", "realtime", "--seconds", "6", "--out", "follow"});
    EXPECT_EQ(follow.exit, 0) << follow.err;
    ::kill(child, SIGINT);
    end(child);
    // The box was touched where the first one touched it.
    EXPECT_THAT(content_of(folder() / "follow" / "frames.csv"), HasSubstr("box"));
}

// A folder has one run: of a trace that it had before nothing is left that a report would mix up
// with it.
TEST_F(ServeCommand, ItsFolderHasNothingOfAnEarlierTrace) {
    ASSERT_EQ(run({"trace", "scene.toml", "--out", "run"}).exit, 0);
    const CommandResult served =
        run({"serve", "scene.toml", "--igtl", "0", "--seconds", "0.3", "--out", "run"});
    EXPECT_EQ(served.exit, 0) << served.err;
    EXPECT_THAT(served.err, HasSubstr("removed what an earlier run had left"));
    EXPECT_TRUE(std::filesystem::exists(folder() / "run/recording.h5"));
    for (const char* table : {"summary.json", "timing.csv"})
        EXPECT_FALSE(std::filesystem::exists(folder() / "run" / table)) << table;
}

TEST_F(ServeCommand, TheDriverOfToolsPassesTheChecksOfDrivers) {
    const pid_t child = start({"serve", "scene.toml", "--igtl", "0"});
    const int at = port();
    ASSERT_NE(at, 0);
    standard_out = "checks.txt";
    CommandResult checked = passed_in_three([&] {
        return run({"validate", "driver", fmt::format("igtl:Stylus@127.0.0.1:{}", at), "--json",
                    "--frames", "2000"});
    });
    ::kill(child, SIGINT);
    end(child);
    checked.out = content_of(folder() / "checks.txt");
    expect_passed_without_force(checked);
}

TEST_F(ServeCommand, AToolWhoseServerGoesAwayIsAFailedRunWithAllThatWasRecorded) {
    const pid_t child = start({"serve", "scene.toml", "--igtl", "0"});
    const int at = port();
    ASSERT_NE(at, 0);
    make("follow.toml", scene(fmt::format("igtl:Stylus@127.0.0.1:{}", at)));
    standard_out = "follow.txt";
    std::thread end_it([this, child] {
        has_grown(folder() / "follow/recording.h5.part", 50'000); // it feels what comes
        ::kill(child, SIGINT);
    });
    const CommandResult follow =
        run({"trace", "follow.toml", "--pace", "realtime", "--seconds", "5", "--out", "follow"});
    end_it.join();
    end(child);
    EXPECT_EQ(follow.exit, 4) << follow.err;
    EXPECT_THAT(follow.err, HasSubstr(fmt::format("at 127.0.0.1 port {} went away", at)));
    EXPECT_THAT(follow.err, HasSubstr("look at the program that sends it"));
    EXPECT_EQ(run({"replay", "follow", "--check"}).exit, 0) << "a folder is as good as its file";
}

TEST_F(ServeCommand, SaysWhatIsInTheWay) {
    const auto expect = [&](const std::vector<std::string>& options, int exit,
                            const std::string& words) {
        std::vector<std::string> arguments{"serve", "scene.toml"};
        arguments.insert(arguments.end(), options.begin(), options.end());
        const CommandResult result = run(arguments);
        EXPECT_EQ(result.exit, exit) << result.err;
        EXPECT_THAT(result.err, HasSubstr(words));
    };
    expect({"--listen", "0.0.0.0"}, 2, "may be a patient's");
    expect({"--listen", "nowhere", "--allow-remote"}, 3, "is no address");
    expect({"--allow-remote"}, 2, "--listen");
    expect({"--igtl", "70000"}, 2, "65535");
    expect({"--device", "igtl:@host"}, 2, "the name of the TRANSFORM has 1 to 20 bytes");
    expect({"--device", "igtl:Tool@127.0.0.1:1"}, 4, "no server of OpenIGTLink answers");
    make("bad.toml", scene("igtl:Tool@host:0"));
    const CommandResult bad = run({"serve", "bad.toml"});
    EXPECT_EQ(bad.exit, 3);
    EXPECT_THAT(bad.err, HasSubstr("bad.toml:9: igtl:Tool@host:0: a port is a number"));
    const CommandResult alone =
        run({"trace", "scene.toml", "--pace", "realtime", "--device", "igtl:Tool"});
    EXPECT_EQ(alone.exit, 4);
    EXPECT_THAT(alone.err, HasSubstr("names no server"));
    const CommandResult asap = run({"trace", "scene.toml", "--device", "igtl:Tool@127.0.0.1"});
    EXPECT_EQ(asap.exit, 2);
    EXPECT_THAT(asap.err, HasSubstr("--pace realtime"));
}

} // namespace
} // namespace palpate::test
