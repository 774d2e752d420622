// SPDX-License-Identifier: Apache-2.0
// The checks of `palpate validate driver` on the drivers of HID devices, over the real libhidapi,
// against the devices' firmware. In this process, as there are simulated nodes in no other.
#include <functional>
#include <string_view>

#include <gtest/gtest.h>

#include <palpate/drivers/pid_device.h>
#include <palpate/drivers/space_mouse.h>
#include <palpate/engine/command/driver_trial.h>

#include "tests/drivers/hid_node.h"
#include "tests/drivers/wooden_rig.h"
#include "tests/support/pid_firmware.h"
#include "tests/support/space_mouse_firmware.h"

namespace palpate {
namespace {

using command::DriverCheck;
using command::DriverTrial;
using command::Outcome;
using command::Verdict;

/// How many of the checks passed; that none failed.
int passed(const std::function<std::unique_ptr<HapticDevice>()>& make) {
    int count = 0;
    for (const auto& checks :
         {command::library_checks(), command::life_checks(), command::state_checks(),
          command::call_checks(), command::force_checks(), command::end_checks()})
        for (const DriverCheck& check : checks) {
            // These leave a device open, or no file to be seen, to the end of their process.
            const std::string_view name = check.name;
            if (name.starts_with("open")) continue;
            Verdict verdict = command::fail("");
            for (int i = 0; i < 3 && verdict.outcome == Outcome::fail;
                 ++i) { // where it stood still
                DriverTrial trial(make, {.may_push = true, .frames = 2000});
                verdict = verdict_of(check, trial);
                trial.close();
            }
            EXPECT_NE(verdict.outcome, Outcome::fail) << name << ": " << verdict.text;
            count += verdict.outcome == Outcome::pass ? 1 : 0;
        }
    return count;
}

TEST(DriverChecks, OfABoardOfTheWoodenHapticsFamilyPass) {
    test::WoodenFirmware board(14);
    test::HidNode node(test::kPath, board);
    const auto make = [] {
        return std::make_unique<WoodenDevice>(wooden_model("woodenhaptics_v2015"), test::patient());
    };
    EXPECT_GE(passed(make), 33);
    EXPECT_EQ(node.at_rest([&] { return board.milliamps; }), (std::array{0, 0, 0}));
}

TEST(DriverChecks, OfASpaceMousePass) {
    test::SpaceMouseFirmware mouse(test::SpaceMouseFirmware::Kind::wired);
    mouse.axes = {30, 0, 0, 0, 0, 0};
    const std::string path = test::node_path("mouse");
    const test::HidNode node(path, mouse);
    EXPECT_GE(passed([&] {
                  SpaceMouseSettings settings;
                  settings.path = path;
                  settings.silence_s = 2.0;
                  return std::make_unique<SpaceMouseDevice>(settings);
              }),
              33);
}

TEST(DriverChecks, OfAStickWithForceFeedbackPass) {
    test::PidFirmware stick(test::kAdapterLayout);
    const std::string path = test::node_path("stick");
    test::HidNode node(path, stick);
    EXPECT_GE(passed([&] {
                  PidSettings settings;
                  settings.path = path;
                  settings.stale_after_s = settings.force_hold_s = 2.0;
                  return std::make_unique<PidDevice>(settings);
              }),
              33);
    EXPECT_FALSE(node.at_rest([&] { return stick.actuators; }));
}

} // namespace
} // namespace palpate
