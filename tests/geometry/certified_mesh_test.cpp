// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/certified_mesh.h>

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <palpate/geometry/internal/triangle_distance.h>

#include "tests/support/odd_meshes.h"

namespace palpate {
namespace {

std::size_t uncertain(TriangleMesh mesh) {
    return CertifiedMesh(std::make_shared<const TriangleMesh>(std::move(mesh))).uncertain_count();
}

Vec3 random_point(std::mt19937_64& random) {
    std::uniform_real_distribution<double> in(-1.0, 1.0);
    const double x = in(random), y = in(random), z = in(random);
    return {x, y, z};
}

// Twin: the closest point of a dense net of points of one triangle to the other. The net's own
// spacing is how much farther it may find it.
TEST(TriangleDistance, IsThatOfDenseSamples) {
    std::mt19937_64 random(5);
    int touching = 0;
    for (int i = 0; i < 300; ++i) {
        const Vec3 apart = 0.7 * random_point(random);
        const internal::Corners3 s{random_point(random), random_point(random),
                                   random_point(random)};
        const internal::Corners3 t{random_point(random) + apart, random_point(random) + apart,
                                   random_point(random) + apart};
        constexpr int kCuts = 60;
        double sampled = 10.0;
        for (int u = 0; u <= kCuts; ++u)
            for (int v = 0; u + v <= kCuts; ++v) {
                const Vec3 p =
                    s.a + (double(u) / kCuts) * (s.b - s.a) + (double(v) / kCuts) * (s.c - s.a);
                sampled =
                    std::min(sampled, glm::length(closest_point_on_triangle(p, t.a, t.b, t.c) - p));
            }
        const double spacing = std::max(glm::length(s.b - s.a), glm::length(s.c - s.a)) / kCuts;
        const double distance = internal::triangle_distance(s, t);
        ASSERT_LE(distance, sampled + 1e-15);
        ASSERT_GE(distance, sampled - 2.0 * spacing);
        ASSERT_NEAR(distance, internal::triangle_distance(t, s), 1e-15);
        if (distance < 1e-14) ++touching;
    }
    EXPECT_GT(touching, 30); // some of them do intersect
}

// What a plane tells apart is apart, by the distances that it stands for; and of what is clearly
// apart it tells most, else it would save nothing.
TEST(TriangleDistance, WhatIsToldApartIs) {
    std::mt19937_64 random(6);
    constexpr double kRounding = 1e-14; // of triangles of size 1
    struct Count {
        int told = 0, apart = 0;
    } anywhere, at_corner, at_edge;
    const auto count = [&](Count& of, bool told, double distance, double gap) {
        if (told) {
            ASSERT_GE(distance, gap - kRounding);
        }
        of.told += told ? 1 : 0;
        of.apart += distance >= gap ? 1 : 0;
    };
    for (int i = 0; i < 20000; ++i) {
        const double gap = std::pow(10.0, -1.0 - 5.0 * std::abs(random_point(random).x));
        const Vec3 apart = 1.5 * random_point(random);
        const internal::Corners3 s{random_point(random), random_point(random),
                                   random_point(random)};
        internal::Corners3 t{random_point(random) + apart, random_point(random) + apart,
                             random_point(random) + apart};
        count(anywhere, internal::told_apart(s, t, gap), internal::triangle_distance(s, t), gap);
        t.a = s.a;
        const double at_a = std::min(internal::segment_triangle_distance(s.b, s.c, t),
                                     internal::segment_triangle_distance(t.b, t.c, s));
        count(at_corner, internal::told_apart_at_corner(s, t, gap), at_a, gap);
        t.b = s.b;
        const auto to = [](const Vec3& p, const internal::Corners3& of) {
            return glm::length(closest_point_on_triangle(p, of.a, of.b, of.c) - p);
        };
        const bool told = internal::told_apart_at_edge(s.a, s.b, s.c, t.c, gap);
        count(at_edge, told, std::min(to(s.c, t), to(t.c, s)), gap);
    }
    EXPECT_GT(anywhere.told, 0.8 * anywhere.apart);
    EXPECT_GT(at_corner.told, 0.25 * at_corner.apart);
    EXPECT_GT(at_edge.told, 0.3 * at_edge.apart) << "half of them open by more than a right angle";
    EXPECT_GT(anywhere.apart, 5000);
}

// Twin: every pair of facets whose boxes are near, looked at by their distances alone.
TEST(CertifiedMesh, FacetsThatShareNothingAreFoundByTheirDistance) {
    TriangleMesh mesh = test::bumpy_sphere(0.03, 2);
    test::append(mesh, test::moved(test::turned(test::bumpy_sphere(0.03, 2)), {0.03, 0.01, 0.0}));
    const CertifiedMesh certified(std::make_shared<const TriangleMesh>(mesh));
    const auto corners = [&](std::uint32_t f) {
        return internal::Corners3{certified.topology().corner(f, 0),
                                  certified.topology().corner(f, 1),
                                  certified.topology().corner(f, 2)};
    };
    // The two are closed and apart but where they intersect: there all that is uncertain is.
    std::size_t in_the_way = 0;
    const auto half = static_cast<std::uint32_t>(mesh.triangles.size() / 2);
    std::vector<bool> met(mesh.triangles.size(), false);
    for (std::uint32_t f = 0; f < half; ++f)
        for (std::uint32_t g = half; g < mesh.triangles.size(); ++g)
            if (internal::triangle_distance(corners(f), corners(g)) < certified.clearance_m())
                met[f] = met[g] = true;
    for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
        ASSERT_EQ(certified.certified(f), !met[f]) << f;
        in_the_way += met[f] ? 1 : 0;
    }
    EXPECT_GT(in_the_way, 20u);
}

TEST(CertifiedMesh, SurfacesWithRoomAroundThemAre) {
    EXPECT_EQ(uncertain(test::icosphere(0.05, 5)), 0u);
    EXPECT_EQ(uncertain(test::turned(test::icosphere(0.05, 5))), 0u);
    EXPECT_EQ(uncertain(test::spiky_ball(0.04, 3, 0.3, 1)), 0u);
    EXPECT_EQ(uncertain(test::plate()), 0u);
    EXPECT_EQ(uncertain(test::knife(0.03, 0.001, 7)), 0u);
    EXPECT_EQ(uncertain(test::sheet(0.05, 10)), 0u);
    EXPECT_EQ(uncertain(test::turned(test::sheet(0.05, 10))), 0u) << "one plane, and rounding";
    EXPECT_EQ(uncertain(test::turned(test::plate())), 0u);
    EXPECT_EQ(uncertain(test::partly_reversed(test::icosphere(0.05, 3))), 0u);
}

TEST(CertifiedMesh, WhatIntersectsOrHangsLooseIsNot) {
    TriangleMesh two = test::icosphere(0.03, 3, {-0.015, 0, 0});
    test::append(two, test::icosphere(0.03, 3, {0.015, 0.001, 0.002}));
    const CertifiedMesh mesh(std::make_shared<const TriangleMesh>(two));
    EXPECT_GT(mesh.uncertain_count(), 50u);
    for (std::uint32_t f = 0; f < two.triangles.size(); ++f) {
        if (mesh.certified(f)) continue;
        // The spheres meet in a circle; its facets, about 4 mm large, are those concerned.
        const Vec3 p = mesh.topology().corner(f, 0);
        const double to_first = std::abs(glm::length(p - Vec3{-0.015, 0, 0}) - 0.03);
        const double to_second = std::abs(glm::length(p - Vec3{0.015, 0.001, 0.002}) - 0.03);
        EXPECT_LT(std::max(to_first, to_second), 0.005);
    }
    const TriangleMesh ball = test::icosphere(0.04, 3);
    EXPECT_EQ(uncertain(test::soup(ball, 5e-9)), ball.triangles.size());
    EXPECT_GE(uncertain(test::with_t_junctions(ball, 100)), 300u);
    EXPECT_EQ(uncertain(test::wedges_on_one_edge(0.03)), 8u);
}

TEST(CertifiedMesh, TheClearanceDecides) {
    const TriangleMesh sheet = test::sheet(0.06, 3);
    const double clearance =
        CertifiedMesh(std::make_shared<const TriangleMesh>(sheet)).clearance_m();
    for (const double gap : {0.9, 1.1}) {
        TriangleMesh pair = sheet;
        test::append(pair, test::moved(sheet, {0, 0, gap * clearance}));
        EXPECT_EQ(uncertain(pair), gap < 1.0 ? pair.triangles.size() : 0u) << gap;
    }
}

// Edges that hang loose look like borders, where both sides can be reached: nothing certified may
// have them.
TEST(CertifiedMesh, NoCertifiedFacetHasAVertexAtAFalseBorder) {
    const CertifiedMesh mesh(std::make_shared<const TriangleMesh>(
        test::with_t_junctions(test::icosphere(0.04, 3), 100)));
    for (std::uint32_t f = 0; f < mesh.topology().facet_count(); ++f)
        for (std::uint8_t k = 0; mesh.certified(f) && k < 3; ++k) {
            Fan fan;
            ASSERT_TRUE(mesh.topology().fan(f, 1, k, fan));
            for (std::size_t i = 0; i < fan.size(); ++i)
                ASSERT_FALSE(mesh.topology().is_border(fan[i].facet, fan[i].exit_edge));
        }
}

TEST(CertifiedMesh, LengthsFollowTheSize) {
    const auto at = [](double radius, const Vec3& center) {
        return CertifiedMesh(
            std::make_shared<const TriangleMesh>(test::icosphere(radius, 2, center)));
    };
    EXPECT_NEAR(at(0.05, Vec3{0.0}).skin_m(), 16 * std::ldexp(1.0, -28), 1e-15); // 16 ulp of 0.05
    EXPECT_NEAR(at(0.05, Vec3{0.0}).tolerance_m(), 1e-12, 1e-15);
    EXPECT_GT(at(0.05, {10, 0, 0}).tolerance_m(), 1e-12) << "rounding is larger far out";
    EXPECT_NEAR(at(5.0, Vec3{0.0}).tolerance_m(), 1e-10, 1e-13);
}

// Else a proxy that is within the tolerance of the skin would be at the facets.
TEST(CertifiedMesh, TheSkinIsWiderThanTheToleranceWhereverTheMeshIs) {
    for (const double radius : {1e-5, 5e-5, 1e-3, 0.05, 5.0})
        for (const double away : {0.0, 1.0, 100.0, 1e4, 9e5}) {
            const CertifiedMesh mesh(
                std::make_shared<const TriangleMesh>(test::icosphere(radius, 1, {away, 0, 0})));
            EXPECT_GE(mesh.skin_m(), 4.0 * mesh.tolerance_m()) << radius << " at " << away;
        }
}

TEST(CertifiedMesh, AVertexOfNoTriangleChangesNoLength) {
    TriangleMesh mesh = test::icosphere(5e-5, 1);
    const CertifiedMesh alone(std::make_shared<const TriangleMesh>(mesh));
    mesh.vertices.push_back({1000.0, 0.0, 0.0});
    const CertifiedMesh with(std::make_shared<const TriangleMesh>(mesh));
    EXPECT_EQ(with.skin_m(), alone.skin_m());
    EXPECT_EQ(with.tolerance_m(), alone.tolerance_m());
}

} // namespace
} // namespace palpate
