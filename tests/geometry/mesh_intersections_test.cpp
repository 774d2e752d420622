// SPDX-License-Identifier: Apache-2.0
#ifdef PALPATE_WITH_CGAL

#include <palpate/geometry/mesh_intersections.h>

#include <limits>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/support/brute_force_queries.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

TriangleMesh two(const std::array<Vec3, 3>& first, const std::array<Vec3, 3>& second) {
    TriangleMesh mesh;
    for (const auto& corners : {first, second})
        mesh.vertices.insert(mesh.vertices.end(), corners.begin(), corners.end());
    mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
    return mesh;
}

constexpr Vec3 kA(0.0, 0.0, 0.0), kB(1.0, 0.0, 0.0), kC(0.0, 1.0, 0.0);

TEST(CountSelfIntersections, SoundMeshesHaveNone) {
    EXPECT_EQ(count_self_intersections({}), 0u);
    EXPECT_EQ(count_self_intersections(test::bumpy_sphere(0.05, 4)), 0u);
    EXPECT_EQ(count_self_intersections(test::plate()), 0u);
    EXPECT_EQ(count_self_intersections(test::sheet(0.06, 8)), 0u); // coplanar neighbours
}

TEST(CountSelfIntersections, SharedCornersAndSidesDoNotCountWhateverTheirIndices) {
    const TriangleMesh whole = test::icosphere(0.05, 2);
    TriangleMesh soup;
    for (const auto& t : whole.triangles)
        for (int k = 0; k < 3; ++k)
            soup.vertices.push_back(whole.vertices[t[k]]);
    for (std::uint32_t k = 0; k < soup.vertices.size(); k += 3)
        soup.triangles.push_back({k, k + 1, k + 2});
    EXPECT_EQ(count_self_intersections(soup), 0u);
}

TEST(CountSelfIntersections, TellsTouchingAtASharedPartFromCrossing) {
    const Vec3 up(0.2, 0.2, 1.0), down(0.2, 0.2, -1.0), far(0.0, 0.0, 1.0);
    EXPECT_EQ(count_self_intersections(two({kA, kB, kC}, {up, down, far})), 1u);
    // One shared corner: beside it apart, or through the triangle.
    EXPECT_EQ(count_self_intersections(two({kA, kB, kC}, {kA, up, {-1.0, -1.0, 1.0}})), 0u);
    EXPECT_EQ(count_self_intersections(two({kA, kB, kC}, {kA, up, down})), 1u);
    // One shared side: unfolded, at an angle, folded flat onto each other.
    EXPECT_EQ(count_self_intersections(two({kA, kB, kC}, {kB, kA, {0.0, -1.0, 0.0}})), 0u);
    EXPECT_EQ(count_self_intersections(two({kA, kB, kC}, {kB, kA, {0.0, 1.0, 1e-9}})), 0u);
    EXPECT_EQ(count_self_intersections(two({kA, kB, kC}, {kB, kA, {1.0, 1.0, 0.0}})), 1u);
    // All three: the same triangle twice, either way round.
    EXPECT_EQ(count_self_intersections(two({kA, kB, kC}, {kC, kB, kA})), 1u);
    // None: a corner that only touches does intersect.
    EXPECT_EQ(count_self_intersections(two({kA, kB, kC}, {Vec3(0.25, 0.25, 0.0), up, far})), 1u);
}

TEST(CountSelfIntersections, LeavesDegenerateTrianglesOut) {
    TriangleMesh mesh =
        two({kA, kB, kC}, {Vec3(0.2, 0.2, -1.0), Vec3(0.2, 0.2, 1.0), Vec3(0.2, 0.2, 0.5)});
    EXPECT_EQ(count_self_intersections(mesh), 0u);
    mesh.vertices[5].x = 0.3; // control: with an area it counts
    EXPECT_EQ(count_self_intersections(mesh), 1u);
}

TEST(CountSelfIntersections, AgreesWithRaysAlongTheSidesOfRandomTriangles) {
    for (const std::uint64_t seed : {1u, 2u}) {
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> in(-0.05, 0.05), step(-0.02, 0.02);
        TriangleMesh mesh;
        for (std::uint32_t t = 0; t < 150; ++t) {
            const Vec3 p(in(random), in(random), in(random));
            for (int k = 0; k < 3; ++k)
                mesh.vertices.push_back(p + Vec3(step(random), step(random), step(random)));
            mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
        }
        // Two triangles without common corners intersect where a side of one meets the other.
        const auto part = [&](std::size_t t) {
            return TriangleMesh{mesh.vertices, {mesh.triangles[t]}};
        };
        const auto side_meets = [&](std::size_t sides_of, std::size_t other) {
            const auto& t = mesh.triangles[sides_of];
            for (int k = 0; k < 3; ++k)
                if (test::brute_first_hit(part(other), mesh.vertices[t[k]],
                                          mesh.vertices[t[(k + 1) % 3]]))
                    return true;
            return false;
        };
        std::size_t expected = 0;
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
            for (std::size_t j = i + 1; j < mesh.triangles.size(); ++j)
                expected += side_meets(i, j) || side_meets(j, i) ? 1 : 0;
        EXPECT_GT(expected, 50u);
        EXPECT_EQ(count_self_intersections(mesh), expected) << "seed " << seed;
    }
}

TEST(CountSelfIntersections, OverlappingBallsIntersectAlongACircle) {
    TriangleMesh mesh = test::icosphere(0.05, 4);
    test::append(mesh, test::icosphere(0.05, 4, Vec3(0.03, 0.004, 0.007)));
    const std::size_t count = count_self_intersections(mesh);
    EXPECT_GT(count, 100u);
    EXPECT_EQ(count, count_self_intersections(mesh));
    std::reverse(mesh.triangles.begin(), mesh.triangles.end());
    EXPECT_EQ(count, count_self_intersections(mesh));
}

TEST(CountSelfIntersections, RefusesWhatIsNoMesh) {
    TriangleMesh mesh = test::sheet(0.06, 1);
    mesh.triangles.push_back({0, 1, 4});
    EXPECT_THROW(count_self_intersections(mesh), std::invalid_argument);
    mesh.vertices.push_back(Vec3(std::numeric_limits<double>::quiet_NaN()));
    EXPECT_THROW(count_self_intersections(mesh), std::invalid_argument);
}

} // namespace
} // namespace palpate

#endif // PALPATE_WITH_CGAL
