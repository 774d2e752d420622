// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/internal/frame_history.h>

#include <vector>

#include <gtest/gtest.h>

namespace palpate::internal {
namespace {

TEST(FrameFeed, KeepsTheNewestWhereNobodyTakesThem) {
    FrameFeed feed(4);
    FrameReport frame;
    for (frame.frame = 0; frame.frame < 6; ++frame.frame)
        feed.add(frame);
    std::vector<FrameReport> taken;
    EXPECT_EQ(feed.take(taken), 2u);
    ASSERT_EQ(taken.size(), 4u);
    EXPECT_EQ(taken.front().frame, 2u);
    EXPECT_EQ(taken.back().frame, 5u);
    feed.add(frame);
    EXPECT_EQ(feed.take(taken), 6u);
    EXPECT_EQ(taken.size(), 1u);
}

} // namespace
} // namespace palpate::internal
