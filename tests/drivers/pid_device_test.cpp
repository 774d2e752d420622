// SPDX-License-Identifier: Apache-2.0
// The whole driver over the real libhidapi-hidraw, against a stick's firmware (pid_firmware.h), for
// two devices whose reports differ in ids, widths and ways of saying things.
#include <palpate/drivers/pid_device.h>

#include <chrono>
#include <ctime>
#include <limits>
#include <stdexcept>
#include <thread>

#include <gtest/gtest.h>

#include "tests/drivers/hid_node.h"
#include "tests/support/device_calls.h"
#include "tests/support/patience.h"
#include "tests/support/pid_firmware.h"
#include "tests/support/space_mouse_firmware.h"

namespace palpate {
namespace {

using test::HidNode;
using test::PidFirmware;
using test::PidLayout;
using test::WriteFault;

const std::string kPath = test::node_path("stick");

struct Rig {
    PidFirmware stick;
    HidNode node{kPath, stick};
    PidDevice device;
    DeviceState state;

    /// Where a test is not about silence, longer than a thread may have to wait for its turn.
    static PidSettings settings(double stale_after_s) {
        PidSettings made;
        made.path = kPath;
        made.stale_after_s = stale_after_s;
        made.force_hold_s = stale_after_s;
        made.reconnect_s = 0.02;
        return made;
    }

    explicit Rig(const PidLayout& layout, double stale_after_s = 2.0)
        : Rig(layout, settings(stale_after_s)) {}
    Rig(const PidLayout& layout, const PidSettings& with) : stick(layout), device(with) {}

    void run() {
        device.open();
        device.start();
    }

    /// Reads and writes as a servo does until something is as wanted.
    template <typename Wanted>
    bool pushes(const Vec3& force, Wanted wanted) {
        return test::comes_true([&] {
            device.write(force);
            return device.read(state) && node.at_rest(wanted);
        });
    }

