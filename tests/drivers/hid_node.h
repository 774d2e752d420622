// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "tests/support/hid_firmware.h"
#include "tests/support/patience.h"

namespace palpate::test {

/// What happens to a report that the host writes.
enum class WriteFault { none, fails, is_cut, blocks };

/// A path for a node that no other process has, as tests run side by side.
std::string node_path(const std::string& name);

/// A device node, /dev/hidrawSIM*, for this process: the real libhidapi-hidraw opens it, and has at
/// the other end of a socket (which keeps reports apart and hangs up as a hidraw node does) a
/// firmware, served by a thread of its own. As with the kernel, every handle gets every report, and
/// a handle's queue of 63 that is full loses the new ones.
///
/// It works in any program into which hid_node.cpp is linked, as that brings functions open, read,
/// write, ioctl and close, which stand before the C library's.
class HidNode {
public:
    static constexpr int kQueue = 63;

    /// Plugged in.
    HidNode(const std::string& path, HidFirmware& firmware);
    /// Unplugged.
    ~HidNode();
    HidNode(const HidNode&) = delete;
    HidNode& operator=(const HidNode&) = delete;

    void plug_in();
    void unplug();
    void set_write_fault(WriteFault fault);

    /// Calls `f()` while the firmware stands still, and returns what it does.
    template <typename F>
    auto at_rest(F f) {
        const std::lock_guard lock(firmware_mutex());
        return f();
    }

    /// comes_true() of `condition()`, looked at while the firmware stands still.
    template <typename F>
    bool wait_until(F condition) {
        return comes_true([&] { return at_rest(condition); });
    }

    struct Cable; ///< shared with what stands before the C library's functions

private:
    std::mutex& firmware_mutex();
    std::shared_ptr<Cable> cable_;
    std::thread service_;
};

} // namespace palpate::test
