// SPDX-License-Identifier: Apache-2.0
// `palpate devices` over made folders of a system: whoever has one of these devices finds the way.
#include <cstdlib>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/command/command_run.h"

namespace palpate {
namespace {

struct OnTheUsb {
    const char* called;
    const char* vendor;
    const char* product;
    const char* maker;
    const char* model;
    const char* way; ///< a part of the remedy
};

constexpr OnTheUsb kDevices[] = {
    {"touch", "0301", "2988", "", "", "plugin:./open_haptics.so"},
    {"touch", "2988", "0304", "3D Systems", "Touch", "plugin:./open_haptics.so"},
    {"sigma", "1451", "0403", "Force Dimension", "sigma.7", "plugin:./force_dimension.so"},
    {"falcon", "0403", "cb48", "", "", "plugin:./falcon.so"},
    {"inverse3", "abcd", "0001", "Haply", "Inverse3", "--device inverse3"},
    {"teensy", "16c0", "0483", "Teensyduino", "USB Serial", "plugin:./udp_device.so"},
};

class DevicesCommand : public test::CommandRun {
protected:
    DevicesCommand() { ::setenv("PALPATE_SYSTEM_ROOT", (folder() / "root").c_str(), 1); }
    ~DevicesCommand() override { ::unsetenv("PALPATE_SYSTEM_ROOT"); }

    void make_usb() const { std::filesystem::create_directories(folder() / kBus); }
    void attach(const OnTheUsb& device, const std::string& place = "1-4") const {
        std::filesystem::create_directories(folder() / kBus / place);
        const auto write = [&](const char* file, const char* text) {
            if (*text != '\0') make(kBus + place + "/" + file, std::string(text) + "\n");
        };
        write("idVendor", device.vendor);
        write("idProduct", device.product);
        write("manufacturer", device.maker);
        write("product", device.model);
    }

    static inline const std::string kBus = "root/sys/bus/usb/devices/";
};

TEST_F(DevicesCommand, NoneIsAttachedWhereTheListsAreEmptyAndOnlyThere) {
    make_usb();
    const test::CommandResult nothing = run({"devices", "--why"});
    EXPECT_NE(nothing.out.find("no haptic device is attached; "), std::string::npos) << nothing.out;
    std::filesystem::remove_all(folder() / "root/sys/bus/usb");
    const test::CommandResult without = run({"devices"});
    EXPECT_EQ(without.exit, 0);
    EXPECT_EQ(without.out.find("is attached;"), std::string::npos) << without.out;
    EXPECT_NE(without.out.find("no haptic device was found; "), std::string::npos) << without.out;
    EXPECT_NE(run({"devices", "--why"}).out.find("this system has no USB"), std::string::npos);
}

TEST_F(DevicesCommand, EachDeviceOfAnotherMakerIsListedWithItsWay) {
    make("ball.toml", "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n[surface.s]\n"
                      "volume = \"v\"\n[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n");
    for (const OnTheUsb& device : kDevices) {
        SCOPED_TRACE(device.product);
        make_usb();
        attach(device);
        const test::CommandResult why = run({"devices", "--why"});
        EXPECT_EQ(why.exit, 0);
        EXPECT_NE(why.out.find(device.way), std::string::npos) << why.out;
        EXPECT_NE(why.out.find("docs/device"), std::string::npos) << why.out;
        EXPECT_NE(why.out.find("not with this"), std::string::npos) << why.out;
        EXPECT_EQ(why.out.find("no haptic device"), std::string::npos) << why.out;
        EXPECT_NE(why.out.find("palpate trace SCENE --pace realtime"), std::string::npos);

        const auto json = nlohmann::json::parse(run({"devices", "--json"}).out);
        ASSERT_EQ(json["devices"].size(), 1u);
        EXPECT_EQ(json["devices"][0]["kind"], "foreign");
        EXPECT_EQ(json["devices"][0]["findings"][0]["remedy"].get<std::string>().find(device.way) ==
                      std::string::npos,
                  false);

        const test::CommandResult trace =
            run({"trace", "ball.toml", "--pace", "realtime", "--seconds", "1", "--device",
                 std::string("hid:") + device.called});
        EXPECT_EQ(trace.exit, 4) << trace.err;
        EXPECT_NE(trace.err.find("usb 1-4 is a "), std::string::npos) << trace.err;
        EXPECT_NE(trace.err.find(device.way), std::string::npos) << trace.err;
        std::filesystem::remove_all(folder() / "root");
    }
}

} // namespace
} // namespace palpate
