// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <palpate/engine/scene/scene_description.h>

#include "tests/support/test_meshes.h"

namespace palpate::test {

/// The ball of 20 mm with any contact: its mesh, and its formula.
inline SceneDescription ball_of(ContactKind contact, double strength_n, bool moves = false) {
    SceneDescription scene;
    static const auto mesh = std::make_shared<const TriangleMesh>(test::icosphere(0.02, 4));
    SurfaceDescription& surface = scene.surfaces["ball"];
    surface.contact = contact;
    surface.triangle_mesh = contact == ContactKind::volume ? nullptr : mesh;
    surface.strength_n = strength_n;
    surface.moves = moves;
    if (contact != ContactKind::mesh) {
        surface.volume = "v";
        scene.volumes["v"].analytic = "solid_sphere";
        scene.volumes["v"].parameters["radius_mm"] = 20.0;
    }
    scene.effects.push_back(effects::Surface{.surface = "ball"});
    return scene;
}

} // namespace palpate::test
