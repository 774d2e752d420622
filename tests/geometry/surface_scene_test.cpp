// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/surface_scene.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/geometry/random_geometry.h"
#include "tests/support/brute_force_queries.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

using test::random_direction;
using test::random_point;
using test::scene_of;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Work {
    const char* name;
    TriangleMesh mesh;
    Vec3 center;
};

std::vector<Work> works() {
    const Vec3 far(10.0, -10.0, 10.0);
    return {{"sphere", test::icosphere(0.05, 3), Vec3{0.0}},
            {"plate", test::plate(), Vec3{0.0}},
            {"bumpy sphere", test::bumpy_sphere(0.05, 3), Vec3{0.0}},
            {"sheet", test::sheet(0.08, 10), Vec3{0.0}},
            {"far bumpy sphere", test::bumpy_sphere(0.05, 3, 0.1, 7.0, far), far}};
}

/// Segments of all lengths from 1 nm to the whole scene: half of them start within 1 um of the
/// surface.
void random_segment(std::mt19937_64& random, const Work& work, Vec3& from, Vec3& to) {
    std::uniform_real_distribution<double> exponent(-9.0, -0.7);
    from = work.center + random_point(random, 0.07);
    if (random() % 2 == 0) {
        const Vec3& on = work.mesh.vertices[random() % work.mesh.vertices.size()];
        const Vec3& other = work.mesh.vertices[random() % work.mesh.vertices.size()];
        from = on + 1e-4 * (other - on) + 1e-6 * random_direction(random);
    }
    to = from + std::pow(10.0, exponent(random)) * random_direction(random);
}

// Of what the twin finds, everything that is clear of an edge and of the segment's ends by more
// than rounding must be found, and what is found must be there.
TEST(FirstHit, AgreesWithTryingEveryTriangle) {
    for (const Work& work : works()) {
        const SurfaceScene scene = scene_of(work.mesh);
        // Grazing planes move a crossing along the segment by rounding over the sine of the angle:
        // 1e4 roundings is a margin that leaves out less than one in a thousand.
        const double room = 1e4 * scene.query_error_m();
        for (const std::uint64_t seed : {11u, 12u}) {
            SCOPED_TRACE(testing::Message() << work.name << ", seed " << seed);
            std::mt19937_64 random(seed);
            int hits = 0, unclear = 0;
            for (int k = 0; k < 3000; ++k) {
                Vec3 from, to;
                random_segment(random, work, from, to);
                const auto hit = scene.first_hit(from, to);
                const auto sure = test::brute_first_hit(work.mesh, from, to, -room);
                const auto possible = test::brute_first_hit(work.mesh, from, to, room);
                if (!possible) {
                    ASSERT_FALSE(hit) << "segment " << k;
                    continue;
                }
                if (!sure || sure->triangle != possible->triangle) {
                    ++unclear;
                    continue;
                }
                ++hits;
                ASSERT_TRUE(hit) << "segment " << k;
                ASSERT_EQ(hit->triangle, sure->triangle) << "segment " << k;
                ASSERT_NEAR(hit->distance_m, sure->distance, room) << "segment " << k;
                ASSERT_LE(glm::length(hit->position - sure->position), room) << "segment " << k;
                const auto& t = work.mesh.triangles[hit->triangle];
                ASSERT_LE(glm::length(hit->normal - triangle_normal(work.mesh.vertices[t[0]],
                                                                    work.mesh.vertices[t[1]],
                                                                    work.mesh.vertices[t[2]])),
                          1e-15);
            }
            EXPECT_GT(hits, 300);
            EXPECT_LT(unclear, 20);
        }
    }
}

