// SPDX-License-Identifier: Apache-2.0
// No system call below frame(): a child under strict seccomp may only read, write and end; anything else kills it.
#include <cmath>

#include <gtest/gtest.h>

#include <palpate/engine/haptic_loop.h>

#include "tests/support/phantom.h"

#if defined(__linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

namespace palpate {
namespace {

constexpr int kUnavailable = 77;

/// Exit status of a child that runs frames (and, if asked, one forbidden call) under seccomp; -1 when it was killed.
int status_under_seccomp(const std::shared_ptr<const Scene>& scene, bool forbidden_call) {
    SteadyClock clock;
    HapticLoop loop(scene, clock);
    const auto frames = [&](int from, int to) {
        DeviceState state;
        for (int i = from; i < to; ++i) {
            state.position = (0.028 + 0.006 * std::sin(0.01 * i)) * Vec3{std::cos(0.004 * i), std::sin(0.004 * i), 0};
            loop.frame(state);
        }
    };
    const pid_t child = fork();
    if (child == 0) {
        frames(0, 100);
        if (prctl(PR_SET_SECCOMP, SECCOMP_MODE_STRICT) != 0) _exit(kUnavailable);
        frames(100, 2000);
        if (forbidden_call) getppid();
        syscall(SYS_exit, 0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(SystemCalls, FramesMakeNone) {
    const int status = status_under_seccomp(test::phantom_scene("volume", "adaptive"), false);
    if (status == kUnavailable) GTEST_SKIP() << "this kernel has no strict seccomp";
    EXPECT_EQ(status, 0);
}

TEST(SystemCalls, AForbiddenOneIsCaught) {
    const int status = status_under_seccomp(test::phantom_scene("volume", "adaptive"), true);
    if (status == kUnavailable) GTEST_SKIP() << "this kernel has no strict seccomp";
    EXPECT_EQ(status, -1);
}

}  // namespace
}  // namespace palpate
#endif
