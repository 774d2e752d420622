// SPDX-License-Identifier: Apache-2.0
// palpate export: what it writes is read back by a program that has nothing of ours.
#include <cstdlib>
#include <string>

#include <gmock/gmock.h>

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

TEST_F(Exported, WhatCannotBeWrittenIsRefusedInOneLine) {
    const auto refused = [&](std::vector<std::string> arguments, int code, const std::string& why) {
        arguments.insert(arguments.begin(), "export");
        const test::CommandResult result = run(arguments);
        EXPECT_EQ(result.exit, code) << result.err;
        EXPECT_THAT(result.err, HasSubstr(why));
        EXPECT_EQ(result.times("\n"), 1U) << result.err;
    };
    refused({"t", "-o", "run.csv"}, 2, "name it .mrk.json or .vtp");
    refused({"t", "-o", "run.mrk.json", "--surface", "s"}, 2, "name the output .vtp");
    refused({"t", "-o", "run.vtp", "--surface", "bone"}, 2, "surfaces are: s; name one of them");
    refused({"t", "-o", "run.mrk.json", "--step-ms", "0"}, 2, "--step-ms");
    refused({"missing.h5", "-o", "run.vtp"}, 3, "missing.h5");
    make("mine.vtp", "<?xml version=\"1.0\"?>\n<VTKFile/>\n");
    refused({"t", "-o", "mine.vtp"}, 3, "was not written by Palpate");
    make("mine.mrk.json", "{\"markups\": []}");
    refused({"t", "-o", "mine.mrk.json"}, 3, "was not written by Palpate");
    EXPECT_EQ(content_of(*this / "mine.mrk.json"), "{\"markups\": []}");
}

} // namespace
} // namespace palpate