TEST(FirstHit, LiesOnTheTriangleAndOnTheSegment) {
    for (const Work& work : works()) {
        SCOPED_TRACE(work.name);
        const SurfaceScene scene = scene_of(work.mesh);
        std::mt19937_64 random(21);
        for (int k = 0; k < 20000; ++k) {
            Vec3 from, to;
            random_segment(random, work, from, to);
            const auto hit = scene.first_hit(from, to);
            if (!hit) continue;
            const auto& t = work.mesh.triangles[hit->triangle];
            const Vec3& a = work.mesh.vertices[t[0]];
            // A few roundings of coordinates of this size.
            ASSERT_LE(std::abs(glm::dot(hit->position - a, hit->normal)),
                      4.0 * scene.query_error_m());
            const double length = glm::length(to - from);
            ASSERT_GE(hit->distance_m, 0.0);
            ASSERT_LE(hit->distance_m, length);
            const Vec3 on_segment = from + hit->distance_m / length * (to - from);
            ASSERT_LE(glm::length(hit->position - on_segment), 8.0 * scene.query_error_m());
        }
    }
}

// Embree's own triangles, ROBUST, missed 0.6 % of these.
TEST(FirstHit, ClosedMeshIsTightAtVerticesAndEdges) {
    for (const Vec3& center : {Vec3{0.0}, Vec3(10.0, -10.0, 10.0)}) {
        const TriangleMesh mesh = test::bumpy_sphere(0.05, 5, 0.1, 7.0, center);
        const SurfaceScene scene = scene_of(mesh);
        std::mt19937_64 random(31);
        std::uniform_real_distribution<double> share(0.0, 1.0);
        for (int k = 0; k < 100000; ++k) {
            const auto& t = mesh.triangles[random() % mesh.triangles.size()];
            const Vec3& a = mesh.vertices[t[0]];
            const Vec3& b = mesh.vertices[t[1]];
            const Vec3 aim = k % 2 == 0 ? a : a + share(random) * (b - a);
            const Vec3 from = center + random_point(random, 0.01);
            // Ends as little as 1 um behind the aim: the box's own rounding must not cut it off.
            const double beyond = k % 3 == 0 ? 1e-6 : 0.1;
            const Vec3 to = aim + beyond * glm::normalize(aim - from);
            ASSERT_TRUE(scene.first_hit(from, to)) << "segment " << k;
            ASSERT_TRUE(scene.first_hit(to, from)) << "segment " << k;
        }
    }
}

TEST(FirstHit, WalkThroughAClosedMeshAlternatesBetweenItsFaces) {
    const TriangleMesh mesh = test::bumpy_sphere(0.05, 4, 0.3, 9.0);
    const SurfaceScene scene = scene_of(mesh);
    std::mt19937_64 random(41);
    for (int k = 0; k < 2000; ++k) {
        Vec3 from = 0.2 * random_direction(random);
        const Vec3 to = -0.2 * random_direction(random);
        const Vec3 direction = glm::normalize(to - from);
        bool inside = false;
        while (const auto hit = scene.first_hit(from, to)) {
            const bool entering = glm::dot(hit->normal, direction) < 0.0;
            ASSERT_NE(entering, inside) << "line " << k;
            inside = entering;
            from = hit->position + 1e-12 * direction;
        }
        ASSERT_FALSE(inside) << "line " << k;
    }
}

TEST(FirstHit, EndsAtTheSurfaceToRounding) {
    const SurfaceScene scene = scene_of(test::sheet(0.08, 7));
    const Vec3 above(0.0101, 0.0203, 0.001);
    const auto end_at = [&](double z) { return scene.first_hit(above, {above.x, above.y, z}); };
    EXPECT_FALSE(end_at(100.0 * scene.query_error_m()));
    EXPECT_TRUE(end_at(0.0));
    EXPECT_TRUE(end_at(-100.0 * scene.query_error_m()));
    EXPECT_NEAR(end_at(-1.0)->distance_m, 0.001, 1e-15);
    EXPECT_FALSE(scene.first_hit({above.x, above.y, -100.0 * scene.query_error_m()},
                                 {above.x, above.y, -1.0}));
}

