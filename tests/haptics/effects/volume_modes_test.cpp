// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/effects/gradient_force.h>
#include <palpate/haptics/effects/viscosity.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/contact_loop.h"
#include "tests/support/effect_lists.h"

namespace palpate {
namespace {

using test::ContactLoop;
using test::one_surface;
using test::stepping;

constexpr double kStiffness = ContactLoop::kStiffness;
constexpr double kPeriod = 1e-3; // s, of ContactLoop

std::vector<std::unique_ptr<Effect>> only(std::unique_ptr<Effect> effect) {
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(std::move(effect));
    return effects;
}

/// Viscosity anchored at the sub-steps: what must not be done.
class FadingViscosity final : public Effect {
public:
    void begin(const FrameContext&) noexcept override {}
    void gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept override {
        primitives.add_spring(proxy, 5.0 / kPeriod);
    }
    QueryCount queries() const noexcept override { return {}; }
};

// Implicit Euler of m = 0: b (x' - x0) / T = k (a - x'). In steady movement the lag is b v / k.
TEST(Viscosity, ResistsByTheVelocity) {
    constexpr double kDamping = 5.0; // N s/m
    constexpr double kSpeed = 0.1;   // m/s: 0.5 N, 1 mm behind
    for (SteppingMethod method :
         {SteppingMethod::single, SteppingMethod::fixed, SteppingMethod::adaptive}) {
        ContactLoop loop(stepping(method), {}, only(std::make_unique<Viscosity>(kDamping)));
        loop.start({0, 0, 0});
        loop.move({kSpeed * kPeriod, 0, 0});
        const double spring = kDamping / kPeriod;
        EXPECT_NEAR(loop.proxy().x, kStiffness / (kStiffness + spring) * kSpeed * kPeriod, 1e-19);
        for (int i = 2; i <= 1000; ++i)
            loop.move({kSpeed * kPeriod * i, 0, 0});
        // The start has decayed by (b/T / (k + b/T))^1000 = 4e-42; rounding of 0.1 m, amplified by
        // the sum of that series, 11.
        EXPECT_NEAR(kSpeed * kPeriod * 1000 - loop.proxy().x, kDamping * kSpeed / kStiffness,
                    11 * 2e-17 * 2);
    }
}

/// The tangential way that a hand's stroke leaves its proxy behind, along a hard face or in the
/// air.
Vec3 stroke(std::unique_ptr<Effect> viscosity, const SteppingSettings& settings, bool on_face) {
    auto surfaces =
        on_face ? one_surface(make_slab(0.002)) : std::vector<std::unique_ptr<SurfaceContact>>{};
    ContactLoop loop(settings, std::move(surfaces), only(std::move(viscosity)));
    loop.start({0, 0, 0.0011});
    for (int i = 0; i < 200; ++i)
        loop.move({0, 0, 0}); // pressed 1 mm in, where there is a face
    Vec3 probe{0.0};
    for (int i = 1; i <= 100; ++i) {
        probe = {1e-4 * i, 0.5e-4 * i, 0.0};
        loop.move(probe);
    }
    return probe - loop.proxy();
}

TEST(Viscosity, DoesNotDependOnTheNumberOfSubSteps) {
    for (bool on_face : {false, true}) {
        const Vec3 lag =
            stroke(std::make_unique<Viscosity>(5.0), stepping(SteppingMethod::fixed, 1), on_face);
        for (int shares : {2, 4, 16, 46}) {
            const Vec3 many = stroke(std::make_unique<Viscosity>(5.0),
                                     stepping(SteppingMethod::fixed, shares), on_face);
            // Each share rounds once: 100 frames of 46 roundings of 0.01 m.
            EXPECT_LE(glm::length(many - lag), 100 * 46 * 1e-18) << shares;
        }
        const Vec3 adaptive =
            stroke(std::make_unique<Viscosity>(5.0), stepping(SteppingMethod::adaptive), on_face);
        EXPECT_LE(glm::length(adaptive - lag), 100 * 46 * 1e-18);
        if (on_face) {
            EXPECT_NEAR(lag.z, -0.001, 1e-12) << "pressed all the same";
        }
    }
    // The control: anchored at the sub-steps it fades.
    const double one = glm::length(
        stroke(std::make_unique<FadingViscosity>(), stepping(SteppingMethod::fixed, 1), false));
    const double many = glm::length(
        stroke(std::make_unique<FadingViscosity>(), stepping(SteppingMethod::fixed, 46), false));
    EXPECT_LE(many, 0.5 * one);
}

TEST(Viscosity, ACreepInContactIsNotTakenForRest) {
    ContactLoop loop(stepping(SteppingMethod::adaptive), one_surface(make_slab(0.002)),
                     only(std::make_unique<Viscosity>(50.0)));
    loop.start({0, 0, 0.001});
    for (int i = 0; i < 3000; ++i)
        loop.move({0.001, 0, 0.0});
    // It rests where a frame would move the coupling by less than the tolerance, 0.1 um: not at
    // the 101 times of it, 10 um, that a frame's movement alone would say.
    EXPECT_NEAR(loop.proxy().x, 0.001, 1.1e-7);
}

TEST(Viscosity, FollowsTheDensityAndNeedsData) {
    // 5 N s/m in the material of a sphere, none outside of it.
    const TransferFunction density{{{{-1e-4, 0.0}, {1e-4, 5.0}}}, 2};
    const std::shared_ptr<const ScalarField> ball = make_solid_sphere(0.02);
    ContactLoop loop(stepping(SteppingMethod::adaptive), {},
                     only(std::make_unique<Viscosity>(ball, density)));
    loop.start({0.03, 0, 0});
    loop.move({0.03, 0.001, 0});
    EXPECT_EQ(loop.proxy(), Vec3(0.03, 0.001, 0));
    loop.start({0.01, 0, 0});
    loop.move({0.01, 0.001, 0});
    EXPECT_NEAR(loop.proxy().y, 0.001 * kStiffness / (kStiffness + 5000.0), 1e-18);
}

TEST(Viscosity, AHeldProbesSpringNeverGainsEnergy) {
    ContactLoop loop(stepping(SteppingMethod::adaptive),
                     one_surface(make_bumpy_cavity(0.05, 1e-3, 15e-3)),
                     only(std::make_unique<Viscosity>(2.0)));
    loop.start({0, 0, 0});
    const Vec3 probe{0.04, 0.03, 0.02};
    double distance = glm::length(probe);
    for (int i = 0; i < 500; ++i) {
        loop.move(probe);
        const double now = glm::length(probe - loop.proxy());
        ASSERT_LE(now, distance * (1.0 + 1e-12)) << i;
        distance = now;
    }
    EXPECT_LE(distance, glm::length(probe) - 0.049) << "it came to the wall";
}

TEST(GradientForce, PushesOutOfWhatIsDenser) {
    const TransferFunction density{{{{0.0, 0.0}, {0.01, 1.0}}}, 2}; // N over m of depth
    ContactLoop loop(stepping(SteppingMethod::adaptive), {},
                     only(std::make_unique<GradientForce>(
                         std::shared_ptr<const ScalarField>(make_solid_sphere(0.02)), density)));
    loop.start({0.015, 0, 0}); // 5 mm deep: 0.5 N, 1 mm
    loop.move({0.015, 0, 0});
    EXPECT_LE(glm::length(loop.proxy() - Vec3(0.016, 0, 0)), 1e-17);
    loop.start({0, 0, 0}); // no direction in the middle
    loop.move({1e-3, 0, 0});
    EXPECT_EQ(loop.proxy(), Vec3(1e-3, 0, 0));
}

/// E of eq. (5) with springs, as solve_proxy() documents it.
double energy(const PrimitiveSet& set, double spring, const Vec3& anchor, const Vec3& probe,
              const Vec3& x) {
    double e = 0.5 * kStiffness * squared_length(x - probe) - glm::dot(set.force(), x) +
               0.5 * spring * squared_length(x - anchor);
    for (const PlanePrimitive& p : set.planes())
        e += p.strength_n * std::max(0.0, -glm::dot(p.normal, x - p.anchor));
    for (const LinePrimitive& l : set.lines())
        e += l.strength_n * glm::length(glm::cross(l.axis, x - l.anchor));
    for (const PointPrimitive& p : set.points())
        e += p.strength_n * glm::length(x - p.anchor);
    return e;
}

TEST(ProxySolver, SpringsAreABalanceLikeAnyOther) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> one(-1.0, 1.0);
    const auto vector = [&] { return Vec3{one(random), one(random), one(random)}; };
    for (int n = 0; n < 500; ++n) {
        const Vec3 probe = 0.01 * vector();
        const Vec3 anchor = 0.01 * vector();
        const double spring = std::pow(10.0, 1.5 * one(random) + 2.5);
        PrimitiveSet set;
        set.add_spring(anchor, 0.25 * spring);
        set.add_spring(anchor, 0.75 * spring);
        set.add_force(vector());
        if (n % 2) set.add({0.005 * vector(), glm::normalize(vector()), 2.0 + 2.0 * one(random)});
        if (n % 3) set.add_line({0.005 * vector(), glm::normalize(vector()), 1.0 + one(random)});
        if (n % 5) set.add_point({0.005 * vector(), 1.0 + one(random)});
        const ProxySolution solution = solve_proxy(set, probe, kStiffness);
        const double least = energy(set, spring, anchor, probe, solution.proxy);
        for (int i = 0; i < 30; ++i) {
            const Vec3 aside = solution.proxy + std::pow(10.0, -3.0 - 4.0 * (i / 30.0)) * vector();
            // Rounding of energies below 1 J.
            EXPECT_GE(energy(set, spring, anchor, probe, aside), least - 1e-15) << n;
        }
    }
}

/// A point, or a line, that stays where it is and draws.
class Drawn final : public Effect {
public:
    explicit Drawn(const PointPrimitive& point) : point_(point) {}
    explicit Drawn(const LinePrimitive& line) : line_(line) {}
    void begin(const FrameContext&) noexcept override {}
    void gather(const Vec3&, PrimitiveSet& primitives) noexcept override {
        if (point_) primitives.add_point(*point_);
        if (line_) primitives.add_line(*line_);
    }
    QueryCount queries() const noexcept override { return {}; }

private:
    std::optional<PointPrimitive> point_;
    std::optional<LinePrimitive> line_;
};

/// Strokes of a few frames over a hard ball while something draws.
class BallStrokes {
public:
    static constexpr double kBall = 0.02;
    static constexpr double kDepth = 0.01; // the curvature weighs as much as the coupling
    static constexpr int kFrames = 5;

