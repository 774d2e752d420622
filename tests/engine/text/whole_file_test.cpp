// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/text/whole_file.h>

#include <filesystem>
#include <iterator>
#include <stdexcept>
#include <string>
#include <thread>

#include <unistd.h>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

// Whoever comes last: the file is always one of both, and whole.
TEST(WholeFile, TwoThreadsThatWriteTheSameFileLeaveAWholeOne) {
    const test::TemporaryFolder folder;
    const std::string shorter(10'000, 'a'), longer(200'000, 'b');
    const auto write = [&](const std::string& bytes) {
        for (int i = 0; i < 100; ++i) {
            EXPECT_NO_THROW(write_whole_file(folder / "f", bytes));
            const std::string there = test::content_of(folder / "f");
            EXPECT_TRUE(there == shorter || there == longer) << there.size();
        }
    };
    std::thread other([&] { write(longer); });
    write(shorter);
    other.join();
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator((folder / "f").parent_path()), {}),
              1)
        << "no temporary file is left";
}

// The name of the temporary file can be guessed: what is there already is not written to.
TEST(WholeFile, WhatStandsWhereTheTemporaryFileWouldBeIsLeftAlone) {
    const test::TemporaryFolder folder;
    test::make_file(folder / "victim", "mine");
    for (int i = 0; i < 20; ++i) {
        const std::string name = "f.part" + std::to_string(::getpid()) + "-";
        std::error_code ignored;
        std::filesystem::create_symlink(folder / "victim", folder / (name + std::to_string(i)),
                                        ignored);
    }
    write_whole_file(folder / "f", "bytes");
    EXPECT_EQ(test::content_of(folder / "f"), "bytes");
    EXPECT_EQ(test::content_of(folder / "victim"), "mine");
}

TEST(WholeFile, WhereItCannotBeWrittenNothingIsLeft) {
    const test::TemporaryFolder folder;
    std::filesystem::create_directory(folder / "d");
    test::make_file(folder / "d" / "in_it", "");
    EXPECT_THROW(write_whole_file(folder / "d", "bytes"), std::runtime_error);
    EXPECT_THROW(write_whole_file(folder / "none" / "f", "bytes"), std::runtime_error);
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / "d" / ".."), {}), 1);
}

} // namespace
} // namespace palpate
