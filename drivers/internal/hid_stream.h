// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>

#include <palpate/drivers/internal/hid_port.h>

namespace palpate::internal {

/// Seconds on the clock of all HID devices' times, from an arbitrary start. No system call. [loop]
double hid_time_s() noexcept;

/// What one kind of device says and wants to hear. HidStream calls it: [reader] and [writer] are
/// its two threads, which may call at the same time; the others are called while neither does.
class HidProtocol {
public:
    virtual ~HidProtocol() = default;

    /// Which node to open. Throws std::runtime_error where there is none, or one of another kind.
    virtual std::string find() = 0;
    /// A force of before, however young, was not meant for what is felt from now on: before
    /// connected(), and as the stream starts.
    virtual void forget_force() noexcept {}
    /// The port is new, at first or after an unplug: finds out what it is and prepares it. Throws
    /// std::runtime_error where it is not what it should be.
    virtual void connected(HidPort& port) = 0;
    /// Takes the force from the device, the last thing that it is sent. The port may be dead.
    virtual void release(HidPort& port) noexcept = 0;

    /// The next report, oldest first; it came at about `time_s`.                       [reader]
    virtual void received(std::span<const std::uint8_t> report, double time_s) noexcept = 0;
    /// No report waits any more: the last one is of now, and the servo may have it.     [reader]
    virtual void caught_up() noexcept = 0;
    /// Puts the next report to send, number first, at most kLongestHidReport bytes; returns its
    /// length, 0: there is none to send.
    /// Called once after each batch of reports, and where none come every `write_period`.
    ///                                                                                 [writer]
    virtual std::size_t compose(std::span<std::uint8_t> report) noexcept = 0;
};

/// Where a HidStream stands; any thread may look.
struct HidStreamCounts {
    std::atomic<std::uint32_t> connections{0};   ///< ports opened
    std::atomic<std::uint32_t> losses{0};        ///< unplugged, or took no report any more
    std::atomic<std::uint32_t> overruns{0};      ///< queues that had filled up and were thrown away
    std::atomic<std::uint32_t> failed_writes{0}; ///< reports not taken, or not whole
};

/// Keeps a HID device's reports flowing on two threads of its own, so that nobody else waits for
/// it: one reads, one writes. A device that is lost is looked for until it is back.
///
/// The kernel queues 63 reports for a slow reader and then drops the *new* ones, so the queue is
/// emptied at each turn; one that had filled up, or that was not looked at for too long, is old to
/// its end, and the next report is waited for. A device that takes no report holds only the writer.
class HidStream {
public:
    struct Settings {
        std::chrono::milliseconds write_period{10}; ///< > 0, of writing where no report comes
        std::chrono::milliseconds retry{1000};      ///< > 0, between two looks for a lost device
        /// How old a report may be, s, more than 0.01; for devices that never fall silent. A report
        /// is as old as the time since its queue was last seen empty, at most.
        double trusted_s = std::numeric_limits<double>::infinity();
    };

    /// `protocol` must outlive the stream.                                              [setup]
    HidStream(HidProtocol& protocol, Settings settings);
    /// Closes.                                                                          [setup]
    ~HidStream();
    HidStream(const HidStream&) = delete;
    HidStream& operator=(const HidStream&) = delete;

    /// Finds, opens and prepares the device. Throws what the protocol and HidPort do.    [setup]
    void open();
    /// Starts the threads, scheduled as the caller is; the stream must be open.         [setup]
    void start();
    /// Ends the threads and takes the force from the device. Waits for a report that the device
    /// is being sent (on USB up to 5 s). More than once does no harm.                    [setup]
    void stop() noexcept;
    /// Stops, and gives the device back.                                                [setup]
    void close() noexcept;

    /// Since when the device has not taken what it was sent, hid_time_s(): it keeps the writer
    /// waiting, refuses, or is gone. Infinity: it has taken all.                        [loop]
    double untaken_since_s() const noexcept { return untaken_since_s_.load(); }

    /// Whether the device is open, and not lost.                                         [any]
    bool is_connected() const noexcept { return is_connected_.load(); }

    const HidStreamCounts& counts() const noexcept { return counts_; }

    /// For connected(): the device was let go as it took no reports, and its node did not go away.
    /// What it counts, it has counted on.
    bool was_let_go() const noexcept { return was_let_go_; }

private:
    void read_reports() noexcept;
    void read_batch() noexcept;
    void write_reports() noexcept;
    void connect();
    void try_again() noexcept;
    std::unique_ptr<HidPort> lose() noexcept;
    void let_write() noexcept;
    bool sleep_until_stopped(std::chrono::milliseconds time);

    HidProtocol& protocol_;
    const Settings settings_;
    HidStreamCounts counts_;
    std::atomic<double> untaken_since_s_;
    std::atomic<bool> refuses_reports_{false};
    std::atomic<bool> is_connected_{false};
    double seen_empty_s_;             ///< the reader's: when no report waited
    bool was_let_go_ = false;         ///< the reader's, see was_let_go()
    std::unique_ptr<HidPort> let_go_; ///< the reader's: still open, so that it tells of an unplug

    /// The writer's while it writes, the reader's while it exchanges the port.
    std::mutex port_mutex_;
    std::unique_ptr<HidPort> port_;

    std::mutex mutex_; ///< of the next two
    bool stopping_ = false;
    bool report_came_ = false;
    std::condition_variable wake_;
    std::thread reader_;
    std::thread writer_;
};

} // namespace palpate::internal
