// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/textures.h"

namespace palpate {
namespace {

using namespace test;

constexpr double kRadius = 50e-3; // of the ball, m
constexpr double kInfinite = std::numeric_limits<double>::infinity();

// By differences over 2 d, d = 1 um: wrong by d^2/6 times the next derivative but one, H/2 k^3 =
// 1.5e6 / m^2 of the waves' slopes, H/2 k^4 = 5e9 / m^3 of their second derivatives.
TEST(SurfaceTexture, WhatIsFeltHasTheDerivativesThatItSays) {
    std::mt19937_64 random(3);
    const auto field = make_solid_sphere(kRadius);
    const auto sampler = field->make_sampler();
    for (const TextureSettings& settings :
         {grating(2e-3, 0.1e-3, {1, 2, 3}), bumps(2e-3, 0.1e-3), cone()}) {
        SurfaceTexture texture(settings, field->feature_size_m());
        const auto felt = [&](const Vec3& p) { return texture.felt(sampler->sample(p), p); };
        for (int i = 0; i < 200; ++i) {
            const Vec3 p = Vec3(0.008) + random_offset(random, 2e-3);
            const FieldSample here = felt(p);
            for (int axis = 0; axis < 3; ++axis) {
                Vec3 d{0.0};
                d[axis] = 1e-6;
                const FieldSample after = felt(p + d), before = felt(p - d);
                EXPECT_NEAR(here.slope[axis], (after.value - before.value) / 2e-6, 1e-6);
                const Vec3 turn = (after.gradient - before.gradient) / 2e-6;
                EXPECT_LE(glm::length(here.hessian[axis] - turn), 2e-3);
            }
            EXPECT_EQ(here.slope, here.gradient); // a formula's are the same
        }
    }
}

TEST(SurfaceTexture, HeightsAreWithinTheirRangeAndFlanksNotSteeperThanAHalf) {
    std::mt19937_64 random(4);
    const auto field = make_solid_sphere(1.0); // nearly flat
    const auto sampler = field->make_sampler();
    const double highest_m = SurfaceTexture::kHighestOfWave * 2e-3;
    for (const TextureSettings& settings : {grating(2e-3, highest_m), bumps(2e-3, highest_m)}) {
        SurfaceTexture texture(settings, 1.0);
        double low = kInfinite, high = 0.0, steepest = 0.0;
        for (int i = 0; i < 100000; ++i) {
            const Vec3 p = Vec3{0, 0, 0.5} + random_offset(random, 5e-3);
            const FieldSample bare = sampler->sample(p), felt = texture.felt(bare, p);
            low = std::min(low, felt.value - bare.value);
            high = std::max(high, felt.value - bare.value);
            steepest = std::max(steepest, glm::length(felt.slope - bare.slope));
        }
        EXPECT_GE(low, -1e-15);
        EXPECT_LE(low, 0.02 * highest_m);
        EXPECT_LE(high, highest_m + 1e-15);
        EXPECT_GE(high, 0.98 * highest_m);
        EXPECT_LE(steepest, 0.5 + 1e-9);
        EXPECT_GE(steepest, settings.pattern == TexturePattern::grating ? 0.499 : 0.27); // 1/2/3^.5
    }
}

TEST(SurfaceTexture, RefusesWhatIsTooHighOrTooSteep) {
    constexpr double any = 1.0; // m
    EXPECT_NO_THROW(SurfaceTexture(grating(2e-3, 0.3e-3), any));
    EXPECT_THROW(SurfaceTexture(grating(2e-3, 0.4e-3), any), std::invalid_argument);
    EXPECT_THROW(SurfaceTexture(grating(2e-3, 0.3e-3), 0.2e-3), std::invalid_argument);
    EXPECT_THROW(SurfaceTexture(grating(2e-3, -0.1e-3), any), std::invalid_argument);
    EXPECT_THROW(SurfaceTexture(grating(0.0, 0.1e-3), any), std::invalid_argument);
    EXPECT_THROW(SurfaceTexture(grating(2e-3, 0.1e-3, Vec3{0.0}), any), std::invalid_argument);
    TextureSettings no_field = cone();
    no_field.field = nullptr;
    EXPECT_THROW(SurfaceTexture(no_field, any), std::invalid_argument);
    EXPECT_NO_THROW(SurfaceTexture(grating(0.0, 0.0), any)); // none
}

} // namespace
} // namespace palpate
