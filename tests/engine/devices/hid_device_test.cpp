// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/devices/hid_device.h>

#include <stdexcept>

#include <gtest/gtest.h>

#include <palpate/drivers/pid_device.h>
#include <palpate/drivers/space_mouse.h>
#include <palpate/drivers/wooden_device.h>

namespace {

using namespace palpate;

const std::vector<AttachedDevice> kAttached = {
    {"/dev/hidraw1", 0x256F, 0xC635, "SpaceMouse Compact", AttachedKind::space_mouse, {}},
    {"/dev/hidraw2", 0x1209, 0xFFB0, "OpenFFBoard", AttachedKind::force_feedback, {}},
    {"/dev/hidraw3", 0x1234, 0x0006, "board", AttachedKind::wooden_haptics, {}},
};

template <typename Kind>
bool is(const std::string& address) {
    return dynamic_cast<const Kind*>(make_hid_device(address, kAttached).get()) != nullptr;
}

TEST(HidDevice, AddressesMakeTheDevicesTheyMean) {
    EXPECT_TRUE(is<SpaceMouseDevice>("spacemouse"));
    EXPECT_TRUE(is<SpaceMouseDevice>("/dev/hidraw1"));
    EXPECT_TRUE(is<PidDevice>("forcefeedback"));
    EXPECT_TRUE(is<PidDevice>("/dev/hidraw2"));
    EXPECT_TRUE(is<WoodenDevice>("wooden:woodenhaptics_v2015"));
    EXPECT_TRUE(is<WoodenDevice>("/dev/hidraw3:polhem_v3"));
    EXPECT_EQ(make_hid_device("wooden:vintage", kAttached)->properties().name, "vintage");
}

TEST(HidDevice, WhatIsMissingOrTooMuchIsSaid) {
    const auto refused = [](const std::string& address, const char* part) {
        try {
            make_hid_device(address, kAttached);
            ADD_FAILURE() << "taken: " << address;
        } catch (const std::runtime_error& error) {
            EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
        }
    };
    refused("wooden", "/dev/hidraw3: which build of the WoodenHaptics family it is");
    refused("wooden", "one of aluhaptics_v2, default_woody");
    refused("wooden:", "give hid:wooden:MODEL");
    refused("wooden:oaken", "oaken");
    refused("spacemouse:polhem_v3", "SpaceMouse Compact is of no build; leave out");
    refused("/dev/hidraw9", "none is attached; plug it in");
}

// A space mouse that was named by its node was lost without a word: exit code 0.
TEST(HidDevice, AStickAloneMayRestHoweverItIsNamed) {
    for (const char* address :
         {"spacemouse", "/dev/hidraw1", "wooden:vintage", "/dev/hidraw3:polhem_v3"})
        EXPECT_FALSE(may_rest(*make_hid_device(address, kAttached))) << address;
    for (const char* address : {"forcefeedback", "/dev/hidraw2"})
        EXPECT_TRUE(may_rest(*make_hid_device(address, kAttached))) << address;
}

} // namespace
