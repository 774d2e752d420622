// SPDX-License-Identifier: Apache-2.0
// A frame's work is one budget: evaluations, bends, friction's rounds and solver passes alike.
#include <algorithm>
#include <limits>
#include <memory>
#include <random>

#include <gtest/gtest.h>

#include <palpate/haptics/contact/direct_contact.h>
#include <palpate/haptics/contact/mesh_contact.h>
#include <palpate/haptics/effects/vector_follow.h>
#include <palpate/haptics/effects/workspace.h>
#include <palpate/haptics/stepping/frame_flags.h>
#include <palpate/volume/fields/analytic_fields.h>
#include <palpate/volume/fields/grid_vector_field.h>
#include <palpate/volume/vector_field.h>

#include "tests/support/contact_loop.h"
#include "tests/support/effect_lists.h"
#include "tests/support/held_scenes.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

/// The budget of a frame, and what its last evaluation may go beyond it: itself, and one
/// round of the fewest passes, up to 16 more of them to end a step, over all primitives.
std::uint32_t most_work(int evaluation_cap) {
    constexpr int kPasses = CoulombFriction::kLeastPasses + 16;
    return static_cast<std::uint32_t>(
        Subdivision::kWorkOfSolvers + 3 * Subdivision::kWorkOfEvaluation * evaluation_cap +
        Subdivision::kWorkOfEvaluation + kPasses * static_cast<int>(PrimitiveSet::kCapacity));
}

/// Fibres of no order at all, on a grid of 2 mm.
std::shared_ptr<const VectorField> tangled_fibres() {
    VectorVolume volume;
    volume.size = {20, 20, 20};
    volume.index_to_scene = {Mat3(2e-3), Vec3(-19e-3)};
    std::mt19937 random(3);
    std::normal_distribution<float> one;
    for (int i = 0; i < 3 * 8000; ++i)
        volume.values.push_back(one(random));
    return std::make_shared<GridVectorField>(volume, VectorSense::axial);
}

// The worst that was found: friction on facets that are slivers, under a guide that leads across
// them. Each edge may cost an evaluation of many rounds.
TEST(FrameWork, FrictionOnSliversUnderAGuideIsBounded) {
    TriangleMesh mesh = test::icosphere(12e-3, 3);
    for (Vec3& vertex : mesh.vertices)
        vertex.z *= 0.03;
    const auto certified =
        std::make_shared<CertifiedMesh>(std::make_shared<const TriangleMesh>(mesh));
    const auto fibres = tangled_fibres();
    for (const int cap : {8, 49}) {
        SteppingSettings settings;
        settings.evaluation_cap = cap;
        std::vector<std::unique_ptr<SurfaceContact>> surfaces;
        surfaces.push_back(std::make_unique<MeshContact>(certified, MeshContactSettings{}));
        SurfaceFinish finish;
        finish.friction = {3.4, 1.8, false};
        test::ContactLoop loop(
            settings, std::move(surfaces),
            test::effects(std::make_unique<VectorFollow>(fibres, TransferFunction::constant(0.13),
                                                         FollowGuide::midpoint)),
            0.0, {finish});
        loop.start({0, 0, 3e-3});
        int spent = 0;
        for (int i = 0; i < 3000; ++i) {
            const double t = 1e-3 * i;
            const SubdivisionResult frame = loop.move(
                {13e-3 * std::cos(9.0 * t), 13e-3 * std::sin(7.0 * t), 2e-3 * std::sin(31.0 * t)});
            ASSERT_LE(frame.work, most_work(cap)) << "cap " << cap << ", frame " << i;
            if (frame.work < most_work(cap) - 2000) continue;
            ++spent;
            EXPECT_TRUE(frame.flags & (kEvaluationCap | kSolverCap)) << i;
        }
        RecordProperty("spent_at_" + std::to_string(cap), spent);
    }
}

TEST(FrameWork, AnyMixOfEffectsIsWithinTheBudget) {
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
        test::HeldScene scene = test::HeldSceneDraw(seed).scene();
        test::ScriptedClock clock(0.0);
        const int cap = scene.stepping.evaluation_cap;
        EXPECT_LE(test::hold(scene, 200, clock).most_work, most_work(cap)) << scene.words;
    }
}

// Where hard planes leave little room, solutions take many passes: a workspace's wall, the cut way
// along a fibre and a rubbing ball. At the end of the budget the solver has a pass or two for each
// solution, which is millimetres off, and a thousand small sub-steps led along them into the ball.
TEST(FrameWork, WhatTheSolverHadNoTimeForLeadsIntoNothing) {
    constexpr double kBall = 9.2e-3;
    SteppingSettings settings;
    settings.method = SteppingMethod::fixed;
    settings.sub_steps = 1245;
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    const TriangleMesh mesh = test::icosphere(kBall, 3);
    surfaces.push_back(std::make_unique<DirectContact>(
        std::make_shared<const SurfaceScene>(std::make_shared<const TriangleMesh>(mesh)),
        make_solid_sphere(kBall), LevelSettings{}));
    SurfaceFinish finish;
    finish.friction = {0.887, 0.758, false};
    test::ContactLoop loop(
        settings, std::move(surfaces),
        test::effects(std::make_unique<VectorFollow>(make_helix(9.09e-3, 10.53e-3),
                                                     TransferFunction::constant(1.21)),
                      std::make_unique<WorkspaceSphere>(Vec3(-1.22e-3, -2.90e-3, -1.47e-3), 10.6e-3,
                                                        std::numeric_limits<double>::infinity())),
        0.0, {finish});
    loop.start({-6.39e-3, 10.38e-3, -15.80e-3});
    int spent = 0;
    constexpr double kWithin = 0.05e-3; // m: facets are up to 0.042 mm within the ball
    // Far outside of the workspace, from one side to another.
    for (const Vec3& probe_mm :
         {Vec3(-6.4, 10.4, -15.8), Vec3(-22.9, -17.4, -15.3), Vec3(2.6, 15.9, -2.4),
          Vec3(-5.4, 16.7, 6.0), Vec3(12.3, 18.7, -17.6), Vec3(13.4, -9.1, 6.4),
          Vec3(8.8, -18.1, -8.3), Vec3(-0.7, -14.5, 20.5)}) {
        const SubdivisionResult frame = loop.move(1e-3 * probe_mm, 1e-4);
        EXPECT_LE(frame.work, most_work(settings.sub_steps)) << probe_mm.x;
        if (frame.flags & kSolverCap) ++spent;
        EXPECT_GE(glm::length(loop.proxy()), kBall - kWithin) << probe_mm.x;
    }
    EXPECT_GT(spent, 0);
}

} // namespace
} // namespace palpate
