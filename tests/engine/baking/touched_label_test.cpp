// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/baking/touched_label.h>

#include <algorithm>
#include <memory>

#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/scene/scene.h>

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

// A body's outline lies in a layer of its own around each organ: it was named everywhere.
TEST(TouchedLabel, OfLabelsThatOverlapIsOneOfTheSurface) {
    AffineTransform millimetres;
    millimetres.linear = Mat3(1e-3);
    LabelVolume both =
        test::made_labels({16, 16, 16}, millimetres, 1, [](const Vec3&) { return 1; });
    both.layers.push_back(test::made_labels({16, 16, 16}, millimetres, 1, [](const Vec3& index) {
                              const Vec3 away = glm::abs(index - Vec3(7.5));
                              return std::max({away.x, away.y, away.z}) < 4.0 ? 2 : 0;
                          }).layers.front());
    both.labels = {{"body", 1, 0, {}}, {"prostate", 2, 1, {}}};
    SceneDescription description;
    description.volumes["v"].label_volume = std::make_shared<const LabelVolume>(both);
    description.surfaces["organ"].volume = "v";
    description.surfaces["organ"].labels = {"prostate"};
    description.surfaces["organ"].contact = ContactKind::volume;
    description.effects.push_back(effects::Surface{.surface = "organ"});
    const Scene scene(description, {.files = scene_files()});
    const LabelProbe labels(scene);
    Touch touch;
    touch.point = 1e-3 * Vec3(7.5, 7.5, 12.0);
    touch.normal = {0, 0, 1};
    EXPECT_EQ(touched_label(labels, touch), "prostate");
    EXPECT_EQ(labels.name_at(touch.point), "body");
    touch.point.z = 16e-3; // a voxel's half in front of nothing of it
    EXPECT_EQ(touched_label(labels, touch), "");
}

TEST(TouchedLabel, IsTheNearestBehindTheContactHoweverFineTheVoxels) {
    AffineTransform fine;
    fine.linear = Mat3(25e-6);
    const LabelProbe labels({test::made_labels({10, 10, 12}, fine, 2, [](const Vec3& index) {
        return index.z < 6 ? 2 : index.z < 10 ? 1 : 0;
    })});
    Touch touch;
    touch.point = 25e-6 * Vec3(5.0, 5.0, 9.7);
    touch.normal = {0, 0, 1};
    EXPECT_EQ(touched_label(labels, touch), "1");
    AffineTransform thick;
    thick.linear = Mat3(1e-3);
    thick.linear[2] = {0, 0, 10e-3};
    const LabelProbe slices({test::made_labels(
        {10, 10, 4}, thick, 1, [](const Vec3& index) { return index.z < 2 ? 1 : 0; })});
    touch.point = {5e-3, 5e-3, 24e-3}; // 9 mm in front of the voxel's face
    EXPECT_EQ(touched_label(slices, touch), "1");
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
