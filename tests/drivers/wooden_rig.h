// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <gtest/gtest.h>

#include <palpate/drivers/wooden_device.h>
#include <palpate/engine/devices/wooden_models.h>

#include "tests/drivers/hid_node.h"
#include "tests/support/patience.h"
#include "tests/support/wooden_firmware.h"

namespace palpate::test {

inline const std::string kPath = test::node_path("wooden");
/// Of v2015: body B upright, C level.
inline const Vec3 kHome(0.025, 0.0, 0.205);

/// A machine that runs tests may keep a thread waiting for long: nothing is stale before that,
/// where a test is not about it.
inline WoodenDevice::Settings patient() {
    WoodenDevice::Settings settings;
    settings.path = kPath;
    settings.stale_after_s = 2.0;
    settings.force_hold_s = 2.0;
    settings.reconnect_s = 0.02;
    return settings;
}

/// Settings that notice silence, though not a thread that waits for its turn.
inline WoodenDevice::Settings watchful() {
    WoodenDevice::Settings settings = patient();
    settings.stale_after_s = 0.1;
    settings.force_hold_s = 0.1;
    return settings;
}

inline DeviceState state_of(WoodenDevice& device) {
    DeviceState state;
    EXPECT_TRUE(device.read(state));
    return state;
}

inline bool is_fresh(WoodenDevice& device) {
    return state_of(device).freshness == Freshness::fresh;
}

/// A board with a driver.
struct Rig {
    WoodenFirmware board;
    HidNode node{kPath, board};
    WoodenDevice device;

    explicit Rig(std::size_t report_size, WoodenDevice::Settings settings = patient(),
                 const std::string& model = "woodenhaptics_v2015")
        : board(report_size), device(wooden_model(model), std::move(settings)) {}

    /// A test that fails must not leave the driver waiting for the board.
    ~Rig() { node.set_write_fault(WriteFault::none); }

    template <typename F>
    auto board_says(F f) {
        return node.at_rest(f);
    }

    /// Writes the force as a servo does until the board says what is wanted.
    template <typename F>
    bool push_until(const Vec3& force, F condition) {
        return test::comes_true([&] {
            device.write(force);
            return node.at_rest(condition);
        });
    }
};

} // namespace palpate::test
