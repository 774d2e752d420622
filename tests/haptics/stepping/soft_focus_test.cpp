// SPDX-License-Identifier: Apache-2.0
// A tip deep in a small soft ball: near its centre the front turns far for a small way of the tip,
// and at the centre it may be anywhere around it (docs/palpation.md).
#include <palpate/haptics/stepping/subdivision.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/stepping/frame_flags.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/half_space.h"
#include "tests/support/soft_loop.h"

namespace palpate {
namespace {

using test::ContactLoop;
using test::force;
using test::soft;

constexpr double kK = ContactLoop::kStiffness;
constexpr double kRadius = 10e-3; // m
constexpr double kSoft = 20.0;    // N/m, as the hand feels it
constexpr double kTissue = 1.0 / (1.0 / kSoft - 1.0 / kK);

constexpr double kTolerance_m = 1e-10;

/// The ball over bone that fills z < `top_m`.
ContactLoop ball_over_bone(double top_m) {
    SteppingSettings settings;
    settings.tolerance_m = kTolerance_m;
    settings.evaluation_cap = 60;
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::make_unique<VolumeContact>(
        std::make_shared<test::HalfSpace>(test::Plane{{0, 0, 1}, top_m}), LevelSettings{}));
    surfaces.push_back(std::make_unique<VolumeContact>(
        std::shared_ptr<const ScalarField>(make_solid_sphere(kRadius)), LevelSettings{}));
    return {settings, std::move(surfaces), {}, 0.0, {SurfaceFinish{}, soft(kSoft)}};
}

// Exactly there, all of it is exact: the distance to the front is the radius, and 1 + d h is 0.
TEST(SoftFocus, ATipThatBoneHoldsInTheCentreOfABallStaysThere) {
    ContactLoop loop = ball_over_bone(0.0);
    loop.start({0, 0, kRadius + 1e-3});
    int in_the_centre = 0;
    for (int i = 0; i <= 40; ++i) {
        const Vec3 probe{0, 0, kRadius + 1e-3 - 1e-3 * i};
        const SubdivisionResult result = loop.move(probe);
        const double pressed = (kK * probe.z + kTissue * kRadius) / (kK + kTissue);
        const double tip = probe.z >= kRadius ? probe.z : std::max(0.0, pressed);
        EXPECT_LE(glm::length(loop.proxy() - Vec3{0, 0, tip}), 1e-9) << i;
        EXPECT_EQ(result.flags, 0u) << i;
        in_the_centre += glm::length(loop.proxy()) < 1e-12 ? 1 : 0;
    }
    EXPECT_GT(in_the_centre, 20);
}

// Round the centre, 0.2 to 1 mm from it: the tip is 0.94 to 0.86 of the radius deep, the force the
// law's along the radius, and Newton's steps are as few as elsewhere.
TEST(SoftFocus, RoundTheMiddleOfABallTheForceIsTheLawsInFewEvaluations) {
    for (const double aside : {0.2e-3, 0.4e-3, 0.7e-3, 1e-3}) {
        ContactLoop loop = ball_over_bone(-1.0); // far away
        loop.start({kRadius + 1e-3, 0, 0});
        for (int i = 0; i <= 100; ++i) { // in
            const double way = kRadius + 1e-3 - aside;
            loop.move({aside + way * (100 - i) / 100.0, 0, 0});
        }
        for (int i = 1; i <= 200; ++i) { // and round
            const double angle = 2e-5 / aside * i;
            const Vec3 up{std::cos(angle), 0.6 * std::sin(angle), 0.8 * std::sin(angle)};
            const Vec3 probe = aside * up;
            const SubdivisionResult result = loop.move(probe);
            EXPECT_LE(glm::length(force(loop, probe) - kSoft * (kRadius - aside) * up),
                      2.0 * kK * kTolerance_m)
                << aside << ' ' << i;
            EXPECT_LE(result.evaluations, 4u) << aside << ' ' << i;
        }
    }
}

} // namespace
} // namespace palpate
