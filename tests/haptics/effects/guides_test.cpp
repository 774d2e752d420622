// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/effects/constant_force.h>
#include <palpate/haptics/effects/point_guide.h>
#include <palpate/haptics/effects/viscosity.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/guide_cases.h"

namespace palpate {
namespace {

using test::Anywhere;
using test::circle;
using test::ContactLoop;
using test::effects;
using test::guide;
using test::kInfinite;
using test::kMethods;
using test::kStiffness;
using test::kTau;
using test::kTolerance;
using test::nearest_of_all;
using test::off_branch;
using test::polyline;
using test::slipped;
using test::stepping;

TEST(Guides, RefuseSettingsOutOfRange) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(PointGuide(Vec3{nan}, {}), std::invalid_argument);
    for (double bad : {-1.0, nan}) {
        EXPECT_THROW(PointGuide(Vec3{0.0}, {bad, 1.0}), std::invalid_argument);
        EXPECT_THROW(PointGuide(Vec3{0.0}, {1.0, bad}), std::invalid_argument);
        EXPECT_THROW(CurveGuide(make_line({0, 0, 0}, {1, 0, 0}), {bad, 1.0}),
                     std::invalid_argument);
    }
    EXPECT_THROW(PointGuide(Vec3{0.0}, {1.0, 0.0}), std::invalid_argument);
}

// Held while the pull is below s, s / k behind the probe above it (composition.md 3.3).
TEST(PointGuide, HoldsAndSlipsByItsStrength) {
    const Vec3 point{0.01, 0.02, 0.03};
    for (double strength : {0.0, 0.3, 2.0, kInfinite})
        for (const SteppingSettings& settings : kMethods) {
            Anywhere anywhere;
            ContactLoop loop(
                settings, {},
                effects(std::make_unique<PointGuide>(point, GuideSettings{strength, kInfinite})));
            loop.start(point);
            loop.move(point);
            EXPECT_EQ(loop.proxy(), point) << "on it";
            for (int i = 0; i < 50; ++i) {
                const Vec3 probe = point + 0.01 * anywhere.vector();
                loop.move(probe);
                EXPECT_LE(glm::length(loop.proxy() - slipped(point, probe, strength)), 1e-15);
            }
        }
}

// A curve that goes straight back ends at its turn.
TEST(CurveGuide, HoldsWhereItGoesStraightBack) {
    for (const Vec3& back : {Vec3{0, 0, 0}, Vec3{0.01, 0.01, 0}}) // to the bit, and to rounding
        for (double strength : {0.3, kInfinite})
            for (const SteppingSettings& settings : kMethods) {
                const std::vector<Vec3> points{{0, 0, 0}, {0.03, 0.03, 0}, back};
                ContactLoop loop(settings, {}, effects(guide(polyline(points), strength)));
                loop.start({0.025, 0.025, 0});
                for (int i = 0; i <= 600; ++i) { // out beyond it, and back
                    const double along = 0.045 - 0.02 * std::abs(i / 300.0 - 1.0);
                    const Vec3 probe{along - 1e-3, along + 1e-3, 0};
                    loop.move(probe);
                    const Vec3 on = nearest_of_all(points, probe);
                    EXPECT_LE(glm::length(loop.proxy() - slipped(on, probe, strength)), 1e-15)
                        << along;
                }
            }
}

/// Force on the hand, N, over the way of a probe away from the guide and back.
template <typename Visit>
void stroke(ContactLoop& loop, double from, double to, const Visit& at) {
    constexpr double kStep = 1e-5;
    const int steps = static_cast<int>(std::round(std::abs(to - from) / kStep));
    for (int i = 0; i <= steps; ++i) {
        const double y = from + (to - from) * i / steps;
        loop.move({0, y, 0});
        at(y, kStiffness * (y - loop.proxy().y));
    }
}

// Snap-on at the capture distance c; pull-off when the proxy, s / k behind, is beyond 1.25 c.
TEST(Guides, SnapOnAndLetGoWhereTheyMust) {
    constexpr double kStrength = 0.5; // N: 1 mm
    constexpr double kCapture = 4e-3;
    const double release = GuideCapture::kRelease * kCapture + kStrength / kStiffness;
    for (int kind = 0; kind < 2; ++kind) {
        std::unique_ptr<Effect> magnet =
            std::make_unique<PointGuide>(Vec3{0.0}, GuideSettings{kStrength, kCapture});
        if (kind == 1) magnet = guide(make_line({0, 0, 0}, {1, 0, 0}), kStrength, kCapture);
        ContactLoop loop(stepping(SteppingMethod::adaptive), {}, effects(std::move(magnet)));
        loop.start({0, 0.01, 0});
        double before = 0.0;
        stroke(loop, 0.01, 0.0, [&](double y, double force) {
            // A frame late: what counts is where the frame began.
            if (y > kCapture + 1e-9) {
                EXPECT_NEAR(force, 0.0, 1e-12) << y;
            }
            if (y < kCapture - 2e-5) {
                EXPECT_NEAR(force, std::min(kStrength, kStiffness * y), 1e-12) << y;
            }
            EXPECT_LE(std::abs(force - before), kStrength + 1e-12);
            before = force;
        });
        stroke(loop, 0.0, 0.01, [&](double y, double force) {
            if (y < release) {
                EXPECT_NEAR(force, std::min(kStrength, kStiffness * y), 1e-12) << y;
            }
            if (y > release + 3e-5) {
                EXPECT_NEAR(force, 0.0, 1e-12) << y;
            }
            EXPECT_LE(std::abs(force - before), kStrength + 1e-12);
            before = force;
        });
    }
}

// At the threshold itself, with a hand's tremor, it snaps on once and stays.
TEST(Guides, DoNotChatterAtTheirThreshold) {
    for (double strength : {1e-6, 0.5}) {
        Anywhere anywhere;
        ContactLoop loop(
            stepping(SteppingMethod::adaptive), {},
            effects(std::make_unique<PointGuide>(Vec3{0.0}, GuideSettings{strength, 4e-3})));
        loop.start({0, 0.01, 0});
        int changes = 0;
        bool held = false;
        for (int i = 0; i < 2000; ++i) {
            const bool now = loop.move({0, 4e-3 + 1e-4 * anywhere.number(), 0}).contacts > 0;
            changes += now != held;
            held = now;
        }
        EXPECT_EQ(changes, 1);
    }
}

// A guide of no strength has nobody: where it has one again, it captures as from afar.
TEST(Guides, WithoutStrengthTheyCaptureNothing) {
    constexpr double kCapture = 4e-3;
    TransferFunction strength; // 0 up to 3.5 mm from z = 0, 0.5 N from 3.6 mm on
    strength.count = 2;
    strength.nodes[0] = {-1e-4, 0.5};
    strength.nodes[1] = {0.0, 0.0};
    const GuideSettings settings{1.0, kCapture, {make_slab(7e-3), strength}};
    const Vec3 weak{0, 0, 3e-3}, within{0, 0, 3.8e-3};
    const Vec3 between{0, 0, 4.5e-3}; // further than it snaps on, nearer than it lets go
    for (int kind = 0; kind < 2; ++kind) {
        std::unique_ptr<Effect> magnet = std::make_unique<PointGuide>(Vec3{0.0}, settings);
        if (kind == 1)
            magnet = std::make_unique<CurveGuide>(make_line({0, 0, 0}, {1, 0, 0}), settings);
        ContactLoop loop(stepping(SteppingMethod::adaptive), {}, effects(std::move(magnet)));
        loop.start(weak);
        for (const Vec3& probe : {weak, between, between, between})
            EXPECT_EQ(loop.move(probe).contacts, 0u) << kind;
        loop.move(within);
        EXPECT_EQ(loop.move(within).contacts, 1u) << "there it has a strength";
    }
}

TEST(Guides, ANewTrialForgetsTheHold) {
    ContactLoop loop(stepping(SteppingMethod::adaptive), {},
                     effects(guide(make_line({0, 0, 0}, {1, 0, 0}), kInfinite, 1e-3)));
    loop.start({0, 0, 0});
    loop.move({0, 0.01, 0});
    EXPECT_LE(glm::length(loop.proxy()), 1e-17);
    loop.start({0, 0.0012, 0}); // further than it snaps on, nearer than it lets go
    loop.move({0, 0.0012, 0});
    EXPECT_EQ(loop.proxy(), Vec3(0, 0.0012, 0));
}

TEST(CurveGuide, AnInfiniteLineInFreeSpaceIsTheClosedForm) {
    const Vec3 point{0.01, -0.02, 0.03};
    const Vec3 axis = glm::normalize(Vec3{1, 2, -0.5});
    for (double strength : {0.0, 0.4, kInfinite})
        for (const SteppingSettings& settings : kMethods) {
            Anywhere anywhere;
            ContactLoop loop(settings, {}, effects(guide(make_line(point, 3.0 * axis), strength)));
            loop.start(point);
            for (int i = 0; i < 100; ++i) {
                const Vec3 probe = point + 0.3 * anywhere.vector();
                const Vec3 on = point + glm::dot(probe - point, axis) * axis;
                loop.move(probe);
                EXPECT_LE(glm::length(loop.proxy() - slipped(on, probe, strength)), 1e-15);
            }
        }
}

// A zigzag with bends of either sense, walked along: where the foot of the pull is on a piece it is
// a line's answer, outside of a bend and beyond the ends a point's.
TEST(CurveGuide, PiecesBendsAndEndsAreExactInFreeSpace) {
    const std::vector<Vec3> points{
        {0, 0, 0}, {0.01, 0, 0}, {0.02, 0.006, 0}, {0.03, 0, 0.005}, {0.04, 0, 0}};
    for (double strength : {0.3, kInfinite})
        for (const SteppingSettings& settings : kMethods) {
            Anywhere anywhere;
            ContactLoop loop(settings, {}, effects(guide(polyline(points), strength)));
            loop.start(points.front());
            int bends = 0;
            int ends = 0;
            for (int i = 0; i < 4000; ++i) {
                const double x = 0.02 - 0.025 * std::cos(kTau * i / 4000.0);
                const Vec3 on = nearest_of_all(points, {x, 0, 0});
                const Vec3 probe = on + Vec3{x - on.x, 0, 0} + 4e-3 * anywhere.vector();
                const Vec3 foot = nearest_of_all(points, probe);
                loop.move(probe);
                ASSERT_LE(off_branch(points, probe, strength, loop.proxy()), 7e-16) << i;
                for (const Vec3& corner : points)
                    if (glm::length(foot - corner) < 1e-15)
                        ++(corner == points.front() || corner == points.back() ? ends : bends);
            }
            EXPECT_GT(bends, 30);
            EXPECT_GT(ends, 30);
        }
}

// With forces and a medium the answer is that of the pull a' = (k a + g x0 + d) / K, in any order
// of the effects; the guide's strength is large, so it holds.
TEST(CurveGuide, OtherEffectsShiftItAlongTheCurve) {
    constexpr double kDamping = 1.0;
    const Vec3 force{0.8, -0.3, 0.2};
    const std::vector<Vec3> points{
        {0, 0, 0}, {0.01, 0, 0}, {0.02, 0.006, 0}, {0.03, 0, 0.005}, {0.04, 0, 0}};
    const auto force_effect = [&] { return std::make_unique<ConstantForce>(force); };
    const auto medium = [&] { return std::make_unique<Viscosity>(kDamping); };
    for (int order = 0; order < 3; ++order) {
        test::Effects list;
        if (order == 0) list = effects(force_effect(), medium(), guide(polyline(points), 50.0));
        if (order == 1) list = effects(guide(polyline(points), 50.0), medium(), force_effect());
        if (order == 2) list = effects(medium(), guide(polyline(points), 50.0), force_effect());
        ContactLoop loop(stepping(SteppingMethod::adaptive), {}, std::move(list));
        loop.start(points.front());
        Anywhere anywhere;
        std::uint32_t most = 0;
        for (int i = 0; i < 4000; ++i) {
            const double x = 0.02 - 0.025 * std::cos(kTau * i / 4000.0);
            const Vec3 on = nearest_of_all(points, {x, 0, 0});
            const Vec3 probe = on + 2e-4 * anywhere.vector();
            const double spring = kDamping / 1e-3;
            const Vec3 pull =
                (kStiffness * probe + spring * loop.proxy() + force) / (kStiffness + spring);
            const SubdivisionResult result = loop.move(probe);
            most = std::max(most, result.evaluations);
            // A place within the tolerance is kept.
            ASSERT_LE(off_branch(points, pull, kInfinite, loop.proxy()), kTolerance)
                << order << " " << i;
        }
        EXPECT_LE(most, order == 0 ? 2u : 6u) << order;
    }
}

/// A circle of chords that just clears a hard ball, and a hand that presses 2 mm into the ball
/// (1 N) and strays 1 mm to either side of the circle.
struct BallStroke {
    static constexpr double kBall = 0.05;
    static constexpr double kLatitude = 0.7;
    static constexpr int kCorners = 2000;
    static constexpr int kFrames = 2000;

