// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/surface_seeds.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include <palpate/geometry/triangle_grid.h>

#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

std::size_t seeds_within(const std::vector<Vec3>& seeds, const Vec3& center, double radius) {
    return static_cast<std::size_t>(std::count_if(seeds.begin(), seeds.end(), [&](const Vec3& p) {
        return glm::length(p - center) <= radius;
    }));
}

TEST(ChooseSeeds, LargeComponentIsThinnedToItsFacets) {
    const TriangleMesh mesh = test::icosphere(0.05, 6);
    const auto seeds = choose_seeds(mesh, 2e-3, 40);
    // A surface of area A meets about 1.5 A / side^2 cubes (Crofton), here 9700; those that it only
    // touches with a corner may hold no vertex of the preview. No vertex is farther than a cube's
    // diagonal from a seed.
    const double cubes = 1.5 * 0.0314159 / std::pow(2.2e-3, 2);
    EXPECT_LT(static_cast<double>(seeds.size()), 1.02 * cubes);
    EXPECT_GT(static_cast<double>(seeds.size()), 0.75 * cubes);
    for (std::size_t v = 0; v < mesh.vertices.size(); v += 97)
        EXPECT_GE(seeds_within(seeds, mesh.vertices[v], std::sqrt(3.0) * 2.2e-3), 1u);
    EXPECT_EQ(choose_seeds(mesh, 2e-3, 40), seeds);
}

TEST(ChooseSeeds, SmallComponentsGetFortyOrAllTheyHave) {
    TriangleMesh mesh = test::icosphere(0.05, 4);
    const Vec3 small(0.1, 0.0, 0.0), tiny(0.2, 0.0, 0.0), dust(0.3, 0.0, 0.0);
    test::append(mesh, test::icosphere(0.001, 4, small)); // 2562 vertices within one cube
    test::append(mesh, test::icosphere(0.001, 1, tiny));  // 42 vertices, 80 triangles
    test::append(mesh, test::icosphere(0.001, 0, dust));  // 12 vertices, 20 triangles
    const auto seeds = choose_seeds(mesh, 2e-3, 40);
    EXPECT_GE(seeds_within(seeds, small, 0.002), 40u);
    EXPECT_LT(seeds_within(seeds, small, 0.002), 400u);
    EXPECT_GE(seeds_within(seeds, tiny, 0.002), 40u);
    EXPECT_EQ(seeds_within(seeds, dust, 0.002), 0u);
    EXPECT_EQ(seeds_within(choose_seeds(mesh, 2e-3, 20), dust, 0.002), 12u);
}

TEST(ChooseSeeds, ThinSheetKeepsBothFaces) {
    TriangleMesh mesh = test::sheet(0.06, 60);
    test::append(mesh, test::moved(test::reversed(test::sheet(0.06, 60)), Vec3(0.0, 0.0, -0.0003)));
    for (auto& triangle : mesh.triangles) // one component
        for (auto& vertex : triangle)
            if (vertex == 61 * 61) vertex = 0;
    const auto seeds = choose_seeds(test::moved(mesh, Vec3(0.0, 0.0, 0.001)), 2e-3, 40);
    const auto upper =
        std::count_if(seeds.begin(), seeds.end(), [](const Vec3& p) { return p.z > 0.00085; });
    EXPECT_GT(upper, 600);
    EXPECT_NEAR(static_cast<double>(upper), static_cast<double>(seeds.size()) / 2.0, 30.0);
}

TEST(ChooseSeeds, BadArgumentsAreRefused) {
    const TriangleMesh mesh = test::icosphere(0.05, 1);
    EXPECT_THROW(choose_seeds(mesh, 0.0, 40), std::invalid_argument);
    EXPECT_THROW(choose_seeds(mesh, std::nan(""), 40), std::invalid_argument);
    EXPECT_THROW(choose_seeds({{}, {{0, 1, 2}}}, 2e-3, 40), std::invalid_argument);
    EXPECT_TRUE(choose_seeds({}, 2e-3, 40).empty());
}

TEST(MissingComponents, OfTwoSpheresTheOneLeftOutIsNamed) {
    const Vec3 aside(0.2, 0.0, 0.0);
    TriangleMesh preview = test::icosphere(0.03, 4);
    test::append(preview, test::icosphere(0.05, 4, aside));
    // The meshes are other triangulations of the same spheres.
    TriangleMesh mesh = test::icosphere(0.03, 5);
    const auto missing = missing_components(preview, mesh, 40, 2e-3);
    ASSERT_EQ(missing.size(), 1u);
    EXPECT_EQ(missing[0].covered, 0.0);
    EXPECT_EQ(missing[0].component.triangles, 5120u);
    EXPECT_NEAR(missing[0].component.bounds.center().x, 0.2, 1e-3);
    EXPECT_NEAR(glm::length(missing[0].component.sample - aside), 0.05, 1e-12);

    test::append(mesh, test::icosphere(0.05, 5, aside));
    EXPECT_TRUE(missing_components(preview, mesh, 40, 2e-3).empty());
    EXPECT_EQ(missing_components(mesh, test::icosphere(0.05, 4, aside), 40, 2e-3).size(), 1u);
}