    Vec3 direction() { return glm::normalize(Vec3{0.4 * one(random), 0.4 * one(random), 1.0}); }
    Vec3 anywhere() { return glm::normalize(Vec3{one(random), one(random), one(random)}); }

    /// Evaluations of all frames but the first, which lands; `probe` and `proxy` are those of the
    /// end.
    std::uint32_t stroke(std::unique_ptr<Effect> drawn) {
        ContactLoop loop(stepping(SteppingMethod::adaptive), one_surface(make_solid_sphere(kBall)),
                         only(std::move(drawn)));
        probe = (kBall - kDepth) * direction();
        loop.start(1.0001 * kBall * glm::normalize(probe));
        loop.move(probe);
        std::uint32_t evaluations = 0;
        for (int i = 0; i < kFrames; ++i) {
            probe += Vec3{2e-4, 1e-4, 0.0};
            evaluations += loop.move(probe).evaluations;
        }
        proxy = loop.proxy();
        return evaluations;
    }

    Vec3 probe{0.0};
    Vec3 proxy{0.0};

private:
    std::mt19937 random{9};
    std::uniform_real_distribution<double> one{-1.0, 1.0};
};

// k (a - x) + s (q - x) / |q - x| balances the wall: its part along the wall vanishes. Without the
// turning of the pull in the step's matrix 5.8 evaluations of the cap's 8 are made, with it 3.
TEST(CurvatureStep, APointThatSlipsOverABallIsBalancedInAFewEvaluations) {
    constexpr int kCases = 200;
    constexpr double kStrength = 0.8;
    BallStrokes strokes;
    std::uint32_t evaluations = 0;
    for (int n = 0; n < kCases; ++n) {
        const Vec3 anchor = BallStrokes::kBall * strokes.direction();
        evaluations += strokes.stroke(std::make_unique<Drawn>(PointPrimitive{anchor, kStrength}));
        const Vec3& x = strokes.proxy;
        const Vec3 way = anchor - x;
        if (glm::length(way) < 1e-4) continue; // it holds, or is about to
        const Vec3 out = glm::normalize(x);
        const Vec3 pull = kStiffness * (strokes.probe - x) + kStrength * glm::normalize(way);
        const Vec3 along = pull - glm::dot(pull, out) * out;
        // The tolerance of the loop, as a force, on a wall whose gain is at most 2.
        EXPECT_LE(glm::length(along), 2.0 * 1e-7 * kStiffness) << n;
    }
    EXPECT_LE(evaluations, kCases * BallStrokes::kFrames * 3.5);
}

// A line that holds leaves the ball's curvature nothing to correct across it: without it in the
// pinned directions 5.8 evaluations of the cap's 8 are made, with it 1.1.
TEST(CurvatureStep, ALineThatHoldsIsNotLeftForTheSurfacesCurvature) {
    constexpr int kCases = 200;
    BallStrokes strokes;
    std::uint32_t evaluations = 0;
    for (int n = 0; n < kCases; ++n) {
        const Vec3 anchor = BallStrokes::kBall * strokes.direction();
        evaluations +=
            strokes.stroke(std::make_unique<Drawn>(LinePrimitive{anchor, strokes.anywhere(), 8.0}));
    }
    EXPECT_LE(evaluations, kCases * BallStrokes::kFrames * 1.5);
}

TEST(Viscosity, HoldsNobodyBackAfterSilence) {
    Viscosity medium(20.0);
    FrameContext frame;
    frame.probe = {0.03, 0, 0};
    frame.after_silence = true;
    PrimitiveSet set;
    medium.begin(frame);
    medium.gather(frame.start, set);
    EXPECT_EQ(set.total_stiffness(500.0), 500.0);
    frame.after_silence = false;
    medium.begin(frame);
    medium.gather(frame.start, set);
    EXPECT_GT(set.total_stiffness(500.0), 500.0);
}

} // namespace
} // namespace palpate
