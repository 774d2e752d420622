// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstring>
#include <optional>

#include <linux/perf_event.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace palpate::bench {

/// Instructions that this thread retires outside of the kernel, by perf_event_open(2). Many virtual
/// machines have no such counter, and some kernels do not permit it: then there is no count.
class InstructionCounter {
public:
    InstructionCounter() {
        perf_event_attr wanted;
        std::memset(&wanted, 0, sizeof wanted);
        wanted.type = PERF_TYPE_HARDWARE;
        wanted.size = sizeof wanted;
        wanted.config = PERF_COUNT_HW_INSTRUCTIONS;
        wanted.disabled = 1;
        wanted.exclude_kernel = 1;
        wanted.exclude_hv = 1;
        file_ = static_cast<int>(syscall(SYS_perf_event_open, &wanted, 0, -1, -1, 0));
    }
    ~InstructionCounter() {
        if (file_ >= 0) close(file_);
    }
    InstructionCounter(const InstructionCounter&) = delete;
    InstructionCounter& operator=(const InstructionCounter&) = delete;

    void start() const {
        if (file_ >= 0) ioctl(file_, PERF_EVENT_IOC_ENABLE, 0);
    }
    void stop() const {
        if (file_ >= 0) ioctl(file_, PERF_EVENT_IOC_DISABLE, 0);
    }
    /// Between all start() and stop() so far; nothing where the kernel does not count.
    std::optional<std::uint64_t> counted() const {
        std::uint64_t count = 0;
        if (file_ < 0 || read(file_, &count, sizeof count) != sizeof count) return std::nullopt;
        return count;
    }

private:
    int file_ = -1;
};

} // namespace palpate::bench
