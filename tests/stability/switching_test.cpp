// SPDX-License-Identifier: Apache-2.0
// Effects of every kind, switched on and off and to any strength while a hand moves among them.
#include <cmath>

#include <gtest/gtest.h>

#include <palpate/haptics/hand/safety_chain.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/support/mesh_fuzz.h"
#include "tests/support/one_of_each.h"
#include "tests/support/scripted_clock.h"

namespace palpate {
namespace {

// The chain's own roundings: lengths of a few N, 1e-16 each.
constexpr double kRounding_n = 1e-12;

TEST(Switching, AtRandomKeepsTheForceWithinItsLimits) {
    const auto scene = test::one_of_each_scene();
    test::ScriptedClock clock;
    HapticLoop loop(scene, clock, test::fibres());
    ASSERT_EQ(loop.effect_count(), 27u);
    std::mt19937_64 random(20);
    const SafetySettings limits;
    Vec3 before_n{0.0};
    long touched = 0, free = 0, inside = 0;
    for (int frame = 0; frame < test::fuzz_frames(100000); ++frame) {
        test::switch_at_random(loop, frame, random);
        DeviceState state;
        state.position = test::dipping(frame);
        const FrameReport report = loop.frame(state);
        ASSERT_TRUE(is_finite(report.force) && is_finite(report.proxy)) << frame;
        ASSERT_LE(glm::length(report.force), limits.force_n + kRounding_n) << frame;
        ASSERT_LE(glm::length(report.force - before_n),
                  limits.slew_n_per_s * limits.period_s + kRounding_n)
            << frame;
        ASSERT_EQ(report.flags & kForceNotFinite, 0u) << frame;
        before_n = report.force;
        touched += report.surfaces_felt != 0 ? 1 : 0;
        inside += report.surfaces_open != 0 ? 1 : 0;
        free += report.surfaces_felt == 0 ? 1 : 0;
    }
    // It was about something.
    EXPECT_GT(touched, 1000);
    EXPECT_GT(inside, 1000);
    EXPECT_GT(free, 0);
}

/// Of one effect alone, with no limits that would hide a step.
FrameReport held_frame(HapticLoop& loop, const Vec3& probe) {
    DeviceState state;
    state.position = probe;
    return loop.frame(state);
}

// Of a held hand's force, one frame changes no more than the ramp explains: 2 % of the strength;
// of a hard thing's, 4 F times 2 %. F is 5 N, and nothing is pressed harder here.
TEST(Switching, NoForceStepsButByTheRamp) {
    struct Mode {
        std::string effect;
        double step_n;
        std::size_t index = 0;       // of the effect that is switched
        Vec3 start{0.020, 0.0, 0.0}; // m, of the hand
        double left_n = 0.0;         // what is felt without it
    };
    constexpr double kStep = 0.02;
    const auto of = [](const char* type, const char* volume, const char* strength) {
        return "[[effect]]\ntype = \"" + std::string(type) + "\"\nvolume = \"" + volume +
               "\"\nstrength_n = " + strength + "\n";
    };
    const std::string volumes =
        "[volume.stream]\nanalytic = \"helix\"\nradius_mm = 20\npitch_mm = 31\n"
        "[volume.ball]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n";
    // 1.24 mm deep in the head where the hand is held.
    const Vec3 at_head{0.0105, 0.0, 0.0};
    const double head_n = 500.0 * (0.010 - glm::length(at_head + 49.0 * Vec3{-5e-5, 5e-5, -5e-5}));
    const auto surface = [](const char* keys) {
        return "[volume.head]\nanalytic = \"solid_sphere\"\nradius_mm = 10\n[surface.head]\n"
               "volume = \"head\"\niso_value = 0\n" +
               std::string(keys) + "[[effect]]\ntype = \"surface\"\nsurface = \"head\"\n";
    };
    const auto guide = [](const char* points_mm, const char* strength) {
        return "[[effect]]\ntype = \"guide\"\npoints_mm = " + std::string(points_mm) +
               "\ncapture_mm = 5\nstrength_n = " + strength + "\n";
    };
    const auto box = [](const char* strength) {
        return "[[effect]]\ntype = \"workspace\"\nbox_mm = [[19, -40, -40], [40, 40, 40]]\n"
               "strength_n = " +
               std::string(strength) + "\n";
    };
    const std::string limits = "[limits]\nforce_n = 5\nslew_n_per_s = 1e6\n";
    for (const Mode& mode :
         {Mode{of("gradient_force", "ball", "0.5"), 0.5 * kStep},
          {of("gradient_surface", "ball", "0.5"), 0.5 * kStep},
          {of("gradient_surface", "ball", "inf"), 20.0 * kStep},
          {of("vector_force", "stream", "0.5"), 0.5 * kStep},
          {of("vector_follow", "stream", "0.5"), 0.5 * kStep},
          {of("vector_follow", "stream", "inf"), 20.0 * kStep},
          {of("front_shape", "stream", "0.5"), 0.5 * kStep},
          {of("front_shape", "stream", "inf"), 20.0 * kStep},
          {of("vortex", "stream", "0.5"), 0.5 * kStep},
          {of("vortex", "stream", "inf"), 20.0 * kStep},
          {"[[effect]]\ntype = \"constant_force\"\nforce_n = [0.3, 0.4, 0]\n", 0.5 * kStep},
          {surface(""), 20.0 * kStep, 0, at_head},
          {surface("strength_n = 0.5\n"), 0.5 * kStep, 0, at_head},
          {surface("strength_n = 1\nyield = \"opens\"\n"), 1.0 * kStep, 0, at_head},
          {guide("[[20, 0, 0]]", "0.5"), 0.5 * kStep},
          {guide("[[20, 0, 0]]", "inf"), 20.0 * kStep},
          {guide("[[20, -30, 0], [20, 30, 0]]", "0.5"), 0.5 * kStep},
          {guide("[[20, -30, 0], [20, 30, 0]]", "inf"), 20.0 * kStep},
          {guide("[[20, -30, 0], [20, 1, 0], [30, 30, 0]]", "0.5"), 0.5 * kStep},
          {box("0.5"), 0.5 * kStep},
          {box("inf"), 20.0 * kStep},
          // 4 mm in front of the head: pulled with 2 N, by what could hold 100 N.
          {surface("") + "[[effect]]\ntype = \"magnet\"\nsurface = \"head\"\nstrength_n = 100\n"
                         "capture_mm = 10\n",
           20.0 * kStep,
           1,
           {0.016, 0.0, 0.0}},
          // Of a hand that strikes nothing a vibration is silent.
          {surface("") + "[[effect]]\ntype = \"vibration\"\n", 0.0, 1, at_head, head_n}}) {
        test::ScriptedClock clock;
        HapticLoop loop(
            std::make_shared<const Scene>(parse_scene(volumes + mode.effect + limits, "x.toml")),
            clock);
        Vec3 probe{0.0};
        for (int i = 0; i < 50; ++i) { // across streams, fronts and tubes, and into the ball
            probe = mode.start + 1.0 * i * Vec3{-0.05e-3, 0.05e-3, -0.05e-3};
            held_frame(loop, probe);
        }
        for (int i = 0; i < 200; ++i)
            held_frame(loop, probe);
        Vec3 before_n = held_frame(loop, probe).force;
        EXPECT_GT(glm::length(before_n), 0.05) << mode.effect;
        for (const double gain : {0.0, 1.0, 0.3, 1.0, 0.0}) {
            ASSERT_TRUE(loop.set_gain(mode.index, gain));
            for (int i = 0; i < 60; ++i) {
                const Vec3 now_n = held_frame(loop, probe).force;
                // An adaptive frame may leave 0.1 um of the way, at 500 N/m; twice.
                EXPECT_LE(glm::length(now_n - before_n), mode.step_n + 1e-4)
                    << mode.effect << gain << " " << i;
                before_n = now_n;
            }
        }
        EXPECT_NEAR(glm::length(before_n), mode.left_n, 1e-12) << mode.effect;
    }
}

} // namespace
} // namespace palpate
