// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <random>
#include <string>
#include <vector>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/haptics/effects/vector_follow.h>
#include <palpate/volume/fields/grid_vector_field.h>

#include "tests/support/mesh_text.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_meshes.h"

/// A scene with an effect of each kind, and hands that play with all of it.
namespace palpate::test {

/// Balls about the origin, one in the other: a membrane, a skin that is pushed along, a hard level
/// and a hard mesh; and every effect that needs no volume file.
inline std::shared_ptr<const Scene> one_of_each_scene() {
    static const TemporaryFolder folder;
    make_file(folder / "core.ply", ascii_ply(icosphere(24.0, 3)));
    std::string text = "[volume.stream]\nanalytic = \"helix\"\nradius_mm = 28\npitch_mm = 30\n";
    const auto ball = [&](const std::string& name, const std::string& radius_mm,
                          const std::string& keys) {
        text += "[volume." + name + "]\nanalytic = \"solid_sphere\"\nradius_mm = " + radius_mm +
                "\n[surface." + name + "]\nvolume = \"" + name + "\"\niso_value = 0\n" + keys;
    };
    ball("membrane", "30", "strength_n = 0.7\nyield = \"opens\"\n");
    ball("skin", "29", "strength_volume = \"membrane\"\nstrength_n = [[0, 0.8], [0.01, 1.2]]\n");
    ball("level", "26", "");
    text += "[surface.mesh]\nmesh = \"core.ply\"\nmesh_unit = \"mm\"\nmesh_frame = \"LPS\"\n";
    for (const char* surface : {"membrane", "skin", "level", "mesh"})
        text += "[[effect]]\ntype = \"surface\"\nsurface = \"" + std::string(surface) + "\"\n";
    for (const char* effect : {"gradient_force", "gradient_surface"})
        text += "[[effect]]\ntype = \"" + std::string(effect) +
                "\"\nvolume = \"level\"\nstrength_n = 0.3\n";
    for (const char* effect : {"vector_force", "vector_follow", "front_shape", "vortex"})
        text += "[[effect]]\ntype = \"" + std::string(effect) +
                "\"\nvolume = \"stream\"\nstrength_n = 0.3\n";
    text +=
        "[[effect]]\ntype = \"viscosity\"\ndamping_n_s_per_m = 1\n"
        "[[effect]]\ntype = \"constant_force\"\nforce_n = [0.1, 0.2, -0.2]\n"
        "[[effect]]\ntype = \"friction\"\nsurface = [\"skin\", \"mesh\"]\nstatic = 0.4\ndynamic "
        "= 0.3\n"
        "[[effect]]\ntype = \"stick_slip\"\nsurface = \"level\"\nstatic = 0.5\ndynamic = 0.2\n"
        "[[effect]]\ntype = \"magnet\"\nsurface = [\"level\", \"mesh\"]\nstrength_n = 0.4\n"
        "[[effect]]\ntype = \"texture\"\nsurface = [\"skin\", \"level\"]\nwavelength_mm = 3\n"
        "height_mm = 0.2\n"
        "[[effect]]\ntype = \"texture\"\nsurface = \"membrane\"\nvolume = \"level\"\n"
        "height_mm = [[-0.01, 0], [0, 0.2]]\n"
        "[[effect]]\ntype = \"guide\"\npoints_mm = [[30, 0, 0], [0, 31, 3], [-30, 2, 0]]\n"
        "strength_n = 0.5\ncapture_mm = 5\n"
        "[[effect]]\ntype = \"guide\"\npoints_mm = [[0, -30, 0]]\nvolume = \"level\"\n"
        "strength_n = [[-0.01, 0.2], [0, 0.5]]\n"
        "capture_mm = 5\n"
        "[[effect]]\ntype = \"workspace\"\nradius_mm = 31\ncenter_mm = [0, 0, 0]\n"
        "[[effect]]\ntype = \"workspace\"\nbox_mm = [[-28, -40, -40], [40, 40, 40]]\n"
        "strength_n = 1\n"
        "[[effect]]\ntype = \"vibration\"\n"
        "[[effect]]\ntype = \"gravity_compensation\"\nmass_kg = 0.05\ndown = [0, -1, 0]\n";
    return std::make_shared<const Scene>(parse_scene(text, folder / "one_of_each.toml"),
                                         SceneResources{.files = scene_files()});
}

/// What a scene would need a file for: fibres on a grid.
inline std::vector<std::unique_ptr<Effect>> fibres() {
    VectorVolume volume;
    volume.size = {2, 2, 2};
    volume.index_to_scene = {Mat3(0.08), Vec3(-0.04)};
    volume.values = {1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1, -1, 0, 0};
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(std::make_unique<VectorFollow>(
        std::make_shared<GridVectorField>(volume, VectorSense::axial),
        TransferFunction::constant(0.3)));
    return effects;
}

/// A probe that dips into the balls on its way round them.
inline Vec3 dipping(int frame) {
    const double angle = 0.002 * frame;
    const double radius = 0.026 + 0.006 * std::sin(0.013 * frame);
    return radius * glm::normalize(Vec3{std::cos(angle), std::sin(angle), std::sin(0.37 * angle)});
}

/// Every 50 frames, each effect is switched on or off, or to any strength.
inline void switch_at_random(HapticLoop& loop, int frame, std::mt19937_64& random) {
    if (frame % 50 != 0) return;
    for (std::size_t effect = 0; effect < loop.effect_count(); ++effect) {
        const double draw = std::uniform_real_distribution<double>(-1.0, 3.0)(random);
        loop.set_gain(effect, draw < 0.0 ? 0.0 : draw > 2.0 ? 1.0 : draw);
    }
}

} // namespace palpate::test
