// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/contact/surface_state.h>

#include <gtest/gtest.h>

namespace palpate {
namespace {

using enum SurfaceState;

constexpr FrameEnd kAway{.felt = false, .yielded = false, .in_front = true, .left = true};
constexpr FrameEnd kTouching{.felt = true, .yielded = false, .in_front = true, .left = false};
constexpr FrameEnd kPushedIn{.felt = true, .yielded = true, .in_front = false, .left = false};
constexpr FrameEnd kHeldBehind{.felt = true, .yielded = false, .in_front = false, .left = false};
constexpr FrameEnd kFollowsBack{.felt = false, .yielded = false, .in_front = false, .left = false};
constexpr FrameEnd kAtTheLevel{.felt = false, .yielded = false, .in_front = true, .left = false};

TEST(SurfaceState, PlayGoesInAndComesBackOut) {
    SurfaceState state = free;
    for (const auto& [end, expected] :
         {std::pair{kAway, free}, std::pair{kTouching, in_contact}, std::pair{kPushedIn, yielded},
          std::pair{kHeldBehind, yielded}, std::pair{kFollowsBack, yielded},
          std::pair{kPushedIn, yielded}, std::pair{kAtTheLevel, free},
          std::pair{kTouching, in_contact}, std::pair{kAtTheLevel, free}}) {
        state = next_state(state, end);
        EXPECT_EQ(state, expected);
    }
}

TEST(SurfaceState, InsideEndsOnlyADistanceAway) {
    for (const FrameEnd& end : {kTouching, kPushedIn, kHeldBehind, kFollowsBack, kAtTheLevel})
        EXPECT_EQ(next_state(inside, end), inside);
    EXPECT_EQ(next_state(inside, kAway), free);
}

TEST(SurfaceState, NothingButYieldingLeadsBehindASurface) {
    for (const SurfaceState now : {free, in_contact})
        for (const FrameEnd& end : {kAway, kTouching, kHeldBehind, kFollowsBack, kAtTheLevel}) {
            EXPECT_NE(next_state(now, end), yielded);
            EXPECT_NE(next_state(now, end), inside);
        }
}

} // namespace
} // namespace palpate
