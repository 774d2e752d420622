// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include <palpate/haptics/effects/contact_vibration.h>
#include <palpate/haptics/effects/gravity_compensation.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/contact_loop.h"
#include "tests/support/effect_lists.h"

namespace palpate {
namespace {

using test::ContactLoop;
using test::effects;
using test::stepping;

constexpr double kPeriod = 1e-3;
constexpr ContactVibrationSettings kBone{5.0, 150.0, 0.02, 2.0, ~std::uint64_t{0}};

/// A frame of a probe that ends with these surfaces felt and the proxy pushed `back` from it.
Vec3 frame(ContactVibration& vibration, const Vec3& probe, std::uint64_t felt,
           const Vec3& back = {0, 0, 1e-4}) {
    vibration.begin({probe, probe, 500.0, kPeriod});
    vibration.commit({probe + back, felt});
    return vibration.device_force_n();
}

double decaying_sine(const ContactVibrationSettings& s, double speed, int periods) {
    const double t = periods * kPeriod;
    return s.amplitude_n_s_per_m * speed * std::exp(-t / s.decay_s) *
           std::sin(2.0 * std::numbers::pi * s.frequency_hz * t);
}

TEST(ContactVibration, AnImpactRingsAsADecayingSine) {
    constexpr double kSpeed = 0.2;
    ContactVibration vibration(kBone);
    vibration.restart({0, 0, 0});
    // Oblique: only the speed against the push back counts, along it the force acts.
    frame(vibration, {0, 0, 0}, 0);
    const Vec3 step{3e-4, 1e-4, -kSpeed * kPeriod};
    EXPECT_EQ(frame(vibration, step, 1), Vec3(0.0)) << "it begins at sin 0";
    for (int i = 1; i <= 400; ++i) {
        const Vec3 force = frame(vibration, (1.0 + i) * step, 1);
        EXPECT_EQ(force.x, 0.0);
        // A rounding of 1 N for each period.
        EXPECT_NEAR(force.z, decaying_sine(kBone, kSpeed, i), 400 * 3e-16);
    }
}

TEST(ContactVibration, OnlyContactsThatBeginAreImpacts) {
    ContactVibration vibration(kBone);
    vibration.restart({0, 0, 0});
    const Vec3 approach{0, 0, -1e-4};
    double felt = 0.0;
    for (int i = 1; i <= 20; ++i) // retreating contacts ring not
        felt += glm::length(frame(vibration, -1.0 * i * approach, i % 2));
    EXPECT_EQ(felt, 0.0);
    vibration.restart({0, 0, 0});
    frame(vibration, {0, 0, 0}, 1); // in contact at rest
    for (int i = 1; i <= 20; ++i)
        felt += glm::length(frame(vibration, 1.0 * i * approach, 1)); // pressed, not hit
    EXPECT_EQ(felt, 0.0);
}

TEST(ContactVibration, ImpactsSuperposeWithoutAJump) {
    // Hit anew by the same surface after 5 periods, by another one after 9.
    ContactVibrationSettings settings = kBone;
    settings.most_n = 100.0;
    ContactVibration vibration(settings);
    vibration.restart({0, 0, 0});
    frame(vibration, {0, 0, 0}, 0);
    const Vec3 step{0, 0, -2e-4}; // 0.2 m/s
    for (int i = 0; i <= 60; ++i) {
        const std::uint64_t felt = i == 4 ? 0 : i < 9 ? 1 : 3;
        const double force = frame(vibration, 1.0 * (i + 1) * step, felt).z;
        const double expected = decaying_sine(settings, 0.2, i) +
                                (i >= 5 ? decaying_sine(settings, 0.2, i - 5) : 0.0) +
                                (i >= 9 ? decaying_sine(settings, 0.2, i - 9) : 0.0);
        EXPECT_NEAR(force, expected, 1e-13) << i;
    }
}

TEST(ContactVibration, AnswersItsOwnSurfacesOnly) {
    ContactVibrationSettings settings = kBone;
    settings.surfaces = 0b100;
    ContactVibration vibration(settings);
    vibration.restart({0, 0, 0});
    const Vec3 step{0, 0, -2e-4};
    frame(vibration, step, 0b011);
    EXPECT_EQ(frame(vibration, 2.0 * step, 0b011), Vec3(0.0));
    frame(vibration, 3.0 * step, 0b111);
    EXPECT_NEAR(frame(vibration, 4.0 * step, 0b111).z, decaying_sine(settings, 0.2, 1), 1e-15);
}

// However it is struck: never above the limit, and between impacts the oscillator only decays.
TEST(ContactVibration, ForceAndEnergyAreBounded) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> one(-1.0, 1.0);
    const auto vector = [&] { return Vec3{one(random), one(random), one(random)}; };
    for (const double most_n : {0.0, 0.5, 2.0}) {
        ContactVibrationSettings settings = kBone;
        settings.most_n = most_n;
        ContactVibration vibration(settings);
        vibration.restart(Vec3(0.0));
        double largest = 0.0;
        for (int i = 0; i < 5000; ++i) { // up to 100 m/s, in chattering contacts
            const Vec3 force = frame(vibration, 0.1 * vector(), random() % 4, 1e-3 * vector());
            largest = std::max(largest, glm::length(force));
            ASSERT_LE(glm::length(force), most_n * (1.0 + 1e-12));
        }
        EXPECT_GE(largest, 0.7 * most_n) << "the limit is reached";
        Vec3 probe{0.0};
        for (int i = 0; i <= 200; ++i)
            ASSERT_LE(glm::length(frame(vibration, probe, 0)),
                      most_n * std::exp(-i * kPeriod / settings.decay_s) * (1.0 + 1e-12));
    }
}

// 1e307 N s/m times 20 m/s is no number any more.
TEST(ContactVibration, AnImpactBeyondAllNumbersRingsAtTheLimit) {
    ContactVibrationSettings settings = kBone;
    settings.amplitude_n_s_per_m = 1e307;
    ContactVibration vibration(settings);
    vibration.restart({0, 0, 0});
    frame(vibration, {0, 0, 0}, 0);
    const Vec3 step{0, 0, -0.02};
    double largest = 0.0;
    for (int i = 1; i <= 20; ++i) {
        const Vec3 force = frame(vibration, 1.0 * i * step, i % 4 == 0 ? 0 : 1);
        ASSERT_TRUE(is_finite(force)) << i;
        ASSERT_LE(glm::length(force), settings.most_n * (1.0 + 1e-12)) << i;
        largest = std::max(largest, glm::length(force));
    }
    EXPECT_GT(largest, 0.5 * settings.most_n);
}

TEST(ContactVibration, ANewTrialIsSilent) {
    ContactVibration vibration(kBone);
    vibration.restart({0, 0, 0});
    frame(vibration, {0, 0, 0}, 0);
    frame(vibration, {0, 0, -2e-4}, 1);
    frame(vibration, {0, 0, -4e-4}, 1);
    EXPECT_GT(glm::length(vibration.device_force_n()), 0.1);
    vibration.restart({0.1, 0.1, 0.1});
    EXPECT_EQ(vibration.device_force_n(), Vec3(0.0));
    frame(vibration, {0.1, 0.1, 0.1}, 1); // put into contact at rest
    EXPECT_EQ(frame(vibration, {0.1, 0.1, 0.1}, 1), Vec3(0.0));
}

// The proxy that a restart is told is not where the hand was: 2 mm deeper, in this case.
TEST(ContactVibration, SwitchedOnUnderAPressingHandItIsSilent) {
    auto list = effects(std::make_unique<ContactVibration>(kBone));
    ContactLoop loop({}, test::one_surface(make_slab(0.02)), std::move(list));
    loop.subdivision().gain(0).set(0.0);
    loop.start({0, 0, 0.011});
    for (int i = 0; i <= 30; ++i)
        loop.move({0, 0, 0.011 - 1e-4 * i});
    const auto rings_n = [&] {
        return glm::length(loop.subdivision().with_device_forces(Vec3{0.0}));
    };
    loop.subdivision().gain(0).set(1.0);
    for (int i = 0; i < 100; ++i) {
        loop.move({0, 0, 0.008});
        ASSERT_EQ(rings_n(), 0.0) << i;
    }
    double most_n = 0.0; // but it hears the next tap
    for (const double z : {0.011, 0.0105, 0.0098, 0.0098, 0.0098}) {
        loop.move({0, 0, z});
        most_n = std::max(most_n, rings_n());
    }
    EXPECT_GT(most_n, 0.1);
}

// 130 silent frames at 5 mm/s, taken for one, would be an impact at 0.65 m/s.
TEST(ContactVibration, AWayThroughASilenceHasNoSpeed) {
    ContactVibration vibration(kBone);
    vibration.restart({0, 0, 0});
    frame(vibration, {0, 0, 0}, 0);
    frame(vibration, {0, 0, -2e-4}, 1);
    EXPECT_GT(glm::length(frame(vibration, {0, 0, -2e-4}, 1)), 0.1);
    const Vec3 probe{0, 0, -130 * 5e-6};
    FrameContext after{probe, probe, 500.0, kPeriod};
    after.after_silence = true;
    vibration.begin(after);
    vibration.commit({probe + Vec3{0, 0, 1e-4}, 1});
    EXPECT_EQ(vibration.device_force_n(), Vec3(0.0)) << "what rang before has died meanwhile";
    EXPECT_EQ(frame(vibration, probe, 1), Vec3(0.0));
    // From then on frames follow one another again.
    frame(vibration, probe, 0);
    const double speed = 0.005;
    frame(vibration, probe + Vec3{0, 0, -speed * kPeriod}, 1);
    EXPECT_NEAR(frame(vibration, probe, 1).z, decaying_sine(kBone, speed, 1), 1e-15);
}

TEST(ContactVibration, ATapOnAHardFaceRingsAgainstTheHand) {
    auto list = effects(std::make_unique<ContactVibration>(kBone));
    const Effect& vibration = *list.front();
    ContactLoop loop(stepping(SteppingMethod::adaptive), test::one_surface(make_slab(0.02)),
                     std::move(list));
    loop.start({0, 0, 0.0125});
    constexpr double kSpeed = 0.1;
    int since = -1; // frames since the face pushed back first
    double with_nothing = 0.0;
    for (int i = 1; i <= 100; ++i) {
        const SubdivisionResult result = loop.move({0, 0, 0.0125 - 1e-4 * i});
        if (since >= 0 || result.felt) ++since;
        // Differences of coordinates of 10 mm over a millisecond: 2e-15 m/s.
        const double expected = since < 0 ? 0.0 : decaying_sine(kBone, kSpeed, since);
        EXPECT_NEAR(vibration.device_force_n().z, expected, 1e-13) << i;
        with_nothing = std::max(with_nothing, std::abs(expected));
    }
    EXPECT_GT(with_nothing, 0.2);
    EXPECT_NEAR(loop.proxy().z, 0.01, 1e-17) << "the proxy is not moved by it";
}

TEST(ContactVibration, RefusesSettingsOutOfRange) {
    const double bad[] = {-1.0, std::numeric_limits<double>::quiet_NaN(),
                          std::numeric_limits<double>::infinity()};
    for (double value : bad) {
        ContactVibrationSettings s = kBone;
        s.amplitude_n_s_per_m = value;
        EXPECT_THROW(ContactVibration{s}, std::invalid_argument);
        s = kBone;
        s.frequency_hz = value;
        EXPECT_THROW(ContactVibration{s}, std::invalid_argument);
        s = kBone;
        s.decay_s = value;
        EXPECT_THROW(ContactVibration{s}, std::invalid_argument);
        s = kBone;
        s.most_n = value;
        EXPECT_THROW(ContactVibration{s}, std::invalid_argument);
    }
}

TEST(GravityCompensation, CarriesTheHandlesWeight) {
    GravityCompensation compensation(0.045, {0, 0, -3.0});
    EXPECT_EQ(compensation.device_force_n().x, 0.0);
    EXPECT_NEAR(compensation.device_force_n().z, 0.045 * 9.80665, 1e-16);
    PrimitiveSet set;
    compensation.gather({0, 0, 0}, set);
    EXPECT_TRUE(set.is_free());
    EXPECT_EQ(set.force(), Vec3(0.0)) << "beside the coupling, not through the proxy";
    EXPECT_EQ(glm::length(GravityCompensation(0.0, {0, 1, 0}).device_force_n()), 0.0);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(GravityCompensation(-1.0, {0, 0, 1}), std::invalid_argument);
    EXPECT_THROW(GravityCompensation(nan, {0, 0, 1}), std::invalid_argument);
    EXPECT_THROW(GravityCompensation(0.1, Vec3(0.0)), std::invalid_argument);
    EXPECT_THROW(GravityCompensation(0.1, Vec3(nan)), std::invalid_argument);
}

} // namespace
} // namespace palpate
