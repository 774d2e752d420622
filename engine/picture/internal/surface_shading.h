// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include <palpate/engine/picture/internal/force_colors.h>
#include <palpate/engine/picture/internal/path_layer.h>
#include <palpate/geometry/surface_scene.h>

namespace palpate::internal {

/// From the scene to pixels: parallel projection along `forward`.
struct Camera {
    Vec3 right;
    Vec3 up;
    Vec3 forward;
    Vec3 center;    ///< m, of the surface's bounds: the middle of the picture
    double pixel_m; ///< m per pixel
    double
        half_depth_m; ///< m, from the centre to before the nearest and behind the farthest vertex
    int width;
    int height;

    /// Where the ray through a place in the picture starts, in front of everything.
    Vec3 ray_start(double x, double y) const noexcept {
        return center + right * ((x - 0.5 * width) * pixel_m) +
               up * ((0.5 * height - y) * pixel_m) - forward * half_depth_m;
    }
    PicturePoint project(const Vec3& p) const noexcept {
        const Vec3 q = p - center;
        return {0.5 * width + glm::dot(q, right) / pixel_m,
                0.5 * height - glm::dot(q, up) / pixel_m, glm::dot(q, forward) + half_depth_m};
    }
};

/// A camera that sees all of a mesh, with `margin` (share of the picture's size) around it. [setup]
/// `towards` and `up` must be finite, not zero and not parallel.
Camera fitted_camera(const TriangleMesh& mesh, const Vec3& towards, const Vec3& up, int width,
                     int height, double margin);

/// What is seen of a surface: colours (linear) and depths, row by row.
struct Shading {
    std::vector<std::array<float, 3>> colors;
    std::vector<float> depth_m; ///< of the farthest of a pixel's samples; infinity where one sees
                                ///< nothing
};

inline constexpr Color kBone{0.86, 0.73, 0.53}; // linear

/// How a surface looks.
struct SurfaceLook {
    /// Which side of it is seen: of free space alone, so that one sees into a cavity; or both, the
    /// inner one blue.
    enum class Sides { free_space, both };
    Sides sides = Sides::free_space;
    std::function<Color(const SurfaceHit&)> color; ///< linear; empty: bone. Called by many threads
};

/// Draws a surface with smooth normals, two by two samples a pixel, a light from above left.
class SurfacePainter {
public:
    explicit SurfacePainter(const SurfaceScene& surface); ///< the surface must outlive it  [setup]

    /// Deterministic, whatever the number of threads.                                   [setup]
    Shading paint(const Camera& camera, const SurfaceLook& look = {}) const;

private:
    const SurfaceScene& surface_;
    std::vector<Vec3> normals_; ///< of the vertices; unit, zero where there is none
};

/// Three bytes a pixel, sRGB: the surface with the lines over it.                      [setup]
std::vector<std::uint8_t> developed(const Shading& shading, const PathLayer& layer);

} // namespace palpate::internal
