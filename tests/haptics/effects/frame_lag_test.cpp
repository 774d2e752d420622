// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/effects/curve_guide.h>
#include <palpate/haptics/effects/frame_lag.h>
#include <palpate/haptics/effects/gradient_force.h>
#include <palpate/haptics/effects/point_guide.h>
#include <palpate/volume/fields/analytic_fields.h>
#include <palpate/volume/transfer_function.h>

#include "tests/support/contact_loop.h"
#include "tests/support/effect_lists.h"

namespace palpate {
namespace {

using test::ContactLoop;
using test::effects;

constexpr double kK = ContactLoop::kStiffness;

TransferFunction function_of(std::vector<TransferFunction::Node> nodes) {
    TransferFunction f;
    std::copy(nodes.begin(), nodes.end(), f.nodes.begin());
    f.count = nodes.size();
    return f;
}

/// Up to five nodes within up to 10 mm of a way, of up to 3 N: as steep as 1 N/um, or as flat as
/// 0.1 N/mm.
TransferFunction any_function(std::mt19937_64& random) {
    std::uniform_real_distribution<double> part(0.0, 1.0);
    const double width_m = std::pow(10.0, -6.0 + 4.0 * part(random));
    std::vector<double> values(2 + random() % 4), strengths(values.size());
    for (double& value : values)
        value = width_m * part(random);
    for (double& strength : strengths)
        strength = 3.0 * part(random);
    std::sort(values.begin(), values.end());
    std::sort(strengths.begin(), strengths.end());
    std::vector<TransferFunction::Node> nodes;
    for (std::size_t i = 0; i < values.size(); ++i)
        nodes.push_back({values[i], i == 0 ? 0.0 : strengths[i]});
    return function_of(nodes);
}

/// The largest change of a force out of what is denser, N, from one frame to the next in the last
/// 20 of 400 in which the hand is held. `follow` says what a frame takes of what it has found.
template <class Follow>
double unrest_n(const TransferFunction& strength, double hand_m, Follow follow) {
    double place = hand_m, taken = 0.0, unrest = 0.0;
    for (int frame = 0; frame < 400; ++frame) {
        const double before = std::exchange(taken, follow(strength(place), Vec3{place, 0.0, 0.0}));
        if (frame >= 380) unrest = std::max(unrest, std::abs(taken - before));
        place = hand_m - taken / kK;
    }
    return unrest;
}

// 0.1 mN: a hundredth of what a finger feels.
TEST(FrameLag, SettlesHoweverSteepAFunctionIs) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> hand(-1e-3, 10e-3);
    int restless = 0;
    for (int k = 0; k < 5000; ++k) {
        const TransferFunction strength = any_function(random);
        const double hand_m = hand(random);
        FrameLag<double> lag;
        const auto lagged = [&](double found, const Vec3& at) { return lag.follow(found, at, kK); };
        EXPECT_LE(unrest_n(strength, hand_m, lagged), 1e-4) << k;
        if (unrest_n(strength, hand_m, [](double found, const Vec3&) { return found; }) > 1e-4)
            ++restless;
    }
    EXPECT_GT(restless, 1000) << "or there was nothing to settle";
}

TEST(FrameLag, WhatDoesNotChangeIsTakenAsItIs) {
    FrameLag<Vec3> lag;
    const Vec3 force{0.1, -0.2, 0.3};
    for (int frame = 0; frame < 10; ++frame)
        EXPECT_EQ(lag.follow(force, Vec3{1e-3 * frame}, kK), force);
}

TEST(FrameLag, ANewTrialTakesWhatItFinds) {
    FrameLag<double> lag;
    lag.follow(0.0, Vec3{0.0}, kK);
    EXPECT_LT(lag.follow(3.0, Vec3{1e-3, 0.0, 0.0}, kK), 3.0); // 3 N within 1 mm: g = 6
    lag.restart();
    EXPECT_EQ(lag.follow(3.0, Vec3{2e-3, 0.0, 0.0}, kK), 3.0);
}

/// Frames of the last 100 of 500 with a held hand that move a proxy by any bit.
int restless_frames(std::unique_ptr<Effect> effect, const Vec3& hand) {
    ContactLoop loop({}, {}, effects(std::move(effect)));
    loop.start(hand);
    int moved = 0;
    for (int frame = 0; frame < 500; ++frame) {
        const Vec3 before = loop.proxy();
        loop.move(hand);
        if (frame >= 400 && loop.proxy() != before) ++moved;
    }
    return moved;
}

// Within a micrometre of the ball's wall the force rises to 1.2 N, which draws the proxy 2.4 mm.
TEST(FrameLag, AHeldProbeAtASteepForceMovesNoBit) {
    const std::shared_ptr<const ScalarField> ball = make_solid_sphere(20e-3);
    const TransferFunction steep = function_of({{-1e-6, 0.0}, {0.0, 1.2}});
    EXPECT_EQ(restless_frames(std::make_unique<GradientForce>(ball, steep), {-20.05e-3, 0, 0}), 0);
    EXPECT_EQ(restless_frames(std::make_unique<GradientForce>(ball, steep), {-19.5e-3, 0, 0}), 0);
}

TEST(FrameLag, AHeldProbeAtAGuideOfSteepStrengthMovesNoBit) {
    GuideSettings settings;
    settings.over = {make_solid_sphere(20e-3), function_of({{-1e-7, 0.0}, {0.0, 3.0}})};
    EXPECT_EQ(restless_frames(std::make_unique<PointGuide>(Vec3{-30e-3, 0, 0}, settings),
                              {-19.9e-3, 0, 0}),
              0);
}

// A steep force that is made ten times as strong: as restful as one that is written so.
TEST(FrameLag, KnowsTheGainOfWhatItFollows) {
    for (const double gain : {1.0, 10.0}) {
        const double most_n = 2.0 / gain;
        ContactLoop loop({}, {},
                         effects(std::make_unique<GradientForce>(
                             make_solid_sphere(20e-3), function_of({{0.0, 0.0}, {1e-4, most_n}}))));
        loop.subdivision().gain(0).set(gain);
        const double radius_m = 19e-3, step_rad = 5e-5 / radius_m; // 0.05 m/s
        const auto probe = [&](int frame) {
            return radius_m * Vec3{std::cos(step_rad * frame), std::sin(step_rad * frame), 0.0};
        };
        loop.start(probe(0));
        double before_n = 0.0, unrest_n = 0.0;
        for (int frame = 1; frame <= 600; ++frame) {
            loop.move(probe(frame));
            const double now_n = kK * glm::length(loop.proxy() - probe(frame));
            if (frame > 500) unrest_n = std::max(unrest_n, std::abs(now_n - before_n));
            before_n = now_n;
        }
        EXPECT_GT(before_n, 0.1) << gain;
        EXPECT_LT(unrest_n, 0.1) << gain;
    }
}

} // namespace
} // namespace palpate
