// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/baselines.h>

#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include <palpate/volume/fields/analytic_fields.h>

namespace palpate {
namespace {

constexpr double kRadius = 0.05; // m
constexpr double kDepth = 2e-3;  // m
constexpr double kStep = 0.2e-3; // m per frame
constexpr double kBall = 1e-3;   // m
constexpr double kNudge = 1e-6;  // m: how far in front of its level a ray begins

/// Out of the centre's side of a cavity into its wall and around; the largest distance from the
/// wall in the last `counted` of the frames.
double farthest_from_the_wall(BaselineKind kind, int frames, int counted) {
    const std::shared_ptr<const ScalarField> field = make_sphere_cavity(kRadius);
    const auto baseline = make_baseline(kind, field, 0.0, kBall);
    baseline->restart({kRadius - 2e-3, 0.0, 0.0});
    double farthest = 0.0;
    for (int i = 0; i < frames; ++i) {
        const double radius = kRadius + std::min(kDepth, 1e-4 * i - 2e-3);
        const double angle = kStep / (kRadius + kDepth) * i;
        const auto step = baseline->move({radius * std::cos(angle), radius * std::sin(angle), 0.0});
        if (i < frames - counted) continue;
        EXPECT_TRUE(step.touches) << name(kind) << " at frame " << i;
        farthest = std::max(farthest, std::abs(glm::length(step.proxy) - kRadius));
    }
    return farthest;
}

TEST(Baselines, FollowTheProbeInFreeSpace) {
    const std::shared_ptr<const ScalarField> field = make_sphere_cavity(kRadius);
    for (const BaselineKind kind : kBaselines) {
        const auto baseline = make_baseline(kind, field, 0.0, kBall);
        baseline->restart({0.01, 0.0, 0.0});
        const auto step = baseline->move({0.02, 0.01, 0.0});
        EXPECT_FALSE(step.touches) << name(kind);
        EXPECT_EQ(step.proxy, Vec3(0.02, 0.01, 0.0)) << name(kind);
    }
}

TEST(Baselines, LetGoWhenTheProbeComesBack) {
    const std::shared_ptr<const ScalarField> field = make_sphere_cavity(kRadius);
    for (const BaselineKind kind : kBaselines) {
        const auto baseline = make_baseline(kind, field, 0.0, kBall);
        baseline->restart({0.04, 0.0, 0.0});
        baseline->move({0.0501, 0.0, 0.0}); // primitives find the wall where a step has ended
        EXPECT_TRUE(baseline->move({0.051, 0.0, 0.0}).touches) << name(kind);
        EXPECT_TRUE(baseline->move({0.051, 1e-4, 0.0}).touches) << name(kind);
        EXPECT_FALSE(baseline->move({0.045, 0.0, 0.0}).touches) << name(kind);
    }
}

TEST(Baselines, PenaltyIsExactForADistance) {
    EXPECT_LT(farthest_from_the_wall(BaselineKind::penalty, 500, 400), 1e-15);
}

TEST(Baselines, AGodObjectComesBackToTheLevelOfADistance) {
    // Newton's step is exact along the gradient of a distance.
    EXPECT_LT(farthest_from_the_wall(BaselineKind::god_object, 500, 400), 1e-15);
}

TEST(Baselines, AVirtualProxyStaysItsRadiusAway) {
    const double farthest = farthest_from_the_wall(BaselineKind::virtual_proxy, 500, 400);
    // It leaves its level by the nudge of every ray, and a frame's way along the tangent uses it
    // up.
    EXPECT_NEAR(farthest, kBall, 2.0 * kNudge);
}

TEST(Baselines, TetrahedraAreOffByTheSquareOfTheirSpacing) {
    // On an edge of length e a linear value is off by e^2 / 8r at most; the longest is the cubes'
    // diagonal of sqrt(3) mm. Facets of a cavity are on its free side; so is the nudge.
    const double farthest = farthest_from_the_wall(BaselineKind::local_tetrahedra, 500, 400);
    EXPECT_LT(farthest, 3e-6 / (8.0 * kRadius) + 1.1 * kNudge);
    EXPECT_GT(farthest, 1e-6);
}

TEST(Baselines, TetrahedraLetNothingThroughAtAnySpeed) {
    const std::shared_ptr<const ScalarField> field = make_slab(1e-3);
    const auto baseline = make_baseline(BaselineKind::local_tetrahedra, field, 0.0);
    baseline->restart({0.1e-3, 0.2e-3, 0.02});
    const auto step = baseline->move({0.3e-3, 0.15e-3, -0.02});
    EXPECT_TRUE(step.touches);
    EXPECT_NEAR(step.proxy.z, 0.5e-3, 0.2e-3)
        << "the corners of a 1 mm lattice blur a slab of 1 mm";
}

TEST(Baselines, IkitsDriftsLittleAndDoesNotComeBack) {
    const double early = farthest_from_the_wall(BaselineKind::ikits, 1000, 500);
    const double late = farthest_from_the_wall(BaselineKind::ikits, 4000, 500);
    EXPECT_LT(late, 1e-7) << "a full step along the tangent leaves 3e-4 m in as many frames";
    EXPECT_GT(late, early) << "what is lost is lost";
}

TEST(Baselines, LinearStepsLoseWhatTheSurfaceBends) {
    // A step h along the tangent ends h^2 / 2r behind the wall; the way in adds a frame's at most.
    const double h = kStep * kRadius / (kRadius + kDepth);
    const double expected = 960.0 * h * h / (2.0 * kRadius); // in contact but for the way in
    EXPECT_NEAR(farthest_from_the_wall(BaselineKind::linear, 1000, 1), expected, 0.05 * expected);
}

TEST(Baselines, SubStepsDivideTheDriftOfHapticPrimitives) {
    // Where on its ramp of strength the proxy comes to rest says nothing; how it goes on from there
    // does. The lag of a held probe is 1 + depth / radius = 1.04.
    const auto drift = [](BaselineKind kind) {
        const std::shared_ptr<const ScalarField> field = make_sphere_cavity(kRadius);
        const auto baseline = make_baseline(kind, field, 0.0);
        baseline->restart({kRadius - 2e-3, 0.0, 0.0});
        std::array<double, 2> radius{};
        for (int i = 0; i < 600; ++i) {
            const double r = kRadius + std::min(kDepth, 1e-4 * i - 2e-3);
            const double angle = kStep / (kRadius + kDepth) * i;
            const auto step = baseline->move({r * std::cos(angle), r * std::sin(angle), 0.0});
            radius[i < 200 ? 0 : 1] = glm::length(step.proxy);
        }
        return radius[1] - radius[0];
    };
    const double h = kStep * kRadius / (kRadius + kDepth);
    const double expected = 400.0 * h * h / (2.0 * kRadius);
    EXPECT_NEAR(drift(BaselineKind::primitives), expected, 0.05 * expected);
    EXPECT_NEAR(drift(BaselineKind::subdivided) * kPaperSubSteps, expected, 0.1 * expected);
}

TEST(Baselines, PenaltyPushesOutAtTheFarSideOfAThinWallAndAProxyDoesNot) {
    // A slab of 1 mm across z; the probe goes 0.8 mm into it.
    const std::shared_ptr<const ScalarField> field = make_slab(1e-3);
    const auto top = [](BaselineKind kind, std::shared_ptr<const ScalarField> slab) {
        const auto baseline = make_baseline(kind, std::move(slab), 0.0, 1e-4);
        baseline->restart({0.0, 0.0, 2e-3});
        Vec3 proxy;
        for (double z = 2e-3; z > -0.3e-3; z -= 1e-4)
            proxy = baseline->move({0.0, 0.0, z}).proxy;
        return proxy.z;
    };
    EXPECT_LT(top(BaselineKind::penalty, field), 0.0);
    EXPECT_GT(top(BaselineKind::god_object, field), 0.0);
    EXPECT_GT(top(BaselineKind::virtual_proxy, field), 0.0);
    EXPECT_GT(top(BaselineKind::ikits, field), 0.0);
}

TEST(Baselines, EachSaysWhatItGetsWrong) {
    for (const BaselineKind kind : kBaselines) {
        EXPECT_FALSE(name(kind).empty());
        EXPECT_FALSE(weakness(kind).empty());
    }
    EXPECT_FALSE(weakness(BaselineKind::finger_proxy).empty());
    EXPECT_THROW(make_baseline(BaselineKind::finger_proxy, make_slab(1e-3), 0.0),
                 std::invalid_argument);
}

} // namespace
} // namespace palpate
