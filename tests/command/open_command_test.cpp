// SPDX-License-Identifier: Apache-2.0
// `palpate view --open`: the desktop's browser gets the link, and nothing else of the command.
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <sstream>
#include <string>
#include <thread>

#include <unistd.h>

#include <gmock/gmock.h>

#include "tests/command/command_run.h"
#include "tests/command/scenes.h"

namespace palpate {
namespace {

using test::content_of;
using testing::HasSubstr;

/// A scene, and a PATH that begins with an xdg-open of the test.
class CommandOpens : public test::CommandRun {
protected:
    CommandOpens() {
        make("ball.toml", test::ball_scene());
        make("probe.csv", test::pressing_path());
        std::filesystem::create_directory(*this / "bin");
        ::setenv("PATH", ((*this / "bin").string() + ":" + path_).c_str(), 1);
    }
    ~CommandOpens() override { ::setenv("PATH", path_.c_str(), 1); }

    void make_browser(const std::string& script) const {
        make("bin/xdg-open", "#!/bin/sh\n" + script);
        std::filesystem::permissions(*this / "bin/xdg-open", std::filesystem::perms::owner_all);
    }
    /// A view that is ended once a file has these words, at the latest after a minute.
    test::CommandResult view_until(const std::string& file, const std::string& words) {
        const pid_t child = start({"view", "ball.toml", "--open", "--seconds", "60", "-o", "live"});
        for (int i = 0; i < 6000 && content_of(*this / file).find(words) == std::string::npos; ++i)
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        ::kill(child, SIGINT);
        return end(child);
    }

private:
    std::string path_ = std::getenv("PATH");
};

TEST_F(CommandOpens, ABrowserWithTheLinkInAGroupOfItsOwnAndWithoutSockets) {
    make_browser("read -r stat < /proc/$$/stat\n" // 31 (xdg-open) S PARENT GROUP ..
                 "set -- \"$1\" $stat\n"
                 "echo \"$1 $5 $6 $(ls -l /proc/$$/fd | grep -c socket)\" > opened.new\n"
                 "mv opened.new opened\n");
    const test::CommandResult result = view_until("opened", "\n");
    EXPECT_EQ(result.times("--open"), 0u) << result.err;
    std::istringstream opened(content_of(*this / "opened"));
    std::string link;
    long parent = 0, group = 0, sockets = -1;
    ASSERT_TRUE(opened >> link >> parent >> group >> sockets) << opened.str();
    EXPECT_THAT(result.out + result.err, HasSubstr(link));
    EXPECT_NE(group, ::getpgrp()) << "a Ctrl-C of the terminal reaches it";
    EXPECT_EQ(sockets, 0);
}

TEST_F(CommandOpens, NoBrowserAndOneThatFailsAreSaidWithTheLink) {
    make_browser("exit 3\n");
    const std::string said = "--open: no browser could be started with xdg-open";
    test::CommandResult result = view_until("err.txt", said);
    EXPECT_EQ(result.times(said), 1u) << result.err;
    EXPECT_THAT(result.err, HasSubstr("open this yourself: http://127.0.0.1:"));

    ::setenv("PATH", (*this / "nothing").c_str(), 1);
    result = view_until("err.txt", said);
    EXPECT_EQ(result.times(said), 1u) << result.err;
    EXPECT_THAT(result.err, HasSubstr("open this yourself: http://127.0.0.1:"));
}

} // namespace
} // namespace palpate