TEST(FirstHit, OfEqualTrianglesIsTheLowest) {
    TriangleMesh mesh = test::sheet(0.08, 4);
    const std::size_t once = mesh.triangles.size();
    test::append(mesh, test::sheet(0.08, 4));
    const SurfaceScene scene = scene_of(mesh);
    std::mt19937_64 random(51);
    for (int k = 0; k < 5000; ++k) {
        Vec3 from = random_point(random, 0.035);
        from.z = 0.01;
        EXPECT_LT(scene.first_hit(from, {from.x, from.y, -0.01})->triangle, once);
        EXPECT_LT(scene.closest_point(from, 1.0)->triangle, once);
    }
    // Straight at a vertex of six triangles: every one of them is met at the same distance.
    const auto hit = scene.first_hit({0.0, 0.0, 0.01}, {0.0, 0.0, -0.01});
    std::uint32_t lowest = 0;
    while (mesh.triangles[lowest][0] != 12 && mesh.triangles[lowest][1] != 12 &&
           mesh.triangles[lowest][2] != 12)
        ++lowest;
    EXPECT_EQ(hit->triangle, lowest);
}

TEST(FirstHit, StartsAnywhereInRange) {
    const SurfaceScene scene = scene_of(test::plate());
    const auto hit = scene.first_hit({0.001, 0.002, 1e6}, {0.001, 0.002, -1e6});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->position.z, 0.0005, 1e-15);
    EXPECT_NEAR(hit->distance_m, 1e6, 1.0);
    EXPECT_FALSE(scene.first_hit({0.1, 0.002, 1e6}, {0.1, 0.002, -1e6}));
}

TEST(SurfaceScene, OddArgumentsGiveNothing) {
    const SurfaceScene scene = scene_of(test::icosphere(0.05, 2));
    const Vec3 good(0.2, 0.0, 0.0), origin(0.0);
    for (const double odd : {kNan, kInfinity, -kInfinity, 1e300, -1e300, 1e18, 1.0001e6})
        for (int axis = 0; axis < 3; ++axis) {
            Vec3 bad(0.01);
            bad[axis] = odd;
            EXPECT_FALSE(scene.first_hit(bad, origin)) << odd;
            EXPECT_FALSE(scene.first_hit(origin, bad)) << odd;
            EXPECT_FALSE(scene.closest_point(bad, 1.0)) << odd;
        }
    for (const double radius : {kNan, kInfinity, -kInfinity, 0.0, -1.0, 1e300, 1.0001e6})
        EXPECT_FALSE(scene.closest_point(good, radius)) << radius;
    EXPECT_FALSE(scene.first_hit(good, good));
    EXPECT_FALSE(scene.first_hit(origin, {1e-320, 0.0, 0.0}));
    EXPECT_FALSE(scene.first_hit(origin, {1e-200, 1e-200, 0.0}));
    EXPECT_TRUE(scene.first_hit(good, origin));
    EXPECT_TRUE(scene.closest_point(good, 1e6));
    static_assert(noexcept(scene.first_hit(good, good))&& noexcept(scene.closest_point(good, 1.0)));
}

