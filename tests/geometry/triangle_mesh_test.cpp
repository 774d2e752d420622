// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/triangle_mesh.h>

#include <cmath>
#include <random>
#include <utility>

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

// A point above a triangle's inside is as far from it as it is high, however thin the triangle is.
// Seen with barycentric coordinates alone: 4.5 nm off on a triangle of 29 mm by 86 nm, so that a
// facet that the point was on was not the nearest.
TEST(ClosestPointOnTriangle, OnSliversIsExactToRounding) {
    std::mt19937_64 random(4);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    for (int k = 0; k < 20000; ++k) {
        const Vec3 a = random_point(random, 0.05), b = random_point(random, 0.05);
        const Vec3 aside = glm::cross(b - a, random_point(random, 1.0));
        const double width_m = 5e-4 * glm::length(b - a) * std::pow(10.0, -5.0 * share(random));
        const Vec3 c = a + share(random) * (b - a) + width_m / glm::length(aside) * aside;
        const Vec3 normal = glm::normalize(glm::cross(b - a, c - a));
        const double u = share(random), v = (1.0 - u) * share(random);
        const double height_m = k % 2 == 0 ? 0.0 : 1e-4 * share(random);
        const Vec3 p = a + u * (b - a) + v * (c - a) + height_m * normal;
        const Vec3 q = closest_point_on_triangle(p, a, b, c);
        // Roundings of positions of 0.1 m; those of the edges turn the normal by as much over the
        // width, which tilts the height.
        const double rounding_m = 1e-15 + 1e-16 * height_m / width_m;
        ASSERT_NEAR(glm::length(q - p), height_m, rounding_m) << k << ", width " << width_m;
        for (const auto& [from, to] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)})
            ASSERT_GE(glm::dot(glm::normalize(glm::cross(normal, to - from)), q - from),
                      -rounding_m)
                << k << ", width " << width_m;
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
