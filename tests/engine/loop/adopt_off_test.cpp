// SPDX-License-Identifier: Apache-2.0
// A loop that goes on with another scene, where a surface was off before.
#include <limits>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/engine/loop/ball_of_contact.h"
#include "tests/support/contact_kinds.h"
#include "tests/support/scripted_clock.h"

namespace palpate {
namespace {

using test::ball_of;

constexpr double kStiffness = 500.0; // N/m, the default

// What was off had let the proxy be anywhere: that says nothing of where it is. A level is felt
// from the first frame on where the proxy is in front of it, and nothing is felt from within.
TEST(Adopt, WhatWasOffIsFeltFromInFrontAndNotFromWithin) {
    const double hard = std::numeric_limits<double>::infinity();
    for (const ContactKind contact :
         {ContactKind::mesh, ContactKind::volume, ContactKind::guarded, ContactKind::direct})
        for (const bool moves : {false, true})
            for (const bool within : {false, true}) {
                SCOPED_TRACE(std::string(name(contact)) + (moves ? ", moves" : "") +
                             (within ? ", within" : ""));
                test::ScriptedClock clock;
                HapticLoop loop(std::make_shared<const Scene>(ball_of(contact, hard, moves)),
                                clock);
                DeviceState state;
                state.position = {0, 0, 0.0205};
                loop.frame(state);
                ASSERT_TRUE(loop.set_gain(0, 0.0));
                for (int i = 0; i < 100; ++i) {
                    if (within && i == 60) state.position.z = 0.015;
                    loop.frame(state);
                }
                loop.adopt(std::make_shared<const Scene>(ball_of(contact, hard, moves)));
                FrameReport report = loop.frame(state);
                const bool by_value =
                    contact == ContactKind::volume || contact == ContactKind::guarded;
                EXPECT_EQ((report.flags & kInsideAtStart) != 0, within && by_value);
                state.position.z = within ? 0.012 : 0.018;
                for (int i = 0; i < 10; ++i)
                    report = loop.frame(state);
                EXPECT_NEAR(report.force.z, within ? 0.0 : kStiffness * 0.002, 0.1);
            }
}

// Also where its first frame is the one in which the hand comes in, and where it moves.
TEST(Adopt, ALevelThatWasOffIsFeltFromTheFirstFrameOn) {
    const double hard = std::numeric_limits<double>::infinity();
    for (const ContactKind contact : {ContactKind::volume, ContactKind::guarded})
        for (const bool moves : {false, true}) {
            SCOPED_TRACE(std::string(name(contact)) + (moves ? ", moves" : ""));
            test::ScriptedClock clock;
            HapticLoop loop(std::make_shared<const Scene>(ball_of(contact, hard, moves)), clock);
            DeviceState state;
            state.position = {0, 0, 0.02002};
            loop.frame(state);
            ASSERT_TRUE(loop.set_gain(0, 0.0));
            for (int i = 0; i < 100; ++i)
                loop.frame(state);
            loop.adopt(std::make_shared<const Scene>(ball_of(contact, hard, moves)));
            for (int i = 0; i < 20; ++i) {
                state.position.z = 0.01997 - 1e-4 * i; // 50 mm/s, then 100
                EXPECT_GE(loop.frame(state).proxy.z, 0.02 - 50e-6) << i;
            }
        }
}

TEST(Adopt, ABodyThatWasOffIsJudgedWhereItIs) {
    const double hard = std::numeric_limits<double>::infinity();
    const Vec3 moved(0.1, 0.0, 0.0);
    for (const ContactKind contact : {ContactKind::volume, ContactKind::guarded})
        for (const bool within : {false, true}) {
            SCOPED_TRACE(std::string(name(contact)) + (within ? ", within" : ""));
            test::ScriptedClock clock;
            HapticLoop loop(std::make_shared<const Scene>(ball_of(contact, hard, true)), clock);
            ASSERT_TRUE(loop.set_pose(0, {moved, {1, 0, 0, 0}}));
            ASSERT_TRUE(loop.set_gain(0, 0.0));
            DeviceState state;
            state.position = within ? moved : Vec3(0.0); // where the scene has the body
            for (int i = 0; i < 100; ++i)
                loop.frame(state);
            loop.adopt(std::make_shared<const Scene>(ball_of(contact, hard, true)));
            EXPECT_EQ((loop.frame(state).flags & kInsideAtStart) != 0, within);
            EXPECT_EQ(loop.pose(0).position, moved);
        }
}

} // namespace
} // namespace palpate
