// SPDX-License-Identifier: Apache-2.0
// A loop that goes on with another scene.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/engine/loop/ball_of_contact.h"
#include "tests/support/contact_kinds.h"
#include "tests/support/scripted_clock.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

using test::ball_of;

constexpr double kStiffness = 500.0;                // N/m, the default
constexpr double kForceError = kStiffness * 0.1e-6; // a frame ends within 0.1 um of the balance
constexpr double kSlew_n = 2.0;                     // in a frame: 2000 N/s, the default

std::string ball(const std::string& name, double radius_mm, const std::string& more = "") {
    return "[volume." + name +
           "]\nanalytic = \"solid_sphere\"\nradius_mm = " + std::to_string(radius_mm) +
           "\n[surface." + name + "]\nvolume = \"" + name + "\"\n" + more +
           "\n[[effect]]\ntype = \"surface\"\nsurface = \"" + name + "\"\n";
}
std::shared_ptr<const Scene> scene_of(const std::string& text) {
    return std::make_shared<const Scene>(parse_scene(text, "adopt.toml"));
}

struct Hand {
    explicit Hand(const std::string& text, std::vector<std::unique_ptr<Effect>> custom = {})
        : loop(scene_of(text), clock, std::move(custom)) {}

    FrameReport to(const Vec3& probe) {
        DeviceState state;
        state.position = probe;
        return report = loop.frame(state);
    }
    void press(double depth_m) { // into the ball of 20 mm, from above
        to({0, 0, 0.021});
        for (int i = 0; i < 5; ++i)
            to({0, 0, 0.02 - depth_m});
    }

    test::ScriptedClock clock;
    HapticLoop loop;
    FrameReport report;
};

TEST(Adopt, TheProxyStaysOnASurfaceThatIsStillThere) {
    for (const std::string contact : {"contact = \"volume\"", "strength_n = 100"}) {
        Hand hand(ball("ball", 20, contact));
        hand.press(0.002);
        const FrameReport before = hand.report;
        hand.loop.adopt(scene_of(ball("other", 5) + ball("ball", 20, contact) +
                                 "[[effect]]\ntype = \"viscosity\"\ndamping_n_s_per_m = 1\n"));
        hand.to(before.probe);
        EXPECT_TRUE(hand.report.flags & kSceneAdopted);
        EXPECT_LT(glm::length(hand.report.proxy - before.proxy), 1e-7);
        EXPECT_NEAR(hand.report.force.z, kStiffness * 0.002, 2.0 * kForceError);
        EXPECT_EQ(hand.report.frame, before.frame + 1);
        // It was already touched: nothing begins.
        ASSERT_EQ(hand.loop.touches().size(), 1u);
        EXPECT_EQ(hand.loop.touches()[0].phase, Touch::Phase::goes_on);
        hand.to(before.probe);
        EXPECT_EQ(hand.report.flags & kSceneAdopted, 0u);
    }
}

TEST(Adopt, EveryContactGoesOnAsItIs) {
    const double hard = std::numeric_limits<double>::infinity();
    for (const ContactKind contact :
         {ContactKind::mesh, ContactKind::volume, ContactKind::guarded, ContactKind::direct})
        for (const bool moves : {false, true}) {
            test::ScriptedClock clock;
            HapticLoop loop(std::make_shared<const Scene>(ball_of(contact, hard, moves)), clock);
            const auto to = [&](const Vec3& probe) {
                DeviceState state;
                state.position = probe;
                return loop.frame(state);
            };
            to({0, 0, 0.021});
            FrameReport report;
            for (int i = 0; i < 10; ++i)
                report = to({0.0003, 0.0002, 0.018});
            const FrameReport before = report;
            ASSERT_GT(before.force.z, 0.9);
            loop.adopt(std::make_shared<const Scene>(ball_of(contact, hard, moves)));
            for (int i = 0; i < 10; ++i) {
                report = to({0.0003, 0.0002, 0.018});
                EXPECT_FALSE(report.flags & kInsideAtStart);
                EXPECT_LT(glm::length(report.proxy - before.proxy), 1e-7)
                    << name(contact) << (moves ? " moves" : "");
            }
        }
}