    bool fresh() const { return state.freshness == Freshness::fresh; }
    bool force_is(double right, double towards) const {
        const auto force = stick.force();
        // A step of the coarser magnitudes, of 255.
        return std::abs(force[0] - right) < 1.0 / 255 && std::abs(force[1] - towards) < 1.0 / 255;
    }
};

class PidSticks : public testing::TestWithParam<PidLayout> {};
INSTANTIATE_TEST_SUITE_P(Layout, PidSticks,
                         testing::Values(test::kAdapterLayout, test::kBoardLayout),
                         [](const testing::TestParamInfo<PidLayout>& layout) {
                             return layout.param.start_delay ? "board" : "adapter";
                         });

TEST_P(PidSticks, Case15OpenedItHasTwoEffectsThatPlayNoForce) {
    Rig rig(GetParam());
    rig.device.open();
    rig.node.at_rest([&] {
        EXPECT_EQ(rig.stick.effects.size(), 2u);
        EXPECT_TRUE(rig.stick.actuators);
        EXPECT_EQ(rig.stick.gain, 255);
        EXPECT_EQ(rig.stick.starts, 2);
        EXPECT_EQ(rig.stick.unknown_reports, 0);
        EXPECT_EQ(rig.stick.largest_force, 0.0);
    });
}

TEST_P(PidSticks, Case15ForcesGoWhereTheyAreMeantTo) {
    Rig rig(GetParam());
    rig.run();
    // 2 N is all that its motors do: half of it to the right, a quarter away from the user; what is
    // upwards it has no axis for.
    EXPECT_TRUE(rig.pushes({-0.5, 1.0, 7.0}, [&] { return rig.force_is(0.5, -0.25); }));
    EXPECT_TRUE(rig.pushes({1.0, -1.0, 0.0}, [&] { return rig.force_is(-0.5, 0.5); }));
    EXPECT_TRUE(rig.pushes({1e9, 0.0, 0.0}, [&] { return rig.force_is(0.0, 1.0); }));
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(rig.pushes({none, 1.0, 0.0}, [&] { return rig.force_is(0.0, 0.0); }));
    EXPECT_EQ(rig.node.at_rest([&] { return rig.stick.unknown_reports; }), 0);
}

TEST_P(PidSticks, ASignTurnsAnAxisAround) {
    PidSettings settings = Rig::settings(2.0);
    settings.towards_sign = -1;
    Rig rig(GetParam(), settings);
    rig.run();
    EXPECT_TRUE(rig.pushes({1.0, 1.0, 0.0}, [&] { return rig.force_is(0.5, -0.5); }));
}

TEST_P(PidSticks, PositionAndButtonsFollowTheStick) {
    Rig rig(GetParam());
    rig.run();
    rig.node.at_rest([&] { rig.stick.axes = {32767, -32767}, rig.stick.buttons = 0x82; });
    EXPECT_TRUE(rig.pushes({}, [&] { return rig.state.buttons == 0x82u; }));
    EXPECT_TRUE(rig.fresh());
    EXPECT_NEAR(glm::length(rig.state.position - Vec3(-0.05, 0.05, 0.0)), 0.0, 1e-15);
    EXPECT_EQ(rig.device.properties().workspace_m.upper, Vec3(0.05, 0.05, 0.0));
}

TEST_P(PidSticks, Case15AFullStickIsSaidAndGetsBackWhatItGave) {
    PidLayout crowded = GetParam();
    crowded.effects = 1; // room for one of the two
    Rig rig(crowded);
    try {
        rig.device.open();
        FAIL() << "opened";
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find(kPath + ": has no room for an effect; stop"),
                  std::string::npos)
            << error.what();
    }
    rig.node.at_rest([&] {
        EXPECT_TRUE(rig.stick.effects.empty());
        EXPECT_FALSE(rig.stick.actuators);
    });
}

TEST_P(PidSticks, Case15AnEffectThatIsRefusedIsSaid) {
    Rig rig(GetParam());
    rig.node.at_rest([&] { rig.stick.refuses_effects = true; });
    EXPECT_THROW(rig.device.open(), std::runtime_error);
}

TEST_P(PidSticks, Case5StopTakesForceEffectsAndActuatorsAway) {
    Rig rig(GetParam());
    rig.run();
    EXPECT_TRUE(rig.pushes({1.0, 1.0, 0.0}, [&] { return rig.force_is(0.5, 0.5); }));
    rig.device.stop();
    rig.node.at_rest([&] {
        EXPECT_TRUE(rig.stick.effects.empty());
        EXPECT_FALSE(rig.stick.actuators);
        EXPECT_EQ(rig.stick.unknown_reports, 0);
    });
    rig.device.stop();
    rig.device.close();
}

TEST_P(PidSticks, StoppedItStartsAgainWithItsEffects) {
    Rig rig(GetParam());
    rig.run();
    EXPECT_TRUE(rig.pushes({1.0, 1.0, 0.0}, [&] { return rig.force_is(0.5, 0.5); }));
    rig.device.stop();
    rig.device.start();
    EXPECT_TRUE(rig.pushes({1.0, 1.0, 0.0}, [&] { return rig.force_is(0.5, 0.5); }));
    rig.device.stop();
    rig.node.at_rest([&] {
        EXPECT_TRUE(rig.stick.effects.empty());
        EXPECT_FALSE(rig.stick.actuators);
    });
}

TEST_P(PidSticks, Case5DestroyedItHoldsNoForce) {
    PidFirmware stick(GetParam());
    HidNode node(kPath, stick);
    {
        PidDevice device(Rig::settings(2.0));
        device.open();
        device.start();
        device.write({1.0, 1.0, 0.0});
        EXPECT_TRUE(node.wait_until([&] { return stick.force()[0] > 0.1; }));
    }
    EXPECT_FALSE(node.at_rest([&] { return stick.actuators; }));
}

TEST_P(PidSticks, Case6AServoThatStallsLeavesNoForce) {
    Rig rig(GetParam(), 0.2);
    rig.run();
    EXPECT_TRUE(rig.pushes({1.0, 1.0, 0.0}, [&] { return rig.force_is(0.5, 0.5); }));
    EXPECT_TRUE(rig.node.wait_until([&] { return rig.force_is(0.0, 0.0); }));
}

TEST_P(PidSticks, SilentItIsStaleAndItsForceIsTakenAway) {
    Rig rig(GetParam(), 0.2);
    rig.run();
    EXPECT_TRUE(rig.pushes({1.0, 1.0, 0.0}, [&] { return rig.force_is(0.5, 0.5); }));
    EXPECT_TRUE(rig.fresh());
    rig.node.at_rest([&] { rig.stick.silent = true; });
    EXPECT_TRUE(rig.pushes({1.0, 1.0, 0.0}, [&] { return rig.force_is(0.0, 0.0); }));
    EXPECT_TRUE(rig.pushes({1.0, 1.0, 0.0}, [&] { return !rig.fresh(); }));
}

TEST_P(PidSticks, Case8ReportsOfOtherLengthsAndNumbersChangeNothing) {
    Rig rig(GetParam());
    rig.run();
    rig.node.at_rest([&] { rig.stick.axes = {32767, 0}; });
    const Vec3 right(0.0, 0.05, 0.0);
    EXPECT_TRUE(rig.pushes({}, [&] { return rig.state.position == right; }));
    for (const test::Bytes& odd :
         {test::Bytes{1}, test::Bytes{1, 0, 0, 0, 0}, test::Bytes{2, 3}, test::Bytes(64, 0x55)}) {
        rig.node.at_rest([&] { rig.stick.instead = odd; });
        EXPECT_TRUE(rig.node.wait_until([&] { return !rig.stick.instead; }));
        EXPECT_TRUE(rig.pushes({}, [&] { return rig.state.position == right && rig.fresh(); }));
    }
}

TEST_P(PidSticks, Case9UnpluggedItIsStaleAndBackItHasItsEffectsAgain) {
    Rig rig(GetParam());
    rig.run();
    for (int time = 0; time < 3; ++time) {
        EXPECT_TRUE(rig.pushes({1.0, 1.0, 0.0}, [&] { return rig.force_is(0.5, 0.5); }));
        const std::uint32_t trial = rig.state.trial;
        rig.node.unplug();
        rig.node.plug_in();
        EXPECT_TRUE(rig.pushes({1.0, 1.0, 0.0},
                               [&] { return rig.fresh() && rig.state.trial == trial + 1; }));
    }
    EXPECT_TRUE(rig.pushes({1.0, 1.0, 0.0}, [&] { return rig.force_is(0.5, 0.5); }));
}

TEST_P(PidSticks, Case9AForceOfBeforeIsNotPlayedByWhatIsPluggedInAfterwards) {
    PidSettings settings = Rig::settings(2.0);
    settings.force_hold_s = 3600.0; // however long forces are held
    Rig rig(GetParam(), settings);
    rig.run();
    EXPECT_TRUE(rig.pushes({1.0, 1.0, 0.0}, [&] { return rig.force_is(0.5, 0.5); }));
    rig.node.unplug();
    rig.node.at_rest([&] { rig.stick.largest_force = 0.0; });
    rig.node.plug_in();
    for (const int right : {32767, -32767, 32767, -32767}) { // each is told, and answered
        rig.node.at_rest([&] { rig.stick.axes = {right, 0}; });
        EXPECT_TRUE(test::comes_true(
            [&] { return rig.device.read(rig.state) && rig.state.position.y * right > 0.0; }));
    }
    EXPECT_EQ(rig.node.at_rest([&] { return rig.stick.largest_force; }), 0.0);
}

TEST_P(PidSticks, Case10AWriteThatBlocksHoldsNobodyButTheWriter) {
    Rig rig(GetParam(), 0.2);
    rig.run();
    EXPECT_TRUE(rig.pushes({1.0, 0.0, 0.0}, [&] { return rig.force_is(0.0, 0.5); }));
    rig.node.set_write_fault(WriteFault::blocks);
    // The servo goes on: it sees that nothing is taken.
    EXPECT_TRUE(rig.pushes({1.0, 0.0, 0.0}, [&] { return !rig.fresh(); }));
    rig.node.set_write_fault(WriteFault::none);
    EXPECT_TRUE(rig.pushes({0.0, 1.0, 0.0}, [&] { return rig.fresh() && rig.force_is(0.5, 0.0); }));
}

TEST(PidDevice, AnotherDeviceAndWrongSettingsAreSaid) {
    test::SpaceMouseFirmware mouse(test::SpaceMouseFirmware::Kind::wired);
    HidNode node(kPath, mouse);
    PidDevice device(Rig::settings(2.0));
    try {
        device.open();
        FAIL() << "opened";
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("has no Create New Effect"), std::string::npos)
            << error.what();
    }
    const auto refused = [](auto change, const char* name) {
        PidSettings settings;
        change(settings);
        try {
            PidDevice stick(settings);
            ADD_FAILURE() << "taken: " << name;
        } catch (const std::invalid_argument& error) {
            EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
        }
    };
    refused([](auto& s) { s.force_n = 0.0; }, "force_n");
    refused([](auto& s) { s.reach_m = std::numeric_limits<double>::quiet_NaN(); }, "reach_m");
    refused([](auto& s) { s.right_sign = 0.5; }, "right_sign");
    refused([](auto& s) { s.damping_n_s_per_m = -1.0; }, "damping_n_s_per_m");
    refused([](auto& s) { s.reconnect_s = 0.0; }, "reconnect_s");
}