TEST(ClosestPoint, AgreesWithTryingEveryTriangle) {
    for (const Work& work : works()) {
        const SurfaceScene scene = scene_of(work.mesh);
        for (const std::uint64_t seed : {61u, 62u}) {
            SCOPED_TRACE(testing::Message() << work.name << ", seed " << seed);
            std::mt19937_64 random(seed);
            std::uniform_real_distribution<double> exponent(-8.0, 0.0);
            int found = 0;
            for (int k = 0; k < 2000; ++k) {
                Vec3 p, ignored;
                random_segment(random, work, p, ignored);
                const double radius = std::pow(10.0, exponent(random));
                const auto hit = scene.closest_point(p, radius);
                const auto twin = test::brute_closest_point(work.mesh, p);
                // Both compute distances from coordinates rounded like the scene's.
                const double room = 4.0 * scene.query_error_m();
                if (twin->distance > radius + room) {
                    ASSERT_FALSE(hit) << "point " << k;
                    continue;
                }
                if (twin->distance > radius - room) continue;
                ++found;
                ASSERT_TRUE(hit) << "point " << k;
                ASSERT_NEAR(hit->distance_m, twin->distance, room) << "point " << k;
                const auto& t = work.mesh.triangles[hit->triangle];
                const Vec3 again =
                    closest_point_on_triangle(p, work.mesh.vertices[t[0]], work.mesh.vertices[t[1]],
                                              work.mesh.vertices[t[2]]);
                ASSERT_EQ(hit->position, again) << "point " << k;
            }
            EXPECT_GT(found, 500);
        }
    }
}

// The same function on every triangle: bit for bit the same answer, with the lowest id where
// distances are equal.
TEST(ClosestPoint, IsExactlyTheBestOfAllTriangles) {
    for (const Work& work : works()) {
        SCOPED_TRACE(work.name);
        const SurfaceScene scene = scene_of(work.mesh);
        std::mt19937_64 random(71);
        for (int k = 0; k < 1000; ++k) {
            Vec3 p, ignored;
            random_segment(random, work, p, ignored);
            if (k % 4 == 0) p = work.center; // the same distance from many triangles
            if (k % 4 == 1) p = work.mesh.vertices[random() % work.mesh.vertices.size()];
            double best = kInfinity;
            std::uint32_t triangle = 0;
            for (std::uint32_t i = 0; i < work.mesh.triangles.size(); ++i) {
                const auto& t = work.mesh.triangles[i];
                const Vec3 q =
                    closest_point_on_triangle(p, work.mesh.vertices[t[0]], work.mesh.vertices[t[1]],
                                              work.mesh.vertices[t[2]]);
                if (squared_length(q - p) < best) {
                    best = squared_length(q - p);
                    triangle = i;
                }
            }
            const auto hit = scene.closest_point(p, 1.0);
            ASSERT_TRUE(hit);
            ASSERT_EQ(hit->distance_m, std::sqrt(best)) << "point " << k;
            ASSERT_EQ(hit->triangle, triangle) << "point " << k;
        }
    }
}

TEST(ClosestPoint, FarAwayIsFoundWithinItsRadiusOnly) {
    const SurfaceScene scene = scene_of(test::icosphere(0.05, 3));
    const Vec3 p(1000.0, 0.0, 0.0);
    EXPECT_FALSE(scene.closest_point(p, 999.9));
    const auto hit = scene.closest_point(p, 1001.0);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->distance_m, 999.95, 1e-3); // chord error of the mesh
}

TEST(SurfaceScene, DegenerateTrianglesAreNotThereAndIdsStay) {
    TriangleMesh mesh = test::icosphere(0.05, 3);
    TriangleMesh odd{mesh.vertices, {}};
    std::vector<std::uint32_t> now_at;
    for (const auto& t : mesh.triangles) {
        odd.triangles.push_back({t[0], t[0], t[1]});
        now_at.push_back(static_cast<std::uint32_t>(odd.triangles.size()));
        odd.triangles.push_back(t);
    }
    const SurfaceScene plain = scene_of(mesh), scene = scene_of(odd);
    std::mt19937_64 random(81);
    for (int k = 0; k < 2000; ++k) {
        const Vec3 to = 0.2 * random_direction(random);
        const auto expected = plain.first_hit({0, 0, 0}, to),
                   found = scene.first_hit({0, 0, 0}, to);
        ASSERT_TRUE(expected && found);
        ASSERT_EQ(found->triangle, now_at[expected->triangle]);
        ASSERT_EQ(found->position, expected->position);
        ASSERT_EQ(scene.closest_point(to, 1.0)->triangle,
                  now_at[plain.closest_point(to, 1.0)->triangle]);
    }
}

