// SPDX-License-Identifier: Apache-2.0
// Soft surfaces over hard ones, over soft ones, and beside what holds the tip: against closed
// forms, and against the elimination that a soft surface alone allows (docs/palpation.md).
#include <palpate/haptics/contact/softness.h>

#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/contact/mesh_contact.h>
#include <palpate/haptics/effects/point_guide.h>
#include <palpate/haptics/effects/viscosity.h>
#include <palpate/haptics/effects/workspace.h>
#include <palpate/haptics/stepping/frame_flags.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/contact_kinds.h"
#include "tests/support/soft_layers.h"

namespace palpate {
namespace {

using test::ball;
using test::ContactLoop;
using test::force;
using test::Kind;
using test::precise_layers;
using test::soft;
using test::Surfaces;
using test::surfaces;

constexpr double kK = ContactLoop::kStiffness;

/// Does nothing, and does not say that it only pushes: the tip is then solved, not eliminated.
class Idle final : public Effect {
public:
    void begin(const FrameContext&) noexcept override {}
    void gather(const Vec3&, PrimitiveSet&) noexcept override {}
    QueryCount queries() const noexcept override { return {}; }
};

std::vector<std::unique_ptr<Effect>> idle() {
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(std::make_unique<Idle>());
    return effects;
}

struct Tally {
    double worst_n = 0.0, deepest_m = 0.0;
    double evaluations = 0.0;
    std::uint32_t most = 0;
    int frames = 0, capped = 0;
};

/// The bone: voxels of 0.5 mm reach 15 mm beyond it.
std::unique_ptr<SurfaceContact> bone_of(Kind kind) {
    constexpr double kRadius = 50e-3;
    if (kind == Kind::formula) return ball(kRadius);
    if (kind == Kind::mesh)
        return test::ball(kind, kRadius, std::numeric_limits<double>::infinity(), Yielding::holds,
                          5);
    return std::make_unique<VolumeContact>(
        test::voxels_of([](const Vec3& p) { return kRadius - glm::length(p); }, 65e-3, 0.5e-3),
        LevelSettings{});
}

/// A layer of slope K at the hand, at a gain g: the force over how deep the probe is.
void expect_strength_left(Softness softness) {
    constexpr double kGain = 0.2, kLeft_n = 5.0 * kGain / (1.0 - kGain); // Gain::strength_n
    SurfaceFinish skin;
    skin.softness = softness;
    const PressLaw law(softness, kK);
    ContactLoop loop(precise_layers(), surfaces(ball(30e-3), ball(60e-3)), {}, 0.0, {{}, skin});
    loop.start({61e-3, 0, 0});
    loop.subdivision().gain(1, SurfacePart::strength).set(kGain);
    for (int i = 0; i < 60; ++i)
        loop.move({61e-3, 0, 0});
    for (double depth_m = 0.5e-3; depth_m < 16e-3; depth_m += 0.5e-3) {
        const Vec3 probe{60e-3 - depth_m, 0, 0};
        loop.move(probe);
        EXPECT_NEAR(force(loop, probe).x, std::min(law.force_n(depth_m), kLeft_n), 1e-6) << depth_m;
    }
}

/// Press to `depth` and drag, over soft skin of 60 mm around bone of 50.
Tally skin_over_bone(double stiffness, double step, double depth, const SteppingSettings& settings,
                     Kind bone = Kind::formula) {
    Surfaces both = surfaces(bone_of(bone), ball(60e-3));
    ContactLoop loop(settings, std::move(both), {}, 0.0, {{}, soft(stiffness)});
    loop.start({61e-3, 0, 0});
    Tally tally;
    const int press = static_cast<int>(depth / step);
    for (int i = 0; i < press + 150; ++i) {
        const double d = std::min(depth, step * i);
        const double angle = i < press ? 0.0 : step / 60e-3 * (i - press);
        const Vec3 up{std::cos(angle), 0.6 * std::sin(angle), 0.8 * std::sin(angle)};
        const Vec3 probe = (60e-3 - d) * up;
        const SubdivisionResult result = loop.move(probe);
        const double tip = std::max(50e-3, 60e-3 - d + stiffness * d / kK);
        tally.worst_n =
            std::max(tally.worst_n, glm::length(force(loop, probe) - kK * (tip - 60e-3 + d) * up));
        tally.deepest_m = std::max(tally.deepest_m, 50e-3 - glm::length(loop.proxy()));
        tally.evaluations += result.evaluations;
        tally.most = std::max(tally.most, result.evaluations);
        tally.capped += (result.flags & kEvaluationCap) != 0 ? 1 : 0;
        ++tally.frames;
    }
    tally.evaluations /= tally.frames;
    return tally;
}

TEST(SoftLayers, AGainLeavesTheStrengthThatTheHandFeels) {
    expect_strength_left(Softness::linear(150.0));
    Softness table;
    table.knots[0] = {4e-3, 0.4};
    table.knots[1] = {8e-3, 1.8};
    table.count = 2;
    expect_strength_left(table);
}

// Two last steps of the tolerance would be 2 k tolerance, 1e-4 N with the usual one; but Newton
// leaves the square of its last step, so far less.
TEST(SoftLayers, SkinOverBoneIsFeltAsTheClosedFormSays) {
    for (const double stiffness : {50.0, 100.0, 200.0, 450.0})
        for (const double step : {2e-4, 2e-3}) {
            const Tally tally = skin_over_bone(stiffness, step, 16e-3, precise_layers());
            EXPECT_LE(tally.worst_n, 1e-10) << stiffness << ' ' << step;
            EXPECT_LE(tally.deepest_m, 1e-15); // rounding
            const Tally usual = skin_over_bone(stiffness, step, 16e-3, {});
            EXPECT_LE(usual.worst_n, 1e-8) << stiffness << ' ' << step;
            EXPECT_LE(usual.deepest_m, 1e-15);
            EXPECT_LE(usual.most, 3u) << stiffness << ' ' << step;
            EXPECT_EQ(tally.capped + usual.capped, 0);
        }
}

// As behind a device that bears less than the scene's coupling: the skin is then the stiffer one.
TEST(SoftLayers, WhatIsStifferThanTheCouplingIsNotPassed) {
    ContactLoop loop({}, surfaces(ball(50e-3), ball(60e-3)), {}, 0.0, {{}, soft(2.0 * kK)});
    loop.start({61e-3, 0, 0});
    for (int i = 0; i < 200; ++i) {
        const double depth = std::min(20e-3, 2e-4 * i);
        const Vec3 probe{60e-3 - depth, 0, 0};
        const SubdivisionResult result = loop.move(probe);
        // Tissue of a hundred times the coupling's stiffness, in series with that.
        EXPECT_NEAR(force(loop, probe).x, kK * depth * 100.0 / 101.0, 2.0 * kK * 1e-7) << i;
        EXPECT_EQ(result.contacts, depth > 0.0 ? 1u : 0u) << i;
    }
}

TEST(SoftLayers, OneThatIsAloneIsTheSameEliminatedOrSolved) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (const double stiffness : {60.0, 200.0, 450.0, 490.0}) {
        const auto field = [] {
            return std::shared_ptr<const ScalarField>(make_bumpy_cavity(30e-3, 0.3e-3, 12e-3));
        };
        ContactLoop eliminated(precise_layers(), test::one_surface(field()), {}, 0.0,
                               {soft(stiffness)});
        ContactLoop solved(precise_layers(), test::one_surface(field()), idle(), 0.0,
                           {soft(stiffness)});
        Vec3 probe{25e-3, 0, 0};
        eliminated.start(probe);
        solved.start(probe);
        double worst_n = 0.0, sum_n = 0.0;
        for (int i = 0; i < 1500; ++i) {
            const double x = unit(random), y = unit(random), z = unit(random);
            probe += 3e-4 * Vec3{x, y, z};
            probe *= (31e-3 + 1e-3 * std::sin(0.01 * i)) / glm::length(probe);
            eliminated.move(probe);
            solved.move(probe);
            const double difference = kK * glm::length(eliminated.proxy() - solved.proxy());
            worst_n = std::max(worst_n, difference);
            sum_n += difference;
        }
        // 2 k tolerance would be 1e-7 N; of a last step, Newton leaves the square.
        EXPECT_LE(worst_n, 1e-8) << stiffness;
        EXPECT_LE(sum_n / 1500, 1e-10) << stiffness;
    }
}

TEST(SoftLayers, SeveralLayersOverBone) {
    // Behind a coupling of 500 N/m; in series: the tip is where all forces balance.
    const double radii[3] = {60e-3, 58e-3, 50e-3}, stiffnesses[3] = {50.0, 150.0, 250.0};
    Surfaces all = surfaces(ball(60e-3), ball(58e-3), ball(50e-3), ball(45e-3));
    ContactLoop loop(precise_layers(), std::move(all), {}, 0.0,
                     {soft(stiffnesses[0]), soft(stiffnesses[1]), soft(stiffnesses[2]), {}});
    loop.start({61e-3, 0, 0});
    for (int i = 0; i < 300; ++i) {
        const double angle = 1e-3 * i;
        const Vec3 up{std::cos(angle), 0.6 * std::sin(angle), 0.8 * std::sin(angle)};
        const double r = 60e-3 - std::min(2e-4 * i, 30e-3);
        loop.move(r * up);
        const auto rest = [&](double x) {
            double f = kK * (r - x);
            for (int l = 0; l < 3; ++l)
                f += std::max(0.0, radii[l] - x) / (1.0 / stiffnesses[l] - 1.0 / kK);
            return f;
        };
        double low = 0.0, high = 61e-3;
        for (int n = 0; n < 100; ++n)
            (rest(0.5 * (low + high)) > 0.0 ? low : high) = 0.5 * (low + high);
        const double tip = std::max(45e-3, low);
        EXPECT_LE(glm::length(loop.proxy() - tip * up), 1e-9) << i;
    }
}

TEST(SoftLayers, BoneIsNeverPassedAtAnySpeed) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (const double stiffness : {50.0, 450.0}) {
        Surfaces both = surfaces(ball(50e-3), ball(60e-3));
        ContactLoop loop({}, std::move(both), {}, 0.0, {{}, soft(stiffness)});
        loop.start({65e-3, 0, 0});
        double deepest_m = 0.0;
        for (int i = 0; i < 5000; ++i) {
            const double x = unit(random), y = unit(random), z = unit(random);
            const double reach = std::min(0.4, std::pow(400.0, unit(random)) * 1e-3);
            Vec3 probe = loop.proxy() + reach * Vec3{x, y, z};
            if (glm::length(probe) > 0.08) probe *= 0.08 / glm::length(probe);
            loop.move(probe);
            const auto path = loop.subdivision().path();
            for (std::size_t c = 1; c < path.size(); ++c)
                for (int s = 0; s <= 20; ++s)
                    deepest_m = std::max(
                        deepest_m,
                        50e-3 - glm::length(path[c - 1] + s / 20.0 * (path[c] - path[c - 1])));
        }
        EXPECT_LE(deepest_m, 25e-6 * (1 + 1e-9));
    }
}