#ifdef PALPATE_HAS_SYSTEM_CALL_FILTER
TEST(PidDevice, ReadingAndWritingMakeNoSystemCall) {
    Rig rig(test::kBoardLayout);
    rig.run();
    ASSERT_TRUE(rig.pushes({1.0, 0.0, 0.0}, [&] { return rig.fresh(); }));
    test::expect_no_system_calls(rig.device);
}
#endif

TEST_P(PidSticks, DeclaresWhatItsPositionsAreRoundedToAndItsDelay) {
    Rig rig(GetParam());
    rig.device.open();
    EXPECT_NEAR(rig.device.properties().position_step_m, 0.1 / 65534.0, 1e-12); // -32767 to 32767
    EXPECT_DOUBLE_EQ(rig.device.properties().delay_s, 4e-3);
}

// However long a stick that speaks on change alone may be silent.
TEST_P(PidSticks, Case9UnpluggedItIsStaleUntilItSaysWhereItIs) {
    Rig rig(GetParam(), 3600.0);
    rig.run();
    rig.node.at_rest([&] { rig.stick.axes = {32767, 0}; });
    ASSERT_TRUE(rig.pushes({}, [&] { return rig.fresh() && rig.state.position.y > 0.0; }));
    const std::uint32_t trial = rig.state.trial;
    rig.node.unplug();
    EXPECT_TRUE(rig.pushes({}, [&] { return !rig.fresh(); }));
    rig.node.at_rest([&] {
        rig.stick.silent = true;
        rig.stick.axes = {-32767, 0};
    });
    rig.node.plug_in();
    ASSERT_TRUE(rig.node.wait_until([&] { return rig.stick.starts == 4; }));
    std::this_thread::sleep_for(std::chrono::milliseconds(50)); // it is connected by then
    rig.device.read(rig.state);
    EXPECT_FALSE(rig.fresh()) << "nobody knows where it is";
    rig.node.at_rest([&] { rig.stick.silent = false; });
    EXPECT_TRUE(rig.pushes({}, [&] { return rig.fresh(); }));
    EXPECT_EQ(rig.state.trial, trial + 1);
    EXPECT_LT(rig.state.position.y, 0.0);
}

TEST(PidDevice, TheShortestReconnectLeavesTheProcessorToOthers) {
    PidSettings settings = Rig::settings(0.2);
    settings.reconnect_s = 1e-4;
    Rig rig(test::kBoardLayout, settings);
    rig.run();
    rig.node.unplug();
    ASSERT_TRUE(rig.pushes({}, [&] { return !rig.fresh(); }));
    const std::clock_t before = std::clock();
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    EXPECT_LT(static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC, 0.35);
}

} // namespace
} // namespace palpate
