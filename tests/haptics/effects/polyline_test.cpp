// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/effects/polyline.h>

#include <limits>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/guide_cases.h"

namespace palpate {
namespace {

using test::Anywhere;
using test::kInfinite;
using test::nearest_of_all;
using test::polyline;

TEST(Polyline, FindsTheNearestPlaceOfAll) {
    Anywhere anywhere;
    for (int count : {2, 3, 9, 17, 100, 1000}) {
        std::vector<Vec3> points{{0, 0, 0}};
        for (int i = 1; i < count; ++i)
            points.push_back(points.back() + 0.01 * anywhere.vector());
        const Polyline curve = polyline(points);
        for (int n = 0; n < 300; ++n) {
            const Vec3 point = 0.2 * anywhere.vector();
            const Vec3 best = nearest_of_all(points, point);
            const double distance = glm::length(point - best);
            const auto place = curve.nearest(point, kInfinite);
            ASSERT_TRUE(place);
            EXPECT_NEAR(glm::length(curve.position(*place) - point), distance, 1e-15);
            EXPECT_TRUE(curve.nearest(point, 1.001 * distance));
            EXPECT_FALSE(curve.nearest(point, 0.999 * distance));
        }
    }
}

TEST(Polyline, RefusesWhatIsNone) {
    EXPECT_THROW(polyline({}), std::invalid_argument);
    EXPECT_THROW(polyline({{0, 0, 0}}), std::invalid_argument);
    EXPECT_THROW(polyline({{0, 0, 1}, {0, 0, 1}}), std::invalid_argument);
    EXPECT_THROW(polyline({{0, 0, 0}, {kInfinite, 0, 0}}), std::invalid_argument);
    EXPECT_THROW(polyline({{0, 0, 0}, {1, 0, 0}}, PolylineEnds::closed), std::invalid_argument);
    EXPECT_THROW(polyline({{0, 0, 0}, {1, 0, 0}, {0, 0, 0}}, PolylineEnds::closed),
                 std::invalid_argument);
    EXPECT_THROW(polyline(std::vector<Vec3>(Polyline::kMostPoints + 1)), std::invalid_argument);
    EXPECT_THROW(make_line({0, 0, 0}, {0, 0, 0}), std::invalid_argument);
    EXPECT_THROW(make_line({0, 0, kInfinite}, {0, 0, 1}), std::invalid_argument);
    EXPECT_NO_THROW(polyline({{0, 0, 0}, {0, 0, 0}, {1, 0, 0}}));
}

} // namespace
} // namespace palpate
