// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/devices/orbit.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/volume/formats/volume_file.h>

#include "tests/support/mesh_text.h"
#include "tests/support/scripted_clock.h"
#include "tests/support/test_meshes.h"
#include "tests/support/test_volumes.h"

namespace palpate::test {

inline constexpr double kRadius = 20e-3;        // m
inline constexpr double kHoleRadius = 2.5e-3;   // m, of the volume's bore hole along +z
inline const Vec3 kCenter{10e-3, -5e-3, 3e-3};  // m: neither axis may be mistaken for another
inline constexpr double kStiffness = 500.0;     // N/m, of the coupling where the scene says nothing
inline constexpr double kLevelTolerance = 1e-7; // m, of method adaptive

inline TriangleMesh ball() { return test::icosphere(kRadius, 4, kCenter); }

/// The largest sphere that is inside the ball's facets.
inline double inner_radius() {
    const TriangleMesh mesh = ball();
    double least = kRadius;
    for (const auto& t : mesh.triangles) {
        const Vec3& a = mesh.vertices[t[0]];
        least = std::min(least, glm::dot(a - kCenter, triangle_normal(a, mesh.vertices[t[1]],
                                                                      mesh.vertices[t[2]])));
    }
    return least;
}

/// In metres and RAS, which the file does not say.
inline std::string file_text(TriangleMesh mesh) {
    for (Vec3& p : mesh.vertices)
        p = {-p.x, -p.y, p.z};
    return test::ascii_ply(mesh);
}

/// 100 per mm around 500 on the sphere; a bore hole down to the middle that the mesh knows nothing
/// of.
inline VoxelVolume drilled_ball() {
    constexpr double spacing = 0.8e-3;
    const std::array<int, 3> size{60, 60, 60};
    const AffineTransform frame{Mat3(spacing), kCenter - Vec3(29.5 * spacing)};
    return test::sampled(size, frame, [](const Vec3& p) {
        const Vec3 q = p - kCenter;
        const double depth = kRadius - glm::length(q);
        const double from_hole =
            q.z > 0.0 ? std::hypot(q.x, q.y) - kHoleRadius : glm::length(q) - kHoleRadius;
        return 500.0 + 1e5 * std::clamp(std::min(depth, from_hole), -3e-3, 3e-3);
    });
}

inline DeviceState at(const Vec3& from_center, std::uint32_t trial = 0) {
    DeviceState state;
    state.position = kCenter + from_center;
    state.trial = trial;
    return state;
}

/// Down onto the ball's far side and along it, 2 mm deep.
inline std::vector<DeviceState> stroke() {
    std::vector<DeviceState> states;
    for (int i = 0; i <= 140; ++i)
        states.push_back(at({0.0, 0.0, -25e-3 + 0.05e-3 * i}));
    for (int i = 0; i < 500; ++i) {
        const double angle = 2e-3 * i;
        states.push_back(
            at(18e-3 * Vec3{std::sin(angle), 0.3 * std::sin(angle), -std::cos(angle)}));
    }
    return states;
}

/// Down the bore hole to 10 mm below the surface and out again, so many times.
inline std::vector<DeviceState> probing(int times) {
    std::vector<DeviceState> states;
    for (int time = 0; time < times; ++time)
        for (int i = -130; i <= 130; ++i)
            states.push_back(at({0.1e-3, 0.05e-3, 10e-3 + 0.1e-3 * std::abs(i)}));
    return states;
}

class MeshScene : public testing::Test {
protected:
    MeshScene() { test::make_file(folder_ / "ball.ply", file_text(ball())); }

    std::shared_ptr<const Scene> scene(const std::string& surface,
                                       const SceneResources& resources = {.files = scene_files()}) {
        if (surface.find("volume") != std::string::npos &&
            !std::filesystem::exists(folder_ / "ball.nrrd"))
            write_volume(drilled_ball(), folder_ / "ball.nrrd");
        const std::string volume = std::filesystem::exists(folder_ / "ball.nrrd")
                                       ? "[volume.ct]\nfile = \"ball.nrrd\"\n"
                                       : "";
        return std::make_shared<const Scene>(
            parse_scene(volume + "[surface.ball]\n" + surface +
                            "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n[limits]\n"
                            "force_n = 100\nslew_n_per_s = 1e6\n",
                        folder_ / "scene.toml"),
            resources);
    }
    std::string refusal(const std::string& surface) {
        try {
            scene(surface);
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return {};
    }

    test::TemporaryFolder folder_;
    test::ScriptedClock clock_;
    const std::string mesh_ = "mesh = \"ball.ply\"\nmesh_unit = \"m\"\nmesh_frame = \"RAS\"\n";
    const std::string both_ = "volume = \"ct\"\niso_value = 500\n" + mesh_;
};

} // namespace palpate::test
