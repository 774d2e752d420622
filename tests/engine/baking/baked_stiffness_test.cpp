// SPDX-License-Identifier: Apache-2.0
// The map of a soft surface over what lies beneath it (docs/palpation.md).
#include <palpate/engine/baking/baking.h>

#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/baking/in_words.h>
#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/report/scene_in_words.h>
#include <palpate/engine/scene/loop_parts.h>
#include <palpate/engine/scene/scene.h>

#include "tests/support/made_labels.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

using testing::HasSubstr;

constexpr double kMm = 1e-3;
constexpr double kTop = 22.0 * kMm; // of the tissue: half way between voxel centres

constexpr double kVoxelsOfBall = 498.0 / 523.6;

/// Tissue (1) of 60 x 44 x 22 mm in voxels of 1 mm, flat at z = kTop, with a ball (2) of 5 mm whose
/// top is 5 mm beneath the middle, and beside it all a block (3).
std::shared_ptr<const LabelVolume> phantom() {
    const AffineTransform frame{Mat3(kMm), Vec3{-36.0, -28.0, -4.5} * kMm};
    LabelVolume volume = test::made_labels({82, 57, 33}, frame, 3, [&](const Vec3& index) {
        const Vec3 p = frame.point(index) / kMm;
        if (p.x > 34.0 && p.x < 40.0 && std::abs(p.y) < 5.0 && p.z > 0.0 && p.z < 10.0) return 3;
        if (std::abs(p.x) > 30.0 || std::abs(p.y) > 22.0 || p.z < 0.0 || p.z > kTop / kMm) return 0;
        return glm::length(p - Vec3{0.0, 0.0, 12.0}) <= 5.0 ? 2 : 1;
    });
    volume.labels[0].name = "Tissue";
    volume.labels[1].name = "Nodule";
    volume.labels[2].name = "Apart";
    return std::make_shared<const LabelVolume>(std::move(volume));
}

SceneDescription scene_of(const std::map<std::string, double>& beneath) {
    static const std::shared_ptr<const LabelVolume> labels = phantom();
    SceneDescription scene;
    scene.volumes["v"].label_volume = labels;
    SurfaceDescription& body = scene.surfaces["body"];
    body.volume = "v";
    body.labels = {"Tissue", "Nodule"};
    body.contact = ContactKind::volume;
    body.softness = Softness::linear(150.0);
    body.beneath = beneath;
    scene.effects.push_back(effects::Surface{.surface = "body"});
    return scene;
}

BakedStiffness baked(const SceneDescription& scene, const ResultCache& cache = {}) {
    return bake_surface(scene, "body", cache).stiffness;
}

