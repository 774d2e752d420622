// SPDX-License-Identifier: Apache-2.0
// Effects, surfaces and friction that are made weaker, stronger or switched off while the loop
// runs.
#include <palpate/haptics/solver/gain.h>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <palpate/haptics/contact/direct_contact.h>
#include <palpate/haptics/effects/constant_force.h>
#include <palpate/haptics/effects/viscosity.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/support/contact_kinds.h"
#include "tests/support/contact_loop.h"

namespace palpate {
namespace {

using test::ContactLoop;

constexpr double kHard = std::numeric_limits<double>::infinity();
constexpr double kLimit = 5.0;    // N: FrameContext's default
constexpr double kStep = 0.02;    // of a gain in one frame: 1 ms of 50
constexpr double kRadius = 0.02;  // m
constexpr double kPressed = 4e-3; // m: 2 N at 500 N/m
constexpr double kRounding_n = 1e-12;
// An adaptive frame may leave the tolerance of 0.1 um, at 500 N/m; twice, in a difference.
constexpr double kTolerance_n = 2 * 500.0 * 1e-7;

TEST(GainRamp, MovesLinearlyInFramesAndArrives) {
    GainRamp ramp;
    EXPECT_FALSE(ramp.advance(1e-3));
    ramp.set(0.0);
    for (int frame = 1; frame < 50; ++frame) {
        EXPECT_TRUE(ramp.advance(1e-3));
        EXPECT_NEAR(ramp.value(), 1.0 - kStep * frame, 1e-14); // 50 roundings of 1e-16
        EXPECT_TRUE(ramp.gain(kLimit).moving);
    }
    EXPECT_TRUE(ramp.advance(1e-3) || ramp.advance(1e-3)); // the last step may be one of rounding
    ramp.advance(1e-3);
    EXPECT_EQ(ramp.value(), 0.0);
    EXPECT_FALSE(ramp.gain(kLimit).moving);
    EXPECT_FALSE(ramp.advance(1e-3));
    ramp.set(10.0);
    ramp.jump();
    EXPECT_EQ(ramp.value(), 10.0);
    EXPECT_TRUE(ramp.advance(1e-3)); // who has not seen the jump is told
}

TEST(GainRamp, OnlyGainsInRangeAreAccepted) {
    for (const double gain : {0.0, 0.5, 10.0})
        EXPECT_TRUE(GainRamp::in_range(gain));
    for (const double gain : {-1e-9, 10.0001, kHard, std::nan("")})
        EXPECT_FALSE(GainRamp::in_range(gain));
}

TEST(Gain, StrengthsScaleAndTheHardFade) {
    EXPECT_EQ((Gain{0.5, kLimit}.strength_n(1.0)), 0.5);
    EXPECT_EQ((Gain{3.0, kLimit}.strength_n(1.0)), 3.0);
    EXPECT_EQ((Gain{0.5, kLimit}.strength_n(kHard)), kLimit);
    EXPECT_EQ((Gain{1.0, kLimit}.strength_n(kHard)), kHard);
    EXPECT_EQ((Gain{2.0, kLimit}.strength_n(kHard)), kHard);
    EXPECT_EQ((Gain{0.0, kLimit}.strength_n(kHard)), 0.0);
}

// From what can be felt, at most kLimit, to nothing: 4 F per unit of gain, whatever the strength.
TEST(Gain, NoStepOfAStrengthThatCanBeFeltIsLargerThanStated) {
    for (const double own_n : {0.1, 1.0, kLimit, 7.0, 12.0, 1e6, kHard}) {
        double before_n = 0.0;
        for (int i = 1; i <= 1000; ++i) {
            const double felt_n = std::min(kLimit, Gain{1e-3 * i, kLimit}.strength_n(own_n));
            EXPECT_GE(felt_n, before_n) << own_n;
            EXPECT_LE(felt_n - before_n, 4.0 * kLimit * 1e-3 + kRounding_n) << own_n << " " << i;
            before_n = felt_n;
        }
        EXPECT_EQ(before_n, std::min(kLimit, own_n));
    }
}

TEST(PrimitiveSet, WhatIsAddedIsScaled) {
    PrimitiveSet set;
    set.set_gain({0.5, kLimit});
    set.add({Vec3{0.0}, {0, 0, 1}, 2.0});
    set.add_line({Vec3{0.0}, {0, 0, 1}, kHard});
    set.add_point({Vec3{0.0}, 4.0});
    set.add_force({1.0, 0, 0});
    set.add_spring(Vec3{0.0}, 100.0);
    set.set_gain({});
    set.add({Vec3{0.0}, {0, 0, 1}, 2.0});
    EXPECT_EQ(set.planes()[0].strength_n, 1.0);
    EXPECT_EQ(set.planes()[1].strength_n, 2.0);
    EXPECT_EQ(set.lines()[0].strength_n, kLimit);
    EXPECT_EQ(set.points()[0].strength_n, 2.0);
    EXPECT_EQ(set.force().x, 0.5);
    EXPECT_EQ(set.total_stiffness(500.0), 550.0);
}

// Each is finite; their sum, or what follows from it, would not be.
TEST(PrimitiveSet, ForcesAndSpringsThatWouldOverflowCountAsNothing) {
    const Vec3 probe{0, 0, -2e-3};
    const auto expect_held = [&](const PrimitiveSet& set) {
        EXPECT_FALSE(set.all_finite());
        const ProxySolution solution = solve_proxy(set, probe, ContactLoop::kStiffness);
        EXPECT_EQ(solution.proxy, Vec3{0.0});
        EXPECT_EQ(solution.planes[0].state, MultiplierState::active) << "it is hard";
    };
    for (const double force_n : {-1.5e308, 1.5e308, -1e200}) {
        PrimitiveSet set;
        set.add({Vec3{0.0}, {0, 0, 1}, kHard});
        set.add_force({0, 0, force_n});
        set.add_force({0, 0, force_n});
        expect_held(set);
    }
    for (const auto& [anchor_m, stiffness] :
         {std::pair{0.0, -1000.0}, {1e10, 1e300}, {0.0, std::nan("")}}) {
        PrimitiveSet set;
        set.add({Vec3{0.0}, {0, 0, 1}, kHard});
        set.add_spring({0, 0, anchor_m}, stiffness);
        expect_held(set);
    }
}

// ---- surfaces ----------------------------------------------------------------------------------

/// A ball that is felt, and the probe above its north pole.
class OnBall {
public:
    explicit OnBall(std::unique_ptr<SurfaceContact> ball) : loop_({}, owned(std::move(ball))) {
        loop_.start(at(2e-3));
        move(2e-3);
    }
    /// The probe to a height above the ball, m, in steps of 0.1 mm.
    void go(double height_m) {
        while (std::abs(height_m - height_m_) > 1e-9)
            move(height_m_ + std::clamp(height_m - height_m_, -1e-4, 1e-4));
    }
    /// The probe held for 60 frames, which is longer than a ramp; the largest change of the force.
    double hold() {
        double largest_n = 0.0;
        for (int frame = 0; frame < 60; ++frame) {
            const Vec3 before_n = force_n_;
            move(height_m_);
            largest_n = std::max(largest_n, glm::length(force_n_ - before_n));
        }
        return largest_n;
    }
    void move(double height_m) {
        height_m_ = height_m;
        loop_.move(at(height_m));
        force_n_ = ContactLoop::kStiffness * (loop_.proxy() - at(height_m));
    }
    void set(double gain) { loop_.subdivision().gain(0, SurfacePart::strength).set(gain); }
    double force() const { return glm::length(force_n_); }
    SurfaceState state() { return loop_.surface(0).state(); }

private:
    static std::vector<std::unique_ptr<SurfaceContact>>
    owned(std::unique_ptr<SurfaceContact> ball) {
        std::vector<std::unique_ptr<SurfaceContact>> surfaces;
        surfaces.push_back(std::move(ball));
        return surfaces;
    }
    /// Not over a vertex of the mesh, nor over a voxel.
    static Vec3 at(double height_m) {
        return (kRadius + height_m) * glm::normalize(Vec3{0.13, 0.21, 1.0});
    }

