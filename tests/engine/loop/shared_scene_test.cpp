// SPDX-License-Identifier: Apache-2.0
// One scene, several threads: ThreadSanitizer watches these tests, too.
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/support/scripted_clock.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

constexpr double kLimit_n = 4.0;
constexpr int kFrames = 4000;

/// A ball that moves, guarded by its mesh and with all that a surface may have, beside one that
/// stays; and effects with a state.
std::shared_ptr<const Scene> balls(double radius_mm) {
    const std::string radius = std::to_string(radius_mm);
    SceneDescription scene =
        parse_scene("[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = " + radius +
                        "\n[surface.moves]\nvolume = \"v\"\nmoves = true\nstrength_n = 3\n"
                        "[surface.stays]\nvolume = \"v\"\ncontact = \"volume\"\n"
                        "[[effect]]\ntype = \"surface\"\nsurface = \"moves\"\n"
                        "[[effect]]\ntype = \"surface\"\nsurface = \"stays\"\n"
                        "[[effect]]\ntype = \"friction\"\nsurface = \"stays\"\nstatic = 0.4\n"
                        "[[effect]]\ntype = \"viscosity\"\ndamping_n_s_per_m = 1\n"
                        "[limits]\nforce_n = " +
                        std::to_string(kLimit_n) + "\n",
                    "balls.toml");
    scene.surfaces.at("moves").contact = ContactKind::guarded;
    scene.surfaces.at("moves").triangle_mesh =
        std::make_shared<const TriangleMesh>(test::icosphere(1e-3 * radius_mm, 3));
    return std::make_shared<const Scene>(scene);
}

/// A hand of its own in a scene that it shares: round in the ball, in and out of it.
struct Hand {
    explicit Hand(std::shared_ptr<const Scene> scene) : loop(std::move(scene), clock) {}

    void feel(int frame) {
        const double t = 1e-3 * frame;
        DeviceState state;
        state.position = (0.02 + 0.004 * std::sin(20.0 * t)) * Vec3{std::cos(t), std::sin(t), 0.0};
        const FrameReport report = loop.frame(state);
        const double force_n = glm::length(report.force);
        if (!(force_n <= kLimit_n * (1.0 + 1e-9))) ++beyond_the_limit;
        if (report.flags & kSceneAdopted) ++adopted;
        felt |= report.surfaces_felt != 0;
    }

    test::ScriptedClock clock;
    HapticLoop loop;
    int beyond_the_limit = 0, adopted = 0;
    bool felt = false;
};

TEST(SharedScene, TwoHandsFeelItWhileGainsPosesAndScenesChange) {
    const auto scene = balls(20.0);
    std::array<Hand, 2> hands{Hand(scene), Hand(scene)};
    std::atomic<bool> done{false};
    const auto until_done = [&](const auto& act) {
        return std::thread([&, act] {
            for (int i = 0; !done; ++i)
                for (Hand& hand : hands)
                    act(hand.loop, i);
        });
    };
    std::vector<std::thread> others;
    for (int i = 0; i < 2; ++i)
        others.push_back(until_done([](HapticLoop& loop, int n) {
            loop.set_gain(static_cast<std::size_t>(n % 3), 0.25 * (n % 5));
            std::this_thread::yield();
        }));
    others.push_back(until_done([](HapticLoop& loop, int n) {
        loop.set_pose(0, {.position = {1e-5 * (n % 7), 0.0, 0.0}});
        std::this_thread::yield();
    }));
    others.push_back(
        until_done([](HapticLoop& loop, int n) { loop.adopt(balls(20.0 - 1e-3 * (n % 100))); }));
    std::vector<std::thread> feeling;
    for (Hand& hand : hands)
        feeling.emplace_back([&hand] {
            for (int frame = 0; frame < kFrames || hand.adopted < 2; ++frame)
                hand.feel(frame);
        });
    for (std::thread& thread : feeling)
        thread.join();
    done = true;
    for (std::thread& thread : others)
        thread.join();
    for (const Hand& hand : hands) {
        EXPECT_EQ(hand.beyond_the_limit, 0);
        EXPECT_TRUE(hand.felt);
    }
}

} // namespace
} // namespace palpate
