// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/effects/constant_force.h>
#include <palpate/haptics/effects/vector_follow.h>
#include <palpate/haptics/effects/viscosity.h>
#include <palpate/volume/fields/analytic_fields.h>
#include <palpate/volume/fields/grid_vector_field.h>

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
constexpr double kSpeed = 0.2;   // m/s
constexpr double kPeriod = 1e-3; // s, of ContactLoop
constexpr double kTau = 2.0 * std::numbers::pi;

Vec3 on_helix(double radius, double angle) {
    return {radius * std::cos(angle), radius * std::sin(angle), kRise * angle};
}

struct Following {
    double drift_m = 0.0; // largest distance across the stream from the helix of the start
    double mean_evaluations = 0.0;
    std::uint32_t most_evaluations = 0;
    double samples_per_frame = 0.0;
    double turned = 0.0; // rad, of the proxy
};

/// A hand follows the helix for two seconds at 0.2 m/s, outside of it; `others` act as well.
Following follow_helix(FollowGuide guide, const SteppingSettings& settings,
                       double outside_m = kOutside,
                       std::vector<std::unique_ptr<Effect>> others = {}) {
    constexpr int kFrames = 2000;
    auto acting = effects(std::make_unique<VectorFollow>(
        make_helix(kRadius, kTau * kRise), TransferFunction::constant(kInfinite), guide));
    const Effect& effect = *acting.front();
    for (auto& other : others)
        acting.push_back(std::move(other));
    ContactLoop loop(settings, {}, std::move(acting));
    loop.start(on_helix(kRadius, 0.0));
    Following result;
    const double radius = kRadius + outside_m;
    const double rate = kSpeed / std::hypot(radius, kRise);
    for (int i = 1; i <= kFrames; ++i) {
        const double angle = rate * kPeriod * i;
        const SubdivisionResult frame = loop.move(on_helix(radius, angle));
        result.mean_evaluations += frame.evaluations;
        result.most_evaluations = std::max(result.most_evaluations, frame.evaluations);
        const Vec3& x = loop.proxy();
        // The proxy's angle, unwound: it lies within half a turn of the probe's.
        const double behind = std::remainder(angle - std::atan2(x.y, x.x), kTau);
        result.turned = angle - behind;
        const double off_radius = std::hypot(x.x, x.y) - kRadius;
        const double off_phase =
            (x.z - kRise * result.turned) * kRadius / std::hypot(kRadius, kRise);
        result.drift_m = std::max(result.drift_m, std::hypot(off_radius, off_phase));
    }
    result.mean_evaluations /= kFrames;
    result.samples_per_frame = 1.0 * effect.queries().field_samples / kFrames;
    return result;
}

// numerics 3.4: 1640, 803 and 34.4 um with 1, 2 and 46 shares.
TEST(VectorFollow, ThePapersLineDriftsByOneOverTheSubSteps) {
    const auto drift = [](int shares) {
        return follow_helix(FollowGuide::tangent, stepping(SteppingMethod::fixed, shares)).drift_m;
    };
    EXPECT_NEAR(drift(1), 1640e-6, 0.01 * 1640e-6);
    EXPECT_NEAR(drift(2), 803e-6, 0.01 * 803e-6);
    EXPECT_NEAR(drift(46), 34.4e-6, 0.01 * 34.4e-6);
}

// numerics 3.4: midpoint with the secant's share 1.13 um with two samples, the goal at most 2 um.
TEST(VectorFollow, MidpointsStayWithinTwoMicrometresOnTwoEvaluations) {
    const Following result =
        follow_helix(FollowGuide::midpoint, stepping(SteppingMethod::adaptive));
    EXPECT_LE(result.drift_m, 1.2e-6);
    EXPECT_GE(result.drift_m, 1.0e-6) << "a third-order error, as derived";
    EXPECT_LE(result.mean_evaluations, 2.0);
    EXPECT_LE(result.samples_per_frame, 2.001);
}

