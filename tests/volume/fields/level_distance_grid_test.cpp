// SPDX-License-Identifier: Apache-2.0
// Distances to a trilinear level, which has kinks between its cells.
#include <palpate/volume/fields/level_distance.h>
#include <palpate/volume/fields/nearest_on_level.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/volume/fields/grid_field.h>

#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

/// A wavy ball of 12 mm on voxels of 0.9, 0.8 and 1.4 mm in an oblique frame.
GridField wavy_ball() {
    VoxelVolume volume;
    volume.size = {40, 44, 28};
    const Vec3 spacing(0.9e-3, 0.8e-3, 1.4e-3);
    volume.index_to_scene = test::oblique_frame(spacing, Vec3(0.0));
    volume.index_to_scene.offset =
        -(volume.index_to_scene.linear * Vec3(19.5, 21.5, 13.5)); // the centre at the origin
    volume.values.resize(volume.voxels());
    for (int k = 0; k < volume.size[2]; ++k)
        for (int j = 0; j < volume.size[1]; ++j)
            for (int i = 0; i < volume.size[0]; ++i) {
                const Vec3 p = volume.index_to_scene.point(Vec3(i, j, k));
                const Vec3 u = p / std::max(glm::length(p), 1e-9);
                const double wave = 5e-4 * std::sin(5.0 * u.x) * std::sin(4.0 * u.y + 1.0);
                volume.values[volume.index(i, j, k)] =
                    static_cast<float>(1e5 * (0.012 + wave - glm::length(p)));
            }
    return GridField(volume, -2000.0f);
}

/// The nearest crossing of the level on rays in 1000 directions, 2 mm long.
double distance_by_rays(FieldSampler& sampler, double level, const Vec3& p) {
    constexpr int kRays = 1000, kSteps = 50;
    constexpr double kReach = 2e-3;
    const bool above = sampler.value(p) > level;
    double nearest = std::numeric_limits<double>::infinity();
    for (int ray = 0; ray < kRays; ++ray) {
        const double z = 1.0 - (2.0 * ray + 1.0) / kRays, r = std::sqrt(1.0 - z * z);
        const double turn = ray * std::numbers::pi * (3.0 - std::sqrt(5.0));
        const Vec3 d(r * std::cos(turn), r * std::sin(turn), z);
        double before = 0.0;
        for (int step = 1; step <= kSteps && before < nearest; ++step) {
            double after = kReach * step / kSteps;
            if ((sampler.value(p + after * d) > level) != above) {
                for (int half = 0; half < 40; ++half) {
                    const double middle = 0.5 * (before + after);
                    ((sampler.value(p + middle * d) > level) != above ? after : before) = middle;
                }
                nearest = std::min(nearest, after);
                break;
            }
            before = after;
        }
    }
    return nearest;
}

TEST(LevelDistance, AgreesWithRaysInAllDirectionsOnAGrid) {
    const GridField field = wavy_ball();
    const auto sampler = field.make_sampler();
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> off(-0.0012, 0.0012);
    constexpr double kLevel = 10.0;
    for (int k = 0; k < 150; ++k) {
        const double x = normal(random), y = normal(random), z = normal(random);
        const Vec3 p = (0.012 + off(random)) * glm::normalize(Vec3(x, y, z));
        const LevelDistance found = level_distance(field, kLevel, std::array{p});
        ASSERT_EQ(found.lost, 0u);
        const double by_rays = distance_by_rays(*sampler, kLevel, p);
        // 1000 directions leave up to 0.08 rad between the best one and the nearest point's: the
        // ray is longer by 1 / cos, 0.32 %.
        ASSERT_GE(found.max_m, by_rays / 1.0033) << "point " << k;
        // A foot at a kink between cells may be held there by the slope of one of them: on this
        // ball 4 points of 150 are, by up to 0.17 %; without turning lines it would be 0.45 %.
        ASSERT_LE(found.max_m, 1.003 * by_rays) << "point " << k;
    }
}