/// A plate of 3 mm in voxels of 1 mm, which lost a piece of 5 mm around (6, 0) mm; its mesh is
/// whole.
constexpr double kPlateTop = 1.5e-3; // m
constexpr double kPlateLeash = 1e-3; // m, of a mesh that is given
std::shared_ptr<const ScalarField> plate_with_a_hole() {
    const auto inside_m = [](const Vec3& p) {
        const double plate =
            std::min({kPlateTop - std::abs(p.z), 0.015 - std::abs(p.x), 0.015 - std::abs(p.y)});
        return std::min(plate, std::hypot(p.x - 0.006, p.y) - 0.0025);
    };
    return test::voxels_of(inside_m, 0.02, 1e-3);
}
std::shared_ptr<const Scene> plate(std::shared_ptr<const ScalarField> field, ContactKind contact) {
    SceneDescription scene;
    scene.volumes["v"].scalar_field = std::move(field);
    SurfaceDescription& surface = scene.surfaces["plate"];
    surface.volume = "v";
    surface.contact = contact;
    if (contact == ContactKind::guarded)
        surface.triangle_mesh = std::make_shared<const TriangleMesh>(
            test::box_mesh({-0.015, -0.015, -kPlateTop}, {0.015, 0.015, kPlateTop}));
    scene.effects.push_back(effects::Surface{.surface = "plate"});
    return std::make_shared<const Scene>(scene);
}

/// A hand that presses from the first to the last frame.
struct PressingHand {
    Vec3 proxy{0.0};             ///< in the end, m
    double lowest_m = 1.0;       ///< of the proxy
    double force_jump_n = 0.0;   ///< at the adoption, where the probe rests
    double largest_step_n = 0.0; ///< of the force from one frame to the next, once it presses
    std::uint32_t flags = 0;     ///< of all frames
};
PressingHand press_over_the_hole(const std::shared_ptr<const ScalarField>& field, double y,
                                 ContactKind first, ContactKind then) {
    test::ScriptedClock clock;
    HapticLoop loop(plate(field, first), clock);
    PressingHand hand;
    FrameReport report;
    Vec3 probe{0.0, y, 0.003};
    const auto go = [&](const Vec3& by, int frames) {
        for (int i = 0; i < frames; ++i) {
            DeviceState state;
            state.position = probe += by / static_cast<double>(frames);
            const Vec3 before = report.force;
            report = loop.frame(state);
            hand.flags |= report.flags;
            hand.lowest_m = std::min(hand.lowest_m, report.proxy.z);
            hand.largest_step_n = std::max(hand.largest_step_n, glm::length(report.force - before));
        }
    };
    go({0.0, 0.0, -0.0035}, 50); // 2 mm deep
    go(Vec3{0.0}, 5);
    const FrameReport before = report;
    EXPECT_NE(before.surfaces_felt, 0u);
    EXPECT_NEAR(before.proxy.z, kPlateTop, 1e-4);
    EXPECT_EQ(hand.flags, 0u);
    if (then != first) loop.adopt(plate(field, then));
    go(Vec3{0.0}, 1);
    hand.force_jump_n = glm::length(report.force - before.force);
    EXPECT_NE(report.surfaces_felt, 0u);
    if (then != first) {
        EXPECT_GT(report.surface_queries, 0u) << "the mesh is there from here on";
    }
    go({0.002, 0.0, 0.0}, 40);
    EXPECT_EQ(hand.flags, then != first ? std::uint32_t{kSceneAdopted} : 0u);
    go({0.004, 0.0, 0.0}, 80);
    go({0.0, 0.0, -0.004}, 80); // far below the plate
    hand.proxy = report.proxy;
    return hand;
}

// What was seen: a hand that never let go felt the preview to the end.
TEST(Adopt, AMeshIsFeltByAHandThatPressesAllTheTime) {
    const auto field = plate_with_a_hole();
    const ContactKind volume = ContactKind::volume, guarded = ContactKind::guarded;
    for (const double y : {-0.001, -0.0004, 0.0, 0.0003, 0.0012}) {
        const PressingHand hand = press_over_the_hole(field, y, volume, guarded);
        EXPECT_LE(hand.force_jump_n, kForceError) << y;
        EXPECT_LT(hand.largest_step_n, kSlew_n) << y;
        EXPECT_GE(hand.lowest_m, kPlateTop - kPlateLeash) << y;
        // From then on it is as if the mesh had been there from the beginning.
        const PressingHand always = press_over_the_hole(field, y, guarded, guarded);
        EXPECT_EQ(hand.flags, always.flags | kSceneAdopted) << y;
        EXPECT_LT(glm::length(hand.proxy - always.proxy), 1e-6) << y;
        const PressingHand without = press_over_the_hole(field, y, volume, volume);
        EXPECT_LT(without.lowest_m, -kPlateTop) << "the plate must be one that needs the mesh";
    }
}

