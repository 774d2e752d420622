// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/coarse_mesh.h>

#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

constexpr double kRadius_m = 0.05;

TEST(CoarseMesh, HasAtMostSoManyTrianglesAndNotMuchFewer) {
    const TriangleMesh fine = test::icosphere(kRadius_m, 6); // 81,920 triangles
    for (const std::size_t most : {100u, 1000u, 10'000u, 40'000u}) {
        const TriangleMesh coarse = coarse_mesh(fine, most);
        EXPECT_LE(coarse.triangles.size(), most);
        EXPECT_GE(coarse.triangles.size(), most / 2) << "of " << most;
    }
}

TEST(CoarseMesh, StaysWithinACellOfTheSphere) {
    // Means of points that are at most sqrt(3) cells apart: of a sphere's cap, its sagitta inside.
    const TriangleMesh coarse = coarse_mesh(test::icosphere(kRadius_m, 6), 10'000);
    for (const Vec3& vertex : coarse.vertices) {
        EXPECT_LE(glm::length(vertex), kRadius_m * (1.0 + 1e-12));
        EXPECT_GE(glm::length(vertex), 0.99 * kRadius_m);
    }
    // Seen from outside nearly all are still counter-clockwise: means may change places.
    std::size_t turned_over = 0;
    for (const auto& [a, b, c] : coarse.triangles) {
        const Vec3 normal = glm::cross(coarse.vertices[b] - coarse.vertices[a],
                                       coarse.vertices[c] - coarse.vertices[a]);
        turned_over += glm::dot(normal, coarse.vertices[a]) < 0.0 ? 1 : 0;
    }
    EXPECT_LT(turned_over, coarse.triangles.size() / 200);
}

TEST(CoarseMesh, IsTheMeshItselfWhereThatIsSmall) {
    const TriangleMesh fine = test::icosphere(kRadius_m, 2);
    EXPECT_EQ(coarse_mesh(fine, 320).triangles, fine.triangles);
    EXPECT_TRUE(coarse_mesh({}, 10).triangles.empty());
    EXPECT_THROW(coarse_mesh(fine, 0), std::invalid_argument);
}

TEST(QuantisedMesh, IsWrongByHalfAStepAtMost) {
    const TriangleMesh mesh = test::icosphere(kRadius_m, 4);
    const Box box = box_of(mesh);
    const QuantisedMesh numbers = quantised(mesh, box);
    ASSERT_EQ(numbers.positions.size(), 3 * mesh.vertices.size());
    ASSERT_EQ(numbers.indices.size(), 3 * mesh.triangles.size());
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
        for (int axis = 0; axis < 3; ++axis) {
            const double step = box.extent()[axis] / 65535.0;
            const double at =
                box.lower[axis] + step * numbers.positions[3 * i + static_cast<std::size_t>(axis)];
            EXPECT_NEAR(at, mesh.vertices[i][axis], 0.5 * step * (1.0 + 1e-9));
        }
}

} // namespace
} // namespace palpate
