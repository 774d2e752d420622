// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <palpate/drivers/haptic_device.h>

#include "tests/support/system_call_filter.h"

#ifdef PALPATE_HAS_SYSTEM_CALL_FILTER
#include <sys/wait.h>
#include <unistd.h>

namespace palpate::test {

/// Reads and writes a started device in a child that may do nothing else.
inline void expect_no_system_calls(HapticDevice& device) {
    constexpr int unavailable = 77;
    const pid_t child = fork();
    if (child == 0) {
        DeviceState state;
        // On some machines reading the time is a system call.
        if (!forbid_system_calls(SYS_clock_gettime)) _exit(unavailable);
        for (int i = 0; i < 1000; ++i) {
            device.read(state);
            device.write(state.position);
        }
        _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFEXITED(status)) << "it was killed";
    if (WEXITSTATUS(status) == unavailable) GTEST_SKIP() << "this kernel has no such filter";
}

} // namespace palpate::test
#endif
