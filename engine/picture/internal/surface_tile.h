// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <palpate/engine/picture/internal/canvas.h>
#include <palpate/engine/picture/internal/surface_shading.h>

namespace palpate::internal {

/// From where a tile shows a surface.
struct SurfaceView {
    Vec3 towards; ///< viewing direction, scene frame
    Vec3 up;
};
inline constexpr SurfaceView kFromFront{{0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
inline constexpr SurfaceView kFromLeft{{-1.0, 0.0, 0.0}, {0.0, 0.0, 1.0}};
inline constexpr SurfaceView kFromAbove{{0.0, 0.0, -1.0}, {0.0, -1.0, 0.0}};
inline constexpr SurfaceView kFromFrontLeftAbove{{-0.6, 0.7, -0.4}, {0.0, 0.0, 1.0}};

/// Two vertices of a mesh.
using MeshEdge = std::array<std::uint32_t, 2>;

/// Edges that are open or not manifold: all but those of two triangles that run along them in
/// opposite directions. Triangles with a vertex twice do not count.                      [setup]
std::vector<MeshEdge> bad_edges(const TriangleMesh& mesh);

/// Draws a surface as a tile of `size` pixels with the patient's directions: letters at its edges
/// for a view along an axis, else a cross of axes in the lower left corner. `red` are edges drawn
/// over it where it does not hide them.                                                 [setup]
void draw_surface(Canvas& canvas, int left, int top, int size, const SurfacePainter& painter,
                  const TriangleMesh& mesh, const SurfaceView& view, const SurfaceLook& look,
                  const std::vector<MeshEdge>& red = {});

/// Draws a ball whose places have the colours of their directions, with the axes' letters. [setup]
/// `color` takes a unit vector, scene frame.
void draw_direction_ball(Canvas& canvas, int left, int top, int size, const SurfaceView& view,
                         const std::function<Rgb(const Vec3&)>& color);

} // namespace palpate::internal
