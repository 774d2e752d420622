// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <palpate/drivers/haptic_device.h>
#include <palpate/drivers/inverse3_service.h>

namespace palpate {

/// A Haply Inverse3, Inverse3x or Minverse through Haply's Inverse Service (docs/devices.md): 3
/// degrees of freedom with force; turn and buttons of a VerseGrip. Device frame: x towards the
/// user, y right, z up, from the device's base.
///
/// A thread of its own, with the scheduling of the thread that calls start(), talks to the service:
/// a force, then the state that answers it. read() and write() only exchange numbers with it. A
/// state is stale when it was asked for more than `stale_after_s` ago, and then the force that is
/// sent is zero. A service that says nothing of use for `lost_after_s`, floods or closes is left,
/// and looked for until it is back; then a new trial begins. stop(), close() and destruction send a
/// zero force; they wait for it at most 0.1 s. States tell the time since the first start().
class Inverse3Device final : public HapticDevice {
public:
    /// Which device, and how long a silence may last.
    struct Settings {
        Inverse3Address address;     ///< whose device, which one, and its longest force
        double rate_hz = 1000.0;     ///< exchanges with the service, [50, 4000]
        double stale_after_s = 0.01; ///< > 0, from asking for a state until it is stale
        double force_hold_s = 0.02;  ///< > 0, how long the last force is held; then it is zero
        double lost_after_s = 0.5;   ///< > stale_after_s, silence while we run; then it is left
        double reconnect_s = 1.0;    ///< > 0, between two looks for it
        double patience_s = 1.0;     ///< > 0, for a connection, and again for its first message
    };

    /// What has happened since construction; any thread may ask.
    struct Counts {
        std::uint64_t states = 0;       ///< used
        std::uint64_t late = 0;         ///< answers after `stale_after_s`, thrown away
        std::uint64_t unasked = 0;      ///< messages that answer nothing, thrown away
        std::uint64_t unreadable = 0;   ///< binary, no JSON, or no states in it
        std::uint64_t not_there = 0;    ///< answers without the device, or with two of its id
        std::uint64_t out_of_range = 0; ///< answers with numbers that cannot be
        std::uint64_t uncalibrated = 0; ///< answers of a device that is not calibrated
        std::uint64_t silences = 0;     ///< times that no answer came within `stale_after_s`
        std::uint64_t connections = 0;  ///< times that the service was found, the first one too
        std::uint64_t losses = 0;       ///< times that it was left
    };

    /// Throws std::invalid_argument where a setting is not as it says.                  [setup]
    explicit Inverse3Device(Settings settings);
    ~Inverse3Device() override;

    DeviceProperties properties() const override;
    void open() override;
    void start() override;
    void stop() noexcept override;
    void close() noexcept override;
    bool read(DeviceState& state) noexcept override;
    void write(const Vec3& force) noexcept override;

    Counts counts() const noexcept; ///< [any]
    /// What was of no use since construction, in words; empty: nothing was.             [setup]
    std::string complaint() const;

private:
    class Link;
    std::unique_ptr<Link> link_;
};

} // namespace palpate
