// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/run/run_watch.h>

namespace palpate::internal {

/// Tells who watches of a loop, and of its end before it goes.
class ShownLoop {
public:
    ShownLoop(HapticLoop& loop, const RunWatch& watch) : watch_(watch) {
        if (watch_.loop) watch_.loop(&loop);
    }
    ~ShownLoop() {
        if (watch_.loop) watch_.loop(nullptr);
    }
    ShownLoop(const ShownLoop&) = delete;
    ShownLoop& operator=(const ShownLoop&) = delete;

private:
    const RunWatch& watch_;
};

} // namespace palpate::internal
