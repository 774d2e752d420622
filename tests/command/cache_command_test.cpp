// SPDX-License-Identifier: Apache-2.0
// A cache that is damaged or cannot be written changes no frame.
#include <cstddef>
#include <string>

#include <gmock/gmock.h>

#include "tests/command/command_run.h"
#include "tests/command/scenes.h"

namespace palpate {
namespace {

using test::content_of;
using testing::HasSubstr;

class CommandCache : public test::CommandRun {
protected:
    CommandCache() { make("scene.toml", test::kPhantomScene); }

    std::filesystem::path kept(const std::string& ending) const {
        for (const auto& entry : std::filesystem::directory_iterator(cache))
            if (entry.path().extension() == ending) return entry.path();
        return {};
    }

    /// Another byte somewhere in a file's numbers.
    static void damage(const std::filesystem::path& file) {
        std::string bytes = content_of(file);
        ASSERT_GT(bytes.size(), 2000u);
        char& byte = bytes[bytes.size() / 2];
        byte = static_cast<char>(byte ^ 0x10);
        test::make_file(file, bytes);
    }
};

// 200 coordinates of a cached mesh tripled: other frames, exit 0, an error column of 1e-12.
TEST_F(CommandCache, WhatIsDamagedIsMadeAnewWithOneWarningAndTheSameFrames) {
#ifndef PALPATE_WITH_CGAL
    GTEST_SKIP() << "this build has no CGAL to extract a mesh with";
#endif
    ASSERT_EQ(run({"phantom", "phantom.nrrd"}).exit, 0);
    const test::CommandResult first = run({"trace", "scene.toml", "--out", "t"});
    ASSERT_EQ(first.exit, 0) << first.err;
    const std::string frames = content_of(*this / "t/frames.csv");
    for (const char* ending : {".ply", ".vdb"}) {
        const std::filesystem::path file = kept(ending);
        ASSERT_FALSE(file.empty()) << ending;
        for (const char* how : {"another byte", "cut short", "empty"}) {
            if (how == std::string("another byte"))
                damage(file);
            else
                std::filesystem::resize_file(file, how == std::string("empty") ? 0 : 1000);
            const test::CommandResult again = run({"trace", "scene.toml", "--out", "t"});
            EXPECT_EQ(again.exit, 0) << ending << " " << how << " " << again.err;
            EXPECT_EQ(again.times("this file of the cache is damaged"), 1u) << again.err;
            EXPECT_THAT(again.err, HasSubstr(file.filename().string()));
            EXPECT_EQ(content_of(*this / "t/frames.csv"), frames) << ending << " " << how;
        }
    }
    const test::CommandResult whole = run({"trace", "scene.toml", "--out", "t"});
    EXPECT_EQ(whole.times("damaged"), 0u) << whole.err;
}

TEST_F(CommandCache, OneThatCannotBeWrittenIsDoneWithoutAndSaidOnce) {
#ifndef PALPATE_WITH_CGAL
    GTEST_SKIP() << "this build has no CGAL to extract a mesh with";
#endif
    ASSERT_EQ(run({"phantom", "phantom.nrrd"}).exit, 0);
    ASSERT_EQ(run({"trace", "scene.toml", "--out", "t"}).exit, 0);
    make("file", "no folder");
    cache = *this / "file/cache";
    const test::CommandResult without = run({"trace", "scene.toml", "--out", "u"});
    EXPECT_EQ(without.exit, 0) << without.err;
    EXPECT_EQ(without.times("PALPATE_CACHE"), 1u) << without.err;
    EXPECT_EQ(content_of(*this / "u/frames.csv"), content_of(*this / "t/frames.csv"))
        << "the same bits with a cache and without";
}

} // namespace
} // namespace palpate
