// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/label_places.h>

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

namespace palpate::internal {
namespace {

constexpr Patch kPlot{0.0, 0.0, 300.0, 250.0};

Patch around(double x, double y) { return {x - 5.0, y - 5.0, x + 5.0, y + 5.0}; }

TEST(LabelPlaces, ALabelIsToTheRightOfItsPointWhereThereIsRoom) {
    LabelPlaces places(kPlot);
    places.keep_off(around(100.0, 100.0));
    const auto place = places.place({{100.0, 100.0, 50.0, 15.0}}).at(0);
    ASSERT_TRUE(place);
    EXPECT_FALSE(place->leader);
    EXPECT_GT(place->patch.left, 105.0);
    EXPECT_LT(place->patch.left, 112.0);
    EXPECT_DOUBLE_EQ(0.5 * (place->patch.top + place->patch.bottom), 100.0);
}

TEST(LabelPlaces, NothingIsOverAnythingElse) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    int placed = 0;
    for (int round = 0; round < 20; ++round) {
        LabelPlaces places(kPlot);
        std::vector<LabelWish> wishes;
        for (int i = 0; i < 12; ++i) {
            wishes.push_back(
                {300.0 * share(random), 250.0 * share(random), 20.0 + 60.0 * share(random), 15.0});
            places.keep_off(around(wishes.back().x, wishes.back().y));
        }
        const auto found = places.place(wishes);
        for (std::size_t i = 0; i < found.size(); ++i) {
            if (!found[i]) continue;
            ++placed;
            const Patch& patch = found[i]->patch;
            EXPECT_TRUE(patch.left >= kPlot.left && patch.right <= kPlot.right &&
                        patch.top >= kPlot.top && patch.bottom <= kPlot.bottom);
            for (const LabelWish& wish : wishes)
                EXPECT_FALSE(patch.overlaps(around(wish.x, wish.y)));
            for (std::size_t j = 0; j < found.size(); ++j) {
                if (j == i || !found[j]) continue;
                EXPECT_FALSE(patch.overlaps(found[j]->patch));
                EXPECT_FALSE(found[j]->leader && crosses(*found[j]->leader, patch));
            }
        }
    }
    // Twelve labels cover an eighth of such a plot: hardly one finds no room.
    EXPECT_GE(placed, 20 * 12 - 5);
}

TEST(LabelPlaces, ALineIsAvoidedWhereThereIsRoomBesideIt) {
    LabelPlaces places(kPlot);
    const Stroke line{{{0.0, 100.0}, {300.0, 100.0}}};
    places.keep_off(around(100.0, 100.0));
    places.avoid(line);
    const auto place = places.place({{100.0, 100.0, 50.0, 15.0}}).at(0);
    ASSERT_TRUE(place);
    EXPECT_FALSE(crosses(line, place->patch));
}

TEST(LabelPlaces, ALabelThatIsTooLargeHasNoPlace) {
    LabelPlaces places(kPlot);
    EXPECT_FALSE(places.place({{100.0, 100.0, 400.0, 15.0}}).at(0));
}

TEST(LabelPlaces, ALineCrossesARectangleWhereAPartOfItIsWithin) {
    const Patch patch{10.0, 10.0, 20.0, 20.0};
    EXPECT_TRUE(crosses({{{0.0, 0.0}, {30.0, 30.0}}}, patch));
    EXPECT_TRUE(crosses({{{15.0, 0.0}, {15.0, 30.0}}}, patch));
    EXPECT_TRUE(crosses({{{12.0, 12.0}, {13.0, 13.0}}}, patch)); // all of it
    EXPECT_FALSE(crosses({{{0.0, 25.0}, {30.0, 25.0}}}, patch));
    EXPECT_FALSE(crosses({{{0.0, 0.0}, {9.0, 9.0}}}, patch)); // ends before
    EXPECT_FALSE(crosses({{{0.0, 12.0}, {12.0, 0.0}}}, {10.0, 10.0, 20.0, 20.0}));
}

} // namespace
} // namespace palpate::internal
