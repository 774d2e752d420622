// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/baking/touched_label.h>

#include <gtest/gtest.h>

#include "tests/support/made_labels.h"

namespace palpate {
namespace {

/// Voxels of 1 mm: label 1 for x below 5, label 2 from there on, both below z = 6 alone.
LabelProbe two_labels() {
    AffineTransform millimetres;
    millimetres.linear = Mat3(1e-3);
    return LabelProbe({test::made_labels({10, 10, 10}, millimetres, 2, [](const Vec3& index) {
        return index.z >= 6 ? 0 : index.x < 5 ? 1 : 2;
    })});
}
Touch above(double x_mm, double height_mm) {
    Touch touch;
    touch.point = 1e-3 * Vec3{x_mm, 5.0, 5.5 + height_mm};
    touch.normal = {0, 0, 1};
    return touch;
}

TEST(TouchedLabel, IsTheOneBehindTheContact) {
    const LabelProbe labels = two_labels();
    for (const double height_mm : {-0.7, 0.0, 0.6, 2.0}) {
        EXPECT_EQ(touched_label(labels, above(2.0, height_mm)), "1") << height_mm;
        EXPECT_EQ(touched_label(labels, above(7.0, height_mm)), "2") << height_mm;
    }
}

TEST(TouchedLabel, IsNoneWhereNoneIsNearBehind) {
    const LabelProbe labels = two_labels();
    EXPECT_EQ(touched_label(labels, above(2.0, 1e3 * kLabelReach_m + 0.5)), "");
    Touch away = above(2.0, 0.5);
    away.normal = -away.normal;
    EXPECT_EQ(touched_label(labels, away), "");
    EXPECT_EQ(touched_label(LabelProbe(std::vector<LabelVolume>{}), above(2.0, 0.0)), "");
}

} // namespace
} // namespace palpate
