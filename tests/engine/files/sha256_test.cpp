// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/files/sha256.h>

#include <cstddef>
#include <filesystem>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

// The vectors of FIPS 180-4's examples (NIST, "SHA256.pdf") and of a million times "a".
TEST(Sha256, GivesThePublishedValues) {
    EXPECT_EQ(sha256_of_text(""),
              "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    EXPECT_EQ(sha256_of_text("abc"),
              "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    EXPECT_EQ(sha256_of_text("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
              "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
    EXPECT_EQ(sha256_of_text(std::string(1000000, 'a')),
              "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, OfAFileIsThatOfItsBytes) {
    const test::TemporaryFolder folder;
    const std::filesystem::path file = folder.path() / "bytes";
    // Sizes around the piece that is read at a time.
    for (const std::size_t size : {std::size_t{0}, std::size_t{1}, (std::size_t{1} << 20) - 1,
                                   std::size_t{1} << 20, (std::size_t{1} << 20) + 1}) {
        std::string bytes(size, '\0');
        for (std::size_t i = 0; i < size; ++i)
            bytes[i] = static_cast<char>(i * 7);
        test::make_file(file, bytes);
        EXPECT_EQ(sha256_of_file(file), sha256_of_text(bytes)) << size;
    }
}

TEST(Sha256, OfWhatIsNoFileIsAnErrorThatNamesIt) {
    const test::TemporaryFolder folder;
    for (const std::filesystem::path& named : {folder.path() / "none", folder.path()}) {
        try {
            sha256_of_file(named);
            ADD_FAILURE() << named;
        } catch (const std::runtime_error& error) {
            EXPECT_THAT(error.what(), testing::StartsWith(named.string() + ": "));
            EXPECT_THAT(error.what(), testing::HasSubstr("; ")) << "no remedy";
        }
    }
}

} // namespace
} // namespace palpate
