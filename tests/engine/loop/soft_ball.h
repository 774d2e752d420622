// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_file.h>

/// A ball whose surface may be soft.
namespace palpate::test::soft_ball {

inline constexpr double kRadius = 50e-3;    // m
inline constexpr double kStiffness = 200.0; // N/m
inline constexpr double kCoupling = 500.0;  // N/m
inline const std::string kSoft = "stiffness_n_per_mm = 0.2\n";

inline std::shared_ptr<const Scene> ball(const std::string& keys, const std::string& more = "") {
    return std::make_shared<const Scene>(parse_scene(
        "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n[surface.liver]\nvolume = "
        "\"v\"\n" +
            keys + "[[effect]]\ntype = \"surface\"\nsurface = \"liver\"\n" + more,
        "ball.toml"));
}

} // namespace palpate::test::soft_ball
