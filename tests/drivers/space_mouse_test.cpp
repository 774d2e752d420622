// SPDX-License-Identifier: Apache-2.0
// The whole driver over the real libhidapi-hidraw, against a cap's firmware
// (space_mouse_firmware.h).
#include <palpate/drivers/space_mouse.h>

#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/drivers/hid_node.h"
#include "tests/support/device_calls.h"
#include "tests/support/patience.h"
#include "tests/support/space_mouse_firmware.h"
#include "tests/support/wooden_firmware.h"

namespace palpate {
namespace {

using test::HidNode;
using test::SpaceMouseFirmware;
using Kind = SpaceMouseFirmware::Kind;

const std::string kPath = test::node_path("mouse");

/// A cap with a driver whose probe has room to move for as long as a test may take.
struct Rig {
    SpaceMouseFirmware mouse;
    HidNode node{kPath, mouse};
    SpaceMouseDevice device;
    DeviceState state;

    static SpaceMouseSettings settings(double silence_s) {
        SpaceMouseSettings made;
        made.path = kPath;
        made.turn_rad_per_s = 1.0;
        made.silence_s = silence_s;
        made.reconnect_s = 0.02;
        made.workspace_m = {Vec3(-100.0), Vec3(100.0)};
        return made;
    }

    /// `silence_s` for tests that are not about it is longer than a thread may have to wait.
    explicit Rig(Kind kind, double silence_s = 10.0) : mouse(kind), device(settings(silence_s)) {
        device.open();
        device.start();
    }

    void push(const std::array<int, 6>& axes) {
        node.at_rest([&] { mouse.axes = axes; });
    }

    /// Reads as a servo does until a state is as wanted.
    template <typename Wanted>
    bool reads(Wanted wanted) {
        return test::comes_true([&] { return device.read(state) && wanted(); });
    }