TEST(SoftLayers, AHeldProbeKeepsTheBits) {
    std::mt19937 random(9);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (int trial = 0; trial < 60; ++trial) {
        Surfaces both = surfaces(ball(50e-3), ball(60e-3));
        const double stiffness = trial % 3 == 0 ? 50.0 : trial % 3 == 1 ? 200.0 : 480.0;
        ContactLoop loop({}, std::move(both), {}, 0.0, {{}, soft(stiffness)});
        const double x = unit(random), y = unit(random), z = unit(random);
        const Vec3 u = glm::normalize(Vec3{x, y, z});
        loop.start(65e-3 * u);
        Vec3 probe = (50e-3 + 8e-3 * unit(random)) * u + 1e-3 * Vec3{y, z, x};
        for (int i = 0; i < 30; ++i)
            loop.move(probe);
        const Vec3 rests = loop.proxy();
        for (int i = 0; i < 200; ++i) {
            loop.move(probe);
            ASSERT_EQ(loop.proxy(), rests) << trial << ' ' << i;
        }
    }
}

TEST(SoftLayers, WorkOverClosedWaysIsThatOfTheZeroOrderHold) {
    double work[2];
    for (int refined = 0; refined < 2; ++refined) {
        const int frames = 1500 << (2 * refined);
        Surfaces both = surfaces(ball(50e-3), ball(60e-3));
        ContactLoop loop(precise_layers(), std::move(both), {}, 0.0, {{}, soft(150.0)});
        const auto place = [&](int i) {
            const double s = 2.0 * std::numbers::pi * i / frames;
            const double d = 9e-3 + 8e-3 * std::sin(2.0 * s); // onto bone and off it
            return (60e-3 - d) * Vec3{std::cos(0.3 * std::sin(s)),
                                      std::sin(0.3 * std::sin(s)) * std::cos(s),
                                      std::sin(0.3 * std::sin(s)) * std::sin(s)};
        };
        loop.start({62e-3, 0, 0});
        for (int i = 0; i < 20; ++i)
            loop.move(place(0));
        double work_j = 0.0, bound_j = 0.0;
        for (int i = 1; i <= frames; ++i) {
            const Vec3 step = place(i) - place(i - 1);
            work_j += glm::dot(force(loop, place(i - 1)), step);
            bound_j += 0.5 * kK * glm::dot(step, step);
            loop.move(place(i));
        }
        EXPECT_LE(work_j, bound_j);
        work[refined] = work_j;
    }
    EXPECT_NEAR(work[0] / work[1], 4.0, 0.08);
}

