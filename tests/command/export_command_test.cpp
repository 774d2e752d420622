// SPDX-License-Identifier: Apache-2.0
// palpate export: what it writes is read back by a program that has nothing of ours.
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <palpate/engine/record/recording.h>

#include "tests/command/command_run.h"
#include "tests/command/scenes.h"

namespace palpate {
namespace {

using test::content_of;
using testing::HasSubstr;

class Exported : public test::CommandRun {
protected:
    void SetUp() override {
        make("ball.toml", test::ball_scene());
        make("probe.csv", test::pressing_path());
        const test::CommandResult trace = run({"trace", "ball.toml", "--out", "t"});
        ASSERT_EQ(trace.exit, 0) << trace.err;
    }
};

TEST_F(Exported, FilesAreReadBackByAnIndependentReader) {
    for (const std::vector<std::string>& more :
         {std::vector<std::string>{"run.mrk.json"}, {"run.vtp"}, {"s.vtp", "--surface", "s"}}) {
        std::vector<std::string> arguments{"export", "t", "-o"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const test::CommandResult result = run(arguments);
        ASSERT_EQ(result.exit, 0) << result.err;
        EXPECT_THAT(result.out, HasSubstr("written: " + more.front()));
        EXPECT_EQ(run(arguments).exit, 0) << "its own files are replaced";
    }
    const std::string command = std::string(PALPATE_PYTHON3) + " " PALPATE_EXPORTED_FILES " " +
                                folder().string() + " > " + (*this / "read.txt").string() + " 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << content_of(*this / "read.txt");
}

TEST_F(Exported, AStepIsOfMarkupsAlone) {
    const test::CommandResult refused = run({"export", "t", "-o", "t.vtp", "--step-ms", "5"});
    EXPECT_EQ(refused.exit, 2);
    EXPECT_THAT(refused.err, HasSubstr("--step-ms: is of .mrk.json"));
    EXPECT_EQ(run({"export", "t", "-o", "t.mrk.json", "--step-ms", "5"}).exit, 0);
}

/// Whether tests/command/mcap_file.py finds what the frames.csv say.
class ExportedForRos : public Exported {
protected:
    bool is_right(const std::string& file, const std::string& frames) {
        const std::string command = "cd " + folder().string() +
                                    " && " PALPATE_PYTHON3 " " PALPATE_MCAP_FILE " " + file + " " +
                                    frames + " > read.txt 2>&1";
        return std::system(command.c_str()) == 0;
    }
    std::string said() { return content_of(*this / "read.txt"); }
};

TEST_F(ExportedForRos, ARunIsReadBackByTheFormatsSpecification) {
    // Two trials, the first with more than one chunk of messages.
    std::string path = "t_s,x_m,y_m,z_m\n";
    for (int trial = 0; trial < 2; ++trial)
        for (int n = 0; n < (trial == 0 ? 4000 : 300); ++n)
            path += fmt::format("{:.17g},{:.17g},{:.17g},0.001\n", 1e-3 * n, 0.0215 - 1e-6 * n,
                                1e-6 * n);
    make("probe.csv", path);
    ASSERT_EQ(run({"trace", "ball.toml", "--out", "t"}).exit, 0);
    const test::CommandResult result = run({"export", "t", "-o", "run.mcap"});
    ASSERT_EQ(result.exit, 0) << result.err;
    EXPECT_TRUE(is_right("run.mcap", "t/frames.csv")) << said();
    EXPECT_THAT(said(), HasSubstr("12901 messages in 2 chunks"));
    EXPECT_EQ(run({"export", "t", "-o", "run.mcap"}).exit, 0) << "its own file is replaced";

    // The reader is about something: it misses no bit that has changed, and no end that is gone.
    const std::string whole = content_of(*this / "run.mcap");
    for (const std::size_t at : {9UL, 40UL, 900UL, whole.size() / 2, whole.size() - 1000,
                                 whole.size() - 60, whole.size() - 20}) {
        std::string damaged = whole;
        damaged[at] = static_cast<char>(damaged[at] ^ 4);
        make("damaged.mcap", damaged);
        EXPECT_FALSE(is_right("damaged.mcap", "t/frames.csv")) << at;
    }
    make("damaged.mcap", whole.substr(0, whole.size() / 2));
    EXPECT_FALSE(is_right("damaged.mcap", "t/frames.csv"));
    make("probe.csv", test::pressing_path());
    ASSERT_EQ(run({"trace", "ball.toml", "--out", "other"}).exit, 0);
    EXPECT_FALSE(is_right("run.mcap", "other/frames.csv"));
}

TEST_F(ExportedForRos, EachOfSeveralHandsHasItsTopics) {
    const std::string scene = test::ball_scene();
    const std::string device = "\ntype = \"path\"\nfile = \"";
    make("other.csv", test::pressing_path(-1.0));
    make("two.toml", scene.substr(0, scene.find("[device]")) + "[[device]]\nname = \"left\"" +
                         device + "probe.csv\"\n[[device]]\nname = \"right\"" + device +
                         "other.csv\"\n");
    ASSERT_EQ(run({"trace", "two.toml", "--out", "two"}).exit, 0);
    const test::CommandResult both = run({"export", "two", "-o", "both.mcap"});
    ASSERT_EQ(both.exit, 0) << both.err;
    EXPECT_EQ(both.err, "") << "it leaves no hand out";
    EXPECT_TRUE(is_right("both.mcap", "left=two/left/frames.csv right=two/right/frames.csv"))
        << said();
    ASSERT_EQ(run({"export", "two", "-o", "one.mcap", "--hand", "right"}).exit, 0);
    EXPECT_TRUE(is_right("one.mcap", "right=two/right/frames.csv")) << said();
    EXPECT_FALSE(is_right("one.mcap", "right=two/left/frames.csv"));
}

TEST_F(ExportedForRos, AnOutputThatCannotBeFinishedLeavesTheOldOne) {
    ASSERT_EQ(run({"export", "t", "-o", "run.mcap"}).exit, 0);
    const std::string before = content_of(*this / "run.mcap");
    const std::string command = "cd " + folder().string() +
                                " && ulimit -f 8 && " PALPATE_COMMAND
                                " export t -o run.mcap > full.txt 2>&1";
    EXPECT_NE(std::system(("bash -c '" + command + "'").c_str()), 0);
    EXPECT_THAT(content_of(*this / "full.txt"), HasSubstr("run.mcap: cannot be written"));
    EXPECT_EQ(content_of(*this / "run.mcap"), before);
    for (const auto& entry : std::filesystem::directory_iterator(folder()))
        EXPECT_EQ(entry.path().string().find(".part"), std::string::npos) << entry.path();
}

TEST_F(Exported, WhatCannotBeWrittenIsRefusedInOneLine) {
    const auto refused = [&](std::vector<std::string> arguments, int code, const std::string& why) {
        arguments.insert(arguments.begin(), "export");
        const test::CommandResult result = run(arguments);
        EXPECT_EQ(result.exit, code) << result.err;
        EXPECT_THAT(result.err, HasSubstr(why));
        EXPECT_EQ(result.times("\n"), 1U) << result.err;
    };
    refused({"t", "-o", "run.csv"}, 2, "name it .mrk.json, .vtp or .mcap");
    refused({"t", "-o", "run.mrk.json", "--surface", "s"}, 2, "name the output .vtp");
    refused({"t", "-o", "run.mcap", "--surface", "s"}, 2, "name the output .vtp");
    refused({"t", "-o", "run.vtp", "--surface", ""}, 2, "--surface: is followed by an empty");
    refused({"t", "-o", "run.vtp", "--surface", "bone"}, 2, "surfaces are: s; name one of them");
    Recording old = read_recording(*this / "t/recording.h5");
    ASSERT_FALSE(old.touches.empty());
    old.touches.clear(); // as in a version that recorded none
    std::filesystem::create_directory(*this / "old");
    write_recording(*this / "old/recording.h5", old);
    refused({"old", "-o", "run.vtp", "--surface", "s"}, 3, "recorded no touches; run it again");
    refused({"t", "-o", "run.mrk.json", "--step-ms", "0"}, 2, "--step-ms");
    refused({"missing.h5", "-o", "run.vtp"}, 3, "missing.h5");
    refused({"t", "-o", "t/recording.mrk.json"}, 3, "named places are read from");
    make("mine.vtp", "<?xml version=\"1.0\"?>\n<VTKFile/>\n");
    refused({"t", "-o", "mine.vtp"}, 3, "was not written by Palpate");
    make("mine.mcap", std::string("\x89MCAP0\r\n\x01", 9) + std::string(60, '\0'));
    refused({"t", "-o", "mine.mcap"}, 3, "was not written by Palpate");
    make("mine.mrk.json", "{\"markups\": []}");
    refused({"t", "-o", "mine.mrk.json"}, 3, "was not written by Palpate");
    EXPECT_EQ(content_of(*this / "mine.mrk.json"), "{\"markups\": []}");
}

// What was felt is in the recording: what the scene was made of is not needed any more.
TEST_F(Exported, PathsOutliveTheFilesOfTheirScene) {
    std::filesystem::remove(*this / "probe.csv");
    for (const char* const out : {"run.vtp", "run.mrk.json", "run.mcap"})
        EXPECT_EQ(run({"export", "t", "-o", out}).exit, 0) << out;
}

} // namespace
} // namespace palpate
