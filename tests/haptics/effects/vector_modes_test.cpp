// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/effects/vector_follow.h>
#include <palpate/haptics/effects/vector_force.h>
#include <palpate/haptics/effects/vector_sheet.h>
#include <palpate/haptics/stepping/frame_flags.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/contact_loop.h"
#include "tests/support/effect_lists.h"
#include "tests/support/formula_fields.h"

namespace palpate {
namespace {

using test::ContactLoop;
using test::effects;
using test::FormulaVectorField;
using test::stepping;

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kRadius = 0.02; // of the helix, m
constexpr double kRise = 0.005;  // of the helix, m per radian
constexpr double kOutside = 0.002;
constexpr double kTau = 2.0 * std::numbers::pi;

/// Unit vectors away from the origin; their fronts are spheres.
std::shared_ptr<const VectorField> radial() {
    return std::make_shared<FormulaVectorField>([](const Vec3& p) {
        const double r = glm::length(p);
        const Vec3 u = p / r;
        return VectorSample{u, (Mat3(1.0) - glm::outerProduct(u, u)) / r, r > 1e-3};
    });
}

/// A stiff rotation about z, with a flow along it: unit angular velocity.
std::shared_ptr<const VectorField> whirl(double along) {
    return std::make_shared<FormulaVectorField>([along](const Vec3& p) {
        return VectorSample{{-p.y, p.x, along}, Mat3{{0, 1, 0}, {-1, 0, 0}, {0, 0, 0}}, true};
    });
}

// The implicit midpoint rule keeps quadratic invariants: (x' - x0).(x' + x0) = 0. What is left of a
// frame is by how much its end differs from the one that the normal was taken for. A flat sheet
// errs by d / R of the step, h = 0.23 mm, at a depth d of 2 mm: 23 um. Each guess and evaluation
// leaves d / 2R = 0.05 of that: 2.9 nm after two more guesses and an evaluation. It turns the
// normal by half of that over R, and moves the proxy off by that times h: 17 pm.
constexpr double kSheetDrift = 2e-11; // m a frame

TEST(VectorSheet, FrontsOfARadialFieldAreSpheres) {
    ContactLoop loop(stepping(SteppingMethod::adaptive), {},
                     effects(std::make_unique<VectorSheet>(
                         radial(), TransferFunction::constant(kInfinite), SheetKind::front)));
    loop.start({kRadius, 0, 0});
    std::uint32_t most = 0;
    for (int i = 1; i <= 1000; ++i) {
        const double angle = 0.01 * i;
        const double depth = kOutside * std::sin(0.05 * i); // to either side
        const SubdivisionResult result =
            loop.move((kRadius + depth) * Vec3{std::cos(angle), std::sin(angle), 0.0} +
                      Vec3{0, 0, 0.01 * std::sin(0.003 * i)});
        most = std::max(most, result.evaluations);
        ASSERT_LE(std::abs(glm::length(loop.proxy()) - kRadius), i * kSheetDrift) << i;
    }
    EXPECT_LE(most, 3u);
}

TEST(VectorSheet, AVortexIsFeltAsTubesAroundItsAxis) {
    ContactLoop loop(stepping(SteppingMethod::adaptive), {},
                     effects(std::make_unique<VectorSheet>(
                         whirl(0.01), TransferFunction::constant(kInfinite), SheetKind::vortex)));
    loop.start({kRadius, 0, 0});
    for (int i = 1; i <= 1000; ++i) {
        const double angle = 0.01 * i;
        const double depth = kOutside * std::sin(0.05 * i);
        const Vec3 probe{(kRadius + depth) * std::cos(angle), (kRadius + depth) * std::sin(angle),
                         1e-4 * i};
        loop.move(probe);
        const Vec3& x = loop.proxy();
        ASSERT_LE(std::abs(std::hypot(x.x, x.y) - kRadius), i * kSheetDrift) << i;
        ASSERT_NEAR(x.z, probe.z, 1e-7) << "along the axis it is free, to the loop's tolerance";
    }
}

TEST(VectorSheet, ThereIsNoTubeWithoutRotation) {
    for (const auto& field : {radial(), std::shared_ptr<const VectorField>(whirl(0.01))}) {
        ContactLoop loop(stepping(SteppingMethod::adaptive), {},
                         effects(std::make_unique<VectorSheet>(
                             field, TransferFunction::constant(1.0), SheetKind::vortex)));
        loop.start({0, 0, 0.02}); // on the axis of the whirl: v and its rotation are parallel
        loop.move({0.003, 0.002, 0.02});
        EXPECT_EQ(loop.proxy(), Vec3(0.003, 0.002, 0.02));
    }
}

TEST(VectorSheet, YieldsToEitherSideAboveItsStrength) {
    constexpr double kStrength = 0.4; // N: 0.8 mm at 500 N/m
    for (double side : {-1.0, 1.0})
        for (double depth : {5e-4, 2e-3}) {
            ContactLoop loop(
                stepping(SteppingMethod::adaptive), {},
                effects(std::make_unique<VectorSheet>(
                    radial(), TransferFunction::constant(kStrength), SheetKind::front)));
            loop.start({kRadius, 0, 0});
            loop.move({kRadius + side * depth, 0, 0});
            const double lag = std::min(depth, kStrength / ContactLoop::kStiffness);
            EXPECT_NEAR(loop.proxy().x, kRadius + side * (depth - lag), 1e-15);
        }
}

// s(g) = g s for g >= 1: the same problem, and the same guesses of where it leads.
TEST(VectorSheet, AGainIsAFactorOfItsStrengthForEachMethod) {
    constexpr double kStrength = 0.5, kGain = 2.0;
    for (const SteppingMethod method :
         {SteppingMethod::single, SteppingMethod::fixed, SteppingMethod::adaptive}) {
        const auto sheet = [&](double strength_n) {
            return ContactLoop(
                stepping(method), {},
                effects(std::make_unique<VectorSheet>(
                    radial(), TransferFunction::constant(strength_n), SheetKind::front)));
        };
        ContactLoop raised = sheet(kStrength), strong = sheet(kGain * kStrength);
        raised.subdivision().gain(0).set(kGain);
        raised.start({kRadius, 0, 0});
        strong.start({kRadius, 0, 0});
        for (int i = 1; i <= 200; ++i) { // up to 4 mm before it: it yields from 2 mm on
            const double angle = 0.01 * i;
            const Vec3 probe =
                (kRadius + 4e-3 * std::sin(0.05 * i)) * Vec3{std::cos(angle), std::sin(angle), 0.0};
            raised.move(probe);
            strong.move(probe);
            ASSERT_EQ(raised.proxy(), strong.proxy()) << i;
        }
    }
}

TEST(VectorForce, CarriesAlongTheVectorByItsStrength) {
    const TransferFunction strength{{{{0.0, 0.0}, {0.02, 1.0}}}, 2}; // N over m/s
    ContactLoop loop(stepping(SteppingMethod::adaptive), {},
                     effects(std::make_unique<VectorForce>(whirl(0.0), strength)));
    loop.start({0.01, 0, 0}); // v = (0, 0.01, 0): 0.5 N, 1 mm
    loop.move({0.01, 0, 0});
    EXPECT_LE(glm::length(loop.proxy() - Vec3(0.01, 1e-3, 0)), 1e-17);
}

// A held probe: whatever primitives are at the proxy vanish there, so to stay would cost no more
// than where it goes (numerics 1.2): the spring's energy never rises, but for rounding.
TEST(VectorModes, AHeldProbesSpringNeverGainsEnergy) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> one(-1.0, 1.0);
    const std::shared_ptr<const VectorField> helix = make_helix(kRadius, kTau * kRise);
    const auto effect = [&](int kind, double strength_n) -> std::unique_ptr<Effect> {
        const TransferFunction strength = TransferFunction::constant(strength_n);
        switch (kind) {
        case 0:
            return std::make_unique<VectorFollow>(helix, strength, FollowGuide::tangent);
        case 1:
            return std::make_unique<VectorFollow>(helix, strength, FollowGuide::midpoint);
        case 2:
            return std::make_unique<VectorFollow>(helix, strength, FollowGuide::streamline);
        case 3:
            return std::make_unique<VectorSheet>(helix, strength, SheetKind::front);
        default:
            return std::make_unique<VectorSheet>(whirl(0.01), strength, SheetKind::vortex);
        }
    };
    for (int kind = 0; kind < 5; ++kind)
        for (const SteppingSettings& settings :
             {stepping(SteppingMethod::single), stepping(SteppingMethod::fixed, 8),
              stepping(SteppingMethod::adaptive)})
            for (int n = 0; n < 60; ++n) {
                ContactLoop loop(settings, {},
                                 effects(effect(kind, n % 3 == 0 ? kInfinite : 1.0 + one(random))));
                const Vec3 start = kRadius * Vec3{one(random), one(random), one(random)};
                const Vec3 probe = start + 0.005 * Vec3{one(random), one(random), one(random)};
                loop.start(start);
                double distance = glm::length(probe - start);
                for (int i = 0; i < 30; ++i) {
                    loop.move(probe);
                    const double now = glm::length(probe - loop.proxy());
                    ASSERT_LE(now, distance * (1.0 + 1e-12) + 1e-16)
                        << "kind " << kind << ", case " << n << ", frame " << i;
                    distance = now;
                }
            }
}

// A streamline and the fronts across it hold the proxy at a point, where each is met at any angle
// on the way. A frame that does not find it stays: the balance is no further from the probe than
// the frame's start, but for the longest force that is felt.
TEST(VectorModes, TwoThatNeverSlipDoNotThrowTheProxyAway) {
    const std::shared_ptr<const VectorField> flow = make_helix(20e-3, 30e-3);
    const TransferFunction hard =
        TransferFunction::constant(std::numeric_limits<double>::infinity());
    ContactLoop loop({}, {},
                     effects(std::make_unique<VectorFollow>(flow, hard),
                             std::make_unique<VectorSheet>(flow, hard, SheetKind::front)));
    const auto hand = [](int frame) { // a circle of 22 mm in 1.4 s
        const double angle = 4.55e-3 * frame;
        return 22e-3 * Vec3{std::cos(angle), std::sin(angle), 0.0};
    };
    loop.start(hand(0));
    double furthest = 0.0;
    for (int frame = 0; frame < 1500; ++frame) {
        const double before = glm::length(loop.proxy() - hand(frame));
        loop.move(hand(frame));
        const double after = glm::length(loop.proxy() - hand(frame));
        EXPECT_LE(after, before + 5.0 / ContactLoop::kStiffness + 1e-9) << frame;
        furthest = std::max(furthest, glm::length(loop.proxy()));
    }
    EXPECT_LE(furthest, 0.1);
}

// Circles about an axis beside the ball's centre lead into the ball and out of it: the ball holds,
// the guide slips. What the wall does not carry of the hand's pull is the guide's, at most its
// strength, and the wall only pushes.
TEST(VectorModes, AGuideThatLeadsIntoASurfaceYieldsAndTheSurfaceHolds) {
    constexpr double kBall = 0.02;
    const Vec3 axis{0.004, 0.0, 0.0};
    const auto circles = std::make_shared<FormulaVectorField>([&](const Vec3& p) {
        return VectorSample{glm::cross(Vec3{0, 0, 1}, p - axis), Mat3(0.0), true};
    });
    for (double strength_n : {0.3, 1.0}) {
        ContactLoop loop(stepping(SteppingMethod::adaptive),
                         test::one_surface(make_solid_sphere(kBall)),
                         effects(std::make_unique<VectorFollow>(
                             circles, TransferFunction::constant(strength_n))));
        const Vec3 from = 1.0005 * kBall * glm::normalize(Vec3{0.018, 0.0, 0.008});
        loop.start(from);
        int slipping = 0;
        double circle = std::hypot(from.x - axis.x, from.y);
        for (int i = 1; i <= 1000; ++i) {
            const Vec3 probe{0.0163 * std::cos(0.01 * i), 0.0163 * std::sin(0.01 * i), 0.009};
            const SubdivisionResult result = loop.move(probe);
            EXPECT_EQ(result.flags, 0u) << i;
            EXPECT_LE(result.evaluations, 6u) << i;
            const Vec3& x = loop.proxy();
            ASSERT_GE(glm::length(x), kBall - 1e-10) << i; // what a last Newton step leaves
            const Vec3 out = glm::normalize(x);
            const Vec3 pull = ContactLoop::kStiffness * (probe - x);
            const Vec3 guided = pull - std::min(0.0, glm::dot(pull, out)) * out;
            // The loop's tolerance, as a force.
            ASSERT_LE(glm::length(guided), strength_n + 1e-7 * ContactLoop::kStiffness) << i;
            const double circle_now = std::hypot(x.x - axis.x, x.y);
            const bool on_wall = glm::length(x) < kBall + 1e-10;
            if (on_wall && std::abs(circle_now - circle) > 1e-6) ++slipping;
            circle = circle_now;
        }
        EXPECT_GT(slipping, 100);
    }
}

} // namespace
} // namespace palpate
