// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <mutex>
#include <string>
#include <thread>

#include <tests/support/hid_firmware.h>

namespace palpate::test {

/// What runs firmware on a thread of its own and connects it with the kernel, which then has a HID
/// device with its reports: a cable that can be pulled. Needs root.
class FirmwareCable {
public:
    /// A turn every so often: as often as a full-speed bus asks for reports.
    static constexpr std::chrono::milliseconds kTurn{1};

    FirmwareCable(HidFirmware& firmware, std::uint16_t vendor, std::uint16_t product)
        : firmware_(firmware), vendor_(vendor), product_(product) {}
    virtual ~FirmwareCable() = default;
    FirmwareCable(const FirmwareCable&) = delete;
    FirmwareCable& operator=(const FirmwareCable&) = delete;

    /// Connects it; it starts anew. Throws std::runtime_error with what the kernel refuses.
    void plug_in();
    /// Pulls the cable: nothing is said or heard any more.
    void pull_out();

    /// Looks at the firmware, or changes it, while it does nothing.
    template <typename Look>
    auto look(Look at) {
        const std::lock_guard alone(mutex_);
        return at();
    }

protected:
    virtual void connect() = 0;
    virtual void disconnect() = 0;
    /// Takes in what the host has sent, waiting at most for a turn.
    virtual void hear() = 0;
    /// Says a report to the host.
    virtual void say(const Bytes& report) = 0;

    static double now_s();
    /// With the firmware locked.
    void received(std::span<const std::uint8_t> report);

    HidFirmware& firmware_;
    const std::uint16_t vendor_;
    const std::uint16_t product_;

private:
    void run();

    std::mutex mutex_;
    std::atomic<bool> pulled_{true};
    std::thread thread_;
};

/// A HID device without a bus: /dev/uhid. Has feature reports.
class UhidCable final : public FirmwareCable {
public:
    using FirmwareCable::FirmwareCable;
    ~UhidCable() override { pull_out(); }

private:
    void connect() override;
    void disconnect() override;
    void hear() override;
    void say(const Bytes& report) override;

    int file_ = -1;
};

/// A device on a USB whose two ends are this computer (dummy_hcd): the kernel's real USB HID
/// driver, interrupt transfers and all. No feature reports.
class GadgetCable final : public FirmwareCable {
public:
    using FirmwareCable::FirmwareCable;
    ~GadgetCable() override { pull_out(); }

private:
    void connect() override;
    void disconnect() override;
    void hear() override;
    void say(const Bytes& report) override;

    int file_ = -1;
};

} // namespace palpate::test
