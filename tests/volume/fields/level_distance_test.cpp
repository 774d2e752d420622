// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/level_distance.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

// A foot is known to 1e-11 m, and a line that is turned until that gains less than 1e-11 m is off
// by at most about as much again.
constexpr double kClose = 3e-11;

Vec3 random_direction(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    const double x = normal(random), y = normal(random), z = normal(random);
    return glm::normalize(Vec3(x, y, z));
}

double distance_from(const ScalarField& field, double level, const Vec3& p) {
    const LevelDistance one = level_distance(field, level, std::array{p});
    EXPECT_EQ(one.points, 1u);
    EXPECT_EQ(one.lost, 0u);
    EXPECT_EQ(one.mean_m, one.max_m);
    EXPECT_EQ(one.p99_m, one.max_m);
    return one.max_m;
}

TEST(LevelDistance, IsThatOfSphereAndTorus) {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> off(-0.004, 0.004);
    const auto cavity = make_sphere_cavity(0.03);
    const auto solid = make_solid_sphere(0.03);
    const auto torus = make_torus(0.03, 0.008);
    for (int k = 0; k < 500; ++k) {
        const Vec3 u = random_direction(random);
        const double d = off(random), level = 0.0005 * (k % 3 - 1);
        const Vec3 p = (0.03 + d) * u;
        ASSERT_NEAR(distance_from(*cavity, level, p), std::abs(d - level), kClose);
        ASSERT_NEAR(distance_from(*solid, level, p), std::abs(d + level), kClose);

        const Vec3 on_circle = 0.03 * glm::normalize(Vec3(u.x, u.y, 0.0));
        const Vec3 radial = glm::normalize(on_circle);
        const double turn = std::numbers::pi * u.z;
        const Vec3 q = on_circle + (0.008 + d) * (std::cos(turn) * radial +
                                                  std::sin(turn) * Vec3(0.0, 0.0, 1.0));
        ASSERT_NEAR(distance_from(*torus, level, q), std::abs(d + level), kClose);
    }
}

/// The nearest point of a star-shaped surface, radius(direction) around the origin: a search over
/// directions around p's, ever finer about the best one.
double brute_star_distance(const std::function<double(const Vec3&)>& radius, const Vec3& p,
                           double widest_rad) {
    Vec3 best = glm::normalize(p);
    double nearest = std::numeric_limits<double>::infinity();
    for (double width = widest_rad; width > 1e-8; width *= 0.35) {
        const Vec3 n = best;
        const Vec3 across = std::abs(n.x) < 0.6 ? Vec3(1.0, 0.0, 0.0) : Vec3(0.0, 1.0, 0.0);
        const Vec3 u = glm::normalize(glm::cross(n, across)), v = glm::cross(n, u);
        for (int i = -10; i <= 10; ++i)
            for (int j = -10; j <= 10; ++j) {
                const Vec3 direction =
                    glm::normalize(n + 0.1 * width * (1.0 * i * u + 1.0 * j * v));
                const double distance = glm::length(radius(direction) * direction - p);
                if (distance >= nearest) continue;
                nearest = distance;
                best = direction;
            }
    }
    return nearest;
}

TEST(LevelDistance, AgreesWithASearchOfTheWholeNeighbourhoodOnBumps) {
    constexpr double kRadius = 0.03, kHeight = 0.001, kWave = 0.012;
    const auto field = make_bumpy_cavity(kRadius, kHeight, kWave);
    const double w = 2.0 * std::numbers::pi * kRadius / kWave;
    const auto radius = [&](const Vec3& u) {
        return kRadius + kHeight * std::sin(w * u.x) * std::sin(w * u.y) * std::sin(w * u.z);
    };
    const auto sampler = field->make_sampler();
    std::mt19937_64 random(2);
    // Closer than the smallest radius of curvature, so that there is one nearest point.
    std::uniform_real_distribution<double> off(-0.0007, 0.0007);
    double most_gained = 0.0;
    for (int k = 0; k < 300; ++k) {
        const Vec3 u = random_direction(random);
        const Vec3 p = (radius(u) + off(random)) * u;
        const double found = distance_from(*field, 0.0, p);
        // The search is within 1e-9 rad of the best direction: 3e-11 m along the surface, less
        // across it.
        ASSERT_NEAR(found, brute_star_distance(radius, p, 0.08), kClose + 3e-11) << "point " << k;
        const FieldSample s = sampler->sample(p);
        most_gained = std::max(most_gained, std::abs(s.value) / glm::length(s.slope) - found);
    }
    EXPECT_GT(most_gained, 1e-6); // control: one Newton step would not have done
}

