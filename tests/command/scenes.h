// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <fmt/format.h>

namespace palpate::test {

/// A ball of 20 mm that a path in `probe` presses into.
inline std::string ball_scene(const std::string& probe = "probe.csv") {
    return "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n"
           "[surface.s]\nvolume = \"v\"\n[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n"
           "[device]\ntype = \"path\"\nfile = \"" +
           probe + "\"\n";
}

/// 200 frames at 1 kHz along x, from 22 mm to 18 mm from the middle, times `scale`.
inline std::string pressing_path(double scale = 1.0) {
    std::string text = "t_s,x_m,y_m,z_m\n";
    for (int i = 0; i < 200; ++i)
        text += fmt::format("{:.17g},{:.17g},0,0\n", 1e-3 * i, scale * (0.022 - 2e-5 * i));
    return text;
}

/// A generated CT, felt by its extracted mesh.
inline const std::string kPhantomScene =
    "[volume.ct]\nfile = \"phantom.nrrd\"\n"
    "[surface.bone]\nvolume = \"ct\"\niso_value = 226\nsmooth_voxels = 0.7\ncontact = \"mesh\"\n"
    "[[effect]]\ntype = \"surface\"\nsurface = \"bone\"\n"
    "[device]\ntype = \"orbit\"\nduration_s = 2\nturns = 3\n";

} // namespace palpate::test
