// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <palpate/drivers/haptic_device.h>
#include <palpate/drivers/wooden_model.h>

namespace palpate {

/// Where the handle is when the device is opened, or plugged in again.
enum class WoodenStart : std::uint8_t {
    at_home, ///< in the model's home pose: the counters are set to it
    as_kept  ///< anywhere; a device that zeroes itself has been calibrated since it got power
};

/// A WoodenHaptics, AluHaptics, Vintage or Polhem device on USB HID (docs/devices.md): position and
/// force, on some builds orientation and a button. Device frame: x towards the user, y right, z up.
///
/// Two threads of its own, with the scheduling of the thread that calls start(), talk to the board;
/// read() and write() only exchange numbers with them. A state is stale when the board has not said
/// anything, or has not taken a force, for `stale_after_s`. An unplugged device is looked for; when
/// it is back its states are fresh again, of a new trial, after it has been zeroed as at open().
/// Motors are without current unless state and force are recent; also after stop(), close() and
/// destruction.
class WoodenDevice final : public HapticDevice {
public:
    /// Which node, and how long a silence may last.
    struct Settings {
        std::string path; ///< of the node, "/dev/hidraw0"; empty: the first device of the family
        WoodenStart start = WoodenStart::at_home; ///< where the handle is at the start
        double stale_after_s = 0.005;             ///< > 0, silence after which a state is stale
        double force_hold_s = 0.02; ///< > 0, how long the last force is held; then it is zero
        double reconnect_s = 1.0;   ///< > 0, between two looks for a device that is gone
    };

    /// What has happened since construction; any thread may ask.
    struct Counts {
        std::uint32_t connections = 0;      ///< times that the device was opened
        std::uint32_t losses = 0;           ///< times that it was gone, or did not listen
        std::uint32_t overruns = 0;         ///< queues of reports thrown away, as they were too old
        std::uint32_t failed_writes = 0;    ///< reports that the device did not take
        std::uint32_t rejected_reports = 0; ///< of another length, or of no possible pose
        std::uint32_t zeroings = 0;         ///< times that the counters were set to the home pose
    };

    /// Throws std::invalid_argument where model or settings are not as they say.        [setup]
    WoodenDevice(const WoodenModel& model, Settings settings);
    ~WoodenDevice() override;

    DeviceProperties properties() const override;
    void open() override;
    void start() override;
    void stop() noexcept override;
    void close() noexcept override;
    bool read(DeviceState& state) noexcept override;
    void write(const Vec3& force) noexcept override;

    Counts counts() const noexcept; ///< [any]

private:
    class Board;
    std::unique_ptr<Board> board_;
};

} // namespace palpate