    ContactLoop loop_;
    double height_m_ = 2e-3;
    Vec3 force_n_{0.0};
};

struct Case {
    test::Kind kind;
    double strength_n;
    Yielding yielding;

    std::string name() const {
        return test::name_of(kind) + (yielding == Yielding::opens ? " opens " : " holds ") +
               std::to_string(strength_n);
    }
    OnBall ball() const { return OnBall(test::ball(kind, kRadius, strength_n, yielding, 5)); }
    /// Of the force in one frame: what is pressed with 2 N fades from its strength at gain 1.
    double step_n() const {
        return (std::isinf(strength_n) ? 4.0 * kLimit : strength_n) * kStep + kTolerance_n;
    }
};

std::vector<Case> cases() {
    using enum test::Kind;
    std::vector<Case> all;
    for (const test::Kind kind : {formula, volume, mesh, guarded})
        for (const auto& [strength_n, yielding] :
             {std::pair{kHard, Yielding::holds}, std::pair{3.0, Yielding::holds},
              std::pair{3.0, Yielding::opens}})
            all.push_back({kind, strength_n, yielding});
    return all;
}

// 2 N on facets and voxels as good as on the sphere: both are within 0.05 mm of it, which is 0.025
// N.
constexpr double kShape_n = 0.03;

TEST(SurfaceGain, SwitchedOffUnderTheHandItFadesAndIsNotFeltAgainUntilLeft) {
    for (const Case& one : cases()) {
        OnBall ball = one.ball();
        ball.go(-kPressed);
        EXPECT_NEAR(ball.force(), 2.0, kShape_n) << one.name();
        ball.set(0.0);
        EXPECT_LE(ball.hold(), one.step_n()) << one.name();
        EXPECT_LE(ball.force(), kRounding_n) << one.name();
        ball.set(1.0);
        EXPECT_LE(ball.hold(), kRounding_n) << one.name();
        EXPECT_EQ(ball.state(), SurfaceState::inside) << one.name();
        for (const double height_m : {-6e-3, -1e-3, 1e-3}) {
            ball.go(height_m);
            EXPECT_LE(ball.force(), kRounding_n) << one.name() << " " << height_m;
        }
        EXPECT_NE(ball.state(), SurfaceState::inside) << one.name();
        ball.go(-kPressed);
        EXPECT_NEAR(ball.force(), 2.0, kShape_n) << one.name();
    }
}

TEST(SurfaceGain, SwitchedOffInTheAirItIsPassedAndComesBackWhenLeft) {
    for (const Case& one : cases()) {
        OnBall ball = one.ball();
        ball.set(0.0);
        ball.hold();
        ball.go(-kPressed);
        EXPECT_LE(ball.force(), kRounding_n) << one.name();
        ball.set(1.0);
        EXPECT_LE(ball.hold(), kRounding_n) << one.name();
        ball.go(1e-3);
        ball.go(-kPressed);
        EXPECT_NEAR(ball.force(), 2.0, kShape_n) << one.name();
    }
}

TEST(SurfaceGain, SwitchedOffAndOnInTheAirItIsThere) {
    for (const Case& one : cases()) {
        OnBall ball = one.ball();
        ball.set(0.0);
        ball.hold();
        ball.set(1.0);
        ball.hold();
        ball.go(-kPressed);
        EXPECT_NEAR(ball.force(), 2.0, kShape_n) << one.name();
    }
}

// A weak one yields with g s, or F g / (1 - g) where it was hard; at full strength again it holds
// where it was pushed to, without a kick, and at its own level once it has been left.
TEST(SurfaceGain, WeakenedItYieldsAndStrongAgainItHoldsWhereItWasPushed) {
    for (const Case& one : cases()) {
        if (one.yielding == Yielding::opens) continue;
        OnBall ball = one.ball();
        ball.set(0.2);
        ball.hold();
        ball.go(-kPressed);
        const double weak_n = std::isinf(one.strength_n) ? kLimit * 0.25 : 0.2 * one.strength_n;
        EXPECT_NEAR(ball.force(), weak_n, 1e-9) << one.name();
        ball.set(1.0);
        EXPECT_LE(ball.hold(), kTolerance_n) << one.name();
        EXPECT_NEAR(ball.force(), weak_n, kTolerance_n) << one.name();
        ball.go(-kPressed - 1e-3);
        EXPECT_NEAR(ball.force(), weak_n + 0.5, kShape_n) << one.name();
        ball.go(1e-3);
        EXPECT_LE(ball.force(), kRounding_n) << one.name();
        ball.go(-kPressed);
        EXPECT_NEAR(ball.force(), 2.0, kShape_n) << one.name();
    }
}

TEST(SurfaceGain, AMembraneOpensAtItsScaledStrength) {
    for (const Case& one : cases()) {
        if (one.yielding == Yielding::holds) continue;
        OnBall ball = one.ball();
        ball.set(0.5);
        ball.hold();
        ball.go(-2.8e-3);
        EXPECT_NEAR(ball.force(), 1.4, kShape_n) << one.name();
        ball.go(-3.2e-3); // 1.6 N are more than 1.5
        EXPECT_LE(ball.force(), kRounding_n) << one.name();
        EXPECT_EQ(ball.state(), SurfaceState::inside) << one.name();
    }
}

TEST(SurfaceGain, ContactDirectFadesToo) {
    const std::shared_ptr<const ScalarField> field = make_solid_sphere(kRadius);
    const auto mesh = std::make_shared<const TriangleMesh>(test::icosphere(kRadius, 5));
    OnBall ball(std::make_unique<DirectContact>(std::make_shared<const SurfaceScene>(mesh), field,
                                                LevelSettings{}));
    ball.go(-kPressed);
    EXPECT_NEAR(ball.force(), 2.0, kShape_n);
    ball.set(0.0);
    EXPECT_LE(ball.hold(), 4.0 * kLimit * kStep + kTolerance_n);
    EXPECT_LE(ball.force(), kRounding_n);
    ball.set(1.0);
    EXPECT_LE(ball.hold(), kRounding_n);
    ball.go(1e-3);
    ball.go(-kPressed);
    EXPECT_NEAR(ball.force(), 2.0, kShape_n);
}

// Each plane has the whole strength of the surface: of a weak one two of them, as in a notch, would
// resist more than it.
TEST(SurfaceGain, PlanesOfContactDirectShareTheStrengthWhereItIsWeak) {
    TriangleMesh faces; // of the notch, out to 30 mm
    faces.vertices = {{-0.03, -0.03, 0.03}, {-0.03, 0.03, 0.03}, {0, -0.03, 0},
                      {0, 0.03, 0},         {0.03, -0.03, 0.03}, {0.03, 0.03, 0.03}};
    faces.triangles = {{0, 2, 1}, {1, 2, 3}, {2, 4, 3}, {3, 4, 5}};
    const auto mesh = std::make_shared<const TriangleMesh>(std::move(faces));
    DirectContact notch(std::make_shared<const SurfaceScene>(mesh),
                        std::shared_ptr<const ScalarField>(make_wedge(270.0)), LevelSettings{});
    for (const double gain : {1.0, 0.5}) {
        notch.restart({0, 0, 5e-3});
        notch.set_gain({gain, kLimit});
        for (const double x : {-1e-4, 1e-4}) // over either face
            EXPECT_LT(notch.carry({x, 0, 1e-3}, {x, 0, -1e-3}).fraction, 1.0);
        ContactSet contacts;
        notch.offer({0, 0, 1e-6}, contacts);
        ASSERT_EQ(contacts.size(), 2u);
        EXPECT_EQ(contacts[1].plane.shares, gain < 1.0);
    }
}

// What is off is neither met nor near: a magnet on it does not draw.
TEST(SurfaceGain, AMagnetOfASurfaceThatIsOffDoesNotDraw) {
    const std::shared_ptr<const ScalarField> field = make_solid_sphere(kRadius);
    const auto mesh = std::make_shared<const TriangleMesh>(test::icosphere(kRadius, 5));
    for (const bool direct : {false, true}) {
        std::vector<std::unique_ptr<SurfaceContact>> surfaces;
        if (direct)
            surfaces.push_back(std::make_unique<DirectContact>(
                std::make_shared<const SurfaceScene>(mesh), field, LevelSettings{}));
        else
            surfaces.push_back(std::make_unique<VolumeContact>(field, LevelSettings{}));
        std::vector<SurfaceFinish> finish(1);
        finish[0].magnet = {1.0, 1e-3};
        ContactLoop loop({}, std::move(surfaces), {}, 0.0, finish);
        const Vec3 probe{0, 0, kRadius + 0.5e-3};
        loop.start(probe);
        loop.move(probe);
        EXPECT_LT(loop.proxy().z, probe.z - 0.1e-3) << "on, it does; direct: " << direct;
        loop.subdivision().gain(0, SurfacePart::strength).set(0.0);
        loop.start(probe);
        for (int i = 0; i < 10; ++i)
            loop.move(probe);
        EXPECT_EQ(loop.proxy(), probe) << "direct: " << direct;
    }
}

// A trial begins with the gains as they are set: there is no ramp to wait for.
TEST(SurfaceGain, ATrialBeginsWithIt) {
    ContactLoop loop({}, test::one_surface(make_solid_sphere(kRadius)));
    loop.subdivision().gain(0, SurfacePart::strength).set(0.0);
    loop.start({0, 0, kRadius + 1e-3});
    EXPECT_EQ(loop.move({0, 0, kRadius - 1e-3}).flags, kLiveGain);
    EXPECT_EQ(loop.proxy(), (Vec3{0, 0, kRadius - 1e-3}));
}

// ---- friction and effects ----------------------------------------------------------------------

// Dragged along a plate that is pressed with 1 N: mu times the gain.
TEST(FrictionGain, ScalesTheCoefficientsWithoutAStep) {
    ContactLoop loop({}, test::one_surface(make_slab(0.02)), {}, 0.0, {{{0.5, 0.4}, {}}});
    loop.start({0, 0, 0.011});
    double x = 0.0, along_n = 0.0, largest_n = 0.0;
    const auto drag = [&] {
        x += 0.1e-3;
        const Vec3 probe{x, 0, 0.008};
        loop.move(probe);
        const double now_n = ContactLoop::kStiffness * (probe.x - loop.proxy().x);
        largest_n = std::max(largest_n, std::abs(now_n - along_n));
        along_n = now_n;
    };
    for (int frame = 0; frame < 60; ++frame)
        drag();
    for (const double gain : {0.5, 0.0, 1.0, 2.0}) {
        loop.subdivision().gain(0, SurfacePart::friction).set(gain);
        largest_n = 0.0;
        for (int frame = 0; frame < 60; ++frame)
            drag();
        EXPECT_NEAR(along_n, gain * 0.4 * 1.0, 1e-7)
            << gain; // fixed point: 1e-10; tolerance 0.1 um
        // What it is at gain 1, times the step.
        EXPECT_LE(largest_n, 0.4 * 1.0 * kStep + kTolerance_n) << gain;
    }
}

/// Notes which of its functions are called.
class Called final : public Effect {
public:
    void restart(const Vec3& proxy) noexcept override {
        ++restarts;
        at = proxy;
    }
    void begin(const FrameContext&) noexcept override { ++begins; }
    void gather(const Vec3&, PrimitiveSet& primitives) noexcept override {
        ++gathers;
        primitives.add_force({1.0, 0, 0});
    }
    void solved(const Vec3&) noexcept override { ++gathers; }
    void commit(const FrameOutcome&) noexcept override { ++begins; }
    Vec3 device_force_n() const noexcept override { return {0, 2.0, 0}; }
    QueryCount queries() const noexcept override { return {}; }

