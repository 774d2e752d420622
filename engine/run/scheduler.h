// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace palpate {

/// Who decides when a loop's thread runs.
enum class Scheduler : std::uint8_t {
    ordinary, ///< SCHED_OTHER: shares the processor with everybody
    fifo,     ///< SCHED_FIFO: before every ordinary thread, after the kernel's own
};

/// Below 50, at which the kernel's own threads serve interrupts: a loop that kept the processor
/// from them would wait for its own device.
inline constexpr int kLoopPriority = 49; // of SCHED_FIFO, 1 to 99

/// Puts the calling thread under a scheduler; false when the system does not permit it.
/// [setup]
bool enter(Scheduler scheduler) noexcept;

} // namespace palpate