    bool fresh() const { return state.freshness == Freshness::fresh; }
};

class SpaceMouseKinds : public testing::TestWithParam<Kind> {};
INSTANTIATE_TEST_SUITE_P(Cap, SpaceMouseKinds, testing::Values(Kind::wired, Kind::wireless),
                         [](const testing::TestParamInfo<Kind>& kind) {
                             return kind.param == Kind::wired ? "of7bytes" : "of13bytes";
                         });

TEST_P(SpaceMouseKinds, Case14DeflectionMovesTheProbeInTheDeviceFrame) {
    Rig rig(GetParam());
    EXPECT_TRUE(rig.reads([&] { return rig.fresh(); }));
    EXPECT_EQ(rig.state.position, Vec3(0.0)) << "the middle of its box";
    rig.push({350, 0, -350, 0, 0, 0}); // right and up
    EXPECT_TRUE(rig.reads([&] { return rig.state.position.y > 1e-3; }));
    EXPECT_GT(rig.state.position.z, 0.0);
    EXPECT_EQ(rig.state.position.x, 0.0);
    EXPECT_NEAR(glm::length(rig.state.velocity), 0.1, 1e-9);
    rig.push({0, 350, 0, 0, 0, 0}); // towards the user
    EXPECT_TRUE(rig.reads([&] { return rig.state.position.x > 1e-3; }));
}

TEST_P(SpaceMouseKinds, Case14TurnsFollowTheSecondReportOrTheSecondHalf) {
    Rig rig(GetParam());
    rig.push({0, 0, 0, 0, 0, -350}); // about up, counter-clockwise
    EXPECT_TRUE(rig.reads([&] { return rig.state.orientation.z > 0.01; }));
    EXPECT_EQ(rig.state.orientation.x, 0.0);
    EXPECT_EQ(rig.state.position, Vec3(0.0));
}

TEST_P(SpaceMouseKinds, Case14SilentAtRestIsFresh) {
    Rig rig(GetParam(), 0.2);
    rig.push({350, 0, 0, 0, 0, 0});
    EXPECT_TRUE(rig.reads([&] { return rig.state.velocity.y > 0.0; }));
    rig.push({});
    EXPECT_TRUE(rig.reads([&] { return rig.state.velocity == Vec3(0.0) && rig.fresh(); }));
    // Three times told and then silent: two silences longer than a deflected cap may keep.
    const auto told = [&] { return rig.node.at_rest([&] { return rig.mouse.reports_sent; }); };
    ASSERT_TRUE(rig.node.wait_until([&] { return rig.mouse.has_said_rest(); }));
    const int before = told();
    const Vec3 place = rig.state.position;
    for (int i = 0; i < 40; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
        ASSERT_TRUE(rig.device.read(rig.state));
        ASSERT_TRUE(rig.fresh());
    }
    EXPECT_EQ(told(), before);
    EXPECT_EQ(rig.state.position, place);
}

TEST_P(SpaceMouseKinds, Case14SilentWhileDeflectedIsStaleAndStands) {
    Rig rig(GetParam(), 0.2);
    rig.push({350, 0, 0, 0, 0, 0});
    EXPECT_TRUE(rig.reads([&] { return rig.state.velocity.y > 0.0; }));
    rig.node.at_rest([&] { rig.mouse.silent = true; });
    EXPECT_TRUE(rig.reads([&] { return !rig.fresh(); }));
    EXPECT_EQ(rig.state.velocity, Vec3(0.0));
    const Vec3 place = rig.state.position;
    EXPECT_TRUE(rig.reads([&] { return true; }));
    EXPECT_EQ(rig.state.position, place);
    rig.node.at_rest([&] { rig.mouse.silent = false; });
    EXPECT_TRUE(rig.reads([&] { return rig.fresh() && rig.state.velocity.y > 0.0; }));
}

TEST_P(SpaceMouseKinds, Case14BeyondTheRangeIsFullSpeedAndNoMore) {
    Rig rig(GetParam());
    rig.push({500, 0, 0, 0, 0, 0});
    EXPECT_TRUE(rig.reads([&] { return rig.state.velocity.y > 0.0; }));
    EXPECT_NEAR(rig.state.velocity.y, 0.1, 1e-9);
}

TEST_P(SpaceMouseKinds, Case14LampIsLitWhileItIsOpen) {
    Rig rig(GetParam());
    const auto lit = [&] { return rig.mouse.lamp; };
    EXPECT_TRUE(rig.node.wait_until(lit));
    rig.device.stop();
    EXPECT_FALSE(rig.node.at_rest(lit));
    rig.device.stop();
    rig.device.close();
}

TEST_P(SpaceMouseKinds, ButtonsAreReportedWithoutMotion) {
    Rig rig(GetParam());
    rig.node.at_rest([&] { rig.mouse.buttons = 2; });
    EXPECT_TRUE(rig.reads([&] { return rig.state.buttons == 2u; }));
    EXPECT_EQ(rig.state.position, Vec3(0.0));
}

TEST_P(SpaceMouseKinds, Case8ReportsOfOtherLengthsChangeNothing) {
    Rig rig(GetParam());
    rig.push({350, 0, 0, 0, 0, 0});
    EXPECT_TRUE(rig.reads([&] { return rig.state.velocity.y > 0.0; }));
    for (const test::Bytes& odd : {test::Bytes{1}, test::Bytes{1, 0, 0, 0, 0, 0},
                                   test::Bytes{99, 1, 2, 3}, test::Bytes(64, 0xFF)}) {
        rig.node.at_rest([&] { rig.mouse.instead = odd; });
        EXPECT_TRUE(rig.node.wait_until([&] { return !rig.mouse.instead; }));
        EXPECT_TRUE(rig.reads([&] { return rig.fresh(); }));
        EXPECT_GT(rig.state.velocity.y, 0.0);
    }
}

TEST_P(SpaceMouseKinds, Case11ASecondUserIsKeptOut) {
    Rig rig(GetParam());
    SpaceMouseDevice second(Rig::settings(1.0));
    EXPECT_THROW(second.open(), std::runtime_error);
    rig.device.close();
    EXPECT_NO_THROW(second.open());
}

TEST_P(SpaceMouseKinds, Case9UnpluggedAtRestIsStaleAndBackIsFreshWhereItWas) {
    Rig rig(GetParam());
    rig.push({350, 0, 0, 0, 0, 0});
    EXPECT_TRUE(rig.reads([&] { return rig.state.position.y > 1e-3; }));
    rig.node.unplug();
    EXPECT_TRUE(rig.reads([&] { return !rig.fresh(); }));
    const Vec3 place = rig.state.position;
    rig.push({});
    rig.node.plug_in();
    EXPECT_TRUE(rig.reads([&] { return rig.fresh(); }));
    EXPECT_EQ(rig.state.position, place) << "the deflection of before is forgotten";
    EXPECT_EQ(rig.state.velocity, Vec3(0.0));
}

TEST_P(SpaceMouseKinds, Case9UnpluggedAfterItWasOpenedAgainIsStale) {
    Rig rig(GetParam());
    rig.device.close();
    EXPECT_TRUE(rig.reads([&] { return !rig.fresh(); }));
    rig.device.open();
    rig.device.start();
    EXPECT_TRUE(rig.reads([&] { return rig.fresh(); }));
    rig.node.unplug();
    EXPECT_TRUE(rig.reads([&] { return !rig.fresh(); }));
}

TEST(SpaceMouseDevice, TakesNoForceAndSaysWhereItsProbeGets) {
    SpaceMouseDevice device;
    EXPECT_EQ(device.properties().force_n, 0.0);
    EXPECT_EQ(device.properties().workspace_m.upper, Vec3(0.1));
    device.write({1.0, 2.0, 3.0});
    device.stop();
    device.close();
}

TEST(SpaceMouseDevice, NoneAttachedAndAnotherDeviceAreSaid) {
    const auto refused = [](const std::string& path, const char* part) {
        SpaceMouseSettings settings;
        settings.path = path;
        SpaceMouseDevice device(settings);
        try {
            device.open();
            ADD_FAILURE() << "opened";
        } catch (const std::runtime_error& error) {
            EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
        }
    };
    refused(test::node_path("nothing"), "there is no such device; plug it in");
    test::WoodenFirmware board(14);
    const std::string other = test::node_path("other");
    HidNode node(other, board);
    refused(other, "is no space mouse; `palpate devices` lists");
}

#ifdef PALPATE_HAS_SYSTEM_CALL_FILTER
TEST(SpaceMouseDevice, ReadingAndWritingMakeNoSystemCall) {
    Rig rig(Kind::wired);
    rig.push({350, 0, 0, 350, 0, 0});
    ASSERT_TRUE(rig.reads([&] { return rig.state.velocity.y > 0.0; }));
    test::expect_no_system_calls(rig.device);
}
#endif

} // namespace
} // namespace palpate