TEST(SoftLayers, MeshesAndVoxelsBeneath) {
    for (const Kind kind : {Kind::mesh, Kind::volume}) {
        const Tally tally = skin_over_bone(150.0, 2e-4, 16e-3, {}, kind);
        // A ball of 20 480 facets sags by 20 um, and holds up to half a facet aside; voxels of 0.5
        // mm err by 2 um.
        EXPECT_LE(tally.worst_n, kind == Kind::volume ? 2e-3 : 0.05) << test::name_of(kind);
        EXPECT_LE(tally.deepest_m, kind == Kind::volume ? 4e-6 : 25e-6);
        EXPECT_EQ(tally.capped, 0);
        EXPECT_LE(tally.evaluations, 2.5);
        EXPECT_LE(tally.most, 6u);
    }
}

// ---- with what holds the tip -------------------------------------------------------------------

/// A plate about z = 0.
std::unique_ptr<SurfaceContact> plate(double top_m) {
    return std::make_unique<VolumeContact>(
        std::shared_ptr<const ScalarField>(make_slab(2.0 * top_m)), LevelSettings{});
}

constexpr double kTop = 10e-3;
constexpr double kStiffness = 150.0;
constexpr double kTissue = 1.0 / (1.0 / kStiffness - 1.0 / kK);

