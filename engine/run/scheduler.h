// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace palpate {

/// Who decides when a loop's thread runs.
enum class Scheduler : std::uint8_t {
    ordinary, ///< SCHED_OTHER: shares the processor with everybody
    fifo,     ///< SCHED_FIFO: before every ordinary thread, after the kernel's own
};

} // namespace palpate