// Runge-Kutta's fifth-order error is a thousand times smaller than that of the cubic between a
// step's ends, s^2 (h - s)^2 / 24 times the fourth derivative: here 0.23 picometres a frame.
TEST(VectorFollow, TheStreamlineStaysWithinANanometreOnTwoEvaluations) {
    const Following result =
        follow_helix(FollowGuide::streamline, stepping(SteppingMethod::adaptive));
    EXPECT_LE(result.drift_m, 1e-9);
    EXPECT_LE(result.mean_evaluations, 2.0);
    EXPECT_LE(result.samples_per_frame, 5.001);
    // Where the pull along the helix vanishes: the foot of a probe on a concentric helix of the
    // same angle lies at that angle but for the lag that the pitch brings.
    EXPECT_NEAR(result.turned, kSpeed * 2.0 / std::hypot(kRadius + kOutside, kRise), 1e-6);
}

// What else acts shifts the end along the streamline by what the guide cannot foresee: two
// solutions and their secant find it, also where the probe is nearly a radius of curvature (21 mm)
// away and the iteration alone would not come to an end.
TEST(VectorFollow, OtherEffectsLeaveItOnTheStreamline) {
    for (double outside_m : {2e-3, 8e-3, 19e-3})
        for (int which : {1, 2, 3}) {
            std::vector<std::unique_ptr<Effect>> others;
            if (which & 1) others.push_back(std::make_unique<Viscosity>(2.0));
            if (which & 2) others.push_back(std::make_unique<ConstantForce>(Vec3{0.5, 0.3, 0.2}));
            const Following result =
                follow_helix(FollowGuide::streamline, stepping(SteppingMethod::adaptive), outside_m,
                             std::move(others));
            EXPECT_LE(result.drift_m, 1e-9) << outside_m << " " << which;
            EXPECT_LE(result.most_evaluations, 4u) << outside_m << " " << which;
        }
}

TEST(VectorFollow, SubStepsDoNotChangeWhereTheStreamlineLeads) {
    const Following one = follow_helix(FollowGuide::streamline, stepping(SteppingMethod::single));
    for (int shares : {2, 8, 46}) {
        const Following many =
            follow_helix(FollowGuide::streamline, stepping(SteppingMethod::fixed, shares));
        // 2000 frames of rounding of positions of 0.1 m.
        EXPECT_NEAR(many.drift_m, one.drift_m, 2000 * 1e-17) << shares;
        EXPECT_NEAR(many.turned, one.turned, 1e-9) << shares;
    }
}

TEST(VectorFollow, YieldsAcrossAboveItsStrength) {
    constexpr double kStrength = 0.4; // N: 0.8 mm at 500 N/m
    ContactLoop loop(
        stepping(SteppingMethod::adaptive), {},
        effects(std::make_unique<VectorFollow>(make_helix(kRadius, kTau * kRise),
                                               TransferFunction::constant(kStrength))));
    loop.start(on_helix(kRadius, 0.0));
    // Outwards, across the stream: held up to 0.8 mm, then 0.8 mm behind.
    for (double depth : {2e-4, 7.9e-4, 1.5e-3, 3e-3}) {
        loop.move(on_helix(kRadius + depth, 0.0));
        const double lag = glm::length(on_helix(kRadius + depth, 0.0) - loop.proxy());
        EXPECT_NEAR(lag, std::min(depth, kStrength / ContactLoop::kStiffness), 1e-12);
    }
    // It does not go back: there is no level, the streamline is that through the proxy.
    const Vec3 there = loop.proxy();
    loop.move(there);
    EXPECT_EQ(loop.proxy(), there);
}

