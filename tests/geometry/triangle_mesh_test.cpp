// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/triangle_mesh.h>

#include <chrono>
#include <numbers>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/support/brute_force_queries.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

Vec3 random_point(std::mt19937_64& random, double half) {
    std::uniform_real_distribution<double> in(-half, half);
    const double x = in(random), y = in(random), z = in(random);
    return {x, y, z};
}

TEST(Inspect, EmptyMeshHasNothingAndIsNotClosed) {
    const MeshReport report = inspect({});
    EXPECT_EQ(report.triangles, 0u);
    EXPECT_EQ(report.smallest_angle_deg, 0.0);
    EXPECT_FALSE(report.closed());
    EXPECT_TRUE(report.components.empty());
}

TEST(Inspect, BoxHasItsAreaVolumeAndAngle) {
    const MeshReport report = inspect(test::box_mesh({0.0, 0.0, 0.0}, {0.1, 0.1, 0.1}));
    EXPECT_TRUE(report.closed());
    EXPECT_TRUE(report.manifold());
    // A handful of products of numbers of size 0.1: relative rounding of a few 1e-16.
    EXPECT_NEAR(report.area_m2, 0.06, 1e-16);
    EXPECT_NEAR(report.volume_m3, 1e-3, 1e-17);
    EXPECT_NEAR(report.smallest_angle_deg, 45.0, 1e-12);
    EXPECT_EQ(report.components.size(), 1u);
    EXPECT_EQ(report.bounds.upper, Vec3(0.1));
}

TEST(Inspect, SphereFarAwayKeepsItsVolume) {
    const MeshReport near = inspect(test::icosphere(0.05, 4));
    const MeshReport far = inspect(test::moved(test::icosphere(0.05, 4), Vec3(10.0, -20.0, 30.0)));
    EXPECT_TRUE(far.closed() && far.manifold());
    // Vertices are rounded to ulp(30 m) = 3.6e-15 m: volume changes by at most that times the
    // area, 1.1e-16 m^3.
    EXPECT_NEAR(far.volume_m3, near.volume_m3, 1.2e-16);
    const double ball = 4.0 / 3.0 * std::numbers::pi * std::pow(0.05, 3);
    EXPECT_GT(near.volume_m3, 0.99 * ball);
    EXPECT_LT(near.volume_m3, ball);
}

TEST(Inspect, ReversedMeshHasNegativeVolume) {
    const TriangleMesh mesh = test::icosphere(0.05, 2);
    EXPECT_EQ(inspect(test::reversed(mesh)).volume_m3, -inspect(mesh).volume_m3);
}

TEST(Inspect, SheetHasItsBorder) {
    const MeshReport report = inspect(test::sheet(0.06, 5));
    EXPECT_EQ(report.border_edges, 20u);
    EXPECT_FALSE(report.closed());
    EXPECT_TRUE(report.manifold());
}

TEST(Inspect, OneTriangleTurnedRoundIsNotManifold) {
    TriangleMesh mesh = test::icosphere(0.05, 1);
    std::swap(mesh.triangles[7][0], mesh.triangles[7][1]);
    const MeshReport report = inspect(mesh);
    EXPECT_EQ(report.non_manifold_edges, 3u);
    EXPECT_EQ(report.border_edges, 0u);
}

TEST(Inspect, ThirdTriangleAtAnEdgeIsNotManifold) {
    TriangleMesh mesh = test::sheet(0.06, 1);
    mesh.vertices.push_back({0.0, 0.0, 0.01});
    mesh.triangles.push_back({0, 3, 4}); // 0-3 is the diagonal
    EXPECT_EQ(inspect(mesh).non_manifold_edges, 1u);
}

TEST(Inspect, TwoConesThatShareTheirTipAreOneComponentWithASplitVertex) {
    TriangleMesh mesh = test::box_mesh({0.0, 0.0, 0.0}, {0.1, 0.1, 0.1});
    TriangleMesh other = test::box_mesh({0.1, 0.1, 0.1}, {0.2, 0.2, 0.2});
    test::append(mesh, other);
    for (auto& triangle : mesh.triangles)
        for (auto& vertex : triangle)
            if (vertex == 8) vertex = 7; // the corner where they meet
    const MeshReport report = inspect(mesh);
    EXPECT_EQ(report.non_manifold_vertices, 1u);
    EXPECT_EQ(report.non_manifold_edges, 0u);
    EXPECT_TRUE(report.closed());
    EXPECT_EQ(report.components.size(), 1u);
}

