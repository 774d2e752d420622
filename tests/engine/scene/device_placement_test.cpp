// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/device_placement.h>

#include <bit>
#include <cstdint>
#include <limits>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

namespace palpate {
namespace {

constexpr std::array<PatientSide, 6> kSides{PatientSide::left,     PatientSide::right,
                                            PatientSide::anterior, PatientSide::posterior,
                                            PatientSide::superior, PatientSide::inferior};

/// Every way in which a device can stand, moved and scaled.
std::vector<DevicePlacementSettings> all_settings() {
    std::vector<DevicePlacementSettings> all;
    for (const PatientSide right : kSides)
        for (const PatientSide up : kSides)
            if (!along_one_line(right, up))
                for (const double scale : {0.01, 1.0, 2.5, 100.0})
                    all.push_back({right, up, Vec3{0.1, -0.2, 0.3}, scale});
    return all;
}

TEST(DevicePlacement, IdentityKeepsEveryBit) {
    DeviceState state;
    state.position = {-0.0, std::numeric_limits<double>::quiet_NaN(), 1e-310};
    state.velocity = {std::numeric_limits<double>::infinity(), -0.0, 3.0};
    state.orientation = {-0.0, 1.0, -0.0, 0.0};
    const DevicePlacement placement;
    const DeviceState placed = placement.to_scene(state);
    for (int i = 0; i < 3; ++i) {
        EXPECT_EQ(std::bit_cast<std::uint64_t>(placed.position[i]),
                  std::bit_cast<std::uint64_t>(state.position[i]));
        EXPECT_EQ(std::bit_cast<std::uint64_t>(placed.velocity[i]),
                  std::bit_cast<std::uint64_t>(state.velocity[i]));
        EXPECT_EQ(std::bit_cast<std::uint64_t>(placement.to_device(state.position)[i]),
                  std::bit_cast<std::uint64_t>(state.position[i]));
    }
    EXPECT_EQ(std::bit_cast<std::uint64_t>(placed.orientation.w),
              std::bit_cast<std::uint64_t>(state.orientation.w));
}

TEST(DevicePlacement, DirectionsGoWhereTheyAreSaidTo) {
    // A device that looks at a patient who stands opposite; y is its right, z up, x to the user.
    const DevicePlacement opposite(DevicePlacementSettings{});
    const auto placed = [&](const Vec3& position) {
        DeviceState state;
        state.position = position;
        return opposite.to_scene(state).position;
    };
    EXPECT_EQ(placed({0, 1, 0}), Vec3(1, 0, 0)) << "right is the patient's left, LPS +x";
    EXPECT_EQ(placed({0, 0, 1}), Vec3(0, 0, 1)) << "up is superior";
    EXPECT_EQ(placed({1, 0, 0}), Vec3(0, -1, 0)) << "towards the user is anterior";
    EXPECT_EQ(opposite.in_words(),
              "device right = patient left, up = patient superior, towards the user = patient "
              "anterior; its origin at [0, 0, 0] mm; 1 mm of the device = 1 mm of the scene");
}

// The axes are turned exactly, as R has nothing but 0 and 1; only the scale and the origin round.
TEST(DevicePlacement, APushOfTheSceneIsAPushOfTheDeviceInTheSameDirection) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> number(-1.0, 1.0);
    for (const DevicePlacementSettings& settings : all_settings()) {
        const DevicePlacement placement(settings);
        DeviceState state;
        state.velocity = {number(random), number(random), number(random)};
        const Vec3 force{number(random), number(random), number(random)};
        const Vec3 v_scene = placement.to_scene(state).velocity;
        const Vec3 f_device = placement.to_device(force);
        EXPECT_DOUBLE_EQ(glm::length(f_device), glm::length(force)) << "newtons stay newtons";
        // Power at the hand is 1/s of the scene's; a few roundings of terms below 1.
        EXPECT_NEAR(glm::dot(f_device, state.velocity) * settings.scale, glm::dot(force, v_scene),
                    1e-15 * 8 * settings.scale);
    }
}

TEST(DevicePlacement, MovingAStateMovesPositionVelocityAndOrientationAlike) {
    for (const DevicePlacementSettings& settings : all_settings()) {
        const DevicePlacement placement(settings);
        const auto placed = [&](const Vec3& position) {
            DeviceState state;
            state.position = position;
            return placement.to_scene(state).position;
        };
        EXPECT_EQ(placed(Vec3{0.0}), settings.origin_m);
        EXPECT_LT(
            glm::length(placed(placement.place_in_device({0.1, 0.2, 0.3})) - Vec3(0.1, 0.2, 0.3)),
            1e-15);
        const Vec3 from{0.01, -0.02, 0.03};
        const Vec3 velocity{0.5, 0.25, -0.125};
        DeviceState state;
        state.position = from;
        state.velocity = velocity;
        const DeviceState in_scene = placement.to_scene(state);
        // One second later; the scene is at most 100 m wide here.
        EXPECT_LT(glm::length(placed(from + velocity) - (in_scene.position + in_scene.velocity)),
                  1e-13);
        // The handle's own x axis points where the device's x axis goes.
        const Vec3 axis = in_scene.orientation * Vec3{1, 0, 0};
        const Vec3 moved = placed(Vec3{1, 0, 0}) - settings.origin_m;
        EXPECT_LT(glm::length(axis - moved / settings.scale), 1e-13);
    }
}

TEST(DevicePlacement, WhatADeviceDeclaresIsMetInTheScene) {
    DeviceProperties device;
    device.name = "arm";
    device.force_n = 8.0;
    device.stiffness_n_per_m = 2000.0;
    device.damping_n_s_per_m = 0.4;
    device.position_step_m = 30e-6;
    device.workspace_m = Box{{-0.1, -0.2, -0.3}, {0.1, 0.2, 0.3}};
    const DevicePlacement placement(
        {PatientSide::left, PatientSide::superior, Vec3{0.0, 0.0, 1.0}, 2.0});
    const DeviceProperties placed = placement.to_scene(device);
    EXPECT_EQ(placed.force_n, 8.0);
    EXPECT_EQ(placed.stiffness_n_per_m, 1000.0) << "1000 N/m of the scene are 2000 at the hand";
    EXPECT_EQ(placed.damping_n_s_per_m, 0.2);
    EXPECT_EQ(placed.position_step_m, 60e-6);
    EXPECT_EQ(placed.scale, 2.0);
    EXPECT_EQ(placed.workspace_m.lower, Vec3(-0.4, -0.2, 0.4));
    EXPECT_EQ(placed.workspace_m.upper, Vec3(0.4, 0.2, 1.6));
    device.workspace_m = Box{};
    EXPECT_TRUE(placement.to_scene(device).workspace_m.empty()) << "anywhere stays anywhere";
}

TEST(DevicePlacement, WhatIsNoPlacementIsRefused) {
    for (const PatientSide right : kSides)
        for (const PatientSide up : kSides)
            if (along_one_line(right, up)) {
                EXPECT_THROW(DevicePlacement({right, up, Vec3{0.0}, 1.0}), std::invalid_argument);
            }
    for (const double scale : {0.0, -1.0, 0.0099, 101.0, std::numeric_limits<double>::quiet_NaN()})
        EXPECT_THROW(DevicePlacement({PatientSide::left, PatientSide::superior, Vec3{0.0}, scale}),
                     std::invalid_argument)
            << scale;
    EXPECT_THROW(DevicePlacement({PatientSide::left, PatientSide::superior,
                                  Vec3{std::numeric_limits<double>::infinity()}, 1.0}),
                 std::invalid_argument);
}

} // namespace
} // namespace palpate
