// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/internal/finger_proxy.h>

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "tests/engine/study/study_fixture.h"

namespace palpate::internal {
namespace {

constexpr double kSide_m = 0.1;
// A contact leaves the clearance, and up to two planes are met at slopes of 45 degrees and more.
constexpr double kClose_m = 3.0 * kFacetClearance_m;

/// Open: the planes z = 0, y = 0 and x = 0 of a corner whose free space is x, y, z > 0; the first
/// `count` of them.
std::unique_ptr<Baseline> corner(int count) {
    auto mesh = std::make_shared<TriangleMesh>();
    for (int axis = 2; axis > 2 - count; --axis) {
        const auto first = static_cast<std::uint32_t>(mesh->vertices.size());
        for (const double u : {-kSide_m, kSide_m})
            for (const double v : {-kSide_m, kSide_m}) {
                Vec3 vertex(0.0);
                vertex[(axis + 1) % 3] = u;
                vertex[(axis + 2) % 3] = v;
                mesh->vertices.push_back(vertex);
            }
        mesh->triangles.push_back({first, first + 2, first + 1});
        mesh->triangles.push_back({first + 1, first + 2, first + 3});
    }
    return make_finger_proxy(std::make_shared<const SurfaceScene>(std::move(mesh)));
}

TEST(FingerProxy, IsHeldByOneTwoAndThreeFacets) {
    const Vec3 probe{-0.004, -0.006, -0.005};
    for (const int planes : {1, 2, 3}) {
        const auto proxy = corner(planes);
        proxy->restart({0.02, 0.03, 0.025});
        const Baseline::Step step = proxy->move(probe);
        EXPECT_TRUE(step.touches);
        for (int axis = 0; axis < 3; ++axis)
            EXPECT_NEAR(step.proxy[axis], axis > 2 - planes ? 0.0 : probe[axis], kClose_m)
                << planes << " planes, axis " << axis;
    }
}

TEST(FingerProxy, SlidesOnAPlateAndLetsGo) {
    const auto proxy = corner(1);
    proxy->restart({0.0, 0.0, 1e-3});
    for (int i = 1; i <= 100; ++i) {
        const Vec3 probe{2e-4 * i, -1e-4 * i, -2e-3};
        const Baseline::Step step = proxy->move(probe);
        EXPECT_TRUE(step.touches) << i;
        EXPECT_GT(step.proxy.z, 0.0) << i;
        EXPECT_NEAR(glm::length(step.proxy - Vec3(probe.x, probe.y, 0.0)), 0.0, kClose_m) << i;
    }
    const Vec3 away{0.0, 0.0, 0.01};
    const Baseline::Step step = proxy->move(away);
    EXPECT_FALSE(step.touches);
    EXPECT_EQ(step.proxy, away);
}

TEST(FingerProxy, NeverLeavesAClosedMesh) {
    const auto mesh = std::make_shared<const TriangleMesh>(test::study::ball(3));
    const auto proxy = make_finger_proxy(std::make_shared<const SurfaceScene>(mesh));
    proxy->restart({0.0, 0.0, 0.0});
    std::mt19937 random(1);
    std::uniform_real_distribution<double> anywhere(-2.0, 2.0);
    for (int i = 0; i < 2000; ++i) {
        const Vec3 probe =
            test::study::kRadius_m * Vec3(anywhere(random), anywhere(random), anywhere(random));
        // Its facets lie within the sphere through its vertices.
        ASSERT_LT(glm::length(proxy->move(probe).proxy), test::study::kRadius_m) << i;
    }
}

TEST(FingerProxy, CountsARayForEachPartOfItsWay) {
    const auto proxy = corner(3);
    proxy->restart({0.02, 0.03, 0.025});
    proxy->move({0.01, 0.01, 0.01});
    EXPECT_EQ(proxy->samples(), 1u) << "free";
    proxy->move({-0.004, -0.006, -0.005});
    EXPECT_EQ(proxy->samples(), 4u) << "a facet at the end of each of three parts";
}

} // namespace
} // namespace palpate::internal
