// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/study/study.h>

#include "tests/support/scripted_clock.h"

/// A cavity and a path behind its wall, for the tests of studies.
namespace palpate::test::study {

constexpr double kRadius_m = 0.05;
constexpr double kDepth_m = 2e-3;
constexpr std::size_t kFrames = 200;

inline const std::string kCavity = "[volume.v]\nanalytic = \"sphere_cavity\"\nradius_mm = 50\n";

/// Felt by its gradient alone, with a strength in N over the metres behind the wall.
inline std::shared_ptr<const Scene> gradient_cavity(const std::string& strength,
                                                    const std::string& loop = "") {
    return std::make_shared<const Scene>(parse_scene(
        kCavity + "[[effect]]\ntype = \"gradient_surface\"\nvolume = \"v\"\nstrength_n = " +
            strength + "\n" + loop,
        "cavity.toml"));
}
inline const std::string kHard = "[[-1e-9, 0], [0, 1e3]]";

inline std::shared_ptr<const Scene> surface_cavity() {
    return std::make_shared<const Scene>(parse_scene(
        kCavity + "[surface.s]\nvolume = \"v\"\n[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n",
        "cavity.toml"));
}

/// From the wall itself, so that nothing is overshot on arrival, or from a place in front of it, to
/// 2 mm behind it, and around at 0.2 m/s.
inline std::vector<DeviceState> along_the_wall(double in_front_m = 0.0) {
    std::vector<DeviceState> states(kFrames);
    for (std::size_t i = 0; i < kFrames; ++i) {
        const double depth = std::min(1e-4 * static_cast<double>(i) - in_front_m, kDepth_m);
        const double radius = kRadius_m + depth;
        const double angle = 0.2e-3 / (kRadius_m + kDepth_m) * static_cast<double>(i);
        states[i].time_s = 1e-3 * static_cast<double>(i);
        states[i].position = {radius * std::cos(angle), radius * std::sin(angle), 0.0};
    }
    return states;
}

inline LoopDescription fixed(int sub_steps) {
    LoopDescription loop;
    loop.method = SteppingMethod::fixed;
    loop.sub_steps = sub_steps;
    return loop;
}

inline Study study_of(std::shared_ptr<const Scene> scene,
                      const std::vector<LoopDescription>& settings, double in_front_m = 0.0) {
    test::ScriptedClock clock(1.0);
    return run_study(std::move(scene), along_the_wall(in_front_m), settings, clock);
}

/// A sphere of 8 * 4^splits facets, its vertices on the cavity's wall.
inline TriangleMesh ball(int splits) {
    TriangleMesh mesh;
    mesh.vertices = {{kRadius_m, 0, 0},  {-kRadius_m, 0, 0}, {0, kRadius_m, 0},
                     {0, -kRadius_m, 0}, {0, 0, kRadius_m},  {0, 0, -kRadius_m}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                      {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (int split = 0; split < splits; ++split) {
        std::map<std::array<std::uint32_t, 2>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [at, is_new] = middles.try_emplace(
                {std::min(a, b), std::max(a, b)}, static_cast<std::uint32_t>(mesh.vertices.size()));
            if (is_new)
                mesh.vertices.push_back(kRadius_m *
                                        glm::normalize(mesh.vertices[a] + mesh.vertices[b]));
            return at->second;
        };
        std::vector<std::array<std::uint32_t, 3>> finer;
        for (const auto& [a, b, c] : mesh.triangles) {
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            for (const std::array<std::uint32_t, 3>& facet :
                 {std::array{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}})
                finer.push_back(facet);
        }
        mesh.triangles = std::move(finer);
    }
    return mesh;
}

} // namespace palpate::test::study
