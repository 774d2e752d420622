// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/igtl_reader.h>

#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace palpate {
namespace {

using Found = IgtlReader::Found;

IgtlBytes message(const std::string& type, std::size_t bytes,
                  IgtlVersion version = IgtlVersion::one) {
    IgtlMessage sent;
    sent.version = version;
    sent.type = type;
    sent.content.resize(bytes, 5);
    return igtl_bytes(sent);
}

IgtlBytes joined(const std::vector<IgtlBytes>& parts) {
    IgtlBytes all;
    for (const IgtlBytes& part : parts)
        all.insert(all.end(), part.begin(), part.end());
    return all;
}

/// What is found in a stream that comes in pieces of so many bytes: the types of messages, and "?",
/// ">" and "!" for what is faulty, passed over and broken.
std::string found_in(const IgtlBytes& stream, std::size_t piece) {
    IgtlReader reader;
    std::string found;
    for (std::size_t at = 0; at < stream.size(); at += piece) {
        std::span<const std::uint8_t> bytes =
            std::span(stream).subspan(at, std::min(piece, stream.size() - at));
        for (;;) {
            const Found what = reader.take(bytes);
            if (what == Found::nothing) break;
            if (what == Found::broken) return found + "!";
            found += what == Found::message  ? reader.message().type
                     : what == Found::faulty ? "?"
                                             : ">";
        }
        EXPECT_TRUE(bytes.empty());
    }
    return found;
}

TEST(IgtlReader, FindsTheSameHoweverTheStreamIsCut) {
    IgtlBytes damaged = message("C", 48);
    damaged.back() ^= 1;
    const IgtlBytes stream =
        joined({message("A", 0), message("B", 48, IgtlVersion::two), damaged,
                message("IMAGE", IgtlReader::kMostBody + 1), message("D", 3), message("E", 0)});
    for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, kIgtlHeader, kIgtlHeader + 1,
                                    std::size_t{1000}, stream.size()})
        EXPECT_EQ(found_in(stream, piece), "AB?>DE") << piece;
}

TEST(IgtlReader, ReadsTheLargestAndPassesOverWhatIsLarger) {
    EXPECT_EQ(found_in(joined({message("A", IgtlReader::kMostBody), message("B", 1)}), 4096), "AB");
    EXPECT_EQ(found_in(joined({message("A", IgtlReader::kMostBody + 1), message("B", 1)}), 4096),
              ">B");
}

TEST(IgtlReader, WhatCannotBeIsNotWaitedFor) {
    IgtlBytes endless = message("IMAGE", 0);
    endless[42] = 0x7F; // of the body's size: 9e18 bytes
    EXPECT_EQ(found_in(joined({message("A", 0), endless, message("B", 0)}), 16), "A!");
    EXPECT_EQ(found_in(IgtlBytes(200, 0), 16), "!");
    const std::string request =
        "GET / HTTP/1.1\r\nHost: 127.0.0.1:18944\r\nUser-Agent: curl\r\n\r\n";
    EXPECT_EQ(found_in({request.begin(), request.end()}, 16), "!");
}

TEST(IgtlReader, StaysBroken) {
    IgtlReader reader;
    const IgtlBytes garbage(kIgtlHeader, 0xFF);
    const IgtlBytes sound = message("A", 0);
    std::span<const std::uint8_t> bytes(garbage);
    EXPECT_EQ(reader.take(bytes), Found::broken);
    bytes = sound;
    EXPECT_EQ(reader.take(bytes), Found::broken);
}

// Random bytes, and sound streams with one byte changed: the reader ends, whatever they are.
TEST(IgtlReader, OutlivesWhateverComes) {
    std::mt19937 random(42); // the seed
    const IgtlBytes sound =
        joined({message("A", 20, IgtlVersion::two), message("B", 48), message("C", 0)});
    EXPECT_EQ(found_in(sound, 10), "ABC");
    for (std::size_t at = 0; at < sound.size(); ++at) {
        IgtlBytes changed = sound;
        changed[at] ^= static_cast<std::uint8_t>(1 + random() % 255);
        // A header has no checksum; whatever it says then, the reader comes to an end.
        const std::string found = found_in(changed, 10);
        const bool is_of_a = at >= kIgtlHeader && at < 92;
        const bool is_of_b = at >= 92 + kIgtlHeader && at < 198;
        if (is_of_a || is_of_b) {
            EXPECT_EQ(found, is_of_a ? "?BC" : "A?C") << at;
        }
    }
    for (int i = 0; i < 2000; ++i) {
        IgtlBytes noise(200);
        for (std::uint8_t& byte : noise)
            byte = static_cast<std::uint8_t>(random());
        if (i % 2 == 0) noise[0] = 0, noise[1] = 2; // a version that there is
        found_in(noise, 1 + random() % 50);
    }
}

} // namespace
} // namespace palpate