TEST(Adopt, WhatYieldedGoesOnWhereItHolds) {
    for (const ContactKind contact : {ContactKind::mesh, ContactKind::volume}) {
        test::ScriptedClock clock;
        HapticLoop loop(std::make_shared<const Scene>(ball_of(contact, 0.5)), clock);
        const auto to = [&](double height_m) {
            DeviceState state;
            state.position = {0, 0, height_m};
            return loop.frame(state);
        };
        to(0.021);
        FrameReport report;
        for (int i = 0; i < 40; ++i)
            report = to(0.02 - 1e-4 * i); // pushed in by some 3 mm
        const FrameReport before = report;
        ASSERT_NEAR(before.force.z, 0.5, 0.02);
        loop.adopt(std::make_shared<const Scene>(ball_of(contact, 0.5)));
        for (int i = 0; i < 10; ++i)
            report = to(0.02 - 1e-4 * 39);
        EXPECT_LT(glm::length(report.proxy - before.proxy), 1e-7) << name(contact);
        EXPECT_NEAR(report.force.z, before.force.z, 1e-4);
    }
}

TEST(Adopt, APoseThatWasSetBeforeTheFirstFrameGoesOn) {
    Hand hand(ball("ball", 20, "moves = true"));
    hand.loop.set_pose(0, {{0.1, 0, 0}, {1, 0, 0, 0}});
    hand.loop.adopt(scene_of(ball("ball", 20, "moves = true")));
    EXPECT_FALSE(hand.to({0, 0, 0}).flags & kInsideAtStart);
    EXPECT_EQ(hand.loop.pose(0).position, Vec3(0.1, 0, 0));
}

TEST(Adopt, ANewTrialSaysForItselfWhetherItBeginsInside) {
    Hand hand(ball("ball", 20));
    hand.press(0.002);
    hand.loop.adopt(scene_of(ball("big", 30)));
    DeviceState state;
    state.trial = 1;
    state.position = {0, 0, 0.05};
    const FrameReport report = hand.loop.frame(state);
    EXPECT_EQ(report.flags, kSceneAdopted);
}

TEST(Adopt, BeforeATrialNothingIsInside) {
    Hand hand(ball("ball", 20));
    hand.loop.adopt(scene_of(ball("big", 30)));
    DeviceState late;
    late.freshness = Freshness::stale;
    EXPECT_EQ(hand.loop.frame(late).flags & kInsideAtStart, 0u);
}

TEST(Adopt, ItsFlagIsAPartOfTheState) {
    Hand hand(ball("ball", 20));
    hand.press(0.002);
    hand.loop.adopt(scene_of(ball("ball", 20, "strength_n = 100")));
    const LoopState then = hand.loop.save();
    const FrameReport first = hand.to({0, 0, 0.018});
    hand.loop.restore(then);
    const FrameReport again = hand.to({0, 0, 0.018});
    EXPECT_EQ(first.flags, again.flags);
    EXPECT_EQ(first.proxy, again.proxy);
}

TEST(Adopt, AnotherStrengthOfTheSameSurfaceHoldsFromNowOn) {
    Hand hand(ball("ball", 20));
    hand.press(0.004); // 2 N
    hand.loop.adopt(scene_of(ball("ball", 20, "strength_n = 0.5")));
    for (int i = 0; i < 20; ++i)
        hand.to(hand.report.probe);
    EXPECT_NEAR(hand.report.force.z, 0.5, 0.01);
}

