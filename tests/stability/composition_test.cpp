// SPDX-License-Identifier: Apache-2.0
// How effects make one frame: what composition.md 5 says must fail, fails.
#include <any>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/effects/coulomb_friction.h>
#include <palpate/haptics/effects/viscosity.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/contact_loop.h"

namespace palpate {
namespace {

constexpr double kK = test::ContactLoop::kStiffness;

/// An effect of what it adds at each evaluation.
class Gathering final : public Effect {
public:
    using Add = std::function<void(const FrameContext&, const Vec3&, PrimitiveSet&)>;
    explicit Gathering(Add add) : add_(std::move(add)) {}
    void begin(const FrameContext& frame) noexcept override { frame_ = frame; }
    void gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept override {
        add_(frame_, proxy, primitives);
    }
    QueryCount queries() const noexcept override { return {}; }

private:
    Add add_;
    FrameContext frame_;
};

SteppingSettings fixed(int sub_steps) {
    SteppingSettings settings;
    settings.method = SteppingMethod::fixed;
    settings.sub_steps = sub_steps;
    return settings;
}

std::vector<std::unique_ptr<Effect>> only(std::unique_ptr<Effect> effect) {
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(std::move(effect));
    return effects;
}

/// Lag behind a hand at 0.05 m/s in a medium of 1 N s/m, after 100 frames, m.
double lag_in_medium(std::unique_ptr<Effect> medium, int sub_steps) {
    test::ContactLoop loop(fixed(sub_steps), {}, only(std::move(medium)));
    loop.start(Vec3{0.0});
    for (int i = 1; i <= 100; ++i)
        loop.move({0.05e-3 * i, 0, 0});
    return 5e-3 - loop.proxy().x;
}

// b v / k = 0.1 mm, for any number of sub-steps composition.md 3.4
TEST(Composition, ViscosityAnchoredAtTheFramesStartIsTheSameForAnyNumberOfSubSteps) {
    for (const int sub_steps : {1, 2, 4, 16, 46})
        EXPECT_NEAR(lag_in_medium(std::make_unique<Viscosity>(1.0), sub_steps), 0.1e-3, 1e-9);
}

TEST(CompositionControl, ViscosityAnchoredAtTheSubStepFades) {
    const auto medium = [] {
        return std::make_unique<Gathering>(
            [](const FrameContext& frame, const Vec3& proxy, PrimitiveSet& primitives) {
                primitives.add_spring(proxy, 1.0 / frame.period_s);
            });
    };
    EXPECT_NEAR(lag_in_medium(medium(), 1), 0.1e-3, 1e-9);
    EXPECT_LT(lag_in_medium(medium(), 46), 0.5 * 0.1e-3); // composition.md 3.4
}

enum class Fault {
    none,
    carries_nothing, ///< its certificate is not asked
    level_moves,     ///< it holds where it was pushed to, as if it yielded
    looks_flat,    ///< its planes are those of a flat wall: steps take no account of its curvature
    yields_at_once ///< a membrane whose strength the solver knows, where it is offered as hard
};

/// A surface with a fault.
class Tampered final : public SurfaceContact {
public:
    Tampered(std::unique_ptr<VolumeContact> contact, Fault fault)
        : contact_(std::move(contact)), fault_(fault) {}
    bool restart(const Vec3& p) noexcept override { return contact_->restart(p); }
    void set_gain(const Gain& gain) noexcept override { contact_->set_gain(gain); }
    void offer(const Vec3& p, ContactSet& contacts, NearestPlane* nearest) noexcept override {
        ContactSet offered;
        contact_->offer(p, offered, nearest);
        for (std::size_t i = 0; i < offered.size(); ++i) {
            ContactPlane contact = offered[i];
            if (fault_ == Fault::looks_flat) contact.slope = Vec3{0.0};
            if (fault_ == Fault::looks_flat) contact.depth_hessian = Mat3{0.0};
            if (fault_ == Fault::yields_at_once)
                contact.plane.strength_n = contact_->opens_above_n();
            contacts.add(contact);
        }
    }
    void keep_active(const ProxySolution& s, std::size_t first) noexcept override {
        contact_->keep_active(s, first);
    }
    Chord carry(const Vec3& from, const Vec3& to) noexcept override {
        return fault_ == Fault::carries_nothing ? Chord{} : contact_->carry(from, to);
    }
    FieldSurface* of_field() noexcept override { return contact_->of_field(); }
    double trust_m() const noexcept override { return contact_->trust_m(); }
    void commit(const Vec3& p, bool yielded, bool felt) noexcept override {
        contact_->commit(p, yielded || (felt && fault_ == Fault::level_moves), felt);
    }
    SurfaceState state() const noexcept override { return contact_->state(); }
    Membrane* membrane() noexcept override { return contact_->membrane(); }
    QueryCount queries() const noexcept override { return contact_->queries(); }
    std::any save_state() const override { return contact_->save_state(); }
    void restore_state(const std::any& state) override { contact_->restore_state(state); }

private:
    std::unique_ptr<VolumeContact> contact_;
    Fault fault_;
};

std::vector<std::unique_ptr<SurfaceContact>> tampered(std::shared_ptr<const ScalarField> field,
                                                      Fault fault, LevelSettings level = {}) {
    // A hard one refuses to move its level.
    if (fault == Fault::level_moves) level.strength_n = 1e6;
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::make_unique<Tampered>(
        std::make_unique<VolumeContact>(std::move(field), level), fault));
    return surfaces;
}

constexpr double kBall = 10e-3; // m, radius

/// How deep the last frame's chords went into a ball around the origin, by 21 samples each, m.
double deepest_on_path(test::ContactLoop& loop) {
    const auto path = loop.subdivision().path();
    double deepest = -1.0;
    for (std::size_t c = 1; c < path.size(); ++c)
        for (int k = 0; k <= 20; ++k)
            deepest = std::max(
                deepest, kBall - glm::length(path[c - 1] + (k / 20.0) * (path[c] - path[c - 1])));
    return deepest;
}

/// Deepest place of any chord in a ball while the hand jumps by up to 40 mm, m.
double deepest_in_ball(Fault fault) {
    test::ContactLoop loop({}, tampered(make_solid_sphere(kBall), fault));
    loop.start({15e-3, 0, 0});
    std::mt19937 random(1);
    std::uniform_real_distribution<double> place(-20e-3, 20e-3);
    double deepest = -1.0;
    for (int i = 0; i < 3000; ++i) {
        const double x = place(random), y = place(random), z = place(random);
        loop.move({x, y, z});
        deepest = std::max(deepest, deepest_on_path(loop));
    }
    return deepest;
}

TEST(Composition, CarriedChordsHoldTheCertificate) {
    EXPECT_LE(deepest_in_ball(Fault::none), LevelSettings{}.certificate_m * (1.0 + 1e-9));
}

TEST(CompositionControl, WithoutCarryingChordsGoThrough) {
    EXPECT_GT(deepest_in_ball(Fault::carries_nothing), 1e-3);
}

/// How far the proxy is behind the wall of a cavity of 10 mm after a hand 2.9 mm deep has gone
/// around for 600 frames of 10 mrad, with four sub-steps each, m.
double drift_in_cavity(Fault fault) {
    constexpr double kRadius = 10e-3, kDepth = 2.9e-3;
    test::ContactLoop loop(fixed(4), tampered(make_sphere_cavity(kRadius), fault));
    loop.start({kRadius - 1e-6, 0, 0});
    for (int i = 0; i < 600; ++i)
        loop.move((kRadius + kDepth) * Vec3{std::cos(10e-3 * i), std::sin(10e-3 * i), 0.0});
    return glm::length(loop.proxy()) - kRadius;
}

// The last sub-step of a frame, a fourth of its h = 0.1 mm, leaves up to (h / 4)^2 / (2 R) = 0.031
// um, which the next frame restores; where the level moves they add up.
TEST(Composition, AHardSurfacesLevelStaysWhereItIs) {
    EXPECT_LE(drift_in_cavity(Fault::none), 0.031e-6);
}

TEST(CompositionControl, AHardSurfaceWhoseLevelMovesIsLeft) {
    EXPECT_GT(drift_in_cavity(Fault::level_moves), 100 * 0.031e-6);
}

enum class Anchor { frame, sub_step };

/// Angle by which the proxy lags in a cavity of 10 mm behind a hand 2.9 mm deep that goes around
/// at 50 mrad a frame, under a friction of 0.2.
double lag_in_cavity(const SteppingSettings& settings, Anchor anchor, Fault fault) {
    constexpr double kRadius = 10e-3, kDepth = 2.9e-3, kMu = 0.2;
    auto drag = std::make_unique<Gathering>(
        [anchor](const FrameContext& frame, const Vec3& proxy, PrimitiveSet& primitives) {
            const Vec3 normal = glm::normalize(proxy);
            const double pressing_n = kK * (glm::dot(frame.probe, normal) - kRadius);
            const Vec3& from = anchor == Anchor::frame ? frame.start : proxy;
            primitives.add_line({from, normal, kMu * std::max(0.0, pressing_n)});
        });
    test::ContactLoop loop(settings, tampered(make_sphere_cavity(kRadius), fault),
                           only(std::move(drag)));
    loop.start({kRadius - 1e-6, 0, 0});
    double angle = 0.0;
    for (int i = 0; i < 60; ++i) {
        angle = 50e-3 * i;
        loop.move((kRadius + kDepth) * Vec3{std::cos(angle), std::sin(angle), 0.0});
    }
    return std::remainder(angle - std::atan2(loop.proxy().y, loop.proxy().x),
                          2.0 * std::acos(-1.0));
}

// phi - asin(R sin phi / |a|), tan phi = mu: 4.54e-2 rad composition.md 3.4
double closed_lag() {
    const double phi = std::atan(0.2);
    return phi - std::asin(10.0 * std::sin(phi) / 12.9);
}

/// Full steps to the end, without regard for curvature where `Fault::looks_flat`.
SteppingSettings to_the_end() {
    SteppingSettings settings;
    settings.evaluation_cap = 60;
    return settings;
}

TEST(Composition, FrictionAnchoredAtTheFramesStartHasTheClosedFormsLag) {
    const double lag = closed_lag();
    // The last of 46 shares of 50 mrad goes too far by its depth over the radius.
    EXPECT_NEAR(lag_in_cavity(fixed(46), Anchor::frame, Fault::none), lag, 0.29 * 50e-3 / 46);
    for (const Fault fault : {Fault::none, Fault::looks_flat})
        EXPECT_NEAR(lag_in_cavity(to_the_end(), Anchor::frame, fault), lag,
                    to_the_end().tolerance_m / 10e-3);
}

// Steps that take a hollow wall for flat go too far, and what holds from there on keeps them from
// coming back.
TEST(CompositionControl, FrictionAnchoredAtTheSubStepFreezesAnOvershoot) {
    EXPECT_LT(lag_in_cavity(to_the_end(), Anchor::sub_step, Fault::looks_flat), 0.8 * closed_lag());
}

/// Deepest place of any chord below a membrane around a ball that opens above 1 N, while a hand
/// that presses with 0.95 N leaps about it by up to 1 rad, m.
double deepest_below_membrane(Fault fault) {
    LevelSettings membrane;
    membrane.strength_n = 1.0;
    membrane.yielding = Yielding::opens;
    test::ContactLoop loop({}, tampered(make_solid_sphere(kBall), fault, membrane));
    loop.start({kBall + 1e-6, 0, 0});
    std::mt19937 random(5);
    std::uniform_real_distribution<double> leap(-1.0, 1.0);
    double deepest = 0.0, angle = 0.0;
    for (int i = 0; i < 500; ++i) {
        angle += leap(random);
        loop.move((kBall - 0.95 / kK) * Vec3{std::cos(angle), std::sin(angle), 0.0});
        deepest = std::max(deepest, deepest_on_path(loop));
    }
    return deepest;
}

// Whether it opens is for the balance at the end to say: offered as hard, nothing passes it on the
// way there, where the planes of a sub-step may be pressed by more.
TEST(Composition, AMembraneOpensByTheBalanceAlone) {
    EXPECT_LE(deepest_below_membrane(Fault::none), LevelSettings{}.certificate_m);
}

TEST(CompositionControl, AMembraneWhoseStrengthTheSolverKnowsLetsThroughTooEarly) {
    EXPECT_GT(deepest_below_membrane(Fault::yields_at_once), 1e-3);
}

/// Friction of 0.4 on both faces of a notch of 90 degrees, and nothing else: frames that begin
/// where the last one's solution ended, with no movement taken for rounding.
class RubbingNotch {
public:
    RubbingNotch() : friction_({{0.4, 0.4}}) {
        for (const double side : {-1.0, 1.0}) {
            ContactPlane face;
            face.plane = {Vec3{0.0}, glm::normalize(Vec3{side, 0.0, 1.0}),
                          std::numeric_limits<double>::infinity()};
            faces_.add(face);
        }
    }
    /// The next frame begins as a trial's first, without multipliers.
    void forget() { friction_.restart(); }
    void move(const Vec3& probe) {
        friction_.begin();
        Vec3 end{0.0};
        do {
            PrimitiveSet primitives;
            for (std::size_t i = 0; i < faces_.size(); ++i)
                primitives.add(faces_[i].plane);
            friction_.gather(proxy_, faces_, primitives);
            int work = 1 << 20; // as much as it wants
            ProxySolution solution;
            friction_.solve(primitives, probe, kK, work, solution);
            end = solution.proxy;
        } while (friction_.breaks_away());
        friction_.commit();
        proxy_ = end;
    }
    const Vec3& proxy() const { return proxy_; }
    bool holds() const { return friction_.holds(); }

private:
    CoulombFriction friction_;
    ContactSet faces_;
    Vec3 proxy_{0.0};
};

// Pressed with 1 N: both faces bear 0.707 N, and friction along the edge up to 0.566 N, which is a
// pull of 1.13 mm. Each frame solves its fixed point to its end, so that nothing has to be known of
// the one before: 2000 frames come to no more than 2000 roundings of 2 mm.
TEST(Composition, InANotchFrictionHoldsWithAndWithoutTheMultipliersOfTheFrameBefore) {
    for (const bool forgets : {false, true})
        for (const double along_m : {0.1e-3, 0.3e-3, 0.9e-3, 1.1e-3}) {
            RubbingNotch notch;
            for (int i = 0; i < 2000; ++i) {
                if (forgets) notch.forget();
                notch.move({0.1e-3, along_m, -2e-3});
                ASSERT_TRUE(notch.holds()) << forgets << " " << along_m << " " << i;
            }
            EXPECT_LE(glm::length(notch.proxy()), 2000 * 4.4e-19) << forgets << " " << along_m;
        }
}

TEST(CompositionControl, InANotchAPullThatFrictionDoesNotBearMovesTheProxy) {
    RubbingNotch notch;
    notch.move({0.1e-3, 1.3e-3, -2e-3});
    EXPECT_NEAR(notch.proxy().y, 1.3e-3 - 0.4 * std::sqrt(2.0) / kK, 1e-9);
}

/// Two lines of friction 0.1 and 0.4 on one surface, under a hand that is held at the edge of
/// sliding: how many of 500 frames move the proxy, where the first bears `share()` of what presses.
int frames_that_move_under_split(const std::function<double()>& share) {
    constexpr double kRadius = 10e-3, kDepth = 2.9e-3;
    auto rub = std::make_unique<Gathering>(
        [&share](const FrameContext& frame, const Vec3& proxy, PrimitiveSet& primitives) {
            const Vec3 normal = glm::normalize(proxy);
            const double pressing_n = std::max(0.0, kK * (glm::dot(frame.probe, normal) - kRadius));
            const double first = share();
            primitives.add_line({frame.start, normal, 0.1 * first * pressing_n});
            primitives.add_line({frame.start, normal, 0.4 * (1.0 - first) * pressing_n});
        });
    test::ContactLoop loop({}, test::one_surface(make_sphere_cavity(kRadius)),
                           only(std::move(rub)));
    loop.start({kRadius - 1e-6, 0, 0});
    double angle = 0.0;
    const auto hand = [&] {
        return (kRadius + kDepth) * Vec3{std::cos(angle), std::sin(angle), 0.0};
    };
    for (int i = 0; i < 60; ++i, angle += 10e-3)
        loop.move(hand());
    for (int i = 0; i < 20; ++i)
        loop.move(hand());
    int moved = 0;
    for (int i = 0; i < 500; ++i) {
        const Vec3 before = loop.proxy();
        loop.move(hand());
        if (loop.proxy() != before) ++moved;
    }
    return moved;
}

TEST(Composition, ADefiniteSplitOfALoadBetweenTwoFrictionsHolds) {
    EXPECT_EQ(frames_that_move_under_split([] { return 0.3; }), 0);
}

TEST(CompositionControl, ARandomSplitOfALoadBetweenTwoFrictionsCreeps) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> any(0.0, 1.0);
    EXPECT_GT(frames_that_move_under_split([&] { return any(random); }), 0);
}