TEST(MissingComponents, SmallOnesDoNotCount) {
    TriangleMesh preview = test::icosphere(0.03, 3);
    test::append(preview, test::icosphere(0.001, 0, Vec3(0.1, 0.0, 0.0)));
    EXPECT_TRUE(missing_components(preview, test::icosphere(0.03, 4), 40, 2e-3).empty());
    EXPECT_EQ(missing_components(preview, test::icosphere(0.03, 4), 20, 2e-3).size(), 1u);
}

// A void of 1.6 mm right under the outer surface: everything of it is within a facet size of the
// outer surface.
TEST(MissingComponents, VoidNextToAWallIsNotTakenForIt) {
    const TriangleMesh outer = test::icosphere(0.03, 5);
    TriangleMesh preview = outer;
    test::append(preview, test::reversed(test::icosphere(0.0008, 2, Vec3(0.0289, 0.0, 0.0))));
    ASSERT_EQ(missing_components(preview, outer, 40, 2e-3).size(), 1u);
    EXPECT_TRUE(missing_components(preview, preview, 40, 2e-3).empty());
}

TEST(MissingComponents, TheOtherFaceOfASheetIsNoCounterpart) {
    TriangleMesh preview = test::sheet(0.06, 30);
    test::append(preview,
                 test::moved(test::reversed(test::sheet(0.06, 30)), Vec3(0.0, 0.0, -0.0003)));
    const auto missing = missing_components(preview, test::sheet(0.06, 20), 40, 2e-3);
    ASSERT_EQ(missing.size(), 1u);
    EXPECT_LT(missing[0].component.sample.z, 0.0);
}

TEST(MissingComponents, OfAnEmptyMeshAreAll) {
    EXPECT_EQ(missing_components(test::icosphere(0.05, 2), {}, 1, 2e-3).size(), 1u);
    EXPECT_TRUE(missing_components({}, test::icosphere(0.05, 2), 1, 2e-3).empty());
    EXPECT_THROW(missing_components({}, {}, 1, -1.0), std::invalid_argument);
}

// Some 1e7 cubes of 1 mm are in the box of each triangle of such an icosahedron.
TEST(MissingComponents, LargeTrianglesAreMatchedWithinASmallTolerance) {
    const TriangleMesh mesh = test::icosphere(0.3, 0);
    EXPECT_TRUE(missing_components(mesh, mesh, 20, 1e-3).empty());
    const TriangleMesh aside = test::moved(mesh, Vec3(0.02, 0.0, 0.0));
    EXPECT_EQ(missing_components(mesh, aside, 20, 1e-3).size(), 1u);
}

/// What a TriangleGrid is asked, of all triangles one by one.
bool any_facing(const TriangleMesh& mesh, const Vec3& p, const Vec3& direction, double radius) {
    return std::any_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& t) {
        const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
        return glm::dot(glm::cross(b - a, c - a), direction) > 0.0 &&
               squared_length(closest_point_on_triangle(p, a, b, c) - p) <= radius * radius;
    });
}

// The last triangle is that of a file in mm taken for one in metres: 3e16 cubes of its box.
TEST(TriangleGrid, OfSmallAndLargeTrianglesAnswersAsAllOfThemOneByOne) {
    constexpr double kSide = 1e-3;
    TriangleMesh mesh = test::icosphere(0.02, 2);
    const auto small = static_cast<std::uint32_t>(mesh.triangles.size());
    for (const double length : {0.3, 300.0}) {
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        for (const Vec3& corner : {Vec3(0.1, 0.0, -0.2), Vec3(1.1, 0.2, 0.8), Vec3(0.3, 1.0, 0.5)})
            mesh.vertices.push_back(length * corner);
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    const TriangleGrid grid(mesh, kSide);

    SCOPED_TRACE("seed 23");
    std::mt19937_64 random(23);
    std::uniform_real_distribution<double> share(0.0, 1.0), sign(-1.0, 1.0);
    std::uniform_int_distribution<std::uint32_t> any_small(0, small - 1);
    const auto vector = [&] {
        const double x = sign(random), y = sign(random), z = sign(random);
        return Vec3(x, y, z);
    };
    int found_near_small = 0, found_near_large = 0;
    constexpr int kQueries = 3000;
    for (int n = 0; n < kQueries; ++n) {
        const bool is_small = n % 3 == 0; // else one of the two large ones
        const auto& t = mesh.triangles[is_small ? any_small(random) : small + n % 3 - 1];
        const double u = share(random), v = (1.0 - u) * share(random);
        const Vec3 on =
            (1.0 - u - v) * mesh.vertices[t[0]] + u * mesh.vertices[t[1]] + v * mesh.vertices[t[2]];
        const Vec3 p = on + 2.0 * kSide * vector(), direction = vector();
        const double radius = kSide * share(random);
        const bool expected = any_facing(mesh, p, direction, radius);
        ASSERT_EQ(grid.has_facing(p, direction, radius), expected) << "query " << n;
        (is_small ? found_near_small : found_near_large) += expected ? 1 : 0;
    }
    // Some of each answer: distances are up to 2 mm, radii up to 1 mm, half of them face away.
    EXPECT_GT(found_near_small, 100);
    EXPECT_GT(found_near_large, 100);
    EXPECT_LT(found_near_small + found_near_large, kQueries / 2);
}

} // namespace
} // namespace palpate