    int restarts = 0, begins = 0, gathers = 0;
    Vec3 at{0.0};
};

TEST(EffectGain, WhatIsOffIsNotCalledAndBeginsAnew) {
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(std::make_unique<Called>());
    Called& effect = static_cast<Called&>(*effects[0]);
    ContactLoop loop({}, {}, std::move(effects));
    loop.start({0, 0, 0});
    EXPECT_EQ(loop.move({0, 0, 0}).flags, 0u);
    EXPECT_EQ(loop.proxy().x, 1.0 / ContactLoop::kStiffness);
    loop.subdivision().gain(0).set(0.5);
    for (int frame = 0; frame < 30; ++frame)
        EXPECT_EQ(loop.move({0, 0, 0}).flags, kLiveGain);
    EXPECT_EQ(loop.proxy().x, 0.5 / ContactLoop::kStiffness);
    EXPECT_EQ(loop.subdivision().with_device_forces(Vec3{0.0}), (Vec3{0, 1.0, 0}));
    loop.subdivision().gain(0).set(0.0);
    for (int frame = 0; frame < 30; ++frame)
        loop.move({0, 0, 0});
    const int begins = effect.begins, gathers = effect.gathers;
    loop.move({0, 0, 0.001});
    EXPECT_EQ(effect.begins, begins);
    EXPECT_EQ(effect.gathers, gathers);
    EXPECT_EQ(loop.proxy(), (Vec3{0, 0, 0.001}));
    EXPECT_EQ(loop.subdivision().with_device_forces(Vec3{0.0}), Vec3{0.0});
    EXPECT_EQ(effect.restarts, 1);
    loop.subdivision().gain(0).set(1.0);
    for (int frame = 0; frame < 60; ++frame)
        loop.move({0, 0, 0.002});
    EXPECT_EQ(effect.restarts, 2);
    EXPECT_EQ(effect.at, (Vec3{0, 0, 0.001})); // where the proxy was when it was switched on
    EXPECT_EQ(loop.move({0, 0, 0.002}).flags, 0u);
}

} // namespace
} // namespace palpate