std::string refusal(const SceneDescription& scene) {
    try {
        baked(scene);
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "accepted";
}

// The kernel's profile of a ball is in docs/palpation.md; the voxels are 498 of the ball's 523.6.
// The spline takes (1 mm)^2 / 8 times the second derivatives along the surface off the top: 3 %.
TEST(BakedStiffness, AcrossALumpIsTheKernelsProfile) {
    const BakedStiffness stiffness = baked(scene_of({{"Nodule", 10.0}}));
    ASSERT_TRUE(stiffness.map);
    const std::vector<double> of_ball{0.210, 0.167, 0.091, 0.040, 0.017}; // every 3 mm
    for (std::size_t i = 0; i < of_ball.size(); ++i)
        for (const double side : {-1.0, 1.0}) {
            const Vec3 at{3.0 * kMm * side * static_cast<double>(i), 0.0, kTop};
            const double wanted = kVoxelsOfBall * of_ball[i];
            EXPECT_NEAR(stiffness.map->sample(at).ratio - 1.0, wanted, 0.03 * wanted + 1e-3);
            // It is the same along the normal: fronts lie a little beside the level.
            for (const double beside : {-0.5 * kMm, 0.5 * kMm})
                EXPECT_NEAR(stiffness.map->sample(at + Vec3{0, 0, beside}).ratio - 1.0, wanted,
                            0.03 * wanted + 1e-3);
        }
    EXPECT_NEAR(stiffness.stiffest, 1.0 + 0.210 * kVoxelsOfBall, 6e-3);
    EXPECT_NEAR(stiffness.steepest_per_m, 24.0, 4.0); // 2.7 % of K0 per mm, over 1.1
    EXPECT_NEAR(glm::length(Vec3{stiffness.steepest_at.x, stiffness.steepest_at.y, 0.0}), 5e-3,
                2e-3);
    EXPECT_EQ(stiffness.contact_radius_m, 4.0 * kMm);
    EXPECT_FALSE(stiffness.from_cache);
}

TEST(BakedStiffness, OfTissueLikeTheOneAroundThereIsNoMap) {
    EXPECT_FALSE(baked(scene_of({{"Nodule", 1.0}})).map);
}

TEST(BakedStiffness, ALabelWhoseNameIsNotUtf8IsKeptToo) {
    const test::TemporaryFolder folder;
    const std::string name = "Tumeur gonfl\351e"; // Latin-1
    auto labels = std::make_shared<LabelVolume>(*phantom());
    labels->labels[1].name = name;
    SceneDescription scene = scene_of({{name, 10.0}});
    scene.volumes["v"].label_volume = labels;
    scene.surfaces["body"].labels = {"Tissue", name};
    EXPECT_FALSE(baked(scene, folder.path()).from_cache);
    EXPECT_TRUE(baked(scene, folder.path()).from_cache);
}

TEST(BakedStiffness, ASoftLumpIsSofter) {
    const BakedStiffness stiffness = baked(scene_of({{"Nodule", 0.2}}));
    EXPECT_EQ(stiffness.stiffest, 1.0);
    // 5 (m - 1) / (2 m + 3) of 0.2 against that of 10
    EXPECT_NEAR(1.0 - stiffness.softest, kVoxelsOfBall * 0.210 * (4.0 / 3.4) / (45.0 / 23.0),
                0.004);
}

TEST(BakedStiffness, FromTheCacheHasTheSameBits) {
    const test::TemporaryFolder folder;
    const ResultCache cache(folder.path());
    const SceneDescription scene = scene_of({{"Nodule", 10.0}});
    const BakedStiffness made = baked(scene, cache), found = baked(scene, cache);
    ASSERT_TRUE(found.map);
    EXPECT_TRUE(found.from_cache);
    EXPECT_EQ(found.map->gains(), made.map->gains());
    EXPECT_EQ(found.map->lattice().origin, made.map->lattice().origin);
    EXPECT_EQ(found.steepest_at, made.steepest_at);
    EXPECT_EQ(found.lumps, "Nodule 10x");
    // Another ratio is another map.
    EXPECT_FALSE(baked(scene_of({{"Nodule", 9.0}}), cache).from_cache);
}

// |grad K| delta <= k with K delta up to the force limit.
TEST(BakedStiffness, IsSmoothedUntilTheLoopBearsIt) {
    SceneDescription scene = scene_of({{"Nodule", 10.0}});
    scene.coupling.stiffness_n_per_m = 160.0;
    scene.limits.force_n = 10.0;
    const BakedStiffness stiffness = baked(scene);
    EXPECT_LE(stiffness.steepest_per_m, 16.0);
    EXPECT_GT(stiffness.steepest_per_m, 10.0); // no smoother than it has to be
    EXPECT_GT(stiffness.contact_radius_m, stiffness.asked_radius_m);
    EXPECT_LT(stiffness.contact_radius_m, 3.0 * stiffness.asked_radius_m);
    const std::string words = baked_in_words(bake_surface(scene, "body", ResultCache{}));
    EXPECT_THAT(words, HasSubstr("smoothed, so that the loop stays stable"));
    EXPECT_THAT(words, HasSubstr("instead of 4 mm"));
}

TEST(BakedStiffness, SaysWhatIsFelt) {
    const std::string words =
        baked_in_words(bake_surface(scene_of({{"Nodule", 10.0}}), "body", ResultCache{}));
    EXPECT_THAT(words, HasSubstr("beneath: Nodule 10x, felt as +"));
    EXPECT_THAT(words, HasSubstr("above the 7 % of a force"));
    EXPECT_THAT(words, testing::Not(HasSubstr("smoothed, so")));
}

// At 0.6 of the coupling there is room for the 20 % that the lump adds; at 0.95 there is not.
TEST(BakedStiffness, ExplainSaysWhatTheCouplingLetsBeFelt) {
    const auto explained = [](double share) {
        SceneDescription scene = scene_of({{"Nodule", 10.0}});
        SurfaceDescription& body = scene.surfaces.at("body");
        body.softness = Softness::linear(share * scene.coupling.stiffness_n_per_m);
        return scene_in_words(Scene(scene, {.files = scene_files()}),
                              std::vector<double>(scene.effects.size()));
    };
    EXPECT_THAT(explained(0.6), testing::Not(HasSubstr("the coupling lets")));
    EXPECT_THAT(explained(0.95), HasSubstr("the coupling lets +5.3 % of it be felt; raise"));
    EXPECT_THAT(explained(1.5), HasSubstr("nothing of it is felt, as the surface is hard"));
}

TEST(BakedStiffness, RefusesLabelsThatAreNotBeneath) {
    EXPECT_THAT(refusal(scene_of({{"Lump", 10.0}})), HasSubstr("Lump"));
    EXPECT_THAT(refusal(scene_of({{"Apart", 10.0}})),
                HasSubstr("100 % of Apart are not beneath the surface; add it"));
    EXPECT_THAT(refusal(scene_of({{"Nodule", 10.0}, {"2", 3.0}})),
                HasSubstr("names label Nodule twice"));
    EXPECT_THAT(refusal(scene_of({{"1", 3.0}, {"2", 3.0}})),
                HasSubstr("beneath has all labels of the surface"));
}

// A loop feels it: pressed by 5 mm over the lump, and far beside it.
TEST(BakedStiffness, AHandFeelsTheLump) {
    const auto scene = std::make_shared<const Scene>(scene_of({{"Nodule", 10.0}}),
                                                     SceneResources{.files = scene_files()});
    const LoopParts parts = scene->make_parts();
    ASSERT_EQ(parts.finish.size(), 1u);
    ASSERT_TRUE(parts.finish[0].stiffness);
    EXPECT_NEAR(parts.finish[0].stiffness->sample({0, 0, kTop}).ratio, 1.2, 0.01);
    EXPECT_NEAR(parts.finish[0].stiffness->sample({25 * kMm, 0, kTop}).ratio, 1.0, 0.005);
}

} // namespace
} // namespace palpate
