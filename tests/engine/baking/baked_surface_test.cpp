// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/baking/baking.h>

#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/baking/in_words.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/volume/formats/volume_file.h>

#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

constexpr double kMm = 1e-3;

/// A ball of 9 mm radius, its left half label 3, its right half 7, and a crumb of 7 apart from it.
class LabelledBall : public ::testing::Test {
protected:
    LabelledBall() {
        write_volume(test::sampled({32, 30, 28}, {Mat3(kMm), Vec3(0.0)},
                                   [](const Vec3& p) {
                                       if (glm::length(p - kCenter) < 9 * kMm)
                                           return p.x > kCenter.x ? 3
                                                                  : 7; // LPS: x grows to the left
                                       return glm::length(p - kCrumb) < 2.2 * kMm ? 7 : 0;
                                   }),
                     folder_ / "ball.nrrd");
        test::make_file(folder_ / "names.txt", "3 Half_L\n7 Half_R\n");
    }

    BakedSurface bake(const std::string& keys, const std::string& cache = {}) const {
        const SceneDescription scene = parse_scene(
            "[volume.v]\nfile = \"ball.nrrd\"\nlabels = \"names.txt\"\n[surface.s]\nvolume = "
            "\"v\"\n" +
                keys,
            folder_ / "scene.toml");
        return bake_surface(scene, "s", cache.empty() ? std::filesystem::path() : folder_ / cache);
    }

    static constexpr Vec3 kCenter{0.0155, 0.015, 0.014};
    static constexpr Vec3 kCrumb{0.003, 0.003, 0.003};
    test::TemporaryFolder folder_;
};

TEST_F(LabelledBall, AHalfIsWhereItsVoxelsAre) {
    const BakedSurface left = bake("label = \"Half_L\"\n");
    EXPECT_EQ(left.labels, std::vector<std::string>{"Half_L"});
    // Half a ball of 9 mm; counted in voxels of 1 mm3 to about the surface's area / 10.
    EXPECT_NEAR(left.volume_before_mm3, 2.0 / 3.0 * M_PI * 729.0, 80.0);
    EXPECT_NEAR(left.volume_mm3, left.volume_before_mm3, 0.01 * left.volume_before_mm3);
    const auto sampler = left.field->make_sampler();
    EXPECT_GT(sampler->value(kCenter + Vec3(4 * kMm, 0, 0)), left.level);
    EXPECT_LT(sampler->value(kCenter - Vec3(4 * kMm, 0, 0)), left.level);
    EXPECT_LT(sampler->value(kCrumb), left.level);
}

TEST_F(LabelledBall, SeveralLabelsAreOneSurfaceWithoutASeam) {
    const BakedSurface ball = bake("label = [\"half_l\", 7]\nkeep = \"largest\"\n");
    ASSERT_EQ(ball.components.size(), 2u) << "ball and crumb";
    EXPECT_FALSE(ball.components[1].kept);
    const auto sampler = ball.field->make_sampler();
    EXPECT_GT(sampler->value(kCenter), 0.99) << "deep inside, where the halves meet";
    EXPECT_LT(sampler->value(kCrumb), ball.level) << "no root is left where it was removed";
    const auto root =
        sampler->first_root(kCrumb - Vec3(3 * kMm, 0, 0), kCrumb + Vec3(4 * kMm, 0, 0), ball.level);
    EXPECT_FALSE(root.has_value());
}

TEST_F(LabelledBall, TheCacheGivesTheSameWithoutReadingTheVolume) {
    const BakedSurface first = bake("label = 7\n", "cache");
    const BakedSurface again = bake("label = 7\n", "cache");
    EXPECT_FALSE(first.from_cache);
    EXPECT_TRUE(again.from_cache);
    EXPECT_EQ(first.key, again.key);
    EXPECT_EQ(baked_as_json(first), baked_as_json(again));
    EXPECT_NE(bake("label = 3\n", "cache").key, first.key);
    test::make_file(folder_ / "names.txt", "3 Half_R\n7 Half_L\n");
    EXPECT_NE(bake("label = \"Half_L\"\n", "cache").key, first.key)
        << "another table may mean another label";
}

