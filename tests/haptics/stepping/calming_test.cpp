// SPDX-License-Identifier: Apache-2.0
// What is taken for a proxy that is stuck under a held probe, and what is let be.
#include <palpate/haptics/stepping/calming.h>

#include <cmath>

#include <gtest/gtest.h>

#include <palpate/haptics/effects/effect.h>

namespace palpate {
namespace {

constexpr double kTolerance_m = 1e-7;
constexpr double kStep_m = 32e-9; // of the proxy, in each frame the same way

/// The spring after so many frames under a held probe, each of which walks `walk` times as far as
/// it gets, N/m.
double spring_after(int frames, double walk) {
    Calming calming(kTolerance_m);
    FrameContext frame;
    frame.probe = {1e-3, 0.0, 0.0};
    for (int i = 0; i < frames; ++i) {
        calming.begin(frame);
        frame.start.x += kStep_m;
        calming.end(frame.start, walk * kStep_m, 1.0);
    }
    calming.begin(frame);
    return calming.spring_n_per_m();
}

// Seen with method paper and 128 sub-steps a frame: 80 um to and fro within each frame, 32 nm on at
// its end, for ever. No frame turned back against the one before.
TEST(Calming, AFrameThatWalksToAndFroWithinItselfIsCalmed) {
    EXPECT_GE(spring_after(40, 2500.0), FrameContext{}.stiffness);
}

TEST(Calming, AFewSuchFramesMayPrecedeRest) { EXPECT_EQ(spring_after(30, 2500.0), 0.0); }

TEST(Calming, WhatGetsOnInZigzagIsLetBe) { EXPECT_EQ(spring_after(1000, 50.0), 0.0); }

/// A proxy rests under a held probe, is asked for something else, goes to the place that `place_of`
/// has of its turn (m, along x), and rests again: how often of 20 times it goes.
template <typename Function>
int moves_of_twenty(Function place_of) {
    Calming calming(kTolerance_m);
    FrameContext frame;
    Vec3 asked{0.0};
    int moves = 0;
    for (int turn = 1; turn <= 20; ++turn) {
        for (int i = 0; i < 40; ++i) {
            calming.begin(frame);
            calming.rests(asked);
            calming.end(frame.start, 0.0, 1.0);
        }
        asked.x += 1e-3;
        calming.begin(frame);
        if (!calming.rests(asked)) {
            frame.start.x = place_of(turn);
            ++moves;
        }
        calming.end(frame.start, 0.0, 1.0);
    }
    return moves;
}

// Seen with method single in a field of forces without order, every 50 frames by up to 190 mm; and
// on soft tissue with two textures, by 0.25 um.
TEST(Calming, WhatRestsAndComesBackAgainAndAgainStays) {
    for (const double way_m : {0.19, 0.25e-6}) {
        const auto to_and_fro = [&](int turn) { return turn % 2 == 0 ? 0.0 : way_m; };
        EXPECT_LE(moves_of_twenty(to_and_fro), 10) << way_m;
        const auto round = [&](int turn) { return way_m * std::sin(turn); };
        EXPECT_LE(moves_of_twenty(round), 15) << way_m;
    }
}

TEST(Calming, WhatCreepsOnBetweenRestsIsLetBe) {
    for (const double step_m : {1e-3, 1e-6})
        EXPECT_EQ(moves_of_twenty([&](int turn) { return step_m * turn; }), 20) << step_m;
}

// And there and back from frame to frame, at once.
TEST(Calming, AProxyThatTurnsBackUnderAHeldProbeIsCalmed) {
    Calming calming(kTolerance_m);
    FrameContext frame;
    for (int i = 0; i < 4; ++i) {
        calming.begin(frame);
        frame.start.x = i % 2 == 0 ? 1e-4 : 0.0;
        calming.end(frame.start, 1e-4, 1.0);
    }
    calming.begin(frame);
    EXPECT_GE(calming.spring_n_per_m(), frame.stiffness);
}

} // namespace
} // namespace palpate
