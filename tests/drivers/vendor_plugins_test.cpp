// SPDX-License-Identifier: Apache-2.0
// The worked examples of plug-ins for makers' libraries, each over a fake of that library: axes,
// units, forces, and what becomes of them when the library or the device fails.
#include <palpate/drivers/plugin_device.h>

#include <dlfcn.h>

#include <chrono>
#include <cmath>
#include <stdexcept>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "tests/support/fake_hand/fake_hand.h"
#include "tests/support/patience.h"

namespace palpate {
namespace {

const std::string kFolder = PALPATE_PLUGINS;

struct Vendor {
    const char* plugin;
    const char* library;
    double longest_force_n;
    Vec3 middle_m;     ///< where the fake has the origin of our frame, its axes
    bool has_our_axes; ///< else x to the right, y up, z towards the user
};

const Vendor kVendors[] = {{"open_haptics", "openhaptics", 3.3, Vec3(0.0), false},
                           {"force_dimension", "force_dimension", 12.0, Vec3(0.0), true},
                           {"falcon", "libnifalcon", 8.0, Vec3(0.0, 0.0, 0.125), false}};

/// What a test may do to the fake behind a plug-in.
class Fake {
public:
    explicit Fake(const Vendor& vendor)
        : vendor_(vendor),
          library_(::dlopen((kFolder + "/libfake_" + vendor.library + ".so").c_str(), RTLD_NOW)) {
        EXPECT_NE(library_, nullptr) << ::dlerror();
    }
    ~Fake() {
        break_it(FAKE_NONE);
        release();
    }
    Fake(const Fake&) = delete;
    Fake& operator=(const Fake&) = delete;

    /// At a place in our frame.
    void hold(const Vec3& ours) {
        const Vec3 place = vendor_.middle_m + theirs(ours);
        const double position[3] = {place.x, place.y, place.z};
        function<decltype(fake_hold)>("fake_hold")(position);
    }
    void release() { function<decltype(fake_release)>("fake_release")(); }
    void break_it(fake_fault fault) { function<decltype(fake_break)>("fake_break")(fault); }
    /// In our frame.
    Vec3 motors() {
        double force[3];
        function<decltype(fake_motors)>("fake_motors")(force);
        return vendor_.has_our_axes ? Vec3(force[0], force[1], force[2])
                                    : Vec3(force[2], force[0], force[1]);
    }

private:
    template <class F>
    F* function(const char* name) {
        return reinterpret_cast<F*>(::dlsym(library_, name));
    }
    Vec3 theirs(const Vec3& ours) const {
        return vendor_.has_our_axes ? ours : Vec3(ours.y, ours.z, ours.x);
    }

    Vendor vendor_;
    void* library_;
};

class VendorPlugin : public testing::TestWithParam<Vendor> {
protected:
    VendorPlugin() : device_({kFolder + "/" + GetParam().plugin + ".so", {}}) {
        device_.open();
        device_.start();
    }
    ~VendorPlugin() override {
        device_.stop();
        device_.close();
    }
    bool fresh() {
        EXPECT_TRUE(device_.read(state_));
        return state_.freshness == Freshness::fresh;
    }
    /// As the safety chain does: no force on a state that is stale.
    bool fresh_and_pushed(const Vec3& force) {
        const bool is_fresh = fresh();
        device_.write(is_fresh ? force : Vec3(0.0));
        return is_fresh;
    }