TEST(VectorFollow, AHeldProbeMovesNoBit) {
    for (FollowGuide guide : {FollowGuide::midpoint, FollowGuide::streamline}) {
        ContactLoop loop(
            stepping(SteppingMethod::adaptive), {},
            effects(std::make_unique<VectorFollow>(make_helix(kRadius, kTau * kRise),
                                                   TransferFunction::constant(0.3), guide)));
        loop.start(on_helix(kRadius, 0.0));
        for (int i = 0; i < 50; ++i)
            loop.move(on_helix(kRadius + kOutside, 0.3));
        const Vec3 held = loop.proxy();
        for (int i = 0; i < 1000; ++i) {
            loop.move(on_helix(kRadius + kOutside, 0.3));
            ASSERT_EQ(loop.proxy(), held);
        }
    }
}

// A jump of a metre is more than is looked ahead: 16 steps of half the feature size, 5 mm each.
TEST(VectorFollow, AJumpIsFollowedAlongTheStreamline) {
    ContactLoop loop(
        stepping(SteppingMethod::adaptive), {},
        effects(std::make_unique<VectorFollow>(make_helix(kRadius, kTau * kRise),
                                               TransferFunction::constant(kInfinite))));
    loop.start(on_helix(kRadius, 0.0));
    for (int i = 0; i < 40; ++i) {
        loop.move({kRadius, 0.0, 1.0});
        const Vec3& x = loop.proxy();
        // Steps of a quarter of the radius of curvature: (1/4)^5 / 120 radii each, a few hundred.
        EXPECT_NEAR(std::hypot(x.x, x.y), kRadius, 1e-3 * kRadius);
        const double turn = std::remainder(std::atan2(x.y, x.x) - x.z / kRise, kTau);
        EXPECT_NEAR(turn, 0.0, 1e-2);
    }
    EXPECT_GT(loop.proxy().z, 0.1);
}

// The end of what is looked at ahead, 80 mm a frame here, held a fast hand with any force.
TEST(VectorFollow, WhereItsWayIsCutItHoldsWithNoMoreThanItsStrength) {
    constexpr double kStrength = 0.1; // N
    const auto straight = std::make_shared<FormulaVectorField>([](const Vec3&) {
        return VectorSample{Vec3(0, 0, 1), Mat3(0.0), true};
    });
    ContactLoop loop(
        stepping(SteppingMethod::adaptive), {},
        effects(std::make_unique<VectorFollow>(straight, TransferFunction::constant(kStrength))));
    loop.start(Vec3{0.0});
    double most = 0.0;
    for (int i = 1; i <= 40; ++i) {
        const Vec3 probe{1e-3 * (i % 2), 0.0, 0.16 * i};
        loop.move(probe);
        most = std::max(most, ContactLoop::kStiffness * glm::length(probe - loop.proxy()));
    }
    EXPECT_GT(most, 0.99 * kStrength) << "across";
    EXPECT_LT(most, 1.001 * std::sqrt(2.0) * kStrength) << "across and along";
}

// Where a way is cut there is a plane beside the line; the loop has room for what is promised.
TEST(VectorFollow, AddsNoMoreThanItPromises) {
    for (FollowGuide guide :
         {FollowGuide::tangent, FollowGuide::midpoint, FollowGuide::streamline}) {
        VectorFollow effect(make_helix(kRadius, kTau * kRise), TransferFunction::constant(1.0),
                            guide);
        EXPECT_EQ(effect.most_primitives(), 2u);
        std::size_t most = 0;
        for (int frame = 0; frame < 40; ++frame) {
            const Vec3 start = on_helix(kRadius, 0.3 * frame);
            const Vec3 probe = start + Vec3{0, 0, frame % 2 == 0 ? 1.0 : -1.0};
            effect.begin({probe, start});
            for (const Vec3& proxy : {start, probe, 0.5 * (start + probe)}) {
                PrimitiveSet primitives;
                effect.gather(proxy, primitives);
                effect.solved(proxy);
                most = std::max(most, primitives.count());
            }
        }
        EXPECT_EQ(most, guide == FollowGuide::tangent ? 1u : 2u) << "a leap is cut";
    }
}

