// SPDX-License-Identifier: Apache-2.0
// No system call below frame(): a child under a seccomp filter may only end; anything else kills
// it.
#include <cmath>

#include <gtest/gtest.h>

#include <palpate/engine/loop/haptic_loop.h>

#include "tests/support/mesh_fuzz.h"
#include "tests/support/odd_meshes.h"
#include "tests/support/phantom.h"
#include "tests/support/scripted_clock.h"
#include "tests/support/system_call_filter.h"

#ifdef PALPATE_HAS_SYSTEM_CALL_FILTER
#include <sys/wait.h>
#include <unistd.h>

namespace palpate {
namespace {

enum class Outcome { finished, killed, unavailable };
constexpr int kUnavailable = 77;

/// What becomes of a child that moves a probe (and, if asked, makes one forbidden call) with system
/// calls forbidden.
template <class Move>
Outcome without_system_calls(const Move& move, bool forbidden_call) {
    const auto frames = [&](int from, int to) {
        for (int i = from; i < to; ++i)
            move((0.028 + 0.006 * std::sin(0.01 * i)) *
                 Vec3{std::cos(0.004 * i), std::sin(0.004 * i), 0});
    };
    const pid_t child = fork();
    if (child == 0) {
        frames(0, 100);
        if (!test::forbid_system_calls()) _exit(kUnavailable);
        frames(100, 2000);
        if (forbidden_call) getppid();
        _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    if (!WIFEXITED(status)) return Outcome::killed;
    return WEXITSTATUS(status) == kUnavailable ? Outcome::unavailable : Outcome::finished;
}

Outcome scene_without_system_calls(const std::shared_ptr<const Scene>& scene, bool forbidden_call) {
    test::ScriptedClock clock(1.0); // on some machines reading the time is a system call of its own
    HapticLoop loop(scene, clock);
    const auto move = [&](const Vec3& probe) {
        DeviceState state;
        state.position = probe;
        loop.frame(state);
    };
    return without_system_calls(move, forbidden_call);
}

TEST(SystemCalls, FramesMakeNone) {
    const Outcome outcome =
        scene_without_system_calls(test::phantom_scene("volume", "adaptive"), false);
    if (outcome == Outcome::unavailable) GTEST_SKIP() << "this kernel has no seccomp filter";
    EXPECT_EQ(outcome, Outcome::finished);
}

TEST(SystemCalls, FramesOfContactMeshMakeNone) {
    TriangleMesh mesh = test::spiky_ball(0.028, 3, 0.1, 5);
    test::append(mesh, test::icosphere(0.02, 3, {0.02, 0, 0})); // not all facets are certified
    test::ContactLoop loop({}, test::one_mesh(test::certified(std::move(mesh))));
    loop.start({0.05, 0, 0});
    const Outcome outcome =
        without_system_calls([&](const Vec3& probe) { loop.move(probe); }, false);
    if (outcome == Outcome::unavailable) GTEST_SKIP() << "this kernel has no seccomp filter";
    EXPECT_EQ(outcome, Outcome::finished);
}

TEST(SystemCalls, AForbiddenOneIsCaught) {
    const Outcome outcome =
        scene_without_system_calls(test::phantom_scene("volume", "adaptive"), true);
    if (outcome == Outcome::unavailable) GTEST_SKIP() << "this kernel has no seccomp filter";
    EXPECT_EQ(outcome, Outcome::killed);
}

} // namespace
} // namespace palpate
#endif
