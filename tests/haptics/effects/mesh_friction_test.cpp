// SPDX-License-Identifier: Apache-2.0
// Coulomb friction on meshes: facet by facet, the same law as on fields.
#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/effects/coulomb_friction.h>

#include "tests/support/brute_force_queries.h"
#include "tests/support/mesh_fuzz.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

using test::certified;
using test::ContactLoop;
using test::one_mesh;

SteppingSettings precise() {
    SteppingSettings settings;
    settings.tolerance_m = 1e-12;
    settings.evaluation_cap = 60;
    return settings;
}

// A sheet of 2 x 60 x 60 facets is a plane: k (a - x) = mu k depth along the way.
TEST(MeshFriction, OverTheEdgesOfAFlatSheetTheLagIsThePlanes) {
    ContactLoop loop(precise(), one_mesh(certified(test::sheet(0.06, 60))), {}, 0.0,
                     {{{0.4, 0.4}, {}}});
    loop.start({-0.02, -0.013, 1e-3});
    loop.move({-0.02, -0.013, -2e-3});
    const Vec3 way = glm::normalize(Vec3{1.0, 0.37, 0.0});
    for (int i = 1; i <= 200; ++i) {
        const SubdivisionResult frame = loop.move(Vec3{-0.02, -0.013, -2e-3} + 0.15e-3 * i * way);
        ASSERT_EQ(frame.flags, 0u) << i;
    }
    const Vec3 expected = Vec3{-0.02, -0.013, 0.0} + (30e-3 - 0.4 * 2e-3) * way;
    EXPECT_LE(glm::length(loop.proxy() - expected), 1e-9); // 1e-6 mm
}

// On a facet of a ball or cavity, what is felt along it is mu times what is felt across it.
TEST(MeshFriction, OnAFacetTheForceIsOnTheCone) {
    constexpr double kRadius = 0.05, kMu = 0.3;
    const TriangleMesh mesh = test::icosphere(kRadius, 4);
    for (const bool inside : {true, false}) {
        ContactLoop loop(precise(), one_mesh(certified(mesh)), {}, 0.0, {{{kMu, kMu}, {}}});
        const double probe = inside ? kRadius + 2e-3 : kRadius - 2e-3;
        const auto at = [](double radius, double angle) {
            return radius * glm::normalize(Vec3{std::cos(angle), std::sin(angle), 0.21});
        };
        loop.start(at(inside ? kRadius - 2e-3 : kRadius + 2e-3, 0.0));
        int slid = 0, on_cone = 0, capped = 0;
        for (int i = 0; i < 600; ++i) {
            const Vec3 before = loop.proxy();
            const Vec3 hand = at(probe, 1e-3 * i);
            const SubdivisionResult frame = loop.move(hand);
            ASSERT_EQ(frame.flags & ~kSolverCap, 0u) << i;
            if (frame.flags & kSolverCap) ++capped;
            if (i < 100 || loop.proxy() == before || frame.contacts != 1) continue;
            // contacts == 1: a single facet; its normal is the force's cone's axis
            const auto closest = test::brute_closest_point(mesh, loop.proxy());
            const auto& t = mesh.triangles[closest->triangle];
            const Vec3 normal =
                glm::normalize(glm::cross(mesh.vertices[t[1]] - mesh.vertices[t[0]],
                                          mesh.vertices[t[2]] - mesh.vertices[t[0]]));
            const Vec3 pull = hand - loop.proxy();
            const double across = std::abs(glm::dot(pull, normal));
            const double along = glm::length(pull - glm::dot(pull, normal) * normal);
            ++slid;
            if (std::abs(along - kMu * across) < 1e-9) ++on_cone;
        }
        EXPECT_GT(slid, 100) << inside;
        EXPECT_EQ(on_cone, slid) << inside;
        EXPECT_LE(capped, 3) << inside; // of 600; halved steps alone left one in six at edges
    }
}

TEST(MeshFriction, BelowItsAngleNotOneBitMoves) {
    constexpr double kRadius = 0.05;
    ContactLoop loop({}, one_mesh(certified(test::icosphere(kRadius, 4))), {}, 0.0,
                     {{{0.5, 0.3}, {}}});
    loop.start(Vec3{0.0});
    for (int i = 0; i < 20; ++i)
        loop.move({kRadius + 2e-3, 1e-3, 0.5e-3});
    const Vec3 held = loop.proxy();
    for (int i = 0; i < 60000; ++i) {
        const double tremor = 0.2e-3 * std::sin(0.05 * i);
        loop.move({kRadius + 2e-3, 1e-3 + tremor, 0.5e-3 - 0.5 * tremor});
        ASSERT_EQ(loop.proxy(), held) << i;
    }
}

} // namespace
} // namespace palpate
