// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <system_error>

#include <linux/perf_event.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace palpate::internal {

/// Instructions that this thread retires outside of the kernel, by perf_event_open(2). Many virtual
/// machines have no such counter, and some kernels do not permit it: then there is no count. Not
/// for two threads at once.                                                              [setup]
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
        if (file_ < 0) error_ = errno;
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
        if (file_ < 0 || ::read(file_, &count, sizeof count) != sizeof count) return std::nullopt;
        return count;
    }

    /// Why there is no count, without a comma; empty where there is one.
    std::string why_not() const {
        if (file_ >= 0) return {};
        if (error_ == ENOENT || error_ == EOPNOTSUPP)
            return "this machine counts no instructions (perf_event_open: no such event)";
        if (error_ == EACCES || error_ == EPERM)
            return "the kernel does not permit counting instructions (perf_event_open: see "
                   "kernel.perf_event_paranoid)";
        return std::string("instructions are not counted (perf_event_open: ") +
               std::generic_category().message(error_) + ")";
    }

private:
    int file_ = -1;
    int error_ = 0;
};

} // namespace palpate::internal