    PluginDevice device_;
    DeviceState state_;
    Fake fake_{GetParam()};
};

constexpr double kRounding = 1e-12; // of metres and newtons through a scale of 1000

TEST_P(VendorPlugin, PositionsAreInOurAxesAndMetres) {
    for (const Vec3& place : {Vec3(0.03, 0.01, 0.02), Vec3(-0.04, 0.02, -0.01)}) {
        fake_.hold(place);
        EXPECT_TRUE(test::comes_true([&] {
            return fresh() && glm::distance(state_.position, place) < kRounding;
        })) << state_.position.x
            << " " << state_.position.y << " " << state_.position.z;
    }
    EXPECT_NE(state_.buttons & 1u, 0u);
}

TEST_P(VendorPlugin, VelocitiesAreThoseOfThePositions) {
    if (device_.properties().velocity_source != VelocitySource::device)
        GTEST_SKIP() << "it measures none";
    fake_.hold(Vec3(0.0, 0.05, 0.0));
    // States from before the hold may still be on their way.
    ASSERT_TRUE(test::comes_true([&] {
        return fresh() && state_.velocity == Vec3(0.0) &&
               std::abs(state_.position.y - 0.05) < kRounding;
    }));
    // From rest, 50 mm beside the middle, to where the hand wants it, 30 mm at most: along -y, with
    // 6 N at first against 14 N s/m.
    fake_.release();
    EXPECT_TRUE(test::comes_true([&] { return fresh() && state_.velocity.y < -0.05; }));
}

TEST_P(VendorPlugin, ForcesArriveInTheirAxesAndNoLongerThanTheLimit) {
    const double most_n = GetParam().longest_force_n;
    EXPECT_DOUBLE_EQ(device_.properties().force_n, most_n);
    const auto arrives = [&](const Vec3& force, const Vec3& expected) {
        return test::comes_true([&] {
            fresh_and_pushed(force);
            return glm::distance(fake_.motors(), expected) < kRounding;
        });
    };
    EXPECT_TRUE(arrives({0.5, 1.0, -1.5}, {0.5, 1.0, -1.5}));
    EXPECT_TRUE(arrives({0.0, 100.0, 0.0}, {0.0, most_n, 0.0}));
    EXPECT_TRUE(arrives({0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}));
}

TEST_P(VendorPlugin, AForceThatTheLoopDoesNotRenewEnds) {
    ASSERT_TRUE(test::comes_true([&] {
        fresh_and_pushed({0.0, 1.0, 0.0});
        return fake_.motors() != Vec3(0.0);
    }));
    EXPECT_TRUE(test::comes_true([&] { return fake_.motors() == Vec3(0.0); }));
}

TEST_P(VendorPlugin, ADeviceThatIsLostOrSilentIsStaleWithoutForceAndComesBack) {
    for (const fake_fault fault : {FAKE_LOST, FAKE_SILENT}) {
        SCOPED_TRACE(fault);
        ASSERT_TRUE(test::comes_true([&] {
            return fresh_and_pushed({0.0, 1.0, 0.0}) && fake_.motors() != Vec3(0.0);
        }));
        fake_.break_it(fault);
        EXPECT_TRUE(test::comes_true([&] {
            return !fresh_and_pushed({0.0, 1.0, 0.0}) && fake_.motors() == Vec3(0.0);
        }));
        for (int i = 0; i < 50; ++i)
            EXPECT_FALSE(fresh_and_pushed({0.0, 1.0, 0.0}));
        EXPECT_EQ(fake_.motors(), Vec3(0.0));
        fake_.break_it(FAKE_NONE);
        device_.stop(); // what a library has given up, a new start takes up again
        device_.start();
        EXPECT_TRUE(test::comes_true([&] { return fresh(); }));
    }
}

// AddressSanitizer sees a library that still calls back into a device that was closed.
TEST_P(VendorPlugin, AfterAStartThatFailedNothingCallsBackAndItOpensAgain) {
    device_.stop();
    fake_.break_it(FAKE_LOST);
    try {
        device_.start();
    } catch (const std::runtime_error&) {
    }
    device_.close();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    fake_.break_it(FAKE_NONE);
    device_.open();
    device_.start();
    EXPECT_TRUE(test::comes_true([&] { return fresh(); }));
}

TEST_P(VendorPlugin, CallsThatFailAreLeftOutAndItGoesOn) {
    ASSERT_TRUE(test::comes_true([&] { return fresh(); }));
    const std::uint64_t states = device_.counts().states;
    fake_.break_it(FAKE_ERRORS);
    EXPECT_TRUE(test::comes_true([&] {
        fresh_and_pushed({0.0, 1.0, 0.0});
        EXPECT_TRUE(is_finite(state_.position));
        return device_.counts().states > states + 100;
    }));
    EXPECT_LE(glm::length(fake_.motors()), 1.0 + kRounding);
}

TEST_P(VendorPlugin, WithoutADeviceItSaysWhatToDo) {
    device_.close();
    fake_.break_it(FAKE_LOST);
    try {
        device_.open();
        ADD_FAILURE() << "opened";
    } catch (const std::runtime_error& error) {
        const std::string said = error.what();
        EXPECT_NE(said.find(": open: "), std::string::npos) << said;
        EXPECT_NE(said.find("let this user open the"), std::string::npos) << said;
    }
}

INSTANTIATE_TEST_SUITE_P(OfMakers, VendorPlugin, testing::ValuesIn(kVendors),
                         [](const auto& vendor) { return std::string(vendor.param.plugin); });

} // namespace
} // namespace palpate