TEST(NearestOnLevel, OfAGridIsAPointOfTheLevelThatRaysInAllDirectionsDoNotBeat) {
    const GridField field = wavy_ball();
    const auto sampler = field.make_sampler();
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> off(-0.0012, 0.0012);
    constexpr double kLevel = 10.0;
    for (int k = 0; k < 100; ++k) {
        const Vec3 direction = glm::normalize(Vec3(normal(random), normal(random), normal(random)));
        const Vec3 p = (0.012 + off(random)) * direction;
        const auto foot = nearest_on_level(*sampler, kLevel, field.feature_size_m(), p, p, 0.01);
        ASSERT_TRUE(foot);
        ASSERT_NEAR(glm::length(foot->position - p), std::abs(foot->depth_m), 1e-15);
        ASSERT_EQ(foot->depth_m > 0.0, sampler->value(p) > kLevel);
        // On the level to 1e-11 m, where the slope is 1e5 a metre.
        ASSERT_NEAR(sampler->value(foot->position), kLevel, 4.0 * 1e5 * 1e-11 + 1e-9);
        const double by_rays = distance_by_rays(*sampler, kLevel, p);
        // As above; and where the level bulges towards the point, with a voxel's radius at least,
        // the best ray misses by (1 + 1.2 mm / 0.8 mm) times as much.
        ASSERT_GE(std::abs(foot->depth_m), by_rays / 1.0083) << "point " << k;
        ASSERT_LE(std::abs(foot->depth_m), 1.003 * by_rays) << "point " << k;
    }
}

// From so far away turning lines would lead away: the foot slides along the level.
TEST(NearestOnLevel, FromFarAwayIsAsNearAsTheNearestOfManyPointsOfTheLevel) {
    const GridField field = wavy_ball();
    const auto sampler = field.make_sampler();
    std::mt19937_64 random(6);
    std::normal_distribution<double> normal;
    const auto direction = [&] {
        return glm::normalize(Vec3(normal(random), normal(random), normal(random)));
    };
    constexpr double kLevel = 10.0, kFar = 0.05;
    std::vector<Vec3> of_level;
    while (of_level.size() < 40000) {
        const Vec3 u = direction();
        const auto root = sampler->first_root(0.015 * u, 0.009 * u, kLevel);
        ASSERT_TRUE(root);
        of_level.push_back((0.015 - *root * 0.006) * u);
    }
    double furthest_over_m = 0.0;
    for (int k = 0; k < 60; ++k) {
        const Vec3 p = kFar * direction();
        // A start that is up to 4 mm beside it, as a mesh may give it.
        const Vec3 start = 0.012 * glm::normalize(glm::normalize(p) + 0.3 * direction());
        const auto foot = nearest_on_level(*sampler, kLevel, field.feature_size_m(), p, start, 0.1);
        ASSERT_TRUE(foot);
        double nearest_m = 1.0;
        for (const Vec3& point : of_level)
            nearest_m = std::min(nearest_m, glm::length(point - p));
        // 22 random points a square millimetre: one is within 0.4 mm of the nearest of all, with
        // a probability of exp(-11) of none. It is farther from p by no more than
        // 0.4^2 / 2 (1 / 12 + 1 / 38) mm = 9 um, as the ball bends, and 0.4 mm times the slope of
        // a facet of a voxel against the ball, 0.05, 20 um.
        EXPECT_GE(-foot->depth_m, nearest_m - 29e-6) << "point " << k;
        furthest_over_m = std::max(furthest_over_m, -foot->depth_m - nearest_m);
    }
    RecordProperty("furthest_over_um", std::to_string(1e6 * furthest_over_m));
    // A kink between voxels may hold the foot beside the nearest point.
    EXPECT_LE(furthest_over_m, 5e-6);
}

} // namespace
} // namespace palpate
