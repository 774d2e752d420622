// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/triangle_mesh.h>

#include <random>

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