TEST(SurfaceScene, TheSameMeshGivesTheSameBits) {
    const TriangleMesh mesh = test::bumpy_sphere(0.05, 5);
    const SurfaceScene one = scene_of(mesh), other = scene_of(mesh);
    std::mt19937_64 random(91);
    for (int k = 0; k < 20000; ++k) {
        const Vec3 aim = mesh.vertices[random() % mesh.vertices.size()];
        const auto first = one.first_hit({0, 0, 0}, 2.0 * aim),
                   second = other.first_hit({0, 0, 0}, 2.0 * aim);
        ASSERT_TRUE(first && second);
        ASSERT_EQ(first->triangle, second->triangle);
        ASSERT_EQ(first->position, second->position);
        ASSERT_EQ(first->distance_m, second->distance_m);
    }
}

// What a query leaves out is as if it were not there: the twin is a mesh without it.
TEST(SurfaceScene, ExceptedTrianglesAreNotMet) {
    const TriangleMesh mesh = test::bumpy_sphere(0.05, 3);
    const SurfaceScene scene = scene_of(mesh);
    std::mt19937_64 random(92);
    for (int k = 0; k < 50; ++k) {
        const Vec3 to = 0.07 * random_direction(random);
        const auto first = scene.first_hit(-to, to);
        ASSERT_TRUE(first);
        TriangleMesh rest = mesh;
        const Vec3 far{0.09, 0.09, 0.09}; // a triangle out of the way keeps the others' numbers
        const auto v = static_cast<std::uint32_t>(rest.vertices.size());
        rest.vertices.insert(rest.vertices.end(), {far, 1.01 * far, far + Vec3{0.001, 0, 0}});
        rest.triangles[first->triangle] = {v, v + 1, v + 2};
        const std::uint32_t except[] = {first->triangle};
        const auto second = scene.first_hit(-to, to, {except, {}});
        const auto expected = test::brute_first_hit(rest, -to, to);
        ASSERT_TRUE(second && expected);
        ASSERT_EQ(second->triangle, expected->triangle);
    }
}

// A crack of 5 nm between two triangles is closed when both are widened, and only then; a line
// along the plane, a hair above, meets neither.
TEST(SurfaceScene, WideningClosesCracks) {
    const double crack = 5e-9;
    TriangleMesh mesh;
    for (const double side : {-1.0, 1.0}) {
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        mesh.vertices.push_back({side * 0.5 * crack, -0.05, 0});
        mesh.vertices.push_back({side * 0.5 * crack, 0.05, 0});
        mesh.vertices.push_back({side * 0.05, 0, 0});
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    const SurfaceScene scene = scene_of(mesh);
    EXPECT_GT(2.0 * scene.widening_m(), crack);
    const std::uint8_t both[] = {1, 1};
    std::mt19937_64 random(93);
    for (int k = 0; k < 1000; ++k) {
        const double y = 0.04 * (random_point(random, 1.0).y);
        const Vec3 from = Vec3{0, y, 0} + random_point(random, 0.02) + Vec3{0, 0, 0.021};
        const Vec3 to = Vec3{0, 2.0 * y, 0} - from; // through the middle of the crack
        ASSERT_FALSE(scene.first_hit(from, to));
        ASSERT_TRUE(scene.first_hit(from, to, {{}, both}));
        const Vec3 above{0, 0, scene.widening_m() * 0.01};
        ASSERT_FALSE(
            scene.first_hit(above - Vec3{0.04, 0, 0}, above + Vec3{0.04, 0, 0}, {{}, both}));
    }
}

TEST(SurfaceScene, TrianglesNearIncludeAllWithin) {
    const TriangleMesh mesh = test::bumpy_sphere(0.05, 4);
    const SurfaceScene scene = scene_of(mesh);
    std::mt19937_64 random(94);
    std::vector<std::uint32_t> found{1, 2, 3};
    for (int k = 0; k < 100; ++k) {
        const Vec3 point = random_point(random, 0.06);
        const double radius = 0.02 * std::abs(random_point(random, 1.0).x);
        scene.triangles_near(point, radius, found);
        for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
            const auto& t = mesh.triangles[i];
            const Vec3 q = closest_point_on_triangle(point, mesh.vertices[t[0]],
                                                     mesh.vertices[t[1]], mesh.vertices[t[2]]);
            if (glm::length(q - point) > radius) continue;
            ASSERT_EQ(std::count(found.begin(), found.end(), i), 1);
        }
    }
    scene.triangles_near({0, 0, kNan}, 1.0, found);
    EXPECT_TRUE(found.empty());
}