TEST(Adopt, WhatIsNewAndHoldsTheProxyInsideIsNotFeltUntilItWasLeft) {
    Hand hand(ball("ball", 20));
    hand.press(0.002);
    const double before_n = hand.report.force.z;
    hand.loop.adopt(scene_of(ball("big", 30)));
    hand.to(hand.report.probe);
    EXPECT_TRUE(hand.report.flags & kInsideAtStart);
    // The old ball is gone, the new one is not felt: the force goes to zero, by the slew limit.
    EXPECT_LT(before_n - hand.report.force.z, kSlew_n * (1.0 + 1e-12));
    hand.to(hand.report.probe);
    EXPECT_EQ(hand.report.force.z, 0.0);
    for (int i = 0; i < 150; ++i)
        hand.to({0, 0, 0.018 + 1e-4 * i});
    for (int i = 0; i < 40; ++i)
        hand.to({0, 0, 0.033 - 1e-4 * i});
    EXPECT_NEAR(hand.report.force.z, kStiffness * 0.0009, kForceError);
}

TEST(Adopt, ASurfaceOfAnotherSizeIsAnotherOne) {
    Hand hand(ball("ball", 20));
    hand.press(0.002);
    hand.loop.adopt(scene_of(ball("ball", 20.5)));
    hand.to(hand.report.probe);
    EXPECT_TRUE(hand.report.flags & kInsideAtStart);
}

TEST(Adopt, TheForceNeverStepsByMoreThanTheSlewLimit) {
    Hand hand(ball("ball", 20));
    hand.press(0.008); // 4 N
    Vec3 last = hand.report.force;
    for (int i = 0; i < 60; ++i) {
        if (i % 10 == 0) hand.loop.adopt(scene_of(ball(i % 20 == 0 ? "other" : "ball", 20)));
        hand.to(hand.report.probe);
        ASSERT_LE(glm::length(hand.report.force - last), kSlew_n * (1.0 + 1e-12)) << i;
        last = hand.report.force;
    }
}

TEST(Adopt, OfTwoBeforeAFrameTheSecondCounts) {
    Hand hand(ball("ball", 20));
    hand.press(0.002);
    hand.loop.adopt(scene_of(ball("ball", 25)));
    hand.loop.adopt(scene_of(ball("ball", 20) + ball("far", 1)));
    EXPECT_EQ(hand.loop.effect_count(), 2u);
    hand.to(hand.report.probe);
    EXPECT_FALSE(hand.report.flags & kInsideAtStart);
    EXPECT_NEAR(hand.report.force.z, kStiffness * 0.002, kForceError);
}

TEST(Adopt, GainsAndPosesAreAboutTheNewSceneAtOnce) {
    Hand hand(ball("ball", 20));
    hand.press(0.002);
    EXPECT_FALSE(hand.loop.set_gain(1, 0.5));
    EXPECT_FALSE(hand.loop.set_pose(1, {}));
    hand.loop.adopt(scene_of(ball("ball", 20) + ball("other", 10, "moves = true")));
    EXPECT_TRUE(hand.loop.set_gain(1, 0.5));
    EXPECT_TRUE(hand.loop.set_pose(1, {{0.5, 0, 0}, {1, 0, 0, 0}}));
    hand.to(hand.report.probe);
    EXPECT_FALSE(hand.report.flags & kInsideAtStart); // it is elsewhere
    EXPECT_EQ(hand.loop.pose(1).position, Vec3(0.5, 0, 0));
}

TEST(Adopt, APoseGoesOnWithItsSurface) {
    Hand hand(ball("ball", 20, "moves = true"));
    hand.loop.set_pose(0, {{0.1, 0, 0}, {1, 0, 0, 0}});
    hand.to({0.1, 0, 0.021});
    hand.to({0.1, 0, 0.018});
    hand.loop.adopt(scene_of(ball("ball", 20, "moves = true\nstrength_n = 50")));
    hand.to({0.1, 0, 0.018});
    EXPECT_NEAR(hand.report.force.z, kStiffness * 0.002, kForceError);
    EXPECT_EQ(hand.loop.pose(0).position, Vec3(0.1, 0, 0));
}

/// Pushes, and counts how often it was restarted.
class Pusher final : public Effect {
public:
    explicit Pusher(int& restarts) : restarts_(restarts) {}
    void restart(const Vec3&) noexcept override { ++restarts_; }
    void begin(const FrameContext&) noexcept override {}
    void gather(const Vec3&, PrimitiveSet& primitives) noexcept override {
        primitives.add_force({0.1, 0, 0});
    }
    QueryCount queries() const noexcept override { return {}; }

private:
    int& restarts_;
};

