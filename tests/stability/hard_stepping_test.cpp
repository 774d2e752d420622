// SPDX-License-Identifier: Apache-2.0
// Hard cases of stepping, each with every method and every way to feel a surface; where one cannot
// meet the case, the test says what it does instead (numerics 5).
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>

#include "tests/support/felt_cavity.h"

namespace palpate {
namespace {

using test::ContactLoop;
using test::Felt;
using test::felt_cavity;
using test::kCavity;
using test::stepping_of;

constexpr double kCertificate = 25e-6; // m, default of LevelSettings

Vec3 direction_at(double angle) {
    return {std::cos(angle), 0.8 * std::sin(angle), 0.6 * std::sin(angle)};
}

/// A loop whose proxy is on the wall and whose probe `depth` behind it, at angle 0; settled.
std::unique_ptr<ContactLoop> pressed(Felt felt, const SteppingSettings& settings, double depth) {
    auto loop = felt_cavity(felt, settings);
    loop->start((kCavity - 1e-9) * direction_at(0.0));
    for (int i = 0; i < 50; ++i)
        loop->move((kCavity + depth) * direction_at(0.0));
    return loop;
}

class HardStepping : public testing::TestWithParam<test::MethodAndFelt> {
protected:
    SteppingMethod method() const { return std::get<0>(GetParam()); }
    Felt felt() const { return std::get<1>(GetParam()); }
};

INSTANTIATE_TEST_SUITE_P(Every, HardStepping,
                         testing::Combine(testing::ValuesIn(test::kEveryMethod),
                                          testing::Values(Felt::volume, Felt::guarded,
                                                          Felt::memoryless)),
                         test::name_of_case);

// 100 mm in one frame: what has a certificate stops at the wall at once, and is at the probe's
// closest point in 25 frames. A memoryless plane is met only by the sub-step that is already behind
// the wall: it ends no more than a share of the jump deep, which is all of it with one evaluation.
TEST_P(HardStepping, AJumpOf100MillimetresEndsAtTheWall) {
    auto loop = felt_cavity(felt(), stepping_of(method()));
    if (felt() == Felt::memoryless)
        loop = test::loop_of(stepping_of(method()), {},
                             test::memoryless(make_sphere_cavity(kCavity), test::hard_from_zero()));
    loop->start({-0.045, 0.01, 0.0});
    const Vec3 probe{0.055, 0.002, 0.0};
    double deep = 0.0;
    std::uint32_t evaluations = 0;
    for (int i = 0; i < 25; ++i) {
        evaluations = std::max(evaluations, loop->move(probe).evaluations);
        for (const Vec3& corner : loop->subdivision().path())
            deep = std::max(deep, glm::length(corner) - kCavity);
    }
    if (felt() == Felt::memoryless) {
        const bool one = method() == SteppingMethod::single || method() == SteppingMethod::adaptive;
        const double share = one ? 1.0 : 1.0 / test::kShares;
        EXPECT_GT(deep, 1e-3);
        EXPECT_LE(deep, share * glm::length(probe - Vec3{-0.045, 0.01, 0.0}));
        return;
    }
    EXPECT_LE(deep, kCertificate + 1e-12);
    // Each evaluation leaves depth / radius = 0.1 of the way along the wall, so twelve suffice; 0.1
    // nm is a thousandth of the tolerance.
    EXPECT_LE(glm::length(loop->proxy() - kCavity * glm::normalize(probe)), 1e-10);
}

class HardJump : public testing::TestWithParam<SteppingMethod> {};
INSTANTIATE_TEST_SUITE_P(Every, HardJump, testing::ValuesIn(test::kEveryMethod),
                         [](const testing::TestParamInfo<SteppingMethod>& of) {
                             return test::name_of(of.param);
                         });

// 500 N/m over 50 mm would be 25 N: the device is sent 5 N, reached no faster than the slew limit.
TEST_P(HardJump, IsSentAsNoMoreThanTheDeviceMayGive) {
    const auto scene = std::make_shared<const Scene>(parse_scene(
        "[volume.v]\nanalytic = \"sphere_cavity\"\nradius_mm = 50\n[surface.s]\nvolume = \"v\"\n"
        "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n[limits]\nforce_n = 5.0\n"
        "slew_n_per_s = 2000.0\n[loop]\nmethod = \"" +
            test::name_of(GetParam()) + "\"\n",
        "jump.toml"));
    test::ScriptedClock clock(test::kReading_us);
    HapticLoop loop(scene, clock);
    DeviceState state;
    loop.frame(state);
    state.position = {0.1, 0.0, 0.0};
    Vec3 before{0.0};
    double greatest = 0.0;
    for (int i = 0; i < 20; ++i) {
        const FrameReport report = loop.frame(state);
        EXPECT_TRUE(report.flags & kForceClamped);
        // 2000 N/s in 1 ms; both limits to rounding.
        EXPECT_LE(glm::length(report.force - before), 2.0 + 1e-12);
        EXPECT_LE(glm::length(report.force), 5.0 + 1e-12);
        greatest = std::max(greatest, glm::length(report.force));
        before = report.force;
    }
    EXPECT_NEAR(greatest, 5.0, 1e-12);
}

/// A stroke round the cavity, `depth` behind its wall.
struct Stroke {
    double level_rms_m = 0.0;
    double level_worst_m = 0.0; ///< to either side
    double deepest_m = 0.0;
    double mean_evaluations = 0.0;
};
Stroke stroke(ContactLoop& loop, double step_m, double depth, int frames) {
    Stroke result;
    double squares = 0.0;
    for (int i = 1; i <= frames; ++i) {
        const SubdivisionResult end =
            loop.move((kCavity + depth) * direction_at(step_m / (kCavity + depth) * i));
        const double level = glm::length(loop.proxy()) - kCavity;
        squares += level * level;
        result.level_worst_m = std::max(result.level_worst_m, std::abs(level));
        result.deepest_m = std::max(result.deepest_m, level);
        result.mean_evaluations += static_cast<double>(end.evaluations) / frames;
    }
    result.level_rms_m = std::sqrt(squares / frames);
    return result;
}

// Ten times the speed costs `adaptive` evaluations, not accuracy: within the 1 nm of numerics
// 3.6. The others come to the level by the tangent plane of each sub-step, so that they are off by
// the square of its way, h^2 / 2R; the certificate keeps what is deeper and may shorten a way to
// half, which the next makes up for. Memoryless planes add that up, frame after frame, until they
// have given way to the probe.
TEST_P(HardStepping, TenTimesTheSpeedIsHeldAsWell) {
    constexpr double kDepth = 2e-3, kFast = 2e-3; // m, m per frame
    constexpr int kFrames = 100;
    const Stroke slow =
        stroke(*pressed(felt(), stepping_of(method()), kDepth), 0.1 * kFast, kDepth, kFrames);
    const Stroke fast =
        stroke(*pressed(felt(), stepping_of(method()), kDepth), kFast, kDepth, kFrames);
    const int shares = method() == SteppingMethod::single ? 1 : test::kShares;
    const double way = kFast * kCavity / (kCavity + kDepth);
    const double sagitta = way * way / (2.0 * kCavity); // 37 um
    if (felt() == Felt::memoryless) {
        EXPECT_GT(fast.level_worst_m, 10.0 * slow.level_worst_m);
        if (method() == SteppingMethod::single) {
            EXPECT_NEAR(fast.level_worst_m, kDepth, 0.05 * kDepth) << "it fell through";
        } else if (method() != SteppingMethod::adaptive) {
            // The drift slows down as the lever arm shrinks.
            EXPECT_NEAR(fast.level_worst_m * shares, kFrames * sagitta, 0.15 * kFrames * sagitta);
        }
        return;
    }
    EXPECT_GE(fast.mean_evaluations, slow.mean_evaluations);
    EXPECT_LE(fast.deepest_m, kCertificate + 1e-12);
    if (method() == SteppingMethod::adaptive)
        EXPECT_LE(fast.level_rms_m, 1e-9);
    else
        EXPECT_LE(fast.level_worst_m, 1.5 * 1.5 * sagitta / (shares * shares));
}

// A held probe means a held proxy, to the bit, once the steps towards it have become rounding: each
// evaluation leaves depth / radius = 0.04 of what was left.
TEST_P(HardStepping, AHeldProbeMovesNoBit) {
    auto loop = pressed(felt(), stepping_of(method()), 2e-3);
    const Vec3 probe = 0.052 * direction_at(0.004);
    for (int i = 0; i < 100; ++i)
        loop->move(probe);
    const Vec3 held = loop->proxy();
    for (int i = 0; i < 1000; ++i) {
        loop->move(probe);
        ASSERT_EQ(loop->proxy(), held) << "frame " << i;
    }
}

// There and back without yielding: whatever is anchored at a level ends where it was, to rounding
// and a tolerance of 1 pm. What remembers no level has drifted by (way of a frame)^2 / (2 R N) each
// frame, both ways.
TEST_P(HardStepping, ThereAndBackIsTheSamePlace) {
    constexpr double kDepth = 2e-3;
    constexpr int kFrames = 200;
    SteppingSettings settings = stepping_of(method());
    settings.tolerance_m = 1e-12;
    auto loop = pressed(felt(), settings, kDepth);
    const Vec3 begin = loop->proxy();
    const auto probe = [&](int frame) { return 0.052 * direction_at(0.2e-3 / 0.052 * frame); };
    for (int i = 1; i <= kFrames; ++i)
        loop->move(probe(i));
    EXPECT_GT(glm::length(loop->proxy() - begin), 0.03) << "it went somewhere";
    for (int i = kFrames - 1; i >= 0; --i)
        loop->move(probe(i));
    for (int i = 0; i < 20; ++i)
        loop->move(probe(0)); // what lags behind catches up
    const double off = glm::length(loop->proxy() - begin);
    if (felt() != Felt::memoryless) {
        EXPECT_LE(off, 2e-12);
        return;
    }
    const double way = 0.2e-3 * kCavity / (kCavity + kDepth);
    const double one = 2 * kFrames * way * way / (2.0 * kCavity);
    EXPECT_GT(off, 0.5 * one / (method() == SteppingMethod::single ? 1 : 2 * test::kShares));
}

class HardCurvature : public testing::TestWithParam<test::MethodAndFelt> {};
INSTANTIATE_TEST_SUITE_P(Every, HardCurvature,
                         testing::Combine(testing::ValuesIn(test::kEveryMethod),
                                          testing::Values(Felt::volume, Felt::memoryless)),
                         test::name_of_case);

constexpr double kSmall = 1e-3; // m, radius of a cavity that a probe is deeper in than that

/// How far from its end the proxy still gets, and where it is.
struct Rest {
    double off_rad = 0.0; ///< at most, in the last 20 of 200 frames
    double radius_m = 0.0;
    int calmed = 0; ///< frames that a spring towards their start has shortened
};

/// The probe is `depth` behind the wall of the small cavity, `turn` rad beside the proxy.
Rest rest_of(Felt felt, const SteppingSettings& settings, double depth, double turn) {
    const std::shared_ptr<const ScalarField> field = make_sphere_cavity(kSmall);
    auto loop = felt == Felt::memoryless
                    ? test::loop_of(settings, {}, test::memoryless(field, test::hard_everywhere()))
                    : test::loop_of(settings, test::one_surface(field));
    loop->start((kSmall - 1e-9) * Vec3{1, 0, 0});
    const Vec3 probe = (kSmall + depth) * Vec3{std::cos(turn), std::sin(turn), 0.0};
    Rest rest;
    for (int i = 0; i < 200; ++i) {
        rest.calmed += (loop->move(probe).flags & kCalmed) != 0;
        const Vec3 x = loop->proxy();
        const double off = std::atan2(glm::length(glm::cross(x, probe)), glm::dot(x, probe));
        if (i >= 180) rest.off_rad = std::max(rest.off_rad, off);
    }
    rest.radius_m = glm::length(loop->proxy());
    return rest;
}

// Deeper than the radius a full step along the tangent plane overshoots by depth / radius > 1:
// curvature in the step makes it right (adaptive), equal shares damp it (the product of 1 - G / m
// over eight shares, G = 1 + depth / radius = 2.5, is 0.003), one evaluation goes from side to side
// until it is calmed. Memoryless planes end it by giving way outwards, with any method.
TEST_P(HardCurvature, DeeperThanTheRadiusThereIsNoLimitCycle) {
    const auto [method, felt] = GetParam();
    // `adaptive` may rest anywhere within its tolerance.
    const double rest = method == SteppingMethod::adaptive ? 1e-7 / kSmall : 1e-9;
    const Rest end = rest_of(felt, stepping_of(method), 1.5e-3, 0.5);
    if (felt == Felt::memoryless) {
        EXPECT_LE(end.off_rad, rest);
        EXPECT_GT(end.radius_m, 1.01 * kSmall) << "at the cost of the wall";
        return;
    }
    EXPECT_LE(end.radius_m, kSmall + kCertificate);
    EXPECT_LE(end.off_rad, rest);
    if (method == SteppingMethod::single) {
        EXPECT_GT(end.calmed, 0) << "the control: by itself it goes on for ever";
    } else {
        EXPECT_EQ(end.calmed, 0);
    }
    if (method == SteppingMethod::adaptive) {
        EXPECT_LE(rest_of(felt, stepping_of(method), 9e-3, 0.5).off_rad, rest) << "G = 10";
    }
}

class HardDeterminism : public testing::TestWithParam<test::MethodAndFelt> {};
INSTANTIATE_TEST_SUITE_P(Every, HardDeterminism,
                         testing::Combine(testing::ValuesIn(test::kEveryMethod),
                                          testing::Values(Felt::volume, Felt::yielding,
                                                          Felt::guarded, Felt::memoryless,
                                                          Felt::follow)),
                         test::name_of_case);

// The same inputs give the same bits, also in a loop that has lived another trial before: what a
// sampler, a bundle or a guard remembers of it must not count. `paper` by its recorded decisions.
TEST_P(HardDeterminism, ATrialsBitsDoNotDependOnTheTrialBefore) {
    const auto [method, felt] = GetParam();
    auto fresh = felt_cavity(felt, stepping_of(method));
    auto used = felt_cavity(felt, stepping_of(method));
    std::mt19937_64 random(17);
    std::uniform_real_distribution<double> share(-1.0, 1.0);
    used->start({0, 0.01, 0.02});
    for (int i = 0; i < 200; ++i) {
        const double x = share(random), y = share(random), z = share(random);
        used->move(0.06 * Vec3{x, y, z});
    }
    used->move({0.0, 0.04, 0.04});        // ends deep behind the wall
    const Vec3 start{0.0499, 0.0, 0.001}; // and begins anew right in front of it
    fresh->start(start);
    used->start(start);
    Vec3 used_proxy = start, probe = start;
    for (int i = 0; i < 300; ++i) {
        const double x = share(random), y = share(random), z = share(random);
        probe += 2e-3 * Vec3{x + 0.2, y, z};
        if (glm::length(probe) > 0.055) probe *= 0.055 / glm::length(probe);
        fresh->move(probe);
        const FrameContext frame{probe, used_proxy, ContactLoop::kStiffness, 1e-3};
        used_proxy = (method == SteppingMethod::paper
                          ? used->subdivision().advance(frame, fresh->subdivision().steps_left())
                          : used->subdivision().advance(frame))
                         .proxy;
        ASSERT_EQ(used_proxy, fresh->proxy()) << "frame " << i;
    }
}

// Begun inside, a surface is not felt until it has been left: no kick, whatever the method.
// Memoryless planes hold the proxy where it begins, from the very first frame: no kick either.
TEST_P(HardStepping, BegunInsideThereIsNoKick) {
    auto loop = felt_cavity(felt(), stepping_of(method()));
    const Vec3 inside = (kCavity + 4e-3) * direction_at(0.0);
    loop->start(inside);
    EXPECT_EQ((loop->flags_at_start() & kInsideAtStart) != 0, felt() != Felt::memoryless);
    double r = kCavity + 4e-3, before = 0.0;
    const auto go_to = [&](double target) {
        while (r != target) {
            const double step = 1e-4;
            r = target > r ? std::min(target, r + step) : std::max(target, r - step);
            loop->move(r * direction_at(0.0));
            const double lag = glm::length(r * direction_at(0.0) - loop->proxy());
            // Never more than the hand's own movement adds; 1e-15 m is rounding.
            ASSERT_LE(lag, before + step + 1e-15) << r;
            if (felt() != Felt::memoryless && r > kCavity) {
                ASSERT_EQ(lag, 0.0) << r;
            }
            before = lag;
        }
    };
    go_to(kCavity + 2e-3);
    go_to(kCavity - 1e-3);
    EXPECT_LE(before, 1e-15) << "free";
}

} // namespace
} // namespace palpate