TEST(LevelDistance, QuantilesAreThoseOfTheSortedDistances) {
    const auto slab = make_slab(0.01); // surface at z = 5 mm
    std::vector<Vec3> points;
    for (int k = 200; k >= 1; --k)
        points.push_back(Vec3(0.001 * k, 0.0, 0.005 + 1e-6 * k));
    const LevelDistance all = level_distance(*slab, 0.0, points);
    EXPECT_EQ(all.points, 200u);
    EXPECT_EQ(all.lost, 0u);
    EXPECT_NEAR(all.mean_m, 100.5e-6, kClose);
    EXPECT_NEAR(all.p99_m, 198e-6, kClose);
    EXPECT_NEAR(all.max_m, 200e-6, kClose);
    points.push_back(Vec3(0.0, 0.0, 0.005)); // 201: the 199th smallest, that of 198 again
    EXPECT_NEAR(level_distance(*slab, 0.0, points).p99_m, 198e-6, kClose);
    EXPECT_EQ(level_distance(*slab, 0.0, {}).points, 0u);
}

TEST(LevelDistance, PointsWithoutALevelNearAreLostAndNotCounted) {
    const auto slab = make_slab(0.01);
    const double beyond = 1.01 * 3.0 * slab->feature_size_m();
    const std::vector<Vec3> points{
        Vec3(0.0, 0.0, 0.006), Vec3(std::numeric_limits<double>::quiet_NaN()),
        Vec3(0.0, 0.0, 0.005 + beyond), Vec3(0.0, 0.0, std::numeric_limits<double>::infinity())};
    const LevelDistance some = level_distance(*slab, 0.0, points);
    EXPECT_EQ(some.points, 4u);
    EXPECT_EQ(some.lost, 3u);
    EXPECT_NEAR(some.max_m, 0.001, kClose);
    EXPECT_EQ(level_distance(*make_sphere_cavity(0.03), 0.0, std::array{Vec3(0.0)}).lost, 1u);
}

TEST(MeshError, IsThatOfChordsAtCentroids) {
    const auto field = make_solid_sphere(0.03);
    const TriangleMesh mesh = test::icosphere(0.03, 3);
    const MeshError error = mesh_error(*field, 0.0, mesh);
    EXPECT_EQ(error.vertices.points, mesh.vertices.size());
    EXPECT_LT(error.vertices.max_m, kClose);
    double most = 0.0, sum = 0.0;
    for (const auto& t : mesh.triangles) {
        const Vec3 center = (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3.0;
        most = std::max(most, 0.03 - glm::length(center));
        sum += 0.03 - glm::length(center);
    }
    EXPECT_EQ(error.centroids.points, mesh.triangles.size());
    EXPECT_EQ(error.centroids.lost, 0u);
    EXPECT_NEAR(error.centroids.max_m, most, kClose);
    EXPECT_NEAR(error.centroids.mean_m, sum / static_cast<double>(mesh.triangles.size()), kClose);
}

TEST(MeshError, RefusesATriangleOfAnUnknownVertex) {
    TriangleMesh mesh = test::sheet(0.06, 1);
    mesh.triangles.push_back({0, 1, 4});
    EXPECT_THROW(mesh_error(*make_slab(0.01), 0.0, mesh), std::invalid_argument);
}

} // namespace
} // namespace palpate
