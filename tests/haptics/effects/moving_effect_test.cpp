// SPDX-License-Identifier: Apache-2.0
// What is added in the frame of a body, as the scene has it.
#include <palpate/haptics/effects/moving_effect.h>

#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/geometry/rigid_pose.h>
#include <palpate/haptics/contact/moving_contact.h>
#include <palpate/haptics/contact/volume_contact.h>
#include <palpate/haptics/effects/gradient_surface.h>
#include <palpate/haptics/solver/primitives.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/contact_loop.h"

namespace palpate {
namespace {

constexpr double kRounding = 1e-14; // of places below 1 m and forces below 10 N

const RigidMap kBody(RigidPose{{0.1, -0.2, 0.3},
                               glm::angleAxis(0.7, glm::normalize(Vec3{1.0, -2.0, 0.5}))});

PrimitiveSet with_all(const RigidMap& map) {
    PrimitiveSet set;
    set.add({map.point({0.01, 0.02, 0.03}), map.direction({0, 0, 1}), 2.0});
    set.add_line({map.point({0.03, 0.01, 0.0}), map.direction({0, 1, 0}), 1.0});
    set.add_point({map.point({0.0, 0.04, 0.01}), 0.5});
    set.add_force(map.direction({1.0, -2.0, 3.0}));
    set.add_spring(map.point({0.05, 0.0, 0.02}), 40.0);
    set.add_spring(map.point({-0.05, 0.01, 0.0}), 10.0);
    return set;
}

TEST(PrimitiveSet, WhatIsAddedInABodysFrameIsAsIfAddedInTheScenes) {
    const PrimitiveSet expected = with_all(kBody);
    PrimitiveSet set;
    const PrimitiveSet::Before before = set.enter(kBody);
    const PrimitiveSet in_body = with_all(RigidMap{});
    set = in_body;
    set.leave(kBody, before, 0.75);
    EXPECT_EQ(set.lines()[0].strength_n, 0.75); // of 1 N
    EXPECT_EQ(set.points()[0].strength_n, 0.5);
    EXPECT_LT(glm::length(set.planes()[0].anchor - expected.planes()[0].anchor), kRounding);
    EXPECT_LT(glm::length(set.planes()[0].normal - expected.planes()[0].normal), kRounding);
    EXPECT_EQ(set.planes()[0].strength_n, 0.75); // of 2 N
    EXPECT_LT(glm::length(set.lines()[0].anchor - expected.lines()[0].anchor), kRounding);
    EXPECT_LT(glm::length(set.lines()[0].axis - expected.lines()[0].axis), kRounding);
    EXPECT_LT(glm::length(set.points()[0].anchor - expected.points()[0].anchor), kRounding);
    EXPECT_LT(glm::length(set.force() - expected.force()), kRounding);
    const Vec3 probe{0.02, 0.03, -0.01};
    EXPECT_LT(glm::length(set.pull(probe, 500.0) - expected.pull(probe, 500.0)), kRounding);
}

TEST(PrimitiveSet, InABodysFrameDrawsAsSeenFromThere) {
    PrimitiveSet set = with_all(RigidMap{});
    const Vec3 probe{0.02, 0.03, -0.01};
    const Vec3 pull = set.pull(probe, 500.0);
    const Vec3 anchor = set.planes()[0].anchor;
    const Vec3 force = set.force();
    const PrimitiveSet::Before before = set.enter(kBody);
    EXPECT_LT(glm::length(kBody.point(set.pull(kBody.point_back(probe), 500.0)) - pull), kRounding);
    set.leave(kBody, before, 1.0);
    // What was there before keeps its bits, where nothing is added.
    EXPECT_EQ(set.planes()[0].anchor, anchor);
    EXPECT_EQ(set.force(), force);
    EXPECT_EQ(set.pull(probe, 500.0), pull);
}

TEST(MovingEffect, RefusesNoEffect) {
    struct Still : MovingSurface {
        void set_pose(const RigidPose&) noexcept override {}
        bool begin_motion() noexcept override { return false; }
        double turn_left() const noexcept override { return 0.0; }
        void try_pose(double) noexcept override {}
        Vec3 along(const Vec3& proxy) noexcept override { return proxy; }
        PlanePrimitive along(const PlanePrimitive& plane) const noexcept override { return plane; }
        bool goes_along(const Vec3&, const Vec3&) noexcept override { return true; }
        Chord carry_relative(const Vec3&, const Vec3&) noexcept override { return {1.0, false}; }
        void take_pose(const Vec3&) noexcept override {}
        bool restart_at(const RigidPose&, const Vec3&) noexcept override { return false; }
        const RigidPose& pose() const noexcept override { return pose_; }
        Vec3 to_body(const Vec3& scene) const noexcept override { return scene; }
        RigidPose pose_;
    } body;
    EXPECT_THROW(MovingEffect(nullptr, body), std::invalid_argument);
}

// A wall through the proxy that comes along with its body pushes a hand that is held.
TEST(MovingEffect, CarriesAProxyThatItHoldsByAPlaneThroughIt) {
    for (const SteppingMethod method : {SteppingMethod::adaptive, SteppingMethod::fixed}) {
        const std::shared_ptr<const ScalarField> field = make_solid_sphere(1e-3);
        auto contact = std::make_unique<MovingContact>(
            std::make_unique<VolumeContact>(field, LevelSettings{}));
        MovingContact& body = *contact;
        std::vector<std::unique_ptr<SurfaceContact>> surfaces;
        surfaces.push_back(std::move(contact));
        std::vector<std::unique_ptr<Effect>> effects;
        effects.push_back(std::make_unique<MovingEffect>(
            std::make_unique<GradientSurface>(field, TransferFunction::constant(0.5)), body));
        SteppingSettings settings;
        settings.method = method;
        test::ContactLoop loop(settings, std::move(surfaces), std::move(effects));
        const Vec3 hand{0.06, 0, 0};
        loop.start(hand);
        loop.move(hand);
        for (int frame = 1; frame <= 10; ++frame) {
            body.set_pose({Vec3{0.05e-3 * frame, 0, 0}});
            loop.move(hand);
            EXPECT_NEAR(loop.proxy().x - hand.x, 0.05e-3 * frame, 1e-9) << frame;
        }
    }
}

} // namespace
} // namespace palpate
