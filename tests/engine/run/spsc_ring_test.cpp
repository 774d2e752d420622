// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/run/internal/spsc_ring.h>

#include <array>
#include <cstdint>
#include <thread>

#include <gtest/gtest.h>

namespace palpate {
namespace {

using internal::SpscRing;

TEST(SpscRing, GivesBackInOrderWhatItWasGiven) {
    SpscRing<int> ring(4);
    int value = 0;
    EXPECT_FALSE(ring.pop(value));
    for (int round = 0; round < 10; ++round) { // over the end of the memory again and again
        for (int i = 0; i < 3; ++i)
            EXPECT_TRUE(ring.push(10 * round + i));
        for (int i = 0; i < 3; ++i) {
            ASSERT_TRUE(ring.pop(value));
            EXPECT_EQ(value, 10 * round + i);
        }
    }
    EXPECT_FALSE(ring.pop(value));
}

TEST(SpscRing, FullItTakesAllOrNothing) {
    SpscRing<int> ring(4);
    const std::array<int, 3> three{1, 2, 3};
    EXPECT_TRUE(ring.push(three));
    EXPECT_EQ(ring.room(), 1u);
    EXPECT_FALSE(ring.push(three));
    EXPECT_EQ(ring.room(), 1u) << "nothing was taken";
    EXPECT_TRUE(ring.push(4));
    EXPECT_FALSE(ring.push(5));
    int value = 0;
    ASSERT_TRUE(ring.pop(value));
    EXPECT_EQ(value, 1);
    EXPECT_TRUE(ring.push(5));
}

TEST(SpscRing, AnOddCapacityIsRoundedUp) { EXPECT_EQ(SpscRing<int>(5).room(), 8u); }

TEST(SpscRing, TwoThreadsLoseNothingAndMixNothing) {
    struct Pair {
        std::uint64_t number = 0, square = 0;
    };
    SpscRing<Pair> ring(64);
    constexpr std::uint64_t kCount = 200000;
    std::thread pusher([&] {
        for (std::uint64_t i = 0; i < kCount;)
            i += ring.push(Pair{i, i * i}) ? 1 : 0;
    });
    std::uint64_t expected = 0;
    Pair pair;
    while (expected < kCount) {
        if (!ring.pop(pair)) continue;
        if (pair.number != expected || pair.square != expected * expected) break;
        ++expected;
    }
    // Whatever has happened, the other thread must come to its end.
    for (; expected < kCount && pair.number + 1 < kCount; ring.pop(pair)) {
    }
    pusher.join();
    EXPECT_EQ(expected, kCount);
}

} // namespace
} // namespace palpate
