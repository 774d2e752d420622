// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include <palpate/engine/loop/frame_report.h>
#include <palpate/geometry/surface_scene.h>

namespace palpate {

/// From where a picture is taken.
struct PictureView {
    Vec3 towards{0.0, 1.0, 0.0}; ///< viewing direction, scene frame; (0,1,0) looks at a face
    Vec3 up{0.0, 0.0, 1.0};      ///< scene frame, of any length > 0, not along `towards`
    int width = 900;             ///< pixels, [16, 8192]
    int height = 900;            ///< pixels, [16, 8192]
};

/// A shaded picture of a surface with the proxy's path on it, coloured by force (parallel
/// projection, fitted to the bounds); parts of the path behind the surface are hidden, free motion
/// is thin and grey. PNG bytes.             [setup]
std::string render_png(const SurfaceScene& surface, std::span<const FrameReport> frames,
                       const PictureView& view);

} // namespace palpate
