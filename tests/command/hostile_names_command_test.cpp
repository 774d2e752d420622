// SPDX-License-Identifier: Apache-2.0
// Names that a format cannot hold as they are: a run ends well, and its folder is whole.
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/command/command_run.h"
#include "tests/command/scenes.h"

namespace palpate {
namespace {

using testing::HasSubstr;

const std::string kLatin = "p\xe9"; // "p" and an e with an accent in ISO 8859-1: not UTF-8

class CommandNames : public test::CommandRun {
protected:
    void expect_whole(const std::string& out) {
        for (const char* name : {"frames.csv", "timing.csv", "summary.json", "recording.h5"})
            EXPECT_TRUE(std::filesystem::exists(*this / (out + "/" + name))) << name;
        const std::string summary = test::content_of(*this / (out + "/summary.json"));
        EXPECT_TRUE(nlohmann::json::accept(summary));
    }
};

TEST_F(CommandNames, ASceneThatIsNotUtf8LeavesAWholeFolder) {
    make("probe.csv", test::pressing_path());
    make(kLatin + ".toml", test::ball_scene());
    const test::CommandResult traced = run({"trace", kLatin + ".toml", "--out", "t"});
    EXPECT_EQ(traced.exit, 0) << traced.err;
    expect_whole("t");
    EXPECT_EQ(run({"replay", "t", "--check"}).exit, 0);
    const test::CommandResult explained = run({"explain", kLatin + ".toml", "--json"});
    EXPECT_EQ(explained.exit, 0) << explained.err;
    EXPECT_TRUE(nlohmann::json::accept(explained.out));
}

TEST_F(CommandNames, AMeshInAFolderThatIsNotUtf8LeavesAWholeFolder) {
    std::filesystem::create_directory(*this / kLatin);
    make(kLatin + "/probe.csv", test::pressing_path());
    make(kLatin + "/t.obj", "v 0.019 -1 -1\nv 0.019 1 -1\nv 0.019 0 1\nf 1 2 3\n");
    make(kLatin + "/s.toml", "[surface.s]\nmesh = \"t.obj\"\nmesh_unit = \"m\"\n"
                             "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n"
                             "[device]\ntype = \"path\"\nfile = \"probe.csv\"\n");
    const test::CommandResult traced = run({"trace", kLatin + "/s.toml", "--out", "t"});
    EXPECT_EQ(traced.exit, 0) << traced.err;
    expect_whole("t");
}

// A recording keeps the device's words as JSON, and could not give them back.
TEST_F(CommandNames, ADevicesFileThatIsNotUtf8IsRefusedBeforeTheRun) {
    make("probe.csv", test::pressing_path());
    make(kLatin + ".csv", test::pressing_path());
    make("ball.toml", test::ball_scene());
    const test::CommandResult traced =
        run({"trace", "ball.toml", "--out", "t", "--device", "path:" + kLatin + ".csv"});
    EXPECT_THAT(traced.exit, testing::AnyOf(2, 3));
    EXPECT_THAT(traced.err, HasSubstr("is not UTF-8"));
    EXPECT_FALSE(std::filesystem::exists(*this / "t/frames.csv"));
}

TEST_F(CommandNames, AStarterSceneOfDataThatIsNotUtf8IsRefused) {
    make(kLatin + ".obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const test::CommandResult made = run({"new", kLatin + ".obj", "-o", "new.toml"});
    EXPECT_EQ(made.exit, 3);
    EXPECT_THAT(made.err, HasSubstr(".obj: its name is not UTF-8"));
    EXPECT_FALSE(std::filesystem::exists(*this / "new.toml"));
}

TEST_F(CommandNames, AStudySaysItsCommandAsAShellTakesIt) {
    make("probe.csv", test::pressing_path());
    make("a ball's.toml", test::ball_scene());
    const test::CommandResult studied =
        run({"study", "a ball's.toml", "--out", "s", "--frames", "20", "--quick"});
    ASSERT_EQ(studied.exit, 0) << studied.err;
    const auto study = nlohmann::json::parse(test::content_of(*this / "s/study.json"));
    EXPECT_EQ(study["command"], "palpate study 'a ball'\\''s.toml' --frames 20 --quick");
}

} // namespace
} // namespace palpate