    static std::vector<Vec3> chords() {
        const double clear = kBall * (1.0 + 1e-8) / std::cos(0.5 * kTau / kCorners);
        return circle(clear * std::cos(kLatitude), clear * std::sin(kLatitude), kCorners);
    }
    static Vec3 probe(int i) {
        const double latitude = kLatitude + 1e-3 * std::sin(0.05 * i) / kBall;
        return (kBall - 2e-3) * Vec3{std::cos(latitude) * std::cos(0.01 * i),
                                     std::cos(latitude) * std::sin(0.01 * i), std::sin(latitude)};
    }

    explicit BallStroke(double strength_n,
                        const SteppingSettings& settings = stepping(SteppingMethod::adaptive))
        : loop(settings, test::one_surface(make_solid_sphere(kBall)),
               effects(guide(polyline(chords(), PolylineEnds::closed), strength_n))) {
        loop.start(1.001 / (1.0 - 2e-3 / kBall) * probe(0));
        loop.move(probe(0));
    }
    ContactLoop loop;
};

// It holds: the closed form is the circle's nearest point to the probe.
TEST(CurveGuide, ACircleOnABallIsTheClosedForm) {
    BallStroke stroke(5.0);
    std::vector<Vec3> chords = BallStroke::chords();
    chords.push_back(chords.front());
    double evaluations = 0.0;
    for (int i = 1; i <= BallStroke::kFrames; ++i) {
        const Vec3 probe = BallStroke::probe(i);
        const SubdivisionResult result = stroke.loop.move(probe);
        evaluations += result.evaluations;
        EXPECT_EQ(result.flags, 0u) << i;
        EXPECT_LE(off_branch(chords, probe, 5.0, stroke.loop.proxy()), kTolerance) << i;
    }
    EXPECT_LE(evaluations / BallStroke::kFrames, 5.2);
}

// The same, as exactly as the loop is asked for; its own tolerance is a tenth of what is allowed.
TEST(CurveGuide, ACircleOnABallIsTheClosedFormToANanometre) {
    SteppingSettings settings = stepping(SteppingMethod::adaptive);
    settings.tolerance_m = 1e-10;
    settings.evaluation_cap = 60;
    BallStroke stroke(5.0, settings);
    std::vector<Vec3> chords = BallStroke::chords();
    chords.push_back(chords.front());
    for (int i = 1; i <= BallStroke::kFrames; ++i) {
        const Vec3 probe = BallStroke::probe(i);
        EXPECT_EQ(stroke.loop.move(probe).flags, 0u) << i;
        EXPECT_LE(off_branch(chords, probe, 5.0, stroke.loop.proxy()), 1e-9) << i;
    }
}

// It slips at 0.3 N: along the ball the hand's pull and the guide's balance.
TEST(CurveGuide, ACircleOnABallYieldsInBalance) {
    constexpr double kStrength = 0.3;
    BallStroke stroke(kStrength);
    const std::vector<Vec3> chords = BallStroke::chords();
    int slipping = 0;
    int capped = 0;
    for (int i = 1; i <= BallStroke::kFrames; ++i) {
        const Vec3 probe = BallStroke::probe(i);
        const SubdivisionResult result = stroke.loop.move(probe);
        const Vec3& x = stroke.loop.proxy();
        const Vec3 out = glm::normalize(x);
        const Vec3 way = nearest_of_all(chords, x) - x;
        if (glm::length(way) < 1e-5) continue; // it holds, or is about to
        ++slipping;
        if (result.flags) {
            // Where hold turns into slip at a bend, a frame may need more than its evaluations.
            ++capped;
            continue;
        }
        const Vec3 pull = kStiffness * (probe - x) + kStrength * glm::normalize(way);
        // The loop's tolerance, as a force.
        EXPECT_LE(glm::length(pull - glm::dot(pull, out) * out), 2.0 * kTolerance * kStiffness)
            << i;
    }
    EXPECT_GT(slipping, 500);
    EXPECT_LE(capped, slipping / 100);
}

TEST(CurveGuide, AHeldProbeMovesNoBit) {
    const std::vector<Vec3> points = circle(0.02, 0.0, 64);
    for (const SteppingSettings& settings : kMethods)
        for (const double radius : {0.018, 0.0205, 0.022})
            for (int n = 0; n < 20; ++n) {
                const Vec3 probe{radius * std::cos(0.3 * n), radius * std::sin(0.3 * n), 5e-4};
                ContactLoop loop(settings, {},
                                 effects(std::make_unique<ConstantForce>(Vec3{0.2, 0.1, 0}),
                                         guide(polyline(points, PolylineEnds::closed), 0.3)));
                loop.start({0.02, 0, 0});
                for (int i = 0; i < 30; ++i)
                    loop.move(probe);
                const Vec3 held = loop.proxy();
                for (int i = 0; i < 300; ++i) {
                    loop.move(probe);
                    ASSERT_EQ(loop.proxy(), held) << radius << " " << n << " " << i;
                }
            }
}

// Two arms of a hairpin 2 mm apart: the proxy stays on its arm however near the other one is.
TEST(CurveGuide, DoesNotJumpToAnotherBranch) {
    const std::vector<Vec3> hairpin{{0, 0, 0}, {0.05, 0, 0}, {0.05, 0.002, 0}, {0, 0.002, 0}};
    ContactLoop loop(stepping(SteppingMethod::adaptive), {},
                     effects(guide(polyline(hairpin), kInfinite)));
    loop.start({0.01, 0, 0});
    for (int i = 0; i < 500; ++i) {
        loop.move({0.01 + 2e-5 * i, 0.0019, 0});
        ASSERT_NEAR(loop.proxy().y, 0.0, 1e-15);
        ASSERT_NEAR(loop.proxy().x, 0.01 + 2e-5 * i, 1e-15);
    }
}

// A million times more than a frame walks is not: a jump over 30 000 pieces goes on in the frames
// that follow, always on the curve.
TEST(CurveGuide, AJumpIsWalkedByFrames) {
    std::vector<Vec3> points;
    for (int i = 0; i < 30'000; ++i)
        points.push_back({1e-5 * i, 1e-3 * std::sin(1e-3 * i), 0});
    ContactLoop loop(stepping(SteppingMethod::adaptive), {},
                     effects(guide(polyline(points), kInfinite)));
    loop.start(points.front());
    int frames = 0;
    for (; frames < 20 && loop.proxy().x < 0.2999; ++frames) {
        loop.move(points.back());
        EXPECT_LE(glm::length(loop.proxy() - nearest_of_all(points, loop.proxy())), 1e-14);
    }
    EXPECT_EQ(frames, 8) << "30 000 pieces, 4096 a frame";
    EXPECT_LE(glm::length(loop.proxy() - points.back()), 1e-15);
}

// Where a walk is cut there is a plane beside the line; the loop has room for what is promised.
TEST(CurveGuide, AddsNoMoreThanItPromises) {
    std::vector<Vec3> points;
    for (int i = 0; i < 30'000; ++i)
        points.push_back({1e-5 * i, 1e-3 * std::sin(1e-3 * i), 0});
    CurveGuide effect(polyline(points), GuideSettings{1.0, kInfinite});
    effect.restart(points.front());
    effect.begin({points.back(), points.front()});
    std::size_t most = 0;
    for (int evaluation = 0; evaluation < 4; ++evaluation) {
        PrimitiveSet primitives;
        effect.gather(points.front(), primitives);
        effect.solved(points.back());
        most = std::max(most, primitives.count());
    }
    EXPECT_EQ(most, 2u) << "the way is cut";
    EXPECT_EQ(effect.most_primitives(), 2u);
}

// Every pull along a curve of sharp bends of all angles: the frames end without a flag, and a held
// probe's spring never gains energy.
TEST(CurveGuide, SharpBendsNeitherHangNorGainEnergy) {
    Anywhere anywhere;
    int capped = 0;
    int frames = 0;
    for (int n = 0; n < 60; ++n) {
        std::vector<Vec3> points{{0, 0, 0}};
        for (int i = 0; i < 30; ++i)
            points.push_back(points.back() + 0.004 * anywhere.vector());
        const double strength = n % 3 == 0 ? kInfinite : 1.0 + anywhere.number();
        ContactLoop loop(stepping(SteppingMethod::adaptive), {},
                         effects(guide(polyline(points), strength)));
        loop.start(points.front());
        for (int k = 0; k < 20; ++k) {
            const Vec3 probe = points[static_cast<std::size_t>(k)] + 0.004 * anywhere.vector();
            double before = kInfinite;
            for (int i = 0; i < 10; ++i, ++frames) {
                const SubdivisionResult result = loop.move(probe);
                capped += result.flags != 0;
                const double now = glm::length(probe - loop.proxy());
                ASSERT_LE(now, before * (1.0 + 1e-12) + 1e-16) << n << " " << k;
                before = now;
            }
        }
    }
    EXPECT_EQ(capped, 0) << "of " << frames;
}

} // namespace
} // namespace palpate
