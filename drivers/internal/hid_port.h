// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace palpate::internal {

/// What the system knows of an attached HID device, one per top-level collection.
struct HidDeviceInfo {
    std::string path; ///< of its node, /dev/hidraw0
    std::uint16_t vendor = 0;
    std::uint16_t product = 0;
    std::uint16_t usage_page = 0;
    std::uint16_t usage = 0;
    int interface_number = -1; ///< of its USB interface, -1 where it has none
    std::string manufacturer;  ///< UTF-8, as the device says; may be empty
    std::string model;         ///< likewise
    std::string serial;        ///< likewise
};

/// All that are attached now, whether they may be opened or not. Some ms.                [setup]
std::vector<HidDeviceInfo> attached_hid_devices();

/// The report descriptor of the device behind a node: from sysfs, which needs no permission, or
/// else from the node itself; empty where neither gives it.                              [setup]
std::vector<std::uint8_t> hid_report_descriptor(const std::string& path);

/// Longest report that is written, its number included: of a full-speed or high-speed device.
inline constexpr std::size_t kLongestHidReport = 1025;

/// What became of a wait for a report.
enum class HidRead : std::uint8_t {
    report,  ///< there is one
    nothing, ///< there is none yet
    gone     ///< unplugged or failed: the port is of no use any more
};

/// An open HID device: the one place that knows hidapi (its hidraw side).
///
/// A second port to the same path is refused while this one is open, in whatever process: two that
/// send forces would each undo what the other does. One thread may read while another writes (each
/// has a handle of hidapi's to itself, as a handle's error text is exchanged without a lock; the
/// writer's gets all reports, too, and its queue overflows without harm). Feature reports belong to
/// the writing thread. Opened and closed while neither runs.
class HidPort {
public:
    /// Opens the node `path`. Throws std::runtime_error with path, reason and remedy.   [setup]
    explicit HidPort(const std::string& path);
    ~HidPort();
    HidPort(const HidPort&) = delete;
    HidPort& operator=(const HidPort&) = delete;

    /// The oldest report that waits, or the first that comes within `wait` (0: does not wait).
    /// `size` is its length; what does not fit into `buffer` is lost. Numbered reports begin with
    /// their number. Signals do not end the wait. A report of length 0 is `nothing`.
    HidRead read(std::span<std::uint8_t> buffer, std::size_t& size,
                 std::chrono::milliseconds wait) noexcept;

    /// Sends one report, its number first (0 where the device has none). Waits until the device
    /// has taken it: on USB up to 5 s. False when it did not, or not all of it.
    bool write(std::span<const std::uint8_t> report_with_id) noexcept;

    /// Sends a feature report, its number first; waits as write() does. False when that failed.
    bool send_feature(std::span<const std::uint8_t> report_with_id) noexcept;

    /// Asks for the feature report whose number is buffer[0] and puts it there, number first.
    /// Its length; nothing when the device does not answer (it may take 5 s to say so).
    std::optional<std::size_t> get_feature(std::span<std::uint8_t> buffer) noexcept;

    /// Empty where it cannot be had.
    std::vector<std::uint8_t> report_descriptor() const { return hid_report_descriptor(path_); }

    const std::string& path() const noexcept { return path_; }

private:
    struct Lock;   ///< keeps others out
    struct Handle; ///< hidapi's

    std::string path_;
    std::unique_ptr<Lock> lock_;
    std::unique_ptr<Handle> reading_;
    std::unique_ptr<Handle> writing_;
};

} // namespace palpate::internal