TEST(Adopt, CustomEffectsGoOnWithTheirGains) {
    int restarts = 0;
    std::vector<std::unique_ptr<Effect>> custom;
    custom.push_back(std::make_unique<Pusher>(restarts));
    Hand hand(ball("ball", 20), std::move(custom));
    hand.to({0, 0, 0.05});
    hand.loop.set_gain(1, 0.5);
    for (int i = 0; i < 60; ++i)
        hand.to({0, 0, 0.05});
    EXPECT_NEAR(hand.report.force.x, 0.05, 1e-9);
    hand.loop.adopt(scene_of(ball("ball", 20) + ball("other", 1)));
    hand.to({0, 0, 0.05});
    EXPECT_NEAR(hand.report.force.x, 0.05, 1e-9);
    EXPECT_EQ(restarts, 1);
    EXPECT_TRUE(hand.loop.set_gain(2, 1.0)); // after the scene's two
}

TEST(Adopt, OtherLimitsOrCouplingAreRefusedByName) {
    Hand hand(ball("ball", 20));
    hand.press(0.002);
    const auto message = [&](const std::string& more) -> std::string {
        try {
            hand.loop.adopt(scene_of(ball("ball", 20) + more));
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "accepted";
    };
    EXPECT_EQ(message("[limits]\nforce_n = 3\n"),
              "adopt: limits.force_n is 3 in the scene and 5 in the loop; give the scene the "
              "loop's, or make another loop");
    EXPECT_NE(message("[limits]\nslew_n_per_s = 100\n").find("limits.slew_n_per_s"),
              std::string::npos);
    EXPECT_NE(message("[coupling]\nstiffness_n_per_m = 300\n").find("coupling.stiffness"),
              std::string::npos);
    EXPECT_THROW(hand.loop.adopt(nullptr), std::invalid_argument);
    hand.to(hand.report.probe);
    EXPECT_EQ(hand.report.flags, 0u); // nothing has changed
}

TEST(Adopt, BeforeTheFirstFrameATrialBeginsAsEver) {
    Hand hand(ball("ball", 20));
    hand.loop.adopt(scene_of(ball("ball", 25)));
    hand.to({0, 0, 0.026});
    hand.to({0, 0, 0.024});
    EXPECT_NEAR(hand.report.force.z, 0.5, kForceError);
}

TEST(Adopt, WhileFramesRunInAnotherThread) {
    Hand hand(ball("ball", 20, "moves = true"));
    std::atomic<bool> stop = false;
    std::atomic<long> frames = 0;
    std::thread servo([&] {
        Vec3 last{0.0};
        hand.to({0, 0, 0.025});
        while (!stop) {
            hand.to({0, 0, 0.015});
            EXPECT_LE(glm::length(hand.report.force - last), kSlew_n * (1.0 + 1e-12));
            last = hand.report.force;
            ++frames;
        }
    });
    for (int i = 0; i < 40; ++i) {
        hand.loop.adopt(scene_of(ball("ball", i % 3 == 0 ? 19 : 20, "moves = true")));
        for (int k = 0; k < 10; ++k) {
            hand.loop.set_gain(0, 0.1 * k);
            hand.loop.set_pose(0, {{1e-4 * k, 0, 0}, {1, 0, 0, 0}});
        }
    }
    const long so_far = frames;
    while (frames < so_far + 10)
        std::this_thread::yield();
    stop = true;
    servo.join();
    // What was set last for the last scene holds.
    for (int i = 0; i < 60; ++i)
        hand.to({0, 0, 0.025});
    EXPECT_EQ(hand.loop.pose(0).position, Vec3(1e-4 * 9, 0, 0));
    hand.to({0, 0, 0.017});
    for (int i = 0; i < 5; ++i)
        hand.to({9e-4, 0, 0.017});
    // At gain 0.9 and 5 N at most, what is hard holds 45 N: all of 2 mm into the last ball, of 19.
    EXPECT_NEAR(hand.report.force.z, kStiffness * 0.002, kForceError);
}

} // namespace
} // namespace palpate