TEST(SoftLayers, AMediumBrakesTheTip) {
    constexpr double kDamping = 2.0, kSpring = kDamping / 1e-3;
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(std::make_unique<Viscosity>(kDamping));
    ContactLoop loop(precise_layers(), surfaces(plate(kTop)), std::move(effects), 0.0,
                     {soft(kStiffness)});
    Vec3 tip{0, 0, kTop + 1e-3};
    loop.start(tip);
    for (int i = 0; i < 200; ++i) {
        const Vec3 probe{1e-4 * i, 0, kTop + 1e-3 - 1e-4 * std::min(i, 60)};
        loop.move(probe);
        Vec3 expected = (kK * probe + kSpring * tip) / (kK + kSpring);
        if (expected.z < kTop)
            expected.z =
                (kK * probe.z + kSpring * tip.z + kTissue * kTop) / (kK + kSpring + kTissue);
        EXPECT_LE(glm::length(loop.proxy() - expected), 1e-12) << i;
        tip = loop.proxy();
    }
}

TEST(SoftLayers, AGuideHoldsTheTipUpToItsStrength) {
    const Vec3 point{0, 0, kTop - 4e-3};
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(std::make_unique<PointGuide>(point, GuideSettings{0.6, 5e-3}));
    ContactLoop loop(precise_layers(), surfaces(plate(kTop)), std::move(effects), 0.0,
                     {soft(kStiffness)});
    loop.start({0, 0, kTop + 1e-4});
    int held = 0, slipped = 0;
    for (int i = 0; i < 120; ++i) {
        const Vec3 probe{0, 0, kTop - 1e-4 * i};
        loop.move(probe);
        // On the axis: what coupling and tissue leave to the guide.
        const double rest_n = kK * (probe.z - point.z) + kTissue * (kTop - point.z);
        double expected = point.z;
        if (std::abs(rest_n) > 0.6) {
            const double guide_n = rest_n > 0.0 ? -0.6 : 0.6;
            expected = (kK * probe.z + kTissue * kTop + guide_n) / (kK + kTissue);
            if (expected > kTop) continue; // let go or free
            ++slipped;
        } else {
            ++held;
        }
        EXPECT_NEAR(loop.proxy().z, expected, 1e-10) << i;
    }
    EXPECT_GT(held, 10);
    EXPECT_GT(slipped, 10);
}