TEST(SurfaceScene, PairsNearAreAllWithinReachOnce) {
    // Sheets that are a little nearer to each other than it looks, a strip of triangles without
    // area, and a piece that is out of reach.
    TriangleMesh mesh = test::bumpy_sphere(0.05, 3);
    const double near_m = scene_of(mesh).near_m();
    const TriangleMesh sheet = test::sheet(0.02, 4);
    for (const double height : {0.0, 0.99 * near_m, 0.01})
        test::append(mesh, test::moved(sheet, {0.0, 0.0, 0.03 + height}));
    mesh.triangles.push_back({0, 1, 1});
    const SurfaceScene scene = scene_of(mesh);

    std::mutex mutex;
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> found;
    scene.for_pairs_near([&](std::uint32_t a, std::uint32_t b) {
        const std::lock_guard lock(mutex);
        ++found[{a, b}];
    });
    for (const auto& [pair, times] : found) {
        ASSERT_EQ(times, 1);
        ASSERT_LT(pair.first, pair.second);
    }
    const auto box = [&](std::uint32_t t) {
        Box result;
        for (const std::uint32_t v : mesh.triangles[t])
            result.add(mesh.vertices[v]);
        return result;
    };
    const auto last = static_cast<std::uint32_t>(mesh.triangles.size() - 1); // without area
    std::size_t near = 0;
    for (std::uint32_t a = 0; a < last; ++a)
        for (std::uint32_t b = a + 1; b < last; ++b) {
            const Box s = box(a), t = box(b);
            const Vec3 gap = glm::max(glm::max(s.lower - t.upper, t.lower - s.upper), 0.0);
            if (std::max({gap.x, gap.y, gap.z}) > near_m) continue;
            ASSERT_TRUE(found.contains({a, b})) << a << " " << b;
            ++near;
        }
    EXPECT_GT(near, mesh.triangles.size());
    EXPECT_LT(found.size(), near + near / 10) << "a few more";
    for (const auto& [pair, times] : found)
        EXPECT_NE(pair.second, last);
}

TEST(SurfaceScene, UnusableMeshesAreRefused) {
    EXPECT_THROW(SurfaceScene(nullptr), std::invalid_argument);
    EXPECT_THROW(scene_of({}), std::invalid_argument);
    for (const double odd : {kNan, kInfinity, 1e300}) {
        TriangleMesh mesh = test::plate();
        mesh.vertices[3].y = odd;
        EXPECT_THROW(scene_of(mesh), std::invalid_argument) << odd;
    }
    TriangleMesh unknown = test::plate();
    unknown.triangles[5][1] = 8;
    EXPECT_THROW(scene_of(unknown), std::invalid_argument);
    EXPECT_THROW(scene_of({{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}}), std::invalid_argument);
}

TEST(SurfaceScene, QueryErrorIsRounding) {
    EXPECT_LT(scene_of(test::icosphere(0.05, 2)).query_error_m(), 1e-15);
    const Vec3 far(10.0, -10.0, 10.0);
    EXPECT_LT(scene_of(test::icosphere(0.05, 2, far)).query_error_m(), 1e-13);
}

} // namespace
} // namespace palpate
