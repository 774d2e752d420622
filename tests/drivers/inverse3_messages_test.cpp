// SPDX-License-Identifier: Apache-2.0
// Bytes of Haply's Inverse Service, as its documents have them, and what damage does to them.
#include <palpate/drivers/internal/inverse3_messages.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace palpate::internal {
namespace {

using Fault = ServiceReading::Fault;

/// "Initial inventory" of the page on the WebSocket protocol of 3.5, shortened.
constexpr const char* kFirst35 = R"({
  "session_id": 7,
  "inverse3": [{
    "device_id": "049D",
    "config": {"type": "inverse3", "port": "COM12", "handedness": "left", "preset": "defaults",
               "basis": {"permutation": "XYZ"}, "filters": {"force_gate": {"gain": 0.3}}},
    "state": {"cursor_position": {"x": 0.0, "y": -0.12, "z": 0.15},
              "cursor_velocity": {"x": 0.0, "y": 0.0, "z": 0.0},
              "current_cursor_force": {"x": 0.0, "y": 0.0, "z": 0.0}, "control_mode": "idle"},
    "status": {"calibrated": true, "in_use": false, "power_supply": true, "ready": true}}],
  "verse_grip": [], "wireless_verse_grip": [{"device_id": "61576", "state": {}}]})";

/// A state of 3.1, as a program that was written for it notes it down.
constexpr const char* kState31 =
    R"({"inverse3":[{"device_id":"04EA","state":{"angular_position":{"a0":-30.9,"a1":53.8,"a2":-6.6},)"
    R"("body_orientation":{"w":0.698,"x":0.0014,"y":0.715,"z":0.0024},"control_mode":"idle",)"
    R"("current_cursor_force":{"x":0,"y":0,"z":0},)"
    R"("cursor_position":{"x":0.10428079,"y":-0.03648221,"z":-0.06100729},)"
    R"("cursor_velocity":{"x":0.5,"y":0.25,"z":-1}},)"
    R"("status":{"calibrated":true,"in_use":false,"power_supply":true,"ready":true,"started":true}}],)"
    R"("wireless_verse_grip":[{"device_id":"61576","state":)"
    R"({"orientation":{"w":0.6,"x":0.8,"y":0.0,"z":0.0},"buttons":{"a":true,"b":false,"c":true}}}],)"
    R"("verse_grip":[{"device_id":"7","state":{"button":true,"hall":1,)"
    R"("orientation":{"w":0.71655273,"x":0.19647217,"y":0.6290283,"z":-0.22833252}}}]})";

/// A state of one device with this in place of its position.
std::string state_at(const std::string& position) {
    return R"({"inverse3":[{"device_id":"A","state":{"cursor_position":)" + position + "}}]}";
}

TEST(Inverse3Messages, TheServicesRightForwardUpBecomesTowardsRightUp) {
    EXPECT_EQ(from_service(Vec3(1, 0, 0)), Vec3(0, 1, 0)) << "right is y";
    EXPECT_EQ(from_service(Vec3(0, 1, 0)), Vec3(-1, 0, 0)) << "forward is away from the user";
    EXPECT_EQ(from_service(Vec3(0, 0, 1)), Vec3(0, 0, 1));
    const Vec3 a(0.1, -0.2, 0.3), b(-0.4, 0.5, 0.6);
    EXPECT_EQ(to_service(from_service(a)), a);
    EXPECT_EQ(glm::cross(from_service(a), from_service(b)), from_service(glm::cross(a, b)))
        << "right-handed stays right-handed; only signs and places change, so it is exact";
}

TEST(Inverse3Messages, ATurnTurnsTheSameVectorsInBothFrames) {
    std::mt19937 random(7);
    std::normal_distribution<double> any;
    for (int i = 0; i < 100; ++i) {
        const Quaternion turn =
            glm::normalize(Quaternion(any(random), any(random), any(random), any(random)));
        const Vec3 v(any(random), any(random), any(random));
        const Vec3 there = from_service(turn * v);
        const Vec3 here = from_service(turn) * from_service(v);
        EXPECT_LT(glm::length(there - here), 1e-14 * (1.0 + glm::length(v)))
            << "some tens of roundings";
    }
}