TEST(SoftLayers, AWorkspaceEndsInTheTissue) {
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(std::make_unique<WorkspaceSphere>(Vec3{0, 0, 2.0 * kTop}, kTop + 2e-3,
                                                        std::numeric_limits<double>::infinity()));
    ContactLoop loop(precise_layers(), surfaces(plate(kTop)), std::move(effects), 0.0,
                     {soft(kStiffness)});
    loop.start({0, 0, kTop + 1e-3});
    for (int i = 0; i < 100; ++i) {
        const Vec3 probe{0, 0, kTop - 1e-4 * i};
        loop.move(probe);
        const double tip = (kK * probe.z + kTissue * kTop) / (kK + kTissue);
        EXPECT_NEAR(loop.proxy().z, std::max(tip, kTop - 2e-3), 1e-10) << i; // 2 mm below the top
    }
}

TEST(SoftLayers, FrictionOfBoneGoesByWhatPressesOnBone) {
    constexpr double kMu = 0.3, kBone = 5e-3, kDepth = 8e-3;
    SurfaceFinish rough;
    rough.friction = {kMu, kMu};
    ContactLoop loop(precise_layers(), surfaces(plate(kBone), plate(kTop)), {}, 0.0,
                     {rough, soft(40.0)});
    constexpr double kSkin = 1.0 / (1.0 / 40.0 - 1.0 / kK);
    loop.start({0, 0, kTop + 1e-3});
    for (int i = 1; i <= 10; ++i)
        loop.move({0, 0, kTop - 1e-3 * std::min(i, 8)});
    const double on_bone_n = kK * (kBone - (kTop - kDepth)) - kSkin * (kTop - kBone);
    for (int i = 1; i <= 300; ++i) {
        const Vec3 probe{2e-5 * i, 0, kTop - kDepth};
        loop.move(probe);
        const Vec3 f = force(loop, probe);
        EXPECT_NEAR(loop.proxy().z, kBone, 1e-10);
        EXPECT_NEAR(-f.x, std::min(kK * 2e-5 * i, kMu * on_bone_n), 1e-7) << i;
    }
}

