// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/contact/guarded_contact.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/support/contact_kinds.h"
#include "tests/support/effect_lists.h"
#include "tests/support/textures.h"

namespace palpate {
namespace {

using namespace test;

constexpr double kTop = 10e-3;    // of the slab, m
constexpr double kRadius = 50e-3; // of the ball, m
constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// The nearest point of a grating on the slab, from below: where 1/2 |x - a|^2 is stationary along
/// it. Unique where the pressed depth times the crests' curvature is below 1.
Vec3 nearest_on_grating(const TextureSettings& g, const Vec3& probe) {
    const double k = 2.0 * std::numbers::pi / g.wavelength_m;
    const auto pull = [&](double x) {
        const double rise = 0.5 * g.height_m * k * std::sin(k * x);
        return x - probe.x + (kTop + grating_height(g, x) - probe.z) * rise;
    };
    double low = probe.x - 2e-3, high = probe.x + 2e-3;
    for (int i = 0; i < 100; ++i) {
        const double middle = 0.5 * (low + high);
        (pull(middle) > 0.0 ? high : low) = middle;
    }
    return {low, probe.y, kTop + grating_height(g, low)};
}

// Curvature of the crests H/2 k^2 = 247 / m: unique down to 4 mm. The place is found to the
// tolerance of 1e-11 m; the force's direction to that over 1 mm.
TEST(TexturedContact, OnAGratingTheProxyIsAtTheClosedForm) {
    const TextureSettings g = grating(2e-3, 0.05e-3);
    ContactLoop loop(exactly(), textured(make_slab(2.0 * kTop), g));
    std::mt19937_64 random(5);
    double lowest = kInfinite, highest = 0.0;
    for (int place = 0; place < 200; ++place) {
        Vec3 probe = random_offset(random, 4e-3);
        probe.z = kTop - 1e-3 - 0.4 * std::abs(probe.z);
        loop.start({probe.x, probe.y, kTop + 2e-3});
        for (int frame = 0; frame < 3; ++frame)
            loop.move(probe);
        const Vec3 expected = nearest_on_grating(g, probe);
        EXPECT_LE(glm::length(loop.proxy() - expected), 1e-9) << place;
        const double k = 2.0 * std::numbers::pi / g.wavelength_m;
        const Vec3 normal =
            glm::normalize(Vec3{-0.5 * g.height_m * k * std::sin(k * loop.proxy().x), 0.0, 1.0});
        const Vec3 force = glm::normalize(loop.proxy() - probe);
        EXPECT_LE(glm::length(force - normal), 1e-6) << place;
        lowest = std::min(lowest, loop.proxy().z - kTop);
        highest = std::max(highest, loop.proxy().z - kTop);
    }
    EXPECT_LT(lowest, 0.1 * g.height_m);
    EXPECT_GT(highest, 0.9 * g.height_m);
}

/// Of a proxy on a ball with a texture: how far its level is, and how far along the surface it is
/// from where it would rest.
struct OnBall {
    double level_m = 0.0;
    double along_m = 0.0;
};

OnBall on_ball(const TextureSettings& b, const Vec3& proxy, const Vec3& probe) {
    const double k = 2.0 * std::numbers::pi / b.wavelength_m;
    Vec3 uphill = -glm::normalize(proxy); // of R - |x| + h
    for (int axis = 0; axis < 3; ++axis)
        uphill[axis] += b.height_m / 6.0 * k * std::sin(k * proxy[axis]);
    const Vec3 n = glm::normalize(uphill), pull = probe - proxy;
    return {glm::length(proxy) - kRadius - bumps_height(b, proxy),
            glm::length(pull - glm::dot(pull, n) * n)};
}

TEST(TexturedContact, OnABallTheProxyIsOnTheBumpsAndAtRest) {
    const TextureSettings b = bumps(3e-3, 0.15e-3);
    ContactLoop loop(exactly(), textured(make_solid_sphere(kRadius), b));
    std::mt19937_64 random(6);
    for (int place = 0; place < 200; ++place) {
        const Vec3 direction = random_direction(random);
        loop.start((kRadius + 1e-3) * direction);
        for (int frame = 0; frame < 20; ++frame)
            loop.move((kRadius - 1.5e-3) * direction);
        const OnBall found = on_ball(b, loop.proxy(), (kRadius - 1.5e-3) * direction);
        EXPECT_LE(std::abs(found.level_m), 1e-9) << place;
        EXPECT_LE(found.along_m, 1e-9) << place;
    }
}

// Voxels of 0.5 mm: the trilinear level is off by up to 3 h^2 / (8 R) = 1.9 um, the gradient's
// direction by what that comes to over a voxel.
TEST(TexturedContact, OnVoxelsTheBumpsAreThoseOfTheFormula) {
    const TextureSettings b = bumps(3e-3, 0.15e-3);
    const auto field =
        voxels_of([](const Vec3& p) { return 0.02 - glm::length(p); }, 0.024, 0.5e-3);
    ContactLoop loop({}, textured(field, b));
    std::mt19937_64 random(7);
    for (int place = 0; place < 200; ++place) {
        const Vec3 direction = random_direction(random);
        loop.start(0.021 * direction);
        for (int frame = 0; frame < 20; ++frame)
            loop.move(0.019 * direction);
        const double level_m = glm::length(loop.proxy()) - 0.02 - bumps_height(b, loop.proxy());
        EXPECT_LE(std::abs(level_m), 3.0 * 0.25e-6 / (8.0 * 0.02) + 0.5e-6) << place;
    }
}

TEST(TexturedContact, HeightsMayBeAFunctionOfAnotherField) {
    ContactLoop loop(exactly(), textured(make_slab(2.0 * kTop), cone()));
    std::mt19937_64 random(8);
    for (int place = 0; place < 100; ++place) {
        const Vec3 probe = random_offset(random, 5e-3) + Vec3{0, 0, kTop - 6e-3};
        loop.start({probe.x, probe.y, kTop + 3e-3});
        for (int frame = 0; frame < 5; ++frame)
            loop.move(probe);
        const Vec3 p = loop.proxy();
        const double depth_m = 20e-3 - glm::length(p); // in the ball whose value it is
        EXPECT_NEAR(p.z, kTop + 0.01 * depth_m, 1e-9) << place;
    }
}

/// Along x, pressed 1 mm deep, a texture's whole length after the first 60 frames.
template <class Look>
void drag(ContactLoop& loop, double speed_m_per_s, double depth_m, const Look& look) {
    loop.start({0, 0, kTop + 1e-3});
    for (int frame = 0; frame < 600; ++frame) {
        const Vec3 probe{speed_m_per_s * 1e-3 * frame, 0.3e-3,
                         kTop - depth_m * std::min(1.0, frame / 50.0)};
        const SubdivisionResult result = loop.move(probe);
        if (frame >= 60) look(result, probe);
    }
}

// Crest by crest, also where the proxy leaps from one to the next: never behind what is felt, by
// more than the step that ends at the tolerance leaves. With the cap reached a frame is late, no
// more; a quarter of a wavelength in each of its eight evaluations.
TEST(TexturedContact, IsFollowedAtTheSpeedOfAHand) {
    for (const double wavelength_m : {1e-3, 2e-3, 5e-3})
        for (const double steepness : {0.3, 1.0}) {
            const TextureSettings g =
                grating(wavelength_m, steepness * SurfaceTexture::kHighestOfWave * wavelength_m);
            ContactLoop loop({}, textured(make_slab(2.0 * kTop), g));
            double behind_m = 0.0, evaluations = 0.0, lowest = kInfinite, highest = 0.0;
            int capped = 0;
            drag(loop, 0.2, 0.5e-3, [&](const SubdivisionResult& result, const Vec3&) {
                const Vec3 p = loop.proxy();
                behind_m = std::max(behind_m, kTop + grating_height(g, p.x) - p.z);
                evaluations += result.evaluations / 540.0;
                capped += (result.flags & kEvaluationCap) != 0 ? 1 : 0;
                EXPECT_EQ(result.flags & kStalled, 0u);
                lowest = std::min(lowest, p.z - kTop);
                highest = std::max(highest, p.z - kTop);
            });
            EXPECT_LE(behind_m, 0.1e-6) << wavelength_m << " " << steepness;
            EXPECT_LE(evaluations, 5.0) << wavelength_m << " " << steepness;
            EXPECT_LE(capped, 0.1 * 540) << wavelength_m << " " << steepness;
            EXPECT_LT(lowest, 0.3 * g.height_m);
            EXPECT_GT(highest, 0.7 * g.height_m);
        }
}

// The certificate is the field's own, and the texture in front of it: nothing goes deeper.
TEST(TexturedContact, NoChordGoesThroughWhatIsBehindTheTexture) {
    const double tau = LevelSettings{}.certificate_m;
    std::uniform_real_distribution<double> share(0.0, 1.0);
    const TextureSettings b = bumps(2e-3, 0.3e-3);
    for (const std::shared_ptr<const ScalarField>& field :
         {std::shared_ptr<const ScalarField>(make_slab(1e-3)),
          std::shared_ptr<const ScalarField>(make_solid_sphere(0.02)),
          std::shared_ptr<const ScalarField>(make_torus(0.03, 0.005))}) {
        const auto sampler = field->make_sampler();
        std::mt19937_64 random(9);
        ContactLoop loop({}, textured(field, b));
        const Vec3 start{0, 0, 0.03};
        loop.start(start);
        Vec3 probe = start;
        double deepest = -kInfinite;
        for (int frame = 0; frame < 3000; ++frame) {
            probe += 0.05e-3 * std::pow(4000.0, share(random)) * random_direction(random);
            if (glm::length(probe) > 0.06) probe *= 0.06 / glm::length(probe);
            const SubdivisionResult result = loop.move(probe);
            ASSERT_TRUE(is_finite(result.proxy));
            const auto path = loop.subdivision().path();
            for (std::size_t i = 1; i < path.size(); ++i)
                for (int k = 0; k <= 20; ++k)
                    deepest = std::max(
                        deepest, sampler->value(path[i - 1] + 0.05 * k * (path[i] - path[i - 1])));
        }
        EXPECT_LE(deepest, tau + 1e-12);
    }
}

// What flies ends at the crests, whatever the chord: found by steps of an eighth of a wavelength,
// between two of which a crest of curvature H/2 (2 pi / wavelength)^2 may be cut by 0.039 H.
TEST(TexturedContact, AFreeFlightEndsWhereTheTextureBegins) {
    const TextureSettings g = grating(2e-3, 0.3e-3);
    const auto field = make_slab(2.0 * kTop);
    VolumeContact contact(make_slab(2.0 * kTop), {}, g);
    std::mt19937_64 random(10);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    int grazing = 0;
    for (int i = 0; i < 2000; ++i) {
        const Vec3 from = random_offset(random, 5e-3) * Vec3{1, 1, 0} +
                          Vec3{0, 0, kTop + g.height_m + 1e-3 * share(random)};
        const Vec3 to = random_offset(random, 5e-3) * Vec3{1, 1, 0} +
                        Vec3{0, 0, kTop + 0.3e-3 - 2e-3 * share(random)};
        contact.restart(from);
        ContactSet none;
        contact.offer(from, none);
        ASSERT_EQ(none.size(), 0u);
        const double met = contact.carry(from, to).fraction;
        const auto gap = [&](double t) {
            const Vec3 p = from + t * (to - from);
            return p.z - kTop - grating_height(g, p.x);
        };
        EXPECT_GE(gap(met), -1e-12) << i;
        if (met < 1.0)
            EXPECT_LE(gap(met), 10e-9) << i; // within a thousandth of free_m, and that is steep
        else
            ++grazing;
        for (double t = 0.0; t < met; t += 0.01)
            ASSERT_GT(gap(t), -0.039 * g.height_m) << i << " " << t;
    }
    EXPECT_GT(grazing, 10);
}

TEST(TexturedContact, AHeldProbeHoldsTheProxysBits) {
    const TextureSettings b = bumps(2e-3, 0.2e-3);
    ContactLoop loop({}, textured(make_solid_sphere(kRadius), b));
    std::mt19937_64 random(11);
    loop.start({0, 0, kRadius + 1e-3});
    for (int place = 0; place < 100; ++place) {
        const Vec3 probe = (kRadius - 2e-3) * random_direction(random);
        for (int frame = 0; frame < 300; ++frame)
            loop.move(probe);
        const Vec3 held = loop.proxy();
        for (int frame = 0; frame < 100; ++frame) {
            loop.move(probe);
            ASSERT_EQ(loop.proxy(), held) << place;
        }
    }
}

// The work on a hand round a closed path is at most what its spring loses, k/2 sum |da|^2, and the
// way back to the level (tests/stability/passivity_test.cpp derives it).
TEST(TexturedContact, AClosedPathOverBumpsGivesTheHandNothing) {
    const double k = ContactLoop::kStiffness;
    for (const TextureSettings& texture : {grating(2e-3, 0.3e-3), grating(5e-3, 0.1e-3)})
        for (const int frames : {300, 3000}) {
            ContactLoop loop({}, textured(make_slab(2.0 * kTop), texture));
            const auto probe = [&](int frame) {
                const double angle = 2.0 * std::numbers::pi * frame / frames;
                return Vec3{8e-3 * std::cos(angle), 8e-3 * std::sin(angle),
                            kTop - 1.5e-3 - 1e-3 * std::sin(3.0 * angle)};
            };
            loop.start(probe(0) + Vec3{0, 0, 4e-3});
            loop.move(probe(0));
            const auto energy = [&](int frame) {
                return 0.5 * k * squared_length(loop.proxy() - probe(frame));
            };
            double on_hand_j = 0.0, bound_j = energy(0);
            for (int i = 1; i <= 2 * frames; ++i) {
                const Vec3 from = probe((i - 1) % frames), to = probe(i % frames), x = loop.proxy();
                on_hand_j += k * glm::dot(x - from, to - from);
                const double behind_m = std::max(0.0, kTop + grating_height(texture, x.x) - x.z);
                bound_j += 0.5 * k * squared_length(to - from) +
                           k * (glm::length(x - to) * behind_m + 0.5 * behind_m * behind_m);
                loop.move(to);
            }
            bound_j -= energy(2 * frames % frames);
            EXPECT_LE(on_hand_j, bound_j + 1e-9) << frames;
        }
}

TEST(TexturedContact, WhatYieldsGivesWayWithItsTexture) {
    LevelSettings level;
    level.strength_n = 0.5; // 1 mm of the spring
    const TextureSettings g = grating(2e-3, 0.2e-3);
    ContactLoop loop(exactly(), textured(make_slab(2.0 * kTop), g, level));
    loop.start({0.9e-3, 0, kTop + 1e-3});
    for (int frame = 0; frame < 300; ++frame) {
        const Vec3 probe{0.9e-3, 0, kTop + 1e-3 - 0.02e-3 * frame};
        loop.move(probe);
        const double force_n = ContactLoop::kStiffness * glm::length(loop.proxy() - probe);
        ASSERT_LE(force_n, level.strength_n + 1e-6) << frame;
    }
    const Vec3 probe{0.9e-3, 0, kTop + 1e-3 - 0.02e-3 * 299};
    EXPECT_NEAR(ContactLoop::kStiffness * glm::length(loop.proxy() - probe), level.strength_n,
                1e-6);
}

TEST(TexturedContact, AMagnetDrawsOntoTheTexture) {
    const TextureSettings g = grating(2e-3, 0.1e-3);
    SurfaceFinish finish;
    finish.magnet = {0.5, 2e-3}; // 1 mm of the spring
    ContactLoop loop(exactly(), textured(make_slab(2.0 * kTop), g), {}, 0.0, {finish});
    loop.start({0, 0, kTop + 0.2e-3});
    for (int frame = 0; frame < 200; ++frame) {
        loop.move({0.02e-3 * frame, 0, kTop + 0.5e-3});
        const Vec3 p = loop.proxy();
        ASSERT_NEAR(p.z, kTop + grating_height(g, p.x), 0.2e-9) << frame;
    }
}

// The steepest flank is 1/2: a coefficient above it holds everywhere.
TEST(TexturedContact, FrictionHoldsOnTheFlanks) {
    const TextureSettings g = grating(2e-3, SurfaceTexture::kHighestOfWave * 2e-3);
    SurfaceFinish finish;
    finish.friction = {0.7, 0.7};
    ContactLoop loop({}, textured(make_slab(2.0 * kTop), g), {}, 0.0, {finish});
    for (double x = 0.0; x < 2e-3; x += 0.05e-3) {
        loop.start({x, 0, kTop + 1e-3});
        for (int frame = 0; frame < 20; ++frame)
            loop.move({x, 0, kTop - 1e-3});
        const Vec3 held = loop.proxy();
        EXPECT_NEAR(held.x, x, 1e-6); // 0.1 um from where it met
        for (int frame = 0; frame < 200; ++frame)
            loop.move({x, 0, kTop - 1e-3});
        EXPECT_EQ(loop.proxy(), held);
    }
}

// A gain of 0 is the bare level, 10 as high as flanks of 1/2 allow; on the way no frame moves the
// proxy by more than its share of the ramp.
TEST(TexturedContact, HeightsFollowTheirGain) {
    const TextureSettings g = grating(2e-3, 0.1e-3);
    ContactLoop loop(exactly(), textured(make_slab(2.0 * kTop), g));
    const double crest = 1e-3;
    const Vec3 probe{crest, 0, kTop - 0.2e-3}; // where the crest is a stable place
    loop.start({crest, 0, kTop + 1e-3});
    const auto settle = [&](double gain) {
        loop.subdivision().gain(0, SurfacePart::texture).set(gain);
        for (int frame = 0; frame < 600; ++frame) {
            const double before = loop.proxy().z;
            loop.move(probe);
            if (frame > 0) {
                EXPECT_LE(std::abs(loop.proxy().z - before), 0.02 * g.height_m + 1e-9) << frame;
            }
        }
        return loop.proxy().z - kTop;
    };
    for (int frame = 0; frame < 20; ++frame)
        loop.move(probe);
    EXPECT_NEAR(loop.proxy().z, kTop + g.height_m, 1e-9);
    EXPECT_NEAR(settle(0.0), 0.0, 1e-9);
    EXPECT_NEAR(settle(0.5), 0.5 * g.height_m, 1e-9);
    EXPECT_NEAR(settle(1.0), g.height_m, 1e-9);
    // What lifts a hand that is held far is booked as what drift has taken: a little less than it.
    const double highest_m = SurfaceTexture::kHighestOfWave * g.wavelength_m;
    EXPECT_NEAR(settle(10.0), highest_m, 0.01 * highest_m);
}

TEST(TexturedContact, ATrialThatBeginsInTheTextureDoesNotFeelItUntilItIsLeft) {
    const TextureSettings g = grating(2e-3, 0.2e-3);
    ContactLoop loop({}, textured(make_slab(2.0 * kTop), g));
    const double crest = 1e-3;
    loop.start({crest, 0, kTop + 0.1e-3});
    EXPECT_TRUE(loop.flags_at_start() & kInsideAtStart);
    loop.move({crest, 0, kTop + 0.05e-3});
    EXPECT_EQ(loop.proxy(), Vec3(crest, 0, kTop + 0.05e-3));
    loop.move({crest, 0, kTop + 1e-3});
    loop.move({crest, 0, kTop + 0.05e-3});
    EXPECT_NEAR(loop.proxy().z, kTop + g.height_m, 0.1e-6);
}

// Crests are in front of the mesh, where the guard just flies along: it changes nothing.
TEST(TexturedContact, AGuardsLeashDoesNotFightTheCrests) {
    const auto field =
        voxels_of([](const Vec3& p) { return 0.02 - glm::length(p); }, 0.024, 0.5e-3);
    const auto mesh = certified(icosphere(0.02, 5));
    const TextureSettings b = bumps(2e-3, 0.3e-3);
    std::vector<std::unique_ptr<SurfaceContact>> guarded;
    guarded.push_back(
        std::make_unique<GuardedContact>(field, LevelSettings{}, mesh, /*leash_m=*/0.2e-3, b));
    ContactLoop with({}, std::move(guarded));
    ContactLoop without({}, textured(field, b));
    const Vec3 start{0, 0, 0.022};
    with.start(start);
    without.start(start);
    double highest = 0.0;
    for (int frame = 0; frame < 2000; ++frame) {
        const double angle = 0.005 * frame;
        const Vec3 probe =
            0.019 * Vec3{std::sin(angle), 0.3 * std::sin(0.3 * angle), std::cos(angle)};
        const SubdivisionResult result = with.move(probe);
        without.move(probe);
        ASSERT_EQ(result.guarded, 0u) << frame;
        ASSERT_EQ(with.proxy(), without.proxy()) << frame;
        highest = std::max(highest, glm::length(with.proxy()) - 0.02);
    }
    EXPECT_GT(highest, 0.2e-3); // higher than the leash is long
}

// Shares of eq. (9) are steps along planes; they end where the adaptive ones do.
TEST(TexturedContact, EveryMethodEndsAtTheSamePlaceOfAHeldProbe) {
    const TextureSettings g = grating(2e-3, 0.05e-3);
    const Vec3 probe{0.4e-3, 0, kTop - 1e-3};
    for (const SteppingMethod method :
         {SteppingMethod::single, SteppingMethod::fixed, SteppingMethod::adaptive}) {
        ContactLoop loop(stepping(method), textured(make_slab(2.0 * kTop), g));
        loop.start({0.4e-3, 0, kTop + 1e-3});
        for (int frame = 0; frame < 100; ++frame)
            loop.move(probe);
        EXPECT_LE(glm::length(loop.proxy() - nearest_on_grating(g, probe)), 0.2e-6)
            << static_cast<int>(method);
    }
}

} // namespace
} // namespace palpate
