// SPDX-License-Identifier: Apache-2.0
// What is felt in real time outlives the program.
#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>

#include <gmock/gmock.h>

#include "tests/command/command_run.h"
#include "tests/command/scenes.h"

namespace palpate {
namespace {

using testing::HasSubstr;

class CommandKilled : public test::CommandRun {};

/// The number in "replayed N frames".
std::size_t frames_in(const std::string& words) {
    const std::size_t at = words.find("replayed ");
    return at == std::string::npos ? 0 : std::strtoul(words.c_str() + at + 9, nullptr, 10);
}

// SIGKILL took everything that had been recorded.
TEST_F(CommandKilled, ARunInRealTimeLosesAtMostASecondAndTheRestIsReplayedBitForBit) {
    std::string path = "t_s,x_m,y_m,z_m\n"; // 60 s, one trial, pressing and letting go
    for (int i = 0; i < 60000; ++i)
        path += fmt::format("{:.17g},{:.17g},0,0\n", 1e-3 * i, 0.020 - 2e-6 * (i % 1000));
    make("probe.csv", path);
    make("ball.toml", test::ball_scene());
    const pid_t child = start({"trace", "ball.toml", "--out", "t", "--pace", "realtime"});
    ASSERT_TRUE(has_grown(*this / "t/recording.h5.part", 1000));
    std::this_thread::sleep_for(std::chrono::milliseconds(5000));
    ::kill(child, SIGKILL);
    ASSERT_EQ(end(child).signal, SIGKILL);
    EXPECT_FALSE(std::filesystem::exists(*this / "t/recording.h5")) << "it is not complete";

    for (const char* name : {"t/recording.h5", "t/recording.h5.part"}) {
        const test::CommandResult replayed = run({"replay", name});
        EXPECT_EQ(replayed.exit, 0) << replayed.err;
        EXPECT_THAT(replayed.err, HasSubstr("its run was cut off"));
        // Of 5 s after the first part, with the second that may be lost, at 1 kHz; the rest for a
        // machine that stands still.
        EXPECT_GE(frames_in(replayed.out), 750u) << replayed.out;
    }
    const test::CommandResult checked = run({"replay", "t/recording.h5.part", "--check"});
    EXPECT_EQ(checked.exit, 0) << checked.out << checked.err;
    EXPECT_THAT(run({"info", "t/recording.h5.part"}).out, HasSubstr("recording"));

    // A part that was being written is passed over; a run that ends leaves no journal.
    const std::string journal = test::content_of(*this / "t/recording.h5.part");
    make("t/recording.h5.part", journal.substr(0, journal.size() - 100));
    EXPECT_EQ(run({"replay", "t/recording.h5", "--check"}).exit, 0);
    const test::CommandResult whole =
        run({"trace", "ball.toml", "--out", "t", "--pace", "realtime", "--seconds", "1.5"});
    EXPECT_EQ(whole.exit, 0) << whole.err;
    EXPECT_TRUE(std::filesystem::exists(*this / "t/recording.h5"));
    EXPECT_FALSE(std::filesystem::exists(*this / "t/recording.h5.part"));
    // What there was of the run that was killed is kept: nobody can feel it again.
    EXPECT_THAT(whole.err, HasSubstr("of an earlier run that was cut off, t/recording.h5.part is "
                                     "now cut-off-1.h5.part"));
    EXPECT_EQ(run({"replay", "t/cut-off-1.h5.part", "--check"}).exit, 0);
    EXPECT_EQ(run({"replay", "t/recording.h5", "--check"}).times("cut off"), 0u);

    // Killed in a folder that has a recording already, which is what is there to be read.
    const auto later = std::filesystem::last_write_time(*this / "t/recording.h5");
    make("t/recording.h5.part", journal);
    std::filesystem::last_write_time(*this / "t/recording.h5.part", later + std::chrono::hours(1));
    const test::CommandResult older = run({"replay", "t", "--check"});
    EXPECT_EQ(older.exit, 0) << older.err;
    EXPECT_THAT(older.err, HasSubstr("beside it is recording.h5.part, of a later run"));
    const test::CommandResult asap = run({"trace", "ball.toml", "--out", "t"});
    EXPECT_THAT(asap.err, HasSubstr("t/recording.h5.part is now cut-off-2.h5.part"));
    EXPECT_FALSE(std::filesystem::exists(*this / "t/recording.h5.part"));
    EXPECT_EQ(test::content_of(*this / "t/cut-off-2.h5.part"), journal);
    make("t/recording.h5.part", journal); // of an earlier run
    std::filesystem::last_write_time(*this / "t/recording.h5.part",
                                     std::filesystem::last_write_time(*this / "t/recording.h5") -
                                         std::chrono::hours(1));
    EXPECT_EQ(run({"replay", "t"}).times("beside it"), 0u);

    // Alone in its folder it is what the folder has, also as the device of a run into it.
    std::filesystem::remove(*this / "t/recording.h5");
    const test::CommandResult shown = run({"view", "t", "-o", "page.html"});
    EXPECT_EQ(shown.exit, 0) << shown.err;
    const test::CommandResult again = run(
        {"trace", "ball.toml", "--out", "t", "--device", "recording:t/recording.h5", "--force"});
    EXPECT_NE(again.exit, 0);
    EXPECT_EQ(test::content_of(*this / "t/recording.h5.part"), journal);
}

// The first one ends the run; those after it came while it was audited and written.
TEST_F(CommandKilled, HoweverOftenItIsInterruptedWhatWasFeltIsWritten) {
    std::string path = "t_s,x_m,y_m,z_m\n"; // a minute
    for (int i = 0; i < 60000; ++i)
        path += fmt::format("{:.17g},{:.17g},0,0\n", 1e-3 * i, 0.022 - 4e-6 * (i % 1000));
    make("probe.csv", path);
    make("ball.toml", test::ball_scene());
    const pid_t child = start({"trace", "ball.toml", "--out", "t", "--pace", "realtime"});
    ASSERT_TRUE(has_grown(*this / "t/recording.h5.part", 1000));
    siginfo_t ended{};
    while (::waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           ended.si_pid == 0) {
        ::kill(child, SIGINT);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    const test::CommandResult result = end(child);
    EXPECT_EQ(result.signal, SIGINT) << result.err;
    EXPECT_GE(result.times("palpate: stopping"), 2u) << "one was enough, and nothing was tried";
    EXPECT_THAT(result.out, HasSubstr("written to t: frames.csv timing.csv summary.json"));
    EXPECT_FALSE(std::filesystem::exists(*this / "t/recording.h5.part"));
    const test::CommandResult checked = run({"replay", "t", "--check"});
    EXPECT_EQ(checked.exit, 0) << checked.err;
    EXPECT_EQ(checked.times("cut off"), 0u);
    EXPECT_THAT(checked.out, HasSubstr("0 of "));
}

} // namespace
} // namespace palpate