// A steep piece is so short for the tip that a step from the piece before it leads beyond.
TEST(SoftLayers, ATableWithASteepPieceBesideAFlatOneIsFeltAsItIsWritten) {
    const std::vector<std::vector<Softness::Knot>> tables{
        {{1e-3, 2.0}, {10e-3, 2.0}},
        {{2e-3, 1.0}, {15e-3, 2.3}},
        {{3.8e-3, 0.7}, {6.5e-3, 0.7}, {9.7e-3, 2.5}, {13.6e-3, 2.5}},
        {{2e-3, 0.0}, {5e-3, 2.4}, {9e-3, 2.4}}};
    for (const std::vector<Softness::Knot>& knots : tables)
        for (const double step_m : {5e-5, 2e-4}) {
            const SurfaceFinish skin = soft(knots);
            const PressLaw law(skin.softness, kK);
            ContactLoop loop({}, surfaces(ball(20e-3), ball(60e-3)), {}, 0.0, {{}, skin});
            loop.start({61e-3, 0, 0});
            for (double depth_m = 0.0; depth_m < 14e-3; depth_m += step_m) {
                const Vec3 probe{60e-3 - depth_m, 0, 0};
                loop.move(probe);
                // What does not give way gives way by a hundredth of the coupling's way.
                EXPECT_NEAR(force(loop, probe).x, law.force_n(depth_m), 0.03)
                    << knots[0].force_n << ' ' << step_m << ' ' << depth_m;
            }
        }
}

TEST(SoftLayers, AGainLeavesNoMoreThanItsStrengthHoweverStiffAndFast) {
    constexpr double kGain = 0.1, kLeft_n = 5.0 * kGain / (1.0 - kGain); // Gain::strength_n
    for (const double stiffness : {150.0, 400.0, 450.0})
        for (const double step_m : {0.25e-3, 1e-3}) {
            ContactLoop loop({}, surfaces(ball(20e-3), ball(60e-3)), {}, 0.0,
                             {{}, soft(stiffness)});
            loop.start({61e-3, 0, 0});
            loop.subdivision().gain(1, SurfacePart::strength).set(kGain);
            for (int i = 0; i < 60; ++i)
                loop.move({61e-3, 0, 0});
            for (double depth_m = 0.0; depth_m < 14e-3; depth_m += step_m) {
                const Vec3 probe{60e-3 - depth_m, 0, 0};
                loop.move(probe);
                EXPECT_LE(force(loop, probe).x, kLeft_n + 1e-3) << stiffness << ' ' << depth_m;
                if (depth_m < 5e-3) continue;
                EXPECT_GE(force(loop, probe).x, kLeft_n - 1e-3) << stiffness << ' ' << depth_m;
            }
        }
}

TEST(SoftLayers, AGainLeavesItsStrengthWhereATableIsSteeperThanTheCoupling) {
    constexpr double kGain = 0.2, kLeft_n = 5.0 * kGain / (1.0 - kGain);
    const std::vector<Softness::Knot> steep{{3e-3, 0.3}, {4e-3, 2.0}, {9e-3, 3.0}};
    ContactLoop loop(precise_layers(), surfaces(ball(20e-3), ball(60e-3)), {}, 0.0,
                     {{}, soft(steep)});
    loop.start({61e-3, 0, 0});
    loop.subdivision().gain(1, SurfacePart::strength).set(kGain);
    for (int i = 0; i < 60; ++i)
        loop.move({61e-3, 0, 0});
    for (double depth_m = 0.0; depth_m < 12e-3; depth_m += 0.05e-3) {
        const Vec3 probe{60e-3 - depth_m, 0, 0};
        loop.move(probe);
        if (depth_m < 5.5e-3) continue;
        EXPECT_NEAR(force(loop, probe).x, kLeft_n, 1e-3) << depth_m;
    }
}

} // namespace
} // namespace palpate