TEST(Inverse3Messages, TheFirstMessageTellsDevicesGripsAndHowForcesAreSpelled) {
    const auto said = inventory_in(kFirst35);
    ASSERT_TRUE(said);
    ASSERT_EQ(said->devices.size(), 1u);
    EXPECT_EQ(said->devices[0].id, "049D");
    EXPECT_EQ(said->devices[0].type, "inverse3");
    EXPECT_EQ(said->devices[0].handedness, "left");
    EXPECT_TRUE(said->devices[0].is_calibrated);
    EXPECT_EQ(said->grips, std::vector<std::string>{"61576"});
    EXPECT_EQ(said->key, ForceKey::vector);
    const auto old = inventory_in(kState31);
    ASSERT_TRUE(old);
    EXPECT_EQ(old->key, ForceKey::values);
    EXPECT_EQ(old->grips.size(), 2u);
}

TEST(Inverse3Messages, WhatIsNoFirstMessageIsNone) {
    for (const char* text : {"", "null", "[]", "7", "{}", "{\"inverse3\":{}}", "{\"inverse3\":[",
                             "{\"devices\":[]}", "\"inverse3\""})
        EXPECT_FALSE(inventory_in(text)) << text;
    const auto odd = inventory_in(
        R"({"inverse3":[{"device_id":"a\"b"},{"device_id":5},{},7,{"device_id":""},)"
        R"({"device_id":"B","status":{"calibrated":false,"power_supply":false,"in_use":true}}]})");
    ASSERT_TRUE(odd);
    ASSERT_EQ(odd->devices.size(), 1u) << "an id that would need quoting is no id";
    EXPECT_FALSE(odd->devices[0].is_calibrated);
    EXPECT_FALSE(odd->devices[0].has_power);
    EXPECT_TRUE(odd->devices[0].is_in_use);
}

TEST(Inverse3Messages, AStateIsReadInTheDeviceFrame) {
    const ServiceReading said = reading_in(kState31, "04EA", "61576");
    EXPECT_EQ(said.fault, Fault::none);
    EXPECT_EQ(said.state.position, Vec3(0.03648221, 0.10428079, -0.06100729));
    EXPECT_EQ(said.state.velocity, Vec3(-0.25, 0.5, -1.0));
    EXPECT_EQ(said.state.buttons, 0b101u);
    const Quaternion& q = said.state.orientation; // about right: y of the device frame
    EXPECT_NEAR(q.w, 0.6, 1e-15);
    EXPECT_NEAR(q.y, 0.8, 1e-15);
    ASSERT_TRUE(said.force_echo);
    EXPECT_EQ(*said.force_echo, Vec3(0.0));
    EXPECT_EQ(reading_in(kState31, "04EA", "7").state.buttons, 1u) << "with a wire there is one";
    EXPECT_EQ(reading_in(kState31, "04EA", "8").fault, Fault::none) << "a grip is no condition";
    EXPECT_EQ(reading_in(kState31, "04EA", "").state.buttons, 0u);
}

TEST(Inverse3Messages, EachFaultOfAStateIsNamed) {
    EXPECT_EQ(reading_in("{", "A", "").fault, Fault::unreadable);
    EXPECT_EQ(reading_in("[]", "A", "").fault, Fault::unreadable);
    EXPECT_EQ(reading_in("{\"inverse3\":[]}", "A", "").fault, Fault::not_there);
    EXPECT_EQ(reading_in(kState31, "04EB", "").fault, Fault::not_there);
    EXPECT_EQ(reading_in(R"({"inverse3":[{"device_id":"A"},{"device_id":"A"}]})", "A", "").fault,
              Fault::not_there)
        << "of two with one id nobody knows which it is";
    for (const char* position :
         {"{}", "null", "[0,0,0]", "{\"x\":0,\"y\":0}", "{\"x\":0,\"y\":0,\"z\":null}",
          "{\"x\":\"0\",\"y\":0,\"z\":0}", "{\"x\":1.1,\"y\":0,\"z\":0}",
          "{\"x\":1e300,\"y\":1e300,\"z\":0}", "{\"x\":true,\"y\":0,\"z\":0}"})
        EXPECT_EQ(reading_in(state_at(position), "A", "").fault, Fault::out_of_range) << position;
    for (const char* position : {"{\"x\":NaN,\"y\":0,\"z\":0}", "{\"x\":Infinity,\"y\":0,\"z\":0}",
                                 "{\"x\":1e999,\"y\":0,\"z\":0}"})
        EXPECT_EQ(reading_in(state_at(position), "A", "").fault, Fault::unreadable)
            << "JSON has no such numbers: " << position;
    EXPECT_EQ(reading_in(R"({"inverse3":[{"device_id":"A","state":{"cursor_position":)"
                         R"({"x":0,"y":0,"z":0},"cursor_velocity":{"x":51,"y":0,"z":0}}}]})",
                         "A", "")
                  .fault,
              Fault::out_of_range);
    EXPECT_EQ(reading_in(R"({"inverse3":[{"device_id":"A","status":{"calibrated":false},)"
                         R"("state":{"cursor_position":{"x":0,"y":0,"z":0}}}]})",
                         "A", "")
                  .fault,
              Fault::uncalibrated);
    EXPECT_EQ(reading_in(state_at("{\"x\":0.1,\"y\":0.2,\"z\":0}"), "A", "").fault, Fault::none);
}