// A header stays as it is while the files that it names are swapped.
TEST(BakedSurface, VoxelsThatAreInfiniteAreNoMaterial) {
    // A ball, one voxel of its middle, and one that is far from it.
    const auto baked = [](float inside, float outside) {
        VoxelVolume voxels = test::sampled({24, 24, 24}, {Mat3(kMm), Vec3(0.0)}, [](const Vec3& p) {
            return 100.0 - 1e4 * glm::length(p - Vec3(11.5 * kMm));
        });
        voxels.values[voxels.index(11, 11, 11)] = inside;
        voxels.values[voxels.index(2, 2, 2)] = outside;
        SceneDescription scene;
        scene.volumes["v"].voxels = std::make_shared<const VoxelVolume>(voxels);
        scene.surfaces["s"].volume = "v";
        scene.surfaces["s"].iso_value = 30.0;
        return bake_surface(scene, "s", ResultCache{});
    };
    constexpr float infinity = std::numeric_limits<float>::infinity();
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    const BakedSurface expected = baked(nan, nan);
    ASSERT_EQ(expected.components.size(), 1U) << "the ball";
    const BakedSurface found = baked(infinity, infinity);
    EXPECT_EQ(found.components.size(), 1U);
    EXPECT_EQ(found.volume_before_mm3, expected.volume_before_mm3);
    EXPECT_EQ(found.volume_mm3, expected.volume_mm3);
    const Vec3 at = Vec3(11.3 * kMm);
    EXPECT_EQ(found.field->make_sampler()->value(at), expected.field->make_sampler()->value(at));
}

TEST(BakedSurface, SwappedFilesOfAHeaderAreAnotherVolume) {
    const test::TemporaryFolder folder;
    constexpr int kSide = 12;
    const auto half = [](bool lower) { // of a ball of 4 voxels in the middle of kSide^3
        std::string bytes;
        for (int k = lower ? 0 : kSide / 2; k < (lower ? kSide / 2 : kSide); ++k)
            for (int j = 0; j < kSide; ++j)
                for (int i = 0; i < kSide; ++i)
                    bytes += (i - 6) * (i - 6) + (j - 6) * (j - 6) + (k - 6) * (k - 6) < 16 ? '\x64'
                                                                                            : '\0';
        return bytes;
    };
    test::make_file(folder / "v.nhdr",
                    "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 12 12 12\nencoding: raw\n"
                    "space: left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
                    "space origin: (0,0,0)\ndata file: LIST\none.raw\ntwo.raw\n");
    const auto key = [&](const char* lower, const char* upper) {
        test::make_file(folder / lower, half(true));
        test::make_file(folder / upper, half(false));
        const SceneDescription scene = parse_scene(
            "[volume.v]\nfile = \"v.nhdr\"\n[surface.s]\nvolume = \"v\"\niso_value = 50\n",
            folder / "scene.toml");
        return bake_surface(scene, "s", folder / "cache").key;
    };
    const std::string first = key("one.raw", "two.raw");
    EXPECT_NE(key("two.raw", "one.raw"), first);
    EXPECT_EQ(key("one.raw", "two.raw"), first);
}

TEST_F(LabelledBall, AWrongLabelIsAnsweredWithTheNearestNames) {
    try {
        bake("label = \"Half_X\"\n");
        FAIL() << "accepted";
    } catch (const std::runtime_error& error) {
        const std::string message = error.what();
        EXPECT_NE(message.find("scene.toml:4: [surface.s]: "), std::string::npos) << message;
        EXPECT_NE(message.find("Half_L"), std::string::npos) << message;
    }
}

TEST_F(LabelledBall, ARegionCutsTheLabelAndIsClosedThere) {
    const Vec3 low = 1e3 * (kCenter - Vec3(20 * kMm)), high = 1e3 * (kCenter + Vec3(20 * kMm));
    const BakedSurface half =
        bake(fmt::format("label = [3, 7]\nregion_mm = [[{}, {}, {}], [{}, {}, {}]]\n", low.x, low.y,
                         low.z, high.x, high.y, 1e3 * kCenter.z));
    const auto sampler = half.field->make_sampler();
    EXPECT_GT(sampler->value(kCenter - Vec3(0, 0, 3 * kMm)), half.level);
    EXPECT_LT(sampler->value(kCenter + Vec3(0, 0, 3 * kMm)), half.level) << "outside the region";
    // Half of the ball, and the plane of voxels that the region ends in.
    EXPECT_NEAR(half.volume_before_mm3, 2.0 / 3.0 * M_PI * 729.0 + 0.5 * M_PI * 81.0, 120.0);
}

TEST_F(LabelledBall, TheReportNamesWhatWasDropped) {
    const BakedSurface ball = bake("label = [3, 7]\nkeep = \"largest\"\n");
    const std::string words = baked_in_words(ball);
    EXPECT_NE(words.find("labels Half_L, Half_R\n"), std::string::npos) << words;
    EXPECT_NE(words.find("1 kept, 1 removed from the field"), std::string::npos) << words;
    const auto document = nlohmann::json::parse(baked_as_json(ball));
    EXPECT_EQ(document.at("components").size(), 2u);
    EXPECT_EQ(document.at("components").at(1).at("kept"), false);
}

} // namespace
} // namespace palpate
