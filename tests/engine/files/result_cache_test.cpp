// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/files/result_cache.h>

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

class KeptFiles : public testing::Test {
protected:
    static auto writing(const std::string& text) {
        return [text](const std::filesystem::path& file) { test::make_file(file, text); };
    }

    test::TemporaryFolder folder_;
    std::vector<std::string> said_;
    ResultCache cache_{folder_ / "kept",
                       [this](const std::string& words) { said_.push_back(words); }};
};

TEST_F(KeptFiles, WhatIsKeptIsFoundAndBeginsAsItWasWritten) {
    EXPECT_FALSE(cache_.find("a"));
    cache_.keep("a", writing("some bytes"));
    const auto file = cache_.find("a");
    ASSERT_TRUE(file);
    EXPECT_TRUE(test::content_of(*file).starts_with("some bytes"));
    EXPECT_EQ(test::files_in(folder_ / "kept"), 1u) << "nothing half-written";
    EXPECT_TRUE(said_.empty());
}

TEST_F(KeptFiles, EveryChangedByteIsSeenAndSaidOnce) {
    cache_.keep("a", writing("some bytes"));
    const std::string whole = test::content_of(*cache_.find("a"));
    for (std::size_t i = 0; i < whole.size(); ++i) {
        std::string other = whole;
        other[i] = static_cast<char>(other[i] ^ 1);
        test::make_file(folder_ / "kept" / "a", other);
        EXPECT_FALSE(cache_.find("a")) << i;
        test::make_file(folder_ / "kept" / "a", whole.substr(0, i));
        EXPECT_FALSE(cache_.find("a")) << i;
    }
    EXPECT_EQ(said_.size(), 1u);
    EXPECT_NE(said_[0].find("is damaged"), std::string::npos);
    cache_.keep("a", writing("some bytes"));
    EXPECT_TRUE(cache_.find("a"));
}

TEST_F(KeptFiles, AnotherEntrysFileIsNotTakenForThisOne) {
    for (const char* name : {"a", "b"})
        cache_.keep(name, writing(name));
    test::make_file(folder_ / "kept" / "a", test::content_of(folder_ / "kept" / "b"));
    EXPECT_FALSE(cache_.find("a"));
    EXPECT_TRUE(cache_.find("b"));
}

TEST_F(KeptFiles, AFolderThatCannotBeWrittenIsSaidOnceAndStopsNothing) {
    test::make_file(folder_ / "file", "");
    const ResultCache none(folder_ / "file" / "kept",
                           [this](const std::string& words) { said_.push_back(words); });
    for (const char* name : {"a", "b"}) {
        none.keep(name, writing("bytes"));
        EXPECT_FALSE(none.find(name));
    }
    ASSERT_EQ(said_.size(), 1u);
    // C and Python name the folder, and do not read the variable.
    EXPECT_NE(said_[0].find("name another one (of the command: PALPATE_CACHE)"), std::string::npos);
    const ResultCache nothing;
    nothing.keep("a", [](const std::filesystem::path&) { FAIL(); });
    EXPECT_FALSE(nothing.find("a"));
}

} // namespace
} // namespace palpate