TEST(Inverse3Messages, AGripThatSaysNonsenseLeavesTheIdentityAndNoButton) {
    for (const char* said :
         {"{}", "null", "[]", R"({"orientation":{"w":0,"x":0,"y":0,"z":0}})",
          R"({"orientation":{"w":1,"x":1,"y":1,"z":1}})", R"({"orientation":{"w":"1"}})",
          R"({"buttons":{"a":1,"b":"down","c":null},"button":1})"}) {
        const ServiceReading reading = reading_in(
            R"({"inverse3":[{"device_id":"A","state":{"cursor_position":{"x":0,"y":0,"z":0}}}],)"
            R"("verse_grip":[{"device_id":"G","state":)" +
                std::string(said) + "}]}",
            "A", "G");
        EXPECT_EQ(reading.fault, Fault::none) << said;
        EXPECT_EQ(reading.state.orientation, Quaternion(1, 0, 0, 0)) << said;
        EXPECT_EQ(reading.state.buttons, 0u) << said;
    }
}

TEST(Inverse3Messages, AForceIsSpelledAsItsVersionHasIt) {
    EXPECT_EQ(force_command("049D", ForceKey::vector, Vec3(-1.5, 0.25, 2.0)),
              R"({"inverse3":[{"device_id":"049D","commands":{"set_cursor_force":)"
              R"({"vector":{"x":0.25,"y":1.5,"z":2}}}}]})");
    EXPECT_EQ(force_command("049D", ForceKey::values, Vec3(0.0)),
              R"({"inverse3":[{"device_id":"049D","commands":{"set_cursor_force":)"
              R"({"values":{"x":0,"y":0,"z":0}}}}]})");
    for (const double bad :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        const std::string sent = force_command("A", ForceKey::vector, Vec3(1.0, bad, 1.0));
        EXPECT_NE(sent.find(R"({"x":0,"y":0,"z":0})"), std::string::npos) << sent;
    }
}

TEST(Inverse3Messages, OnlyA35ServiceIsGreetedWithSettings) {
    EXPECT_EQ(greeting(*inventory_in(kState31), "04EA"), "");
    EXPECT_EQ(greeting(*inventory_in(kFirst35), "049D"),
              R"({"session":{"configure":{"profile":{"name":"palpate"},)"
              R"("basis":{"permutation":"XYZ"}}},"inverse3":[{"device_id":"049D",)"
              R"("configure":{"preset":{"preset":"defaults"}}}]})");
}

TEST(Inverse3Messages, WhateverIsDamagedIsReadToTheEndAndNeverBeyondAnArm) {
    std::mt19937 random(20260807);
    const std::string whole = kState31;
    int readable = 0;
    const auto check = [&](const std::string& text) {
        const ServiceReading said = reading_in(text, "04EA", "61576");
        if (said.fault != Fault::none) return;
        ++readable;
        EXPECT_TRUE(is_finite(said.state.position) && is_finite(said.state.velocity));
        EXPECT_LE(glm::length(said.state.position), kFarthestReach_m);
        EXPECT_NEAR(glm::length(said.state.orientation), 1.0, 1e-12);
    };
    for (std::size_t length = 0; length < whole.size(); ++length) {
        EXPECT_EQ(reading_in(whole.substr(0, length), "04EA", "").fault, Fault::unreadable);
        inventory_in(whole.substr(0, length));
    }
    for (int i = 0; i < 5000; ++i) {
        std::string text = whole;
        for (int damages = 1 + static_cast<int>(random() % 4); damages > 0; --damages)
            text[random() % text.size()] = static_cast<char>(random() % 256);
        check(text);
        inventory_in(text);
    }
    EXPECT_GT(readable, 100) << "a digit or a name that nobody reads";
    // As deep as a message may be: read without recursion.
    std::string deep(100'000, '[');
    EXPECT_EQ(reading_in(deep, "A", "").fault, Fault::unreadable);
    deep = "{\"inverse3\":" + deep + std::string(100'000, ']') + "}";
    EXPECT_EQ(reading_in(deep, "A", "").fault, Fault::not_there);
}

} // namespace
} // namespace palpate::internal