TEST(VectorFollow, NothingIsFeltWithoutDataOrStrength) {
    const auto nowhere =
        std::make_shared<FormulaVectorField>([](const Vec3&) { return VectorSample{}; });
    const auto still = std::make_shared<FormulaVectorField>([](const Vec3&) {
        return VectorSample{Vec3(0.0), Mat3(0.0), true};
    });
    const std::shared_ptr<const VectorField> helix = make_helix(kRadius, kTau * kRise);
    struct Case {
        std::shared_ptr<const VectorField> field;
        double strength_n;
    };
    for (const Case& c : {Case{nowhere, 1.0}, Case{still, 1.0}, Case{helix, 0.0}})
        for (FollowGuide guide :
             {FollowGuide::tangent, FollowGuide::midpoint, FollowGuide::streamline}) {
            ContactLoop loop(stepping(SteppingMethod::adaptive), {},
                             effects(std::make_unique<VectorFollow>(
                                 c.field, TransferFunction::constant(c.strength_n), guide)));
            loop.start({0.01, 0, 0});
            EXPECT_EQ(loop.move({0.02, 0.01, 0.03}).contacts, 0u);
            EXPECT_EQ(loop.proxy(), Vec3(0.02, 0.01, 0.03));
        }
}

/// Fibres along the helix around (0.01, 0, 0) on a grid of half millimetres, each with the given
/// sign.
template <typename Sign>
std::shared_ptr<const VectorField> fibre_grid(const Sign& sign) {
    VectorVolume volume;
    volume.size = {32, 32, 32};
    constexpr double kSpacing = 0.5e-3;
    volume.index_to_scene = {Mat3(kSpacing), {0.002, -0.008, -0.008}};
    const auto helix = make_helix(kRadius, kTau * kRise);
    const auto sampler = helix->make_sampler();
    for (int k = 0; k < volume.size[2]; ++k)
        for (int j = 0; j < volume.size[1]; ++j)
            for (int i = 0; i < volume.size[0]; ++i) {
                const Vec3 v =
                    sign() * sampler->sample(volume.index_to_scene.point(Vec3(i, j, k))).value;
                for (int axis = 0; axis < 3; ++axis)
                    volume.values.push_back(static_cast<float>(v[axis]));
            }
    return std::make_shared<GridVectorField>(volume, VectorSense::axial);
}

TEST(FibreFollow, SignsOfTheFibresDoNotMatter) {
    std::mt19937 random(11);
    const auto plain = fibre_grid([] { return 1.0; });
    const auto reversed = fibre_grid([] { return -1.0; });
    const auto mixed = fibre_grid([&] { return random() % 2 ? 1.0 : -1.0; });
    const auto trace = [](const std::shared_ptr<const VectorField>& field) {
        ContactLoop loop(
            stepping(SteppingMethod::adaptive), {},
            effects(std::make_unique<VectorFollow>(field, TransferFunction::constant(0.5))));
        loop.start(on_helix(0.01, 0.0));
        std::vector<Vec3> path;
        for (int i = 0; i < 200; ++i) {
            loop.move(on_helix(0.01, 0.5 * std::sin(0.01 * kTau * i)) + Vec3{3e-4, 0, 0});
            path.push_back(loop.proxy());
        }
        return path;
    };
    const std::vector<Vec3> expected = trace(plain);
    EXPECT_EQ(trace(reversed), expected);
    EXPECT_EQ(trace(mixed), expected);
    // And it does follow, to and fro: the grid's interpolation turns the fibres by at most (0.5 /
    // 10)^2 / 8 along each axis, 0.9 mrad, over 2 * 5.6 mm of way in all.
    double worst = 0.0;
    double furthest = 0.0;
    for (const Vec3& x : expected) {
        worst = std::max(worst, std::abs(std::hypot(x.x, x.y) - 0.01));
        furthest = std::max(furthest, x.y);
    }
    EXPECT_LE(worst, 4.0 * 5.6e-3 * 0.9e-3);
    EXPECT_GE(furthest, 4e-3);
}

} // namespace
} // namespace palpate
