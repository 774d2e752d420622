// SPDX-License-Identifier: Apache-2.0
// Two soft bodies side by side: one surface around both is felt as one, two surfaces are not
// (docs/palpation.md, "What lies beneath").
#include <palpate/haptics/contact/mesh_contact.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/contact_kinds.h"
#include "tests/support/contact_loop.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

using test::ContactLoop;

constexpr double kK = ContactLoop::kStiffness;
constexpr double kStiffness = 200.0; // N/m
constexpr double kDeep = 4e-3;       // m
constexpr double kBeyond = 12e-3;    // of the border, m

/// 40 mm wide and 20 mm deep, its top at z = 0.
std::unique_ptr<SurfaceContact> box(double from_x, double to_x) {
    return std::make_unique<MeshContact>(
        test::certified(test::box_mesh({from_x, -20e-3, -20e-3}, {to_x, 20e-3, 0.0})),
        MeshContactSettings{});
}

/// The forces of a probe that is pressed in on one side and drawn over the border at x = 0.
std::vector<Vec3> drawn_over(std::vector<std::unique_ptr<SurfaceContact>> surfaces) {
    SurfaceFinish soft;
    soft.softness = Softness::linear(kStiffness);
    const std::vector<SurfaceFinish> finish(surfaces.size(), soft);
    ContactLoop loop({}, std::move(surfaces), {}, 0.0, finish);
    loop.start({-kBeyond, 0.0, 1e-3});
    for (int i = 0; i <= 40; ++i)
        loop.move({-kBeyond, 0.0, -1e-4 * i});
    std::vector<Vec3> forces;
    for (int i = 0; i <= 240; ++i) {
        const Vec3 probe{-kBeyond + 1e-4 * i, 0.0, -kDeep};
        loop.move(probe);
        forces.push_back(kK * (loop.proxy() - probe));
    }
    return forces;
}

TEST(SoftBorder, OneSurfaceAroundTwoBodiesPushesUpwardsAllTheWay) {
    std::vector<std::unique_ptr<SurfaceContact>> whole;
    whole.push_back(box(-30e-3, 30e-3));
    for (const Vec3& force : drawn_over(std::move(whole)))
        EXPECT_LE(glm::length(force - Vec3{0.0, 0.0, kStiffness * kDeep}), 1e-9);
}

// The control. Beyond the border the first body lets go, and the second holds its front where the
// probe came in: at its side.
TEST(SoftBorder, TwoSurfacesPushSideways) {
    std::vector<std::unique_ptr<SurfaceContact>> split;
    split.push_back(box(-30e-3, 0.0));
    split.push_back(box(0.0, 30e-3));
    const std::vector<Vec3> forces = drawn_over(std::move(split));
    EXPECT_LE(glm::length(forces.front() - Vec3{0.0, 0.0, kStiffness * kDeep}), 1e-4);
    EXPECT_NEAR(forces.back().x, -kStiffness * kBeyond, 1e-3);
    EXPECT_NEAR(forces.back().z, 0.0, 1e-3);
}

} // namespace
} // namespace palpate
