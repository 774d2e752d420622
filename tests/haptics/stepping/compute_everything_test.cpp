// SPDX-License-Identifier: Apache-2.0
// What a scene does not call for is left out. The referee is the same loop with
// Subdivision::compute_everything(): every bit of every frame is the same, with each method.
#include <algorithm>
#include <bit>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/stepping/subdivision.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/mesh_fuzz.h"
#include "tests/support/mesh_references.h"
#include "tests/support/odd_meshes.h"

namespace palpate {
namespace {

using Surfaces = std::vector<std::unique_ptr<SurfaceContact>>;

constexpr double kRadius_m = 0.05;
constexpr int kFrames = 1500;

/// A hand about a ball of kRadius_m: slow and fast, held still, through the middle, far away.
std::vector<Vec3> wild_hand(unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> share(0.0, 1.0);
    const auto any = [&] { return Vec3(normal(random), normal(random), normal(random)); };
    std::vector<Vec3> path;
    Vec3 at{0.0, 0.0, 1.2 * kRadius_m}, towards = at;
    while (path.size() < kFrames) {
        if (share(random) < 0.05)
            towards = (0.9 + 0.2 * share(random)) * kRadius_m * glm::normalize(any());
        if (share(random) < 0.005) at = towards = 0.03 * any();
        if (share(random) < 0.05) // held
            for (int i = 0; i < 5; ++i)
                path.push_back(at);
        const double step_m = share(random) < 0.1 ? 5e-3 : 0.2e-3;
        const Vec3 way = towards - at;
        if (glm::length(way) > step_m) at += step_m / glm::length(way) * way;
        path.push_back(at);
    }
    return path;
}

/// Also the sign of a zero.
void expect_same_bits(double a, double b) {
    ASSERT_EQ(std::bit_cast<std::uint64_t>(a), std::bit_cast<std::uint64_t>(b));
}

void expect_same(const SubdivisionResult& plain, const SubdivisionResult& all) {
    for (int axis = 0; axis < 3; ++axis)
        ASSERT_NO_FATAL_FAILURE(expect_same_bits(plain.proxy[axis], all.proxy[axis]));
    ASSERT_EQ(plain.evaluations, all.evaluations);
    ASSERT_EQ(plain.sub_steps, all.sub_steps);
    ASSERT_EQ(plain.contacts, all.contacts);
    ASSERT_NO_FATAL_FAILURE(expect_same_bits(plain.residual_m, all.residual_m));
    ASSERT_EQ(plain.flags, all.flags);
    ASSERT_EQ(plain.work, all.work);
    ASSERT_EQ(plain.felt, all.felt);
    ASSERT_EQ(plain.open, all.open);
    ASSERT_EQ(plain.guarded, all.guarded);
}

void expect_same_touches(const Subdivision& plain, const Subdivision& all) {
    TouchList a, b;
    plain.find_touches(a);
    all.find_touches(b);
    ASSERT_TRUE(a == b);
}

/// Feels `make()` twice along wild paths, with each method.
template <class Make>
void expect_the_same_bits(const Make& make, const std::vector<SurfaceFinish>& finish = {}) {
    const bool has_surfaces = !make().empty();
    for (const SteppingMethod method : {SteppingMethod::adaptive, SteppingMethod::single,
                                        SteppingMethod::fixed, SteppingMethod::paper}) {
        SteppingSettings settings;
        settings.method = method;
        settings.sub_steps = 7;
        settings.budget_us = 30.0; // of a clock that goes on by 1 us with each look
        for (unsigned seed = 1; seed <= 4; ++seed) {
            test::ContactLoop plain(settings, make(), {}, 1.0, finish);
            test::ContactLoop all(settings, make(), {}, 1.0, finish);
            all.subdivision().compute_everything();
            const std::vector<Vec3> path = wild_hand(seed);
            plain.start(path.front());
            all.start(path.front());
            for (std::size_t i = 0; i < path.size(); ++i) {
                // For a while a surface is weaker.
                const bool weaker = i >= path.size() / 2 && i < path.size() / 2 + 100;
                for (test::ContactLoop* loop : {&plain, &all})
                    if (has_surfaces)
                        loop->subdivision().gain(0, SurfacePart::strength).set(weaker ? 0.3 : 1.0);
                SCOPED_TRACE("seed " + std::to_string(seed) + ", frame " + std::to_string(i));
                const SubdivisionResult a = plain.move(path[i]), b = all.move(path[i]);
                ASSERT_NO_FATAL_FAILURE(expect_same(a, b));
                ASSERT_TRUE(
                    std::ranges::equal(plain.subdivision().path(), all.subdivision().path()));
                ASSERT_TRUE(std::ranges::equal(plain.subdivision().steps_left(),
                                               all.subdivision().steps_left()));
                ASSERT_NO_FATAL_FAILURE(
                    expect_same_touches(plain.subdivision(), all.subdivision()));
            }
        }
    }
}

TEST(ComputeEverything, HasTheBitsOfAnEmptyScene) {
    expect_the_same_bits([] { return Surfaces(); });
}

TEST(ComputeEverything, HasTheBitsOfAMesh) {
    const auto ball = test::certified(test::turned(test::icosphere(kRadius_m, 4)));
    expect_the_same_bits([&] { return test::one_mesh(ball); });
}

TEST(ComputeEverything, HasTheBitsOfACoarseMeshWithSharpEdges) {
    const auto ball = test::certified(test::icosphere(kRadius_m, 0));
    expect_the_same_bits([&] { return test::one_mesh(ball); });
}

TEST(ComputeEverything, HasTheBitsOfAMeshThatYields) {
    const auto ball = test::certified(test::turned(test::icosphere(kRadius_m, 3)));
    expect_the_same_bits([&] {
        MeshContactSettings settings;
        settings.strength_n = 1.0;
        Surfaces surfaces;
        surfaces.push_back(std::make_unique<MeshContact>(ball, settings));
        return surfaces;
    });
}

/// Facets of both orientations: only what was seen when it opened tells in front from behind.
TEST(ComputeEverything, HasTheBitsOfAMembraneOfMixedOrientation) {
    TriangleMesh mesh = test::icosphere(kRadius_m, 3);
    std::mt19937 random(7);
    for (auto& triangle : mesh.triangles)
        if (random() % 2 != 0) std::swap(triangle[0], triangle[1]);
    const auto ball = test::certified(test::turned(std::move(mesh)));
    MeshContactSettings settings;
    settings.strength_n = 1.0;
    settings.yielding = Yielding::opens;
    expect_the_same_bits([&] { return test::one_mesh(ball, settings); });
}

/// A frame's legs run out just before, at and after the one that ends its way.
TEST(ComputeEverything, HasTheBitsOfAFrameWhoseLegsRunOut) {
    constexpr double pitch_m = 5e-3;
    TriangleMesh strip;
    for (int i = 0; i <= 800; ++i)
        for (const double y_m : {-5e-3, 5e-3})
            strip.vertices.push_back({i * pitch_m, y_m, 0.0});
    for (std::uint32_t a = 0; a < 1600; a += 2) {
        strip.triangles.push_back({a, a + 2, a + 1});
        strip.triangles.push_back({a + 1, a + 2, a + 3});
    }
    const auto mesh = test::certified(std::move(strip));
    std::uint32_t flags = 0, flags_of_all = 0;
    for (const SteppingMethod method : {SteppingMethod::adaptive, SteppingMethod::fixed})
        for (double end_m = 2.5; end_m < 2.6; end_m += 0.25 * pitch_m) {
            SteppingSettings settings;
            settings.method = method;
            settings.sub_steps = 7;
            test::ContactLoop plain(settings, test::one_mesh(mesh)),
                all(settings, test::one_mesh(mesh));
            all.subdivision().compute_everything();
            for (test::ContactLoop* loop : {&plain, &all}) {
                loop->start({0.0012, 0.0003, 0.001});
                loop->move({0.0012, 0.0003, -0.001});
            }
            SCOPED_TRACE(end_m);
            const SubdivisionResult a = plain.move({end_m, 0.0003, -0.001});
            const SubdivisionResult b = all.move({end_m, 0.0003, -0.001});
            ASSERT_NO_FATAL_FAILURE(expect_same(a, b));
            flags |= a.flags;
            flags_of_all |= ~b.flags;
        }
    EXPECT_TRUE((flags & flags_of_all & kEvaluationCap) != 0) << "some run out, others do not";
}

TEST(ComputeEverything, HasTheBitsOfAMeshWithFrictionAndAMagnet) {
    const auto ball = test::certified(test::turned(test::icosphere(kRadius_m, 3)));
    SurfaceFinish finish;
    finish.friction = {0.4, 0.3};
    expect_the_same_bits([&] { return test::one_mesh(ball); }, {finish});
    finish.friction = {};
    finish.magnet.strength_n = 1.0;
    expect_the_same_bits([&] { return test::one_mesh(ball); }, {finish});
}

TEST(ComputeEverything, HasTheBitsOfALevel) {
    expect_the_same_bits([] { return test::one_surface(make_solid_sphere(kRadius_m)); });
}

} // namespace
} // namespace palpate