TEST(Inspect, ComponentsComeLargestFirst) {
    TriangleMesh mesh = test::icosphere(0.01, 2);
    test::append(mesh, test::icosphere(0.03, 2, Vec3(0.1, 0.0, 0.0)));
    test::append(mesh, test::reversed(test::icosphere(0.02, 2, Vec3(0.1, 0.0, 0.0))));
    const MeshReport report = inspect(mesh);
    ASSERT_EQ(report.components.size(), 3u);
    EXPECT_NEAR(report.components[0].bounds.extent().z, 0.06, 1e-4 * 0.06 + 0.003);
    EXPECT_GT(report.components[0].volume_m3, 0.0);
    EXPECT_LT(report.components[1].volume_m3, 0.0);
    EXPECT_GT(report.components[1].area_m2, report.components[2].area_m2);
    EXPECT_EQ(report.components[2].triangles, 320u);
    EXPECT_EQ(report.components[2].sample, mesh.vertices[mesh.triangles[0][0]]);
}

TEST(Inspect, CountsDegenerateTriangles) {
    TriangleMesh mesh = test::sheet(0.06, 1);
    mesh.triangles.push_back({0, 1, 1});
    mesh.vertices.push_back(
        {0.0, -0.03, 1e-12}); // almost on the side 0-1: |cross| / side^2 = 2e-11
    mesh.triangles.push_back({0, 1, 4});
    EXPECT_EQ(inspect(mesh).degenerate, 2u);
}

TEST(Inspect, TriangleOfAnUnknownVertexIsRefused) {
    TriangleMesh mesh = test::sheet(0.06, 1);
    mesh.triangles.push_back({0, 1, 4});
    EXPECT_THROW(inspect(mesh), std::invalid_argument);
}

TEST(Inspect, LargeMeshIsQuick) {
    TriangleMesh mesh = test::icosphere(0.1, 7);
    test::append(mesh, test::icosphere(0.1, 7, Vec3(1.0, 0.0, 0.0)));
    const auto start = std::chrono::steady_clock::now();
    const MeshReport report = inspect(mesh);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    EXPECT_EQ(report.components.size(), 2u);
    RecordProperty("seconds_for_655360_triangles", std::to_string(taken.count()));
    EXPECT_LT(taken.count(), 60.0); // no timing test: a quadratic method takes hours
}

TEST(TriangleNormal, FollowsTheRightHandAndIsZeroWhereThereIsNone) {
    EXPECT_EQ(triangle_normal({0, 0, 0}, {1, 0, 0}, {0, 1, 0}), Vec3(0, 0, 1));
    EXPECT_EQ(triangle_normal({0, 0, 0}, {1, 0, 0}, {2, 0, 0}), Vec3(0.0));
    EXPECT_EQ(triangle_normal({1, 2, 3}, {1, 2, 3}, {1, 2, 3}), Vec3(0.0));
}

TEST(ClosestPointOnTriangle, AgreesWithFootAndSides) {
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        std::mt19937_64 random(seed);
        for (int k = 0; k < 20000; ++k) {
            const TriangleMesh mesh{{random_point(random, 0.05), random_point(random, 0.05),
                                     random_point(random, 0.05)},
                                    {{0, 1, 2}}};
            const Vec3 p = random_point(random, 0.1);
            const Vec3 q =
                closest_point_on_triangle(p, mesh.vertices[0], mesh.vertices[1], mesh.vertices[2]);
            const auto twin = test::brute_closest_point(mesh, p);
            ASSERT_TRUE(twin);
            // A distance changes by the square of an error along the triangle, but by all of one
            // across it, and thin triangles lose digits of their plane: 1e-12 m is 1e4 roundings at
            // 0.1 m.
            ASSERT_NEAR(glm::length(q - p), twin->distance, 1e-12) << "triangle " << k;
        }
    }
}

TEST(ClosestPointOnTriangle, DegenerateTriangleGivesAPointOfIt) {
    const Vec3 a(0, 0, 0), b(1, 0, 0), middle(0.5, 0, 0);
    EXPECT_EQ(closest_point_on_triangle({0.25, 1, 0}, a, b, middle), Vec3(0.25, 0, 0));
    EXPECT_EQ(closest_point_on_triangle({0.25, 1, 0}, a, a, a), a);
    EXPECT_EQ(closest_point_on_triangle({2, 1, 0}, a, b, b), b);
}

} // namespace
} // namespace palpate
