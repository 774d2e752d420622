// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/internal/rate_control.h>
#include <palpate/drivers/internal/space_mouse_reports.h>

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

namespace {

using namespace palpate;
using namespace palpate::internal;

using Bytes = std::vector<std::uint8_t>;

TEST(SpaceMouseReports, WiredTranslationAndRotationComeApart) {
    SpaceMouseReading reading;
    // X = 350 right, Y = -175 away from the user, Z = 35 down.
    EXPECT_EQ(take_space_mouse_report(Bytes{0x01, 0x5E, 0x01, 0x51, 0xFF, 0x23, 0x00}, reading),
              SpaceMouseNews::motion);
    EXPECT_EQ(reading.deflection.push, Vec3(-0.5, 1.0, -0.1));
    EXPECT_EQ(reading.deflection.turn, Vec3(0.0));
    // Ry = -30: about the axis towards the user, which is our x.
    EXPECT_EQ(take_space_mouse_report(Bytes{0x02, 0x00, 0x00, 0xE2, 0xFF, 0x00, 0x00}, reading),
              SpaceMouseNews::motion);
    EXPECT_EQ(reading.deflection.turn, Vec3(-30.0 / 350.0, 0.0, 0.0));
    EXPECT_EQ(reading.deflection.push, Vec3(-0.5, 1.0, -0.1)) << "of the report before";
    take_space_mouse_report(Bytes{0x01, 0, 0, 0, 0, 0, 0}, reading);
    EXPECT_EQ(reading.deflection.push, Vec3(0.0));
}

TEST(SpaceMouseReports, ThirteenBytesCarryBoth) {
    SpaceMouseReading reading;
    EXPECT_EQ(take_space_mouse_report(Bytes{0x01, 0x5E, 0x01, 0, 0, 0, 0, 0, 0, 0, 0, 0xA2, 0xFE},
                                      reading),
              SpaceMouseNews::motion);
    EXPECT_EQ(reading.deflection.push, Vec3(0.0, 1.0, 0.0));
    EXPECT_EQ(reading.deflection.turn, Vec3(0.0, 0.0, 1.0)) << "Rz = -350 about down is + about up";
}

TEST(SpaceMouseReports, LengthDecidesAndNotWhatCameBefore) {
    SpaceMouseReading reading;
    take_space_mouse_report(Bytes{0x01, 0, 0, 0, 0, 0, 0, 0x5E, 0x01, 0, 0, 0, 0}, reading);
    take_space_mouse_report(Bytes{0x01, 0x5E, 0x01, 0, 0, 0, 0}, reading);
    EXPECT_EQ(reading.deflection.turn, Vec3(0.0, 1.0, 0.0)) << "a short one says nothing of turns";
    EXPECT_EQ(reading.deflection.push, Vec3(0.0, 1.0, 0.0));
}

TEST(SpaceMouseReports, CapsPushedBeyondTheRangeCountAsFullyDeflected) {
    SpaceMouseReading reading;
    take_space_mouse_report(Bytes{0x01, 0x90, 0x01, 0x00, 0x80, 0xFF, 0x7F}, reading);
    EXPECT_EQ(reading.deflection.push, Vec3(-1.0, 1.0, -1.0)) << "400, -32768, 32767";
}

TEST(SpaceMouseReports, ButtonsAreABitmapOrCodes) {
    SpaceMouseReading reading;
    EXPECT_EQ(take_space_mouse_report(Bytes{0x03, 0x01, 0x00}, reading), SpaceMouseNews::buttons);
    EXPECT_EQ(reading.buttons, 1u);
    take_space_mouse_report(Bytes{0x03, 0x03, 0x00}, reading);
    EXPECT_EQ(reading.buttons, 3u);
    take_space_mouse_report(Bytes{0x03, 0x00, 0x00, 0x40, 0x04, 0xFF, 0xFF}, reading); // ESC, 4.2
    EXPECT_EQ(reading.buttons, 1u << 22 | 1u << 26) << "what is beyond 32 buttons is left out";
    EXPECT_EQ(
        take_space_mouse_report(Bytes{0x1C, 0x02, 0x00, 0x20, 0x00, 0x21, 0x00, 0, 0}, reading),
        SpaceMouseNews::buttons);
    EXPECT_EQ(reading.buttons, 1u << 1 | 1u << 31);
}

TEST(SpaceMouseReports, WirelessOnesTellTheirBattery) {
    SpaceMouseReading reading;
    EXPECT_EQ(take_space_mouse_report(Bytes{0x17, 0x5A, 0x00}, reading), SpaceMouseNews::battery);
    EXPECT_EQ(reading.battery_percent, 90);
}

TEST(SpaceMouseReports, ShortAndUnknownReportsChangeNothing) {
    for (const Bytes& report :
         {Bytes{}, Bytes{0x01}, Bytes{0x03}, Bytes{0x01, 0x5E, 0x01, 0x5E, 0x01, 0x5E},
          Bytes{0x05, 1, 2, 3, 4, 5, 6}, Bytes{0x00, 1, 2, 3, 4, 5, 6}}) {
        SpaceMouseReading reading;
        EXPECT_EQ(take_space_mouse_report(report, reading), SpaceMouseNews::nothing);
        EXPECT_EQ(reading.deflection.push, Vec3(0.0));
        EXPECT_EQ(reading.buttons, 0u);
    }
}

TEST(SpaceMouseReports, WhateverComesTheDeflectionIsWithinOne) {
    std::mt19937 random(1);
    SpaceMouseReading reading;
    for (int round = 0; round < 100'000; ++round) {
        Bytes report(random() % 20);
        for (std::uint8_t& byte : report)
            byte = static_cast<std::uint8_t>(random());
        if (!report.empty()) report[0] %= 32; // ids that mean something come often
        take_space_mouse_report(report, reading);
        for (int i = 0; i < 3; ++i) {
            ASSERT_LE(std::abs(reading.deflection.push[i]), 1.0);
            ASSERT_LE(std::abs(reading.deflection.turn[i]), 1.0);
        }
    }
}

// ---------------------------------------------------------------------------------- rate control

constexpr double kStep = 0.001; // s

RateControlledProbe moved(const SpaceMouseSettings& settings, const SpaceMouseDeflection& by,
                          int steps) {
    RateControlledProbe probe(settings);
    for (int i = 0; i < steps; ++i)
        probe.advance(by, kStep);
    return probe;
}

TEST(RateControl, AFullPushMovesAtTheSetSpeed) {
    const RateControlledProbe probe = moved({}, {{0.0, 1.0, 0.0}, {}}, 500);
    // 500 additions, each off by at most half a unit in the last place of 0.05.
    EXPECT_NEAR(probe.position().y, 0.05, 500 * 0.05 * 1.2e-16);
    EXPECT_NEAR(probe.velocity().y, 0.1, 1e-12) << "a difference of places by 1 ms: 1e-17 / 1e-3";
    EXPECT_EQ(probe.position().x, 0.0);
}

TEST(RateControl, InTheDeadZoneNothingMovesAndBeyondItBeginsWithoutAStep) {
    SpaceMouseSettings settings;
    settings.dead_zone = 0.2;
    EXPECT_EQ(moved(settings, {{0.2, -0.2, 0.2}, {}}, 100).position(), Vec3(0.0));
    EXPECT_FALSE(RateControlledProbe(settings).moved_by({{0.2, -0.2, 0.2}, {}}));
    const RateControlledProbe barely = moved(settings, {{0.2 + 1e-6, 0.0, 0.0}, {}}, 1);
    EXPECT_GT(barely.velocity().x, 0.0);
    EXPECT_LT(barely.velocity().x, 1e-6) << "0.1 m/s * 1e-6 / 0.8, not a jump";
    EXPECT_NEAR(moved(settings, {{0.6, 0.0, 0.0}, {}}, 1).velocity().x, 0.05, 1e-12);
}

TEST(RateControl, AskewTheSpeedIsTheSame) {
    const RateControlledProbe probe = moved({}, {Vec3(1.0, -1.0, 1.0), {}}, 1);
    EXPECT_NEAR(glm::length(probe.velocity()), 0.1, 1e-12);
}

TEST(RateControl, AtASideOfTheBoxItSlidesAndItsSpeedIsWhatItMoves) {
    SpaceMouseSettings settings;
    settings.workspace_m = {Vec3(-0.01), Vec3(0.01, 1.0, 1.0)};
    const RateControlledProbe probe = moved(settings, {{1.0, 1.0, 0.0}, {}}, 1000);
    EXPECT_EQ(probe.position().x, 0.01);
    EXPECT_EQ(probe.velocity().x, 0.0);
    EXPECT_GT(probe.velocity().y, 0.05);
}

TEST(RateControl, APauseOfTheProgramIsNoJump) {
    RateControlledProbe probe{SpaceMouseSettings{}};
    probe.advance({{1.0, 0.0, 0.0}, {}}, 10.0);
    EXPECT_NEAR(probe.position().x, 0.1 * 0.05, 1e-15);
    probe.advance({{1.0, 0.0, 0.0}, {}}, -1.0);
    EXPECT_NEAR(probe.position().x, 0.1 * 0.05, 1e-15) << "time does not run backwards";
    EXPECT_EQ(probe.velocity(), Vec3(0.0));
}

TEST(RateControl, TurnsOnlyWhereAskedAndStaysARotation) {
    const SpaceMouseDeflection turn{{}, {0.0, 0.0, 1.0}};
    EXPECT_EQ(moved({}, turn, 1000).orientation(), Quaternion(1.0, 0.0, 0.0, 0.0));
    EXPECT_FALSE(RateControlledProbe(SpaceMouseSettings{}).moved_by(turn));
    SpaceMouseSettings settings;
    settings.turn_rad_per_s = std::numbers::pi / 2.0;
    const Quaternion quarter = moved(settings, turn, 1000).orientation();
    const double half = std::sqrt(0.5);
    // A thousand products and normalisations, a few rounding errors each.
    EXPECT_NEAR(quarter.w, half, 1e-12);
    EXPECT_NEAR(quarter.z, half, 1e-12);
    EXPECT_NEAR(glm::length(quarter), 1.0, 1e-15);
}

TEST(RateControl, WrongSettingsAreRefusedByName) {
    const auto refused = [](auto change, const char* name) {
        SpaceMouseSettings settings;
        change(settings);
        try {
            RateControlledProbe probe(settings);
            ADD_FAILURE() << "taken: " << name;
        } catch (const std::invalid_argument& error) {
            EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
        }
    };
    refused([](auto& s) { s.speed_m_per_s = 0.0; }, "speed_m_per_s");
    refused([](auto& s) { s.turn_rad_per_s = -1.0; }, "turn_rad_per_s");
    refused([](auto& s) { s.dead_zone = 1.0; }, "dead_zone");
    refused([](auto& s) { s.silence_s = 0.0; }, "silence_s");
    refused([](auto& s) { s.reconnect_s = 1e9; }, "reconnect_s");
    refused([](auto& s) { s.workspace_m = {}; }, "workspace_m");
}

} // namespace
