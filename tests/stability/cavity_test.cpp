// SPDX-License-Identifier: Apache-2.0
// The paper's experiment: a probe that circles behind the wall of a spherical cavity at 0.2 m/s
// (its section 5).
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>

#include "tests/support/scripted_clock.h"

namespace palpate {
namespace {

constexpr double kRadius = 0.05;

/// From the centre to 55 mm and round, 0.2 mm per frame.
std::vector<DeviceState> circle() {
    std::vector<DeviceState> states;
    DeviceState state;
    for (int i = 0; i <= 275; ++i) {
        state.position = {0.2e-3 * i, 0, 0};
        states.push_back(state);
    }
    const double turn = 2.0 * std::numbers::pi;
    for (double angle = 0.0; angle < 2.0 * turn; angle += 0.2e-3 / 0.055) {
        state.position = 0.055 * Vec3{std::cos(angle), std::sin(angle), 0};
        states.push_back(state);
    }
    return states;
}

std::shared_ptr<const Scene> scene(const std::string& effect, const std::string& loop) {
    const std::string text = "[volume.cavity]\nanalytic = \"sphere_cavity\"\nradius_mm = 50\n"
                             "[surface.wall]\nvolume = \"cavity\"\n" +
                             effect + "[loop]\n" + loop;
    return std::make_shared<const Scene>(parse_scene(text, "cavity.toml"));
}

const char* kSurface = "[[effect]]\ntype = \"surface\"\nsurface = \"wall\"\n";
const char* kGradientSurface = "[[effect]]\ntype = \"gradient_surface\"\nvolume = "
                               "\"cavity\"\nstrength_n = [[-1e-9, 0], [0, 1e3]]\n";

double final_drift(const std::string& loop) {
    test::ScriptedClock clock;
    const Trace trace = run_trace(scene(kGradientSurface, loop), circle(), clock);
    return glm::length(trace.frames.back().proxy) - kRadius;
}

// numerics 2.1: drift times number of sub-steps is constant, so 1 against 46 is a factor of 46; 5 %
// for the lever arm of the drifted proxy.
TEST(Cavity, FortySixSubStepsDriftAFortySixthOfOne) {
    const double one = final_drift("method = \"single\"\n");
    const double many = final_drift("method = \"fixed\"\nsub_steps = 46\n");
    EXPECT_NEAR(one / many, 46.0, 0.05 * 46.0);
}

// numerics 2.1: a hand 2 mm behind the wall goes around for a second at 0.2 m/s; the proxy starts
// on the wall, moves h = v R / R_p T in a frame, and each of N steps lifts it off by (h / N)^2 / (2
// R).
TEST(Cavity, DriftTimesTheNumberOfSubStepsIsConstant) {
    constexpr double kSpeed = 0.2, kHand = 0.052, kPeriod = 1e-3, kDuration = 1.0;
    std::vector<DeviceState> states(1);
    states.front().position = {kRadius, 0, 0};
    for (int i = 1; i <= std::lround(kDuration / kPeriod); ++i) {
        const double angle = kSpeed * kPeriod * i / kHand;
        DeviceState state;
        state.position = kHand * Vec3{std::cos(angle), std::sin(angle), 0};
        states.push_back(state);
    }
    const double speed = kSpeed * kRadius / kHand;
    const double law_m = speed * speed * kPeriod * kDuration / (2.0 * kRadius);
    for (int n = 1; n <= 1024; n *= 2) {
        test::ScriptedClock clock;
        const Trace trace = run_trace(
            scene(kGradientSurface, "method = \"fixed\"\nsub_steps = " + std::to_string(n) + "\n"),
            states, clock);
        const double drift_m = glm::length(trace.frames.back().proxy) - kRadius;
        EXPECT_NEAR(n * drift_m, law_m, 0.02 * law_m) << n << " sub-steps";
    }
}

double rms(const std::vector<double>& values) {
    double squares = 0.0;
    for (const double value : values)
        squares += value * value;
    return std::sqrt(squares / static_cast<double>(values.size()));
}

double mean_evaluations(const Trace& trace) {
    double sum = 0.0;
    for (const FrameReport& frame : trace.frames)
        sum += frame.evaluations;
    return sum / static_cast<double>(trace.frames.size());
}

// numerics 3.6: level 1e-3 um, position 1e-2 um, at a mean of 4 evaluations.
TEST(Cavity, AdaptiveStaysWithinAThousandthOfAMicrometre) {
    test::ScriptedClock clock;
    const Trace trace = run_trace(scene(kSurface, "method = \"adaptive\"\n"), circle(), clock);
    ASSERT_GT(trace.audits.front().level_distance_m().size(), 3000u);
    EXPECT_LE(rms(trace.audits.front().level_distance_m()), 1e-9);
    std::vector<double> off;
    for (const FrameReport& frame : trace.frames)
        if (frame.contacts > 0)
            off.push_back(glm::length(frame.proxy - kRadius * glm::normalize(frame.probe)));
    EXPECT_LE(rms(off), 1e-8);
    EXPECT_LE(mean_evaluations(trace), 4.0);
}

/// The point of the level 0 nearest to `probe` near `guess`: small steps along the level, each put
/// back onto it.
Vec3 nearest_on_level(FieldSampler& sampler, const Vec3& probe, Vec3 guess) {
    const auto on_level = [&](Vec3 point) {
        for (int i = 0; i < 20; ++i) {
            const FieldSample here = sampler.sample(point);
            point -= (here.value / squared_length(here.gradient)) * here.gradient;
        }
        return point;
    };
    guess = on_level(guess);
    for (int i = 0; i < 400; ++i) {
        const Vec3 normal = glm::normalize(sampler.sample(guess).gradient);
        const Vec3 way = probe - guess;
        const Vec3 along = way - glm::dot(way, normal) * normal;
        if (glm::length(along) < 1e-11) break;
        guess = on_level(guess + 0.3 * along);
    }
    return guess;
}

// numerics 3.6: level 0.01 um, position 2 um, at a mean of 6 evaluations; bumps of 1 mm and 15
// mm wavelength, 1.5 to 3.5 mm deep.
TEST(Cavity, OnBumpsAdaptiveStaysWithinAHundredthOfAMicrometre) {
    const std::string text =
        "[volume.cavity]\nanalytic = \"bumpy_cavity\"\nradius_mm = 50\namplitude_mm = 1\n"
        "wavelength_mm = 15\n[surface.wall]\nvolume = \"cavity\"\n" +
        std::string(kSurface);
    const auto bumps = std::make_shared<const Scene>(parse_scene(text, "bumps.toml"));
    std::vector<DeviceState> hand = circle();
    for (std::size_t i = 0; i < hand.size(); ++i) {
        const double longest = glm::length(hand[i].position);
        if (longest < 0.051) continue;
        const double angle = std::atan2(hand[i].position.y, hand[i].position.x);
        // off the plane z = 0, in which these bumps vanish
        hand[i].position = (0.0525 + 0.001 * std::sin(7.0 * angle)) *
                           glm::normalize(Vec3{std::cos(angle), std::sin(angle), 0.08});
    }
    test::ScriptedClock clock;
    const Trace trace = run_trace(bumps, hand, clock);
    const auto sampler = bumps->surfaces().front().baked.field->make_sampler();
    std::vector<double> level, off;
    for (std::size_t i = 0; i < trace.frames.size(); i += 5) {
        const FrameReport& frame = trace.frames[i];
        if (frame.contacts == 0) continue;
        const FieldSample here = sampler->sample(frame.proxy);
        level.push_back(here.value / glm::length(here.gradient));
        off.push_back(
            glm::length(frame.proxy - nearest_on_level(*sampler, frame.probe, frame.proxy)));
    }
    ASSERT_GT(off.size(), 500u);
    EXPECT_LE(rms(level), 0.01e-6);
    EXPECT_LE(rms(off), 2e-6);
    EXPECT_LE(mean_evaluations(trace), 6.0);
}

// numerics 5, case 9: a jump of 100 mm to the other side ends on the wall, not behind it.
TEST(Cavity, AJumpAcrossEndsOnTheWall) {
    test::ScriptedClock clock;
    HapticLoop loop(scene(kSurface, "method = \"adaptive\"\n"), clock);
    DeviceState state;
    loop.frame(state);
    for (const Vec3& jump : {Vec3{0.055, 0, 0}, Vec3{-0.055, 0.001, 0}, Vec3{0.0, 0.3, 0.4}}) {
        state.position = jump;
        for (int i = 0; i < 60; ++i) {
            const FrameReport report = loop.frame(state);
            ASSERT_LE(glm::length(report.proxy), kRadius + 25e-6 + 1e-12);
        }
    }
}

} // namespace
} // namespace palpate
