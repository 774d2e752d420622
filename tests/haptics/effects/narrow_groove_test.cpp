// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/effects/coulomb_friction.h>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace palpate {
namespace {

constexpr double kStiffness = 500.0; // N/m
constexpr double kMu = 0.5;
constexpr double kHard = std::numeric_limits<double>::infinity();

/// Two walls that rub, of two surfaces, whose groove along y opens towards +z; the proxy is at its
/// bottom, or by `behind_m` in both of them.
struct Groove {
    Groove(double half_angle, double behind_m, double left_mu = kMu, double right_mu = kMu)
        : friction({{left_mu, left_mu}, {right_mu, right_mu}}) {
        for (const double side : {-1.0, 1.0}) {
            ContactPlane contact;
            contact.plane.normal = {side * std::cos(half_angle), 0.0, std::sin(half_angle)};
            contact.plane.anchor = behind_m * contact.plane.normal;
            contact.plane.strength_n = kHard;
            contacts.begin(side < 0.0 ? 0 : 1);
            contacts.add(contact);
        }
    }

    /// A frame whose proxy begins at `start`.
    Vec3 frame(const Vec3& probe, const Vec3& start = Vec3{0.0}) {
        friction.begin();
        PrimitiveSet primitives;
        for (std::size_t i = 0; i < contacts.size(); ++i)
            primitives.add(contacts[i].plane);
        if (floor) primitives.add({{0.0, 0.0, -1.0}, {0.0, 0.0, 1.0}, kHard});
        if (drawn_n > 0.0) primitives.add_force({0.0, 0.0, -drawn_n});
        friction.gather(start, contacts, primitives);
        int work = 100000;
        ProxySolution solution;
        friction.solve(primitives, probe, kStiffness, work, solution);
        const Vec3 proxy = solution.proxy;
        friction.commit();
        return proxy;
    }

    bool floor = false;   // a workspace's wall, a metre away
    double drawn_n = 0.0; // into the groove, by an effect: a magnet, a weight
    ContactSet contacts;
    CoulombFriction friction;
};

double degrees(double angle) { return angle * M_PI / 180.0; }

// Two labels that touch are such walls. By Coulomb's law alone they may hold the proxy against any
// pull, once they have pressed on each other.
TEST(NarrowGroove, APullOutOfItIsNotHeld) {
    for (const double half_angle : {2.0, 3.4, 10.0, 20.0})
        for (const double behind_m : {0.0, 1e-6, 10e-6}) {
            SCOPED_TRACE(::testing::Message() << half_angle << " degrees, " << behind_m << " m");
            for (const bool floor : {false, true}) {
                Groove groove(degrees(half_angle), behind_m);
                groove.floor = floor;
                for (const Vec3& out :
                     {Vec3{0, 0, 17e-3}, Vec3{0, 17e-3, 17e-3}, Vec3{0, 0, 1e-3}}) {
                    for (int i = 0; i < 20; ++i)
                        groove.frame({0.0, 1e-3, -17e-3}); // pressed into it
                    // What is deep in the walls is first lifted out of them, which friction may
                    // stop.
                    const Vec3 lifted = groove.frame(out);
                    EXPECT_LE(glm::length(groove.frame(out, lifted) - out), 1e-9) << floor;
                }
            }
        }
}

TEST(NarrowGroove, WhateverItsWallsRubWith) {
    for (const double left_mu : {0.05, 0.5, 2.0})
        for (const double right_mu : {0.0, 0.1, 1.0}) {
            SCOPED_TRACE(::testing::Message() << left_mu << " and " << right_mu);
            Groove groove(degrees(3.4), 1e-6, left_mu, right_mu);
            for (int i = 0; i < 20; ++i)
                groove.frame({0.0, 1e-3, -17e-3});
            const Vec3 out{0.0, 5e-3, 17e-3};
            const Vec3 lifted = groove.frame(out);
            EXPECT_LE(glm::length(groove.frame(out, lifted) - out), 1e-9);
        }
}

// An effect that draws the proxy into the groove is overcome by a stronger pull.
TEST(NarrowGroove, AgainstAnEffectThatDrawsIntoIt) {
    for (const double drawn_n : {0.5, 2.0, 5.0}) {
        SCOPED_TRACE(drawn_n);
        Groove groove(degrees(3.4), 1e-6);
        groove.drawn_n = drawn_n;
        for (int i = 0; i < 20; ++i)
            groove.frame({0.0, 1e-3, -17e-3});
        const Vec3 balance{0.0, 5e-3, 17e-3};
        const Vec3 out = balance + Vec3{0.0, 0.0, drawn_n / kStiffness};
        const Vec3 lifted = groove.frame(out);
        EXPECT_LE(glm::length(groove.frame(out, lifted) - balance), 1e-9);
    }
}

TEST(NarrowGroove, APullAlongItIsNotHeldEither) {
    for (const double half_angle : {2.0, 3.4, 10.0, 20.0}) {
        SCOPED_TRACE(half_angle);
        Groove groove(degrees(half_angle), 0.0);
        for (int i = 0; i < 20; ++i)
            groove.frame({0.0, 0.0, -17e-3});
        // In it by so little that the walls bear next to nothing.
        const Vec3 along{0.0, 20e-3, -1e-6};
        const double lag_m = 2.0 * kMu * 0.5e-6 / std::sin(degrees(half_angle));
        EXPECT_NEAR(groove.frame(along).y, along.y - lag_m, 1e-6);
    }
}

} // namespace
} // namespace palpate
