// SPDX-License-Identifier: Apache-2.0
// What the command writes is never what it reads, nor somebody else's.
#include <csignal>
#include <cstdlib>
#include <string>

#include <gmock/gmock.h>

#include "tests/command/command_run.h"
#include "tests/command/scenes.h"

namespace palpate {
namespace {

using test::content_of;
using testing::HasSubstr;
using testing::Not;

class CommandOutputs : public test::CommandRun {
protected:
    CommandOutputs() {
        make("ball.toml", test::ball_scene());
        make("probe.csv", test::pressing_path());
    }

    /// Refused with one line that says `why`, and everything as it was.
    void expect_refused(const std::vector<std::string>& arguments, const std::string& kept,
                        const std::string& why) {
        const std::string before = content_of(*this / kept);
        ASSERT_FALSE(before.empty());
        const test::CommandResult result = run(arguments);
        EXPECT_EQ(result.exit, 3) << result.err;
        EXPECT_THAT(result.err, HasSubstr(why));
        EXPECT_EQ(result.times("\n"), 1u) << result.err;
        EXPECT_EQ(content_of(*this / kept), before) << kept;
    }
};

// A path that happens to be called frames.csv was replaced by the frames that it led to.
TEST_F(CommandOutputs, APathCalledFramesCsvIsNotReplacedByTheFramesOfItsTrace) {
    make("frames.csv", test::pressing_path());
    make("own.toml", test::ball_scene("frames.csv"));
    expect_refused({"trace", "own.toml", "--out", "."}, "frames.csv", "is what is read as");
    expect_refused({"trace", "own.toml", "--out", ".", "--force"}, "frames.csv",
                   "is what is read as");
    expect_refused({"trace", "ball.toml", "--device", "path:frames.csv", "--out", "."},
                   "frames.csv", "is what is read as");
}

TEST_F(CommandOutputs, LinksToAnInputAreTheInput) {
    std::filesystem::create_directory(*this / "hard");
    std::filesystem::create_hard_link(*this / "probe.csv", *this / "hard/frames.csv");
    expect_refused({"trace", "ball.toml", "--out", "hard", "--force"}, "hard/frames.csv",
                   "is what is read as");
    std::filesystem::create_directory(*this / "soft");
    std::filesystem::create_symlink("../probe.csv", *this / "soft/timing.csv");
    expect_refused({"trace", "ball.toml", "--out", "soft", "--force"}, "probe.csv",
                   "is what is read as");
    std::filesystem::create_directory(*this / "scene");
    std::filesystem::create_symlink("../ball.toml", *this / "scene/index.html");
    expect_refused({"study", "ball.toml", "--out", "scene"}, "ball.toml", "is what is read as");
}

// What was being played was replaced by what came of it.
TEST_F(CommandOutputs, ARecordingIsNotReplacedByTheOneOfItsPlaying) {
    ASSERT_EQ(run({"trace", "ball.toml", "--out", "r"}).exit, 0);
    expect_refused(
        {"trace", "ball.toml", "--device", "recording:r/recording.h5", "--out", "r", "--force"},
        "r/recording.h5", "is what is read as");
    ASSERT_EQ(
        run({"trace", "ball.toml", "--device", "recording:r/recording.h5", "--out", "q"}).exit, 0);
    std::filesystem::create_hard_link(*this / "r/recording.h5", *this / "q/again.h5");
    std::filesystem::rename(*this / "q/again.h5", *this / "q/summary.json");
    expect_refused({"replay", "r/recording.h5", "--out", "q", "--force"}, "r/recording.h5",
                   "is what is read as");
}

// How late the frames of a run in real time were is in its tables alone: a replay wrote its own in
// their place, and a report then refused the folder.
TEST_F(CommandOutputs, AReplayLeavesTheTablesOfARunAlone) {
    ASSERT_EQ(run({"trace", "ball.toml", "--out", "t"}).exit, 0);
    for (const char* folder : {"t", "./t/"})
        expect_refused({"replay", "t", "--out", folder, "--force"}, "t/summary.json",
                       "has the recording of a run");
    EXPECT_EQ(run({"report", "t", "-o", "page.html"}).exit, 0);
}

// Pages called .png were written, and a folder of a run became a paragraph of text.
TEST_F(CommandOutputs, APageIsCalledOneAndARunIsNoNote) {
    ASSERT_EQ(run({"trace", "ball.toml", "--out", "t"}).exit, 0);
    const std::vector<std::vector<std::string>> wrong{{"report", "t", "-o", "page.png"},
                                                      {"view", "t", "-o", "page.png"},
                                                      {"view", "ball.toml", "-o", "page.html"},
                                                      {"report", "t", "--note", "a", "t"}};
    for (const std::vector<std::string>& arguments : wrong) {
        const test::CommandResult result = run(arguments);
        EXPECT_EQ(result.exit, 2) << result.err;
        EXPECT_EQ(result.times("\n"), 1u) << result.err;
    }
    for (const char* name : {"page.png", "page.html", "report.html"})
        EXPECT_FALSE(std::filesystem::exists(*this / name)) << name;
}

// All rows had the same name.
TEST_F(CommandOutputs, RunsOfOneSceneAreToldApartInAReport) {
    for (const char* folder : {"first", "second"})
        ASSERT_EQ(run({"trace", "ball.toml", "--out", folder}).exit, 0);
    const test::CommandResult both =
        run({"report", "first", "second/recording.h5", "-o", "page.html"});
    EXPECT_EQ(both.exit, 0) << both.err;
    for (const char* folder : {", first ", ", second "})
        EXPECT_THAT(both.out, HasSubstr(folder));
    std::filesystem::remove(*this / "second/summary.json"); // as serve leaves none
    expect_refused({"report", "second", "-o", "page.html"}, "page.html", "has no summary.json");
}

// Both said that all was written, and one of them was gone.
TEST_F(CommandOutputs, AFolderIsWrittenByOneCommandAtATime) {
    const pid_t first = start({"trace", "ball.toml", "--device", "hand", "--pace", "realtime",
                               "--seconds", "60", "--out", "t"});
    ASSERT_TRUE(has_grown(*this / "t/recording.h5.part", 1000));
    standard_out = "second.txt";
    const test::CommandResult second = run({"trace", "ball.toml", "--out", "t", "--force"});
    EXPECT_EQ(second.exit, 3);
    EXPECT_THAT(second.err, HasSubstr("t: another command is writing into it"));
    ::kill(first, SIGINT);
    EXPECT_EQ(end(first).signal, SIGINT);
    EXPECT_EQ(run({"replay", "t", "--check"}).exit, 0);
    EXPECT_EQ(run({"trace", "ball.toml", "--out", "t"}).exit, 0) << "it is free again";
}

TEST_F(CommandOutputs, AFileOfSomebodyElseIsReplacedOnlyByForceAndOwnOnesAlways) {
    std::filesystem::create_directory(*this / "t");
    make("t/summary.json", "{\"mine\": 1}\n");
    expect_refused({"trace", "ball.toml", "--out", "t"}, "t/summary.json",
                   "was not written by Palpate");
    EXPECT_FALSE(std::filesystem::exists(*this / "t/frames.csv")) << "before anything is computed";
    EXPECT_EQ(run({"trace", "ball.toml", "--out", "t", "--force"}).exit, 0);
    EXPECT_EQ(run({"trace", "ball.toml", "--out", "t"}).exit, 0) << "all four are ours now";
    EXPECT_EQ(run({"replay", "t/recording.h5", "--out", "again"}).exit, 0);
    EXPECT_EQ(run({"replay", "t/recording.h5", "--out", "again"}).exit, 0);

    make("note.html", "<!DOCTYPE html><title>Palpate, my notes</title>");
    make("shape.ply", "ply\nformat ascii 1.0\nend_header\n");
    make("picture.png", "\x89PNG somebody's");
    make("head.nrrd", "NRRD0004\n");
    expect_refused({"report", "t", "-o", "note.html"}, "note.html", "was not written by Palpate");
    expect_refused({"phantom", "head.nrrd"}, "head.nrrd", "was not written by Palpate");
    for (const char* name : {"head.nrrd", "ct.nii", "ct.nii.gz"}) {
        EXPECT_EQ(run({"phantom", name, "--force"}).exit, 0) << name;
        EXPECT_EQ(run({"phantom", name}).exit, 0) << name;
    }
    expect_refused(
        {"extract", "head.nrrd", "-o", "shape.ply", "--iso", "226", "--method", "preview"},
        "shape.ply", "was not written by Palpate");
    expect_refused({"info", "head.nrrd", "--picture", "picture.png"}, "picture.png",
                   "was not written by Palpate");
    for (const char* how : {"--force", "--keep"}) {
        std::vector<std::string> extract{"extract", "head.nrrd", "-o",       "shape.ply",
                                         "--iso",   "226",       "--method", "preview"};
        std::vector<std::string> picture{"info", "head.nrrd", "--picture", "picture.png"};
        if (how == std::string("--force")) {
            extract.push_back(how);
            picture.push_back(how);
        }
        EXPECT_EQ(run(extract).exit, 0) << how;
        EXPECT_EQ(run(picture).exit, 0) << how;
    }
    EXPECT_EQ(run({"study", "ball.toml", "--frames", "50", "--out", "st"}).exit, 0);
    EXPECT_EQ(run({"study", "ball.toml", "--frames", "50", "--out", "st"}).exit, 0);
}

// The page replaced the scene, exit 0; and a folder that is not there was found after minutes.
TEST_F(CommandOutputs, ReportFailsBeforeItComputes) {
    ASSERT_EQ(run({"trace", "ball.toml", "--out", "t"}).exit, 0);
    expect_refused({"report", "t", "-o", "ball.toml", "--force"}, "ball.toml",
                   "is what is read as");
    for (const std::string name : {"t/summary.json", "t/frames.csv", "t/timing.csv"})
        expect_refused({"report", "t", "-o", name}, name, "is what is read as");
    expect_refused({"report", "t", "-o", "none/page.html"}, "ball.toml",
                   "its folder does not exist");
    const test::CommandResult result = run({"report", "t", "-o", "none/page.html"});
    EXPECT_THAT(result.out, Not(HasSubstr("adaptive"))) << "no table: nothing was computed";
}

// What is recorded of a run says what was felt; its pictures need no frame that can be replayed.
// Two scenes of one name are two subjects.
TEST_F(CommandOutputs, AReportIsOfTheScenesThatWereFelt) {
    ASSERT_EQ(run({"trace", "ball.toml", "--out", "t"}).exit, 0);
    std::string bigger = test::ball_scene();
    bigger.replace(bigger.find("radius_mm = 20"), 14, "radius_mm = 21");
    make("ball.toml", bigger);
    ASSERT_EQ(run({"trace", "ball.toml", "--out", "u"}).exit, 0);
    ASSERT_EQ(run({"report", "t", "u", "-o", "both.html"}).exit, 0);
    const std::string page = content_of(*this / "both.html");
    std::size_t pictures = 0;
    for (std::size_t at = 0; (at = page.find("<h2>ball", at)) != std::string::npos; ++at)
        ++pictures;
    EXPECT_EQ(pictures, 2u);
}

// Its numbers stood beside the charts of the recording.
TEST_F(CommandOutputs, TheSummaryOfAnotherSceneIsRefused) {
    ASSERT_EQ(run({"trace", "ball.toml", "--out", "t"}).exit, 0);
    std::string bigger = test::ball_scene();
    bigger.replace(bigger.find("radius_mm = 20"), 14, "radius_mm = 21");
    make("bigger.toml", bigger);
    ASSERT_EQ(run({"trace", "bigger.toml", "--out", "u"}).exit, 0);
    ASSERT_EQ(run({"report", "t", "u", "-o", "both.html"}).exit, 0);
    std::filesystem::copy_file(*this / "u/summary.json", *this / "t/summary.json",
                               std::filesystem::copy_options::overwrite_existing);
    expect_refused({"report", "t", "u", "-o", "both.html"}, "both.html",
                   "t/summary.json: is of another run than recording.h5");
    ASSERT_EQ(run({"trace", "ball.toml", "--method", "single", "--out", "v"}).exit, 0);
    std::filesystem::copy_file(*this / "v/summary.json", *this / "t/summary.json",
                               std::filesystem::copy_options::overwrite_existing);
    expect_refused({"report", "t", "-o", "both.html"}, "both.html",
                   "t/summary.json: is of another run than recording.h5");
    make("t/summary.json", "{");
    expect_refused({"report", "t", "u", "-o", "both.html"}, "both.html",
                   "t/summary.json: is damaged; trace the scene again");
}

// Nor does it matter how the loop steps: the surface is the same.
TEST_F(CommandOutputs, TracesOfOneSceneShareItsPicture) {
    ASSERT_EQ(run({"trace", "ball.toml", "--out", "t"}).exit, 0);
    ASSERT_EQ(run({"trace", "ball.toml", "--method", "single", "--out", "u"}).exit, 0);
    ASSERT_EQ(run({"report", "t", "u", "-o", "both.html"}).exit, 0);
    const std::string page = content_of(*this / "both.html");
    const std::size_t first = page.find("<h2>ball");
    ASSERT_NE(first, std::string::npos);
    EXPECT_EQ(page.find("<h2>ball", first + 1), std::string::npos);
}

TEST_F(CommandOutputs, APageThatIsFilledIsNotReplaced) {
    ASSERT_EQ(run({"trace", "ball.toml", "--out", "t"}).exit, 0);
    make("own.html", "<title>Palpate</title> with words of one's own");
    expect_refused({"view", "t", "--page", "own.html", "-o", "own.html", "--force"}, "own.html",
                   "is what is read as");
}

TEST_F(CommandOutputs, WhatIsNoOrdinaryFileIsNotReplaced) {
    ASSERT_EQ(run({"trace", "ball.toml", "--out", "t"}).exit, 0);
    std::filesystem::create_symlink("nowhere", *this / "page.html");
    for (const char* name : {"page.html", "t", "/dev/null"}) {
        const test::CommandResult result = run({"report", "t", "-o", name, "--force"});
        EXPECT_EQ(result.exit, 3) << name;
        EXPECT_THAT(result.err, HasSubstr("no ordinary file"));
    }
    EXPECT_TRUE(std::filesystem::is_symlink(*this / "page.html"));
}

// An event that stdout did not take aborted the command, with a device in its hand.
TEST_F(CommandOutputs, ARunGoesOnWhereItsEventsCannotBeWritten) {
    standard_out = "/dev/full";
    for (const std::string pace : {"asap", "realtime"}) {
        const test::CommandResult result =
            run({"trace", "ball.toml", "--events", "--pace", pace, "--out", pace});
        EXPECT_EQ(result.exit, 3) << pace << result.err;
        EXPECT_EQ(result.times("events cannot be written to stdout any more"), 1u) << result.err;
        EXPECT_EQ(result.times("palpate: stdout: what was found cannot be written"), 1u);
        for (const char* file : {"frames.csv", "timing.csv", "summary.json", "recording.h5"})
            EXPECT_TRUE(std::filesystem::exists(*this / pace / file)) << pace << "/" << file;
    }
}

TEST_F(CommandOutputs, AReportIsThereAlsoWhereItsTableCannotBeWritten) {
    ASSERT_EQ(run({"trace", "ball.toml", "--out", "t"}).exit, 0);
    standard_out = "/dev/full";
    EXPECT_EQ(run({"report", "t", "-o", "page.html"}).exit, 3);
    EXPECT_TRUE(std::filesystem::exists(*this / "page.html"));
}

TEST_F(CommandOutputs, AReaderThatGoesAwayEndsNoRun) {
    const std::string run = "cd '" + folder().string() +
                            "' && PALPATE_CACHE= " PALPATE_COMMAND
                            " trace ball.toml --events --pace realtime --out r | true";
    EXPECT_EQ(std::system(run.c_str()), 0) << "the exit code is that of `true`";
    EXPECT_TRUE(std::filesystem::exists(*this / "r/recording.h5"));
    EXPECT_FALSE(std::filesystem::exists(*this / "r/recording.h5.part"));
}

// It was none of the folders, though it was named as one of them.
TEST_F(CommandOutputs, ARunIsPlayedByTheNameOfItsRecordingToo) {
    ASSERT_EQ(run({"trace", "ball.toml", "--out", "t"}).exit, 0);
    const test::CommandResult result =
        run({"report", "t/recording.h5", "-o", "r.html", "--playback", "t/recording.h5"});
    if (result.err.find("no page in it") != std::string::npos) GTEST_SKIP() << result.err;
    EXPECT_EQ(result.exit, 0) << result.err;
    EXPECT_TRUE(std::filesystem::exists(*this / "r-t.html"));
}

} // namespace
} // namespace palpate