// Which of two planes in one place bears the load is left open by the solver: the weaker does, up
// to its strength, and the bone the rest (composition.md 4.2). So the hand slides against 0.1 times
// the skin's 1 N and 0.4 times what is left of N.
TEST(Composition, ASkinPushedDownToBoneRubsWithItsStrengthAndTheBoneWithTheRest) {
    constexpr double kBone = 5e-3, kSkin = 8e-3, kWay = 10e-3; // m
    SteppingSettings settings = to_the_end();
    settings.tolerance_m = 1e-12;
    for (const bool bone_first : {false, true})
        for (const double pressing_n : {1.5, 3.0}) {
            std::vector<std::unique_ptr<SurfaceContact>> surfaces;
            std::vector<SurfaceFinish> finish;
            for (const bool bone : {bone_first, !bone_first}) {
                LevelSettings level;
                if (!bone) level.strength_n = 1.0;
                surfaces.push_back(std::make_unique<VolumeContact>(
                    std::shared_ptr<const ScalarField>(make_slab(2.0 * (bone ? kBone : kSkin))),
                    level));
                finish.push_back(
                    {bone ? FrictionCoefficients{0.4, 0.4} : FrictionCoefficients{0.1, 0.1}, {}});
            }
            test::ContactLoop loop(settings, std::move(surfaces), {}, 0.0, finish);
            const double z = kBone - pressing_n / kK;
            loop.start({0, 0, kSkin + 1e-3});
            for (int i = 0; i <= 200; ++i)
                loop.move({0, 0, std::max(z, kSkin + 1e-3 - 0.1e-3 * i)});
            ASSERT_NEAR(loop.proxy().z, kBone, 1e-12) << "the skin lies on the bone";
            for (int i = 1; i <= 100; ++i)
                loop.move({0.01 * i * kWay, 0, z});
            const double sliding_n = kK * (kWay - loop.proxy().x);
            EXPECT_NEAR(sliding_n, 0.1 * 1.0 + 0.4 * (pressing_n - 1.0), 1e-9) << bone_first;
            const Vec3 held = loop.proxy();
            for (int i = 0; i < 2000; ++i) {
                loop.move({kWay, 0, z});
                ASSERT_EQ(loop.proxy(), held) << bone_first << " " << pressing_n << " " << i;
            }
        }
}

} // namespace
} // namespace palpate
