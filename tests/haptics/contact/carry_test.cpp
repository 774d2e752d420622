// SPDX-License-Identifier: Apache-2.0
// What asking how far a chord holds may change, as SurfaceContact::carry() remembers what it meets
// (docs/architecture.md, "Decisions"): the planes of the next offer(), and no more.
#include <any>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/contact/direct_contact.h>

#include "tests/support/contact_kinds.h"
#include "tests/support/contact_loop.h"

namespace palpate {
namespace {

using test::ContactLoop;
using test::Kind;

constexpr double kRadius = 0.02; // m
constexpr std::array kKinds{Kind::formula, Kind::volume, Kind::mesh, Kind::guarded};

Vec3 random_direction(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    const double x = normal(random), y = normal(random), z = normal(random);
    return glm::normalize(Vec3{x, y, z});
}

/// 1 um to 30 mm: over facets and voxels, and through the whole ball.
double random_length_m(std::mt19937_64& random) {
    return 1e-6 * std::pow(3e4, std::uniform_real_distribution<double>()(random));
}

/// A hand that goes round the ball, now in front of it and now up to 4 mm behind.
Vec3 random_probe(std::mt19937_64& random, const Vec3& before) {
    const Vec3 probe = before + random_length_m(random) * random_direction(random);
    const double height = glm::length(probe);
    if (height < kRadius - 4e-3) return probe * ((kRadius - 4e-3) / height);
    return height > kRadius + 4e-3 ? probe * ((kRadius + 4e-3) / height) : probe;
}

std::vector<std::unique_ptr<SurfaceContact>> one(std::unique_ptr<SurfaceContact> contact) {
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::move(contact));
    return surfaces;
}

std::unique_ptr<SurfaceContact> direct_ball() {
    const auto mesh = std::make_shared<const TriangleMesh>(test::icosphere(kRadius, 4));
    return std::make_unique<DirectContact>(std::make_shared<const SurfaceScene>(mesh),
                                           make_solid_sphere(kRadius), LevelSettings{});
}

/// What a surface says of some chords.
std::vector<double> fractions(SurfaceContact& contact, const Vec3& from,
                              const std::vector<Vec3>& ends) {
    std::vector<double> result;
    for (const Vec3& to : ends) {
        const Chord chord = contact.carry(from, to);
        result.push_back(chord.engaged ? 2.0 + chord.fraction : chord.fraction);
    }
    return result;
}

/// After each of many frames: asks, and goes on from where it was before that. `ask` is given the
/// contact, the proxy and ends of chords from it.
template <class Ask>
void ask_between_frames(std::unique_ptr<SurfaceContact> contact, const Ask& ask) {
    ContactLoop loop({}, one(std::move(contact)));
    std::mt19937_64 random(5);
    Vec3 probe{0, 0, kRadius + 3e-3};
    loop.start(probe);
    for (int frame = 0; frame < 600 && !testing::Test::HasFailure(); ++frame) {
        SCOPED_TRACE(testing::Message() << "frame " << frame);
        probe = random_probe(random, probe);
        loop.move(probe);
        std::vector<Vec3> ends;
        for (int i = 0; i < 4; ++i)
            ends.push_back(loop.proxy() + random_length_m(random) * random_direction(random));
        const std::any state = loop.surface(0).save_state();
        ask(loop.surface(0), loop.proxy(), ends);
        loop.surface(0).restore_state(state);
    }
}

void offer(SurfaceContact& contact, const Vec3& proxy) {
    ContactSet planes;
    contact.offer(proxy, planes);
}

TEST(Carry, TheSameChordAskedAgainHoldsAsFar) {
    const auto ask_twice = [](SurfaceContact& contact, const Vec3& proxy,
                              const std::vector<Vec3>& ends) {
        offer(contact, proxy);
        const std::vector<double> first = fractions(contact, proxy, ends);
        EXPECT_EQ(fractions(contact, proxy, ends), first);
    };
    for (const double strength_n : {std::numeric_limits<double>::infinity(), 0.5})
        for (const Kind kind : kKinds) {
            SCOPED_TRACE(testing::Message() << name_of(kind) << ", " << strength_n << " N");
            ask_between_frames(ball(kind, kRadius, strength_n, Yielding::holds, 4), ask_twice);
        }
    SCOPED_TRACE("direct");
    ask_between_frames(direct_ball(), ask_twice);
}

// On one flank of a notch, the other one is met. It was remembered at once, and a second chord took
// it for a plane that the solver had weighed already: it went through.
TEST(Carry, DirectContactStopsAtAnotherFlankAsOftenAsItIsAsked) {
    TriangleMesh faces; // of the notch, out to 30 mm
    faces.vertices = {{-0.03, -0.03, 0.03}, {-0.03, 0.03, 0.03}, {0, -0.03, 0},
                      {0, 0.03, 0},         {0.03, -0.03, 0.03}, {0.03, 0.03, 0.03}};
    faces.triangles = {{0, 2, 1}, {1, 2, 3}, {2, 4, 3}, {3, 4, 5}};
    const auto mesh = std::make_shared<const TriangleMesh>(std::move(faces));
    DirectContact notch(std::make_shared<const SurfaceScene>(mesh),
                        std::shared_ptr<const ScalarField>(make_wedge(270.0)), LevelSettings{});
    const Vec3 proxy{-1e-4, 0, 1.01e-4};
    notch.restart(proxy);
    offer(notch, proxy);
    const std::vector<Vec3> across{{3e-4, 0, 1e-4}};
    const std::vector<double> first = fractions(notch, proxy, across);
    EXPECT_LT(first[0], 1.0);
    EXPECT_EQ(fractions(notch, proxy, across), first);
    ContactSet planes;
    notch.offer(proxy, planes);
    EXPECT_EQ(planes.size(), 2u); // both flanks
}

// Neither where the surface stands, nor the level that the frame's end finds, nor what is certified
// from there.
TEST(Carry, AskingMovesNoLevel) {
    for (const double strength_n : {std::numeric_limits<double>::infinity(), 0.5})
        for (const Yielding yielding : {Yielding::holds, Yielding::opens})
            for (const Kind kind : kKinds) {
                if (std::isinf(strength_n) && yielding == Yielding::opens) continue;
                SCOPED_TRACE(testing::Message() << name_of(kind) << ", " << strength_n << " N");
                const auto ask = [](SurfaceContact& contact, const Vec3& proxy,
                                    const std::vector<Vec3>& ends) {
                    struct Found {
                        SurfaceState state;
                        bool guarded;
                        std::vector<double> fractions;
                        bool operator==(const Found&) const = default;
                    };
                    const auto at_frames_end = [&] {
                        contact.commit(proxy, false, true);
                        offer(contact, proxy);
                        return Found{contact.state(), contact.guarded(),
                                     fractions(contact, proxy, ends)};
                    };
                    offer(contact, proxy);
                    const std::any unasked = contact.save_state();
                    const Found without = at_frames_end();
                    contact.restore_state(unasked);
                    offer(contact, proxy);
                    const SurfaceState state = contact.state();
                    const bool guarded = contact.guarded();
                    fractions(contact, proxy, ends);
                    EXPECT_EQ(contact.state(), state);
                    EXPECT_EQ(contact.guarded(), guarded);
                    EXPECT_EQ(at_frames_end(), without);
                };
                ask_between_frames(ball(kind, kRadius, strength_n, yielding, 4), ask);
            }
}

// The level of a field remembers nothing of a chord: its frames are the same bits.
TEST(Carry, OfALevelAskingLeavesEveryBit) {
    for (const Kind kind : {Kind::formula, Kind::volume})
        for (const double strength_n : {std::numeric_limits<double>::infinity(), 0.5}) {
            SCOPED_TRACE(testing::Message() << name_of(kind) << ", " << strength_n << " N");
            ContactLoop asked({}, one(ball(kind, kRadius, strength_n, Yielding::holds)));
            ContactLoop unasked({}, one(ball(kind, kRadius, strength_n, Yielding::holds)));
            std::mt19937_64 random(6);
            Vec3 probe{0, 0, kRadius + 3e-3};
            asked.start(probe);
            unasked.start(probe);
            for (int frame = 0; frame < 2000; ++frame) {
                probe = random_probe(random, probe);
                asked.move(probe);
                unasked.move(probe);
                ASSERT_EQ(asked.proxy(), unasked.proxy()) << "frame " << frame;
                asked.surface(0).carry(asked.proxy(), asked.proxy() + random_length_m(random) *
                                                                          random_direction(random));
            }
        }
}

} // namespace
} // namespace palpate
