// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/geometry/isosurface.h>

#include "tests/support/scripted_clock.h"
#include "tests/support/test_meshes.h"
#include "tests/support/test_volumes.h"

/// Scenes of a ball whose data lies in a file or in memory.
namespace palpate::test {

inline constexpr double kBall_m = 10e-3; // radius

/// 100 per mm about 500 at the surface, with noise; a crumb apart; some voxels are NaN or infinite.
inline VoxelVolume ball_voxels() {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> noise(-20.0, 20.0);
    VoxelVolume volume = sampled({30, 30, 30}, {Mat3(1e-3), Vec3(-14.5e-3)}, [&](const Vec3& p) {
        const double ball = kBall_m - glm::length(p);
        const double crumb = 1.5e-3 - glm::length(p - Vec3(12e-3));
        return 500.0 + std::clamp(1e5 * std::max(ball, crumb), -500.0, 500.0) + noise(random);
    });
    volume.values[volume.index(2, 3, 4)] = std::numeric_limits<float>::quiet_NaN();
    volume.values[volume.index(15, 15, 24)] = std::numeric_limits<float>::infinity();
    return volume;
}

/// The ball as it is extracted: near the level whatever is baked.
inline TriangleMesh ball_mesh() { return icosphere(kBall_m, 4); }

inline SceneResources ball_resources(const std::filesystem::path& cache = {}) {
    SceneResources resources{.files = scene_files(cache)};
    resources.extract = [](const Isosurface&, const IsosurfaceSettings&, const Progress&) {
        return ball_mesh();
    };
    return resources;
}

/// The surface "ball" of a volume "ct", felt.
inline SceneDescription ball_scene() {
    SceneDescription scene;
    SurfaceDescription& ball = scene.surfaces["ball"];
    ball.volume = "ct";
    ball.iso_value = 500.0;
    scene.effects.push_back(effects::Surface{.surface = "ball"});
    return scene;
}

/// Of a hand that presses 2 mm into the ball and goes around it.
inline std::vector<DeviceState> around_ball() {
    std::vector<DeviceState> inputs;
    for (int i = 0; i < 400; ++i) {
        DeviceState hand;
        hand.time_s = 1e-3 * i;
        const double angle = 5e-3 * std::max(i - 100, 0);
        const double radius_m = kBall_m + 2e-3 - 4e-5 * std::min(i, 100);
        hand.position =
            radius_m * Vec3(std::cos(angle), 0.6 * std::sin(angle), 0.8 * std::sin(angle));
        inputs.push_back(hand);
    }
    return inputs;
}

inline std::vector<FrameReport> frames_of(std::shared_ptr<const Scene> scene) {
    ScriptedClock clock;
    HapticLoop loop(std::move(scene), clock);
    std::vector<FrameReport> frames;
    for (const DeviceState& hand : around_ball())
        frames.push_back(loop.frame(hand));
    return frames;
}

} // namespace palpate::test
