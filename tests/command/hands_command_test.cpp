// SPDX-License-Identifier: Apache-2.0
// Several hands on the command line: what each command makes of them.
#include <string>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "tests/command/command_run.h"
#include "tests/command/scenes.h"

namespace palpate {
namespace {

using test::content_of;
using testing::HasSubstr;
using testing::Not;

class HandsCommand : public test::CommandRun {
protected:
    HandsCommand() {
        make("probe.csv", test::pressing_path());
        make("other.csv", test::pressing_path(-1.0));
        make("one.toml", test::ball_scene());
        make("two.toml", of_hands("left", "probe.csv") + of_hand("right", "other.csv"));
    }

    static std::string of_hand(const std::string& name, const std::string& path) {
        return "[[device]]\nname = \"" + name + "\"\ntype = \"path\"\nfile = \"" + path + "\"\n";
    }
    static std::string of_hands(const std::string& name, const std::string& path) {
        const std::string scene = test::ball_scene();
        return scene.substr(0, scene.find("[device]")) + of_hand(name, path);
    }
    bool is_there(const std::string& name) const { return std::filesystem::exists(*this / name); }

    /// Ends with this code and these words on stderr.
    void expect_refused(const std::vector<std::string>& arguments, int exit,
                        const std::string& why) {
        const test::CommandResult result = run(arguments);
        EXPECT_EQ(result.exit, exit) << result.err;
        EXPECT_THAT(result.err, HasSubstr(why));
        EXPECT_EQ(result.times("\n"), 1u) << result.err;
    }
};

TEST_F(HandsCommand, WhatEventsCannotSayIsWrittenNevertheless) {
    standard_out = "/dev/full";
    const test::CommandResult result = run({"trace", "two.toml", "--events", "--out", "two"});
    EXPECT_EQ(result.exit, 3) << result.err;
    for (const char* file : {"summary.json", "recording.h5", "left/frames.csv", "right/frames.csv"})
        EXPECT_TRUE(is_there(std::string("two/") + file)) << file << '\n' << result.err;
}

TEST_F(HandsCommand, ATraceHasAFolderForEachHandAndOneOfAll) {
    const test::CommandResult result = run({"trace", "two.toml", "--out", "two"});
    ASSERT_EQ(result.exit, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("two left adaptive"));
    EXPECT_THAT(result.out, HasSubstr("two right adaptive"));
    EXPECT_THAT(result.out, HasSubstr("written to two: summary.json recording.h5, and frames.csv "
                                      "timing.csv in left, right"));
    EXPECT_FALSE(is_there("two/frames.csv"));
    ASSERT_EQ(run({"trace", "one.toml", "--out", "one"}).exit, 0);
    ASSERT_EQ(run({"trace", "one.toml", "--device", "path:other.csv", "--out", "other"}).exit, 0);
    EXPECT_EQ(content_of(*this / "two/left/frames.csv"), content_of(*this / "one/frames.csv"));
    EXPECT_EQ(content_of(*this / "two/right/frames.csv"), content_of(*this / "other/frames.csv"));
    EXPECT_NE(content_of(*this / "two/left/frames.csv"),
              content_of(*this / "two/right/frames.csv"));
    EXPECT_THAT(content_of(*this / "two/left/timing.csv"), HasSubstr("frame,spent_us"));

    const auto all = nlohmann::json::parse(content_of(*this / "two/summary.json"));
    auto alone = nlohmann::json::parse(content_of(*this / "one/summary.json"));
    ASSERT_EQ(all["hands"].size(), 2u);
    EXPECT_EQ(all["hands"][0]["hand"], "left");
    EXPECT_EQ(all["machine"], alone["machine"]);
    for (const char* key : {"frames", "force_n", "surfaces", "felt", "queries_per_frame"})
        EXPECT_EQ(all["hands"][0][key], alone[key]) << key;
    EXPECT_FALSE(alone.contains("hand"));

    const test::CommandResult check = run({"replay", "two/recording.h5", "--check"});
    EXPECT_EQ(check.exit, 0) << check.err;
    EXPECT_EQ(check.out, "hand left: 0 of 200 frames differ\nhand right: 0 of 200 frames differ\n");
    ASSERT_EQ(run({"replay", "two/recording.h5", "--out", "again"}).exit, 0);
    EXPECT_EQ(content_of(*this / "again/right/frames.csv"),
              content_of(*this / "two/right/frames.csv"));
    EXPECT_THAT(run({"info", "two/recording.h5"}).out, HasSubstr("hand right: 200 frames"));
}

TEST_F(HandsCommand, InRealTimeAllRunAtOnceAndReplay) {
    const test::CommandResult result =
        run({"trace", "two.toml", "--pace", "realtime", "--events", "--out", "two"});
    ASSERT_EQ(result.exit, 0) << result.err;
    // A machine that is so busy that a loop was late may have felt nothing, and says so.
    EXPECT_THAT(result.out, HasSubstr("left: "));
    EXPECT_THAT(result.out, HasSubstr("right: "));
    EXPECT_FALSE(is_there("two/recording.h5.part"));
    const auto summary = nlohmann::json::parse(content_of(*this / "two/summary.json"));
    for (const auto& hand : summary["hands"]) {
        EXPECT_EQ(hand["pace"], "realtime");
        EXPECT_TRUE(hand.contains("realtime"));
    }
    EXPECT_EQ(run({"replay", "two/recording.h5", "--check"}).exit, 0);
}

TEST_F(HandsCommand, OneOfThemIsTracedAlone) {
    ASSERT_EQ(run({"trace", "two.toml", "--hand", "right", "--out", "right"}).exit, 0);
    ASSERT_EQ(run({"trace", "two.toml", "--out", "two"}).exit, 0);
    EXPECT_EQ(content_of(*this / "right/frames.csv"), content_of(*this / "two/right/frames.csv"));
    const test::CommandResult check = run({"replay", "right/recording.h5", "--check"});
    EXPECT_EQ(check.out, "0 of 200 frames differ\n") << check.err;
    ASSERT_EQ(run({"trace", "two.toml", "--device", "right=path:probe.csv", "--out", "same"}).exit,
              0);
    EXPECT_EQ(content_of(*this / "same/right/frames.csv"),
              content_of(*this / "two/left/frames.csv"));
    EXPECT_EQ(run({"replay", "same/recording.h5", "--check"}).exit, 0);
}

TEST_F(HandsCommand, WhatIsOfOneHandAsksWhich) {
    expect_refused({"study", "two.toml", "--quick"}, 2,
                   "two.toml: has the hands left, right, and this is of one; add --hand left");
    expect_refused({"trace", "two.toml", "--device", "left="}, 2, "has no device behind =");
    expect_refused({"trace", "two.toml", "--device", "=orbit"}, 2, "has no hand before =");
    expect_refused({"trace", "two.toml", "--device", "path:probe.csv"}, 2,
                   "say which one it is for, as --device left=path:probe.csv");
    expect_refused({"trace", "two.toml", "--hand", "third"}, 2,
                   "the scene's hands are left, right");
    expect_refused({"trace", "one.toml", "--hand", "left"}, 2, "one device without a name");
    expect_refused({"trace", "two.toml", "--pace", "realtime", "--cpu", "0"}, 2,
                   "--cpu 0: the scene has 2 loops; give a processor for each");
    expect_refused({"trace", "two.toml", "--pace", "realtime", "--preview"}, 2,
                   "--preview: is for one hand");
    EXPECT_FALSE(is_there("two-trace")) << "nothing was begun";
    EXPECT_EQ(run({"study", "two.toml", "--quick", "--frames", "20", "--hand", "left"}).exit, 0);
}

TEST_F(HandsCommand, NoHandsFolderIsReplacedThatIsSomebodyElses) {
    std::filesystem::create_directories(*this / "two/right");
    make("two/right/frames.csv", "mine\n");
    expect_refused({"trace", "two.toml", "--out", "two"}, 3, "was not written by Palpate");
    EXPECT_EQ(content_of(*this / "two/right/frames.csv"), "mine\n");
    EXPECT_FALSE(is_there("two/left")) << "it was made for nothing";
    make("third", "mine\n");
    expect_refused({"trace", "two.toml", "--out", "third"}, 3, "cannot be made a folder");
}

// The folders of hands that were not in the new run stayed, beside a summary without them.
TEST_F(HandsCommand, FilesOfHandsThatAreNotInTheNewRunGoAndNothingElse) {
    make("third.toml", of_hands("right", "other.csv") + of_hand("third", "probe.csv"));
    ASSERT_EQ(run({"trace", "one.toml", "--out", "r"}).exit, 0);
    const test::CommandResult two = run({"trace", "two.toml", "--out", "r"});
    ASSERT_EQ(two.exit, 0) << two.err;
    EXPECT_THAT(two.err, HasSubstr("note: removed what an earlier run had left: "
                                   "frames.csv, timing.csv\n"));
    EXPECT_FALSE(is_there("r/frames.csv"));
    make("r/left/notes.txt", "mine\n");
    std::filesystem::create_directories(*this / "r/elsewhere");
    ASSERT_EQ(run({"trace", "one.toml", "--out", "r/elsewhere"}).exit, 0); // another trace's folder
    const test::CommandResult third = run({"trace", "third.toml", "--out", "r"});
    ASSERT_EQ(third.exit, 0) << third.err;
    EXPECT_THAT(third.err, HasSubstr("left: left/frames.csv, left/timing.csv\n"));
    EXPECT_FALSE(is_there("r/left/frames.csv"));
    EXPECT_EQ(content_of(*this / "r/left/notes.txt"), "mine\n");
    EXPECT_TRUE(is_there("r/right/frames.csv") && is_there("r/third/timing.csv"));
    EXPECT_TRUE(is_there("r/elsewhere/frames.csv"));
    make("r/third/timing.csv", "mine\n");
    ASSERT_EQ(run({"trace", "one.toml", "--out", "r"}).exit, 0);
    EXPECT_FALSE(is_there("r/right")) << "it was empty";
    EXPECT_FALSE(is_there("r/third/frames.csv"));
    EXPECT_EQ(content_of(*this / "r/third/timing.csv"), "mine\n");
    EXPECT_TRUE(is_there("r/frames.csv"));
    // Nor does what a link leads to, nor a whole run that lies in a hand's folder.
    ASSERT_EQ(run({"trace", "two.toml", "--out", "s"}).exit, 0);
    std::filesystem::remove_all(*this / "s/left");
    std::filesystem::create_directory_symlink(*this / "r", *this / "s/left");
    ASSERT_EQ(run({"trace", "one.toml", "--out", "s/right"}).exit, 0);
    const test::CommandResult one = run({"trace", "one.toml", "--out", "s"});
    ASSERT_EQ(one.exit, 0) << one.err;
    EXPECT_THAT(one.err, Not(HasSubstr("removed")));
    EXPECT_TRUE(is_there("r/frames.csv") && is_there("s/left") && is_there("s/right/frames.csv"));
    // Nothing goes before the new files are there.
    ASSERT_EQ(run({"trace", "two.toml", "--out", "r"}).exit, 0);
    make("r/frames.csv", "mine\n");
    expect_refused({"trace", "one.toml", "--out", "r"}, 3, "was not written by Palpate");
    EXPECT_TRUE(is_there("r/left/frames.csv"));
}

TEST_F(HandsCommand, AReportAndAnExplanationShowAllOfThem) {
    ASSERT_EQ(run({"trace", "two.toml", "--out", "two"}).exit, 0);
    const test::CommandResult report = run({"report", "two", "-o", "r.html"});
    ASSERT_EQ(report.exit, 0) << report.err;
    for (const char* words : {"two, left, adaptive, volume", "two, right, adaptive, volume"}) {
        EXPECT_THAT(report.out, HasSubstr(words));
        EXPECT_THAT(content_of(*this / "r.html"), HasSubstr(words));
    }
    expect_refused({"report", "two", "-o", "r.html", "--playback", "two"}, 2,
                   "has several hands, and a page plays one");
    const test::CommandResult explained = run({"explain", "two.toml"});
    EXPECT_THAT(explained.out, HasSubstr("hand left: path, in the scene's own frame"));
    EXPECT_THAT(explained.out, HasSubstr("the tools do not feel each other"));
    EXPECT_THAT(run({"explain", "one.toml"}).out, Not(HasSubstr("hand ")));
    const auto json = nlohmann::json::parse(run({"explain", "two.toml", "--json"}).out);
    EXPECT_EQ(json["hands"][1]["name"], "right");
}

TEST_F(HandsCommand, APageSaysWhichHandItPlays) {
    ASSERT_EQ(run({"trace", "two.toml", "--out", "two"}).exit, 0);
    const test::CommandResult first = run({"view", "two", "-o", "p.html"});
    if (first.err.find("no page in it") != std::string::npos) GTEST_SKIP() << first.err;
    ASSERT_EQ(first.exit, 0) << first.err;
    EXPECT_THAT(first.err, HasSubstr("this is of hand left of left, right; --hand NAME"));
    const test::CommandResult right = run({"view", "two", "--hand", "right", "-o", "q.html"});
    ASSERT_EQ(right.exit, 0) << right.err;
    EXPECT_NE(content_of(*this / "p.html"), content_of(*this / "q.html"));
    expect_refused({"view", "two", "--hand", "third", "-o", "p.html"}, 2,
                   "has the hands left, right; name one of them");
}

// It had no such option.
TEST_F(HandsCommand, AnInteractiveReportSaysWhichCommandTakesAnotherHand) {
    ASSERT_EQ(run({"trace", "two.toml", "--out", "two"}).exit, 0);
    const test::CommandResult page = run({"report", "two", "--interactive", "-o", "p.html"});
    if (page.err.find("no page in it") != std::string::npos) GTEST_SKIP() << page.err;
    EXPECT_THAT(page.err,
                HasSubstr("--hand NAME of palpate view and palpate export takes another"));
}

} // namespace
} // namespace palpate
