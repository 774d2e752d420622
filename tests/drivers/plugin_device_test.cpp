// SPDX-License-Identifier: Apache-2.0
// The wrapper around plug-ins, over a real one with a fault of each kind (plugins/seeded_device.c).
#include <palpate/drivers/plugin_device.h>

#include <cstring>
#include <random>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include <palpate/drivers/internal/plugin_library.h>

#include "tests/support/device_calls.h"
#include "tests/support/patience.h"

namespace palpate {
namespace {

const std::string kFolder = PALPATE_PLUGINS;

PluginAddress with(const std::string& defect) {
    return {kFolder + "/seeded_device.so", {{"defect", defect}}};
}

/// For functions that never return, without waiting for them as long as for a slow one.
constexpr PluginDevice::Patience kShort{0.3, 0.3, 0.3, 0.3};

struct Rig {
    explicit Rig(const std::string& defect, const PluginDevice::Patience& patience = {})
        : device(with(defect), patience) {
        device.open();
        device.start();
    }
    ~Rig() {
        device.stop();
        device.close();
    }
    bool fresh() {
        EXPECT_TRUE(device.read(state));
        return state.freshness == Freshness::fresh;
    }
    PluginDevice device;
    DeviceState state;
};

std::string refusal(const PluginAddress& address, const PluginDevice::Patience& patience = {}) {
    PluginDevice device(address, patience);
    try {
        device.open();
        device.start();
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "";
}

#define EXPECT_PART(text, part)                                                                    \
    EXPECT_NE(std::string(text).find(part), std::string::npos) << std::string(text)

TEST(PluginDevice, StatesComeAndTheirTimeGoesOn) {
    Rig rig("NONE");
    ASSERT_TRUE(test::comes_true([&] { return rig.fresh(); }));
    const double first_s = rig.state.time_s;
    EXPECT_TRUE(test::comes_true([&] { return rig.fresh() && rig.state.time_s > first_s + 0.05; }));
    EXPECT_EQ(rig.state.buttons, 1u);
    EXPECT_TRUE(test::comes_true([&] { return rig.device.counts().states > 10; }));
    EXPECT_EQ(rig.device.counts().faulty, 0u);
}

TEST(PluginDevice, DeclaresWhatThePluginSaysAndTheWayThroughItsThread) {
    PluginDevice device(with("NONE"));
    device.open();
    const DeviceProperties properties = device.properties();
    EXPECT_EQ(properties.name, "seeded device");
    EXPECT_EQ(properties.force_n, 8.0);
    EXPECT_EQ(properties.damping_n_s_per_m, 2.0);
    EXPECT_EQ(properties.stiffness_n_per_m, std::numeric_limits<double>::infinity())
        << "0 is not known, which is no limit";
    EXPECT_EQ(properties.workspace_m.upper, Vec3(0.2));
    EXPECT_EQ(properties.velocity_source, VelocitySource::device);
    EXPECT_DOUBLE_EQ(properties.delay_s, 2e-3) << "a state and a force wait for a period each";
}

TEST(PluginDevice, TheForceArrivesFiniteAndNoLongerThanItsLimit) {
    Rig rig("TELLS_FORCE"); // its position is 1 mm per newton held
    const auto held = [&](const Vec3& force, double expected_mm) {
        return test::comes_true([&] {
            rig.device.write(force);
            return rig.fresh() && std::abs(rig.state.position.x - 1e-3 * expected_mm) < 1e-12;
        });
    };
    EXPECT_TRUE(held({2.0, 0.0, 0.0}, 2.0));
    EXPECT_TRUE(held({100.0, 0.0, 0.0}, 8.0));
    EXPECT_TRUE(held({std::numeric_limits<double>::quiet_NaN(), 1.0, 0.0}, 0.0));
}

TEST(PluginDevice, AForceThatTheLoopDoesNotRenewEnds) {
    Rig rig("TELLS_FORCE");
    ASSERT_TRUE(test::comes_true([&] {
        rig.device.write({2.0, 0.0, 0.0});
        return rig.fresh() && rig.state.position.x > 1e-3;
    }));
    EXPECT_TRUE(test::comes_true([&] { return rig.fresh() && rig.state.position.x == 0.0; }));
}

TEST(PluginDevice, WhatIsNoNumberIsASilenceAndNoState) {
    Rig rig("NAN_POSITION");
    EXPECT_TRUE(test::comes_true([&] {
        rig.device.read(rig.state);
        EXPECT_TRUE(is_finite(rig.state.position));
        return rig.device.counts().faulty > 3;
    }));
    rig.device.stop();
    rig.device.close();
    EXPECT_PART(rig.device.complaint(), "states with numbers out of range");
    EXPECT_PART(rig.device.complaint(), "the first: position_m is not finite");
}

TEST(PluginDevice, TimeThatRunsBackwardsIsLeftOut) {
    Rig rig("TIME_BACK");
    double last_s = -1.0;
    EXPECT_TRUE(test::comes_true([&] {
        rig.device.read(rig.state);
        EXPECT_GE(rig.state.time_s, last_s);
        last_s = rig.state.time_s;
        return rig.device.counts().not_later > 3;
    }));
}

TEST(PluginDevice, TheSameStateOverAndOverBecomesStale) {
    Rig rig("SAME_TIME");
    ASSERT_TRUE(test::comes_true([&] { return rig.device.counts().states == 1; }));
    EXPECT_TRUE(test::comes_true([&] { return !rig.fresh(); }));
    EXPECT_EQ(rig.device.counts().states, 1u);
}

TEST(PluginDevice, WithoutAStateItIsStale) {
    Rig rig("NO_STATE");
    for (int i = 0; i < 100; ++i)
        EXPECT_FALSE(rig.fresh());
    EXPECT_TRUE(is_finite(rig.state.position));
}

TEST(PluginDevice, AReadThatDoesNotReturnIsStaleAndStopsNobody) {
    Rig rig("HANG_IN_READ", kShort);
    ASSERT_TRUE(test::comes_true([&] { return rig.device.counts().states > 0; }));
    // A busy machine makes it stale before it hangs: then it goes on.
    EXPECT_TRUE(test::comes_true([&] {
        rig.device.write({1.0, 0.0, 0.0});
        if (rig.fresh()) return false;
        rig.device.stop();
        if (rig.device.complaint().find("stop did not return") != std::string::npos) return true;
        rig.device.start();
        return false;
    }));
    EXPECT_FALSE(rig.fresh()) << "and it goes on";
}

TEST(PluginDevice, AStopOrCloseThatDoesNotReturnIsLeftToItself) {
    for (const char* defect : {"HANG_IN_STOP", "HANG_IN_CLOSE"}) {
        Rig rig(defect, kShort);
        rig.device.stop();
        rig.device.close();
        EXPECT_PART(rig.device.complaint(), "did not return");
        rig.device.close();
    }
}

TEST(PluginDevice, AStopThatFailsIsTold) {
    PluginDevice device(with("STOP_FAILS"));
    device.open();
    device.start();
    EXPECT_EQ(device.complaint().find("stop failed"), std::string::npos);
    device.stop();
    EXPECT_PART(device.complaint(), "stop failed, so that nobody knows whether a force is held: "
                                    "switch the device off");
    device.close();
    EXPECT_PART(device.complaint(), "stop failed");
}

TEST(PluginDevice, AStopThatSucceedsLaterIsTheLastWord) {
    PluginDevice device(with("STOP_FAILS_ONCE"));
    device.open();
    device.start();
    device.stop();
    EXPECT_PART(device.complaint(), "stop failed");
    device.close(); // which stops it once more
    EXPECT_EQ(device.complaint().find("stop failed"), std::string::npos);
}

// What takes as long as <palpate/device_plugin.h> allows, each function by itself, is waited for: a
// stop comes after a read, a write and a period, and a close stops before.
TEST(PluginDevice, OneThatEndsAsLateAsItMayIsWaitedFor) {
    constexpr double kStop_s = 1.0, kClose_s = 5.0, kCall_s = 0.1, kPeriod_s = 1.0 / 50.0;
    constexpr PluginDevice::Patience patience;
    EXPECT_GE(patience.stop_s, kStop_s + 2.0 * kCall_s + kPeriod_s);
    EXPECT_GE(patience.close_s, patience.stop_s + kClose_s);
}

TEST(PluginDevice, CallsThatTakeLongerThanItSaysBringNoState) {
    Rig rig("SLOW_READ");
    ASSERT_TRUE(test::comes_true([&] { return rig.device.counts().slow_calls > 10; }));
    EXPECT_EQ(rig.device.counts().states, 0u);
    EXPECT_FALSE(rig.fresh());
}

TEST(PluginDevice, AForceThatIsRefusedIsCountedWithItsReason) {
    Rig rig("REFUSES_FORCE");
    ASSERT_TRUE(test::comes_true([&] { return rig.device.counts().failed_writes > 2; }));
    EXPECT_PART(rig.device.complaint(), "the amplifiers are too hot; wait");
}

TEST(PluginDevice, GarbageLeavesOnlyWhatIsGood) {
    Rig rig("GARBAGE");
    EXPECT_TRUE(test::comes_true([&] {
        rig.device.read(rig.state);
        EXPECT_TRUE(is_finite(rig.state.position) && is_finite(rig.state.velocity));
        EXPECT_NEAR(glm::length(rig.state.orientation), 1.0, 1e-12);
        const PluginCounts counts = rig.device.counts();
        return counts.faulty > 30 && counts.failed_reads > 3 && counts.states > 30;
    }));
}

TEST(PluginDevice, StopsAndStartsAgain) {
    Rig rig("NONE");
    for (int i = 0; i < 3; ++i) {
        EXPECT_TRUE(test::comes_true([&] { return rig.fresh(); }));
        rig.device.stop();
        rig.device.stop();
        EXPECT_TRUE(test::comes_true([&] { return !rig.fresh(); }));
        rig.device.start();
    }
}

TEST(PluginDevice, WhatIsWrongWithTheFileIsSaidWithTheRemedy) {
    const auto of_file = [](const std::string& name) {
        return refusal({kFolder + "/" + name, {}});
    };
    EXPECT_PART(of_file("none.so"), "none.so: there is no such file; give the plug-in's shared");
    EXPECT_PART(refusal({kFolder, {}}), "plugins: is no file; give the plug-in's shared");
    EXPECT_PART(refusal({PALPATE_PYTHON_HAND, {}}), "); give a shared library of this machine's");
    EXPECT_PART(of_file("seeded_UNDEFINED_SYMBOL.so"), "); link the plug-in with all that it");
    EXPECT_PART(of_file("seeded_NO_ENTRY.so"), "has no function palpate_device_plugin_entry()");
    EXPECT_PART(of_file("seeded_NULL_TABLE.so"), "returns NULL; let it return the table");
    EXPECT_PART(of_file("seeded_WRONG_ABI.so"), "abi = 99, and this Palpate has 1; compile it");
    EXPECT_PART(of_file("seeded_SHORT_TABLE.so"), "size = 16, and the table has ");
    EXPECT_PART(of_file("seeded_NULL_READ.so"), "read is NULL or empty; set it");
    EXPECT_EQ(plugin_name(kFolder + "/seeded_device.so").name, "seeded");
}

TEST(PluginDevice, WhatIsWrongWithTheDeviceIsSaidInItsOwnWords) {
    EXPECT_PART(refusal(with("NOT_ONE")), "open: an option is unknown; leave it out");
    EXPECT_PART(refusal(with("SILENT_OPEN")), "open: the plug-in gives no reason");
    EXPECT_PART(refusal(with("RATE_NAN")), "properties: rate_hz = nan: must be in [50, 20000]");
    EXPECT_PART(refusal(with("START_FAILS")), "start: the motors do not answer; switch them on");
    EXPECT_PART(refusal(with("OPEN_HANGS"), kShort), "open does not return");
}

TEST(PluginDevice, AnExceptionOfAPluginIsAFailure) {
    EXPECT_PART(refusal({kFolder + "/throwing_device.so", {}}),
                "throwing_device.so: open: an exception leaves it; catch it there");
    // Also one of the function that is asked for the reason of another's failure.
    EXPECT_PART(refusal({kFolder + "/throwing_device.so", {{"only", "properties"}}}),
                "throwing_device.so: properties: the plug-in's reason() throws");
    // And one of those that are called in each frame.
    PluginDevice device({kFolder + "/throwing_device.so", {{"only", "frames"}}});
    device.open();
    device.start();
    ASSERT_TRUE(test::comes_true([&] { return device.counts().failed_reads > 2; }));
    device.close();
    EXPECT_PART(device.complaint(), "an exception leaves it; catch it there");
}

TEST(PluginDevice, AnAddressIsAFileAndItsOptions) {
    const PluginAddress address = plugin_address("./a b.so?port=5055&name=x=y&empty=");
    EXPECT_EQ(address.path, "./a b.so");
    const std::vector<std::pair<std::string, std::string>> options{
        {"port", "5055"}, {"name", "x=y"}, {"empty", ""}};
    EXPECT_EQ(address.options, options);
    EXPECT_TRUE(plugin_address("a.so").options.empty());
    for (const char* wrong :
         {"", "?a=b", "a.so?", "a.so?port", "a.so?=1", "a.so?a=1&a=2", "a.so?&"})
        EXPECT_THROW(plugin_address(wrong), std::runtime_error) << wrong;
}

/// What is taken from any bytes is finite, near, and turned by a unit quaternion.
TEST(PluginLibrary, AMillionStatesOfRandomBytesLetNoNumberThroughThatIsNone) {
    std::mt19937_64 random(20261123);
    constexpr double kSome[] = {0.0,
                                1.0,
                                -0.1,
                                1e-300,
                                1e3,
                                1.0000001e3,
                                1e300,
                                std::numeric_limits<double>::quiet_NaN(),
                                std::numeric_limits<double>::infinity()};
    long taken = 0;
    for (int i = 0; i < 1000000; ++i) {
        palpate_plugin_state state = internal::unknown_state();
        const auto number = [&]() -> double {
            if (random() % 4 != 0) return kSome[random() % 3];
            if (random() % 2 == 0) return kSome[random() % std::size(kSome)];
            double any = 0.0;
            const std::uint64_t bits = random();
            std::memcpy(&any, &bits, sizeof any);
            return any;
        };
        state.time_s = number();
        for (int axis = 0; axis < 3; ++axis) {
            state.position_m[axis] = number();
            state.velocity_m_per_s[axis] = number();
        }
        state.orientation[random() % 4] += random() % 8 == 0 ? number() : 0.0;
        if (internal::fault_of(state) != nullptr) continue;
        ++taken;
        const double* q = state.orientation;
        const double length = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
        ASSERT_TRUE(std::isfinite(state.time_s) && std::abs(length - 1.0) < 3e-3);
        for (int axis = 0; axis < 3; ++axis)
            ASSERT_TRUE(std::abs(state.position_m[axis]) <= 1e3 &&
                        std::isfinite(state.velocity_m_per_s[axis]));
    }
    EXPECT_GT(taken, 1000);
}

TEST(PluginLibrary, EachPropertyOutOfRangeIsNamed) {
    palpate_plugin_properties good = internal::unknown_properties();
    std::strcpy(good.name, "x");
    good.rate_hz = 1000.0;
    good.longest_call_s = 1e-3;
    good.stale_after_s = 0.01;
    ASSERT_EQ(internal::fault_of(good), "");
    const auto fault = [&](auto change) {
        palpate_plugin_properties one = good;
        change(one);
        return internal::fault_of(one);
    };
    EXPECT_PART(fault([](auto& p) { p.name[0] = '\0'; }), "name: is empty");
    EXPECT_PART(fault([](auto& p) { std::memset(p.name, 'x', sizeof p.name); }),
                "name: has no end");
    EXPECT_PART(fault([](auto& p) { p.rate_hz = 49.0; }), "rate_hz = 49: must be in [50, 20000]");
    EXPECT_PART(fault([](auto& p) { p.longest_call_s = 0.0; }), "longest_call_s = 0");
    EXPECT_PART(fault([](auto& p) { p.stale_after_s = 2.0; }), "stale_after_s = 2");
    EXPECT_PART(fault([](auto& p) { p.force_n = -1.0; }), "force_n = -1");
    EXPECT_PART(fault([](auto& p) { p.delay_s = NAN; }), "delay_s = nan");
    EXPECT_PART(fault([](auto& p) { p.buttons = 33; }), "buttons = 33");
    EXPECT_PART(fault([](auto& p) { p.workspace_upper_m[1] = -0.1; }), "workspace_lower_m[1] = 0");
}

#ifdef PALPATE_HAS_SYSTEM_CALL_FILTER
TEST(PluginDevice, ReadingAndWritingMakeNoSystemCall) {
    Rig rig("NONE");
    ASSERT_TRUE(test::comes_true([&] { return rig.fresh(); }));
    test::expect_no_system_calls(rig.device);
}
#endif

} // namespace
} // namespace palpate
