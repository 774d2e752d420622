// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/picture/internal/surface_tile.h>

#include <algorithm>
#include <cmath>

#include <palpate/engine/picture/internal/slice_view.h>

namespace palpate::internal {
namespace {

// The ends of the axes that face a viewer in front, left and above: patient left, anterior,
// superior.
constexpr std::array<Vec3, 3> kShownAxes{Vec3{1, 0, 0}, Vec3{0, -1, 0}, Vec3{0, 0, 1}};

/// A direction as the picture shows it: pixels right and down for a length of 1.
struct PictureDirection {
    double x;
    double y;
};
PictureDirection shown(const Camera& camera, const Vec3& direction) noexcept {
    return {glm::dot(direction, camera.right), -glm::dot(direction, camera.up)};
}

bool looks_along_an_axis(const Camera& camera) noexcept {
    return direction_letter(camera.forward) != ' ';
}

struct AxesCross {
    static constexpr double kLength = 26.0; // pixels
    static constexpr double kLetter = 40.0; // pixels from the middle to a letter's
    static constexpr double kFromEdge = 56.0;
};

void draw_axes(PathLayer& layer, const Camera& camera) {
    constexpr LineStyle kStyle{{0.12, 0.13, 0.16}, 2.5, 1.0};
    const PicturePoint middle{AxesCross::kFromEdge, camera.height - AxesCross::kFromEdge, 0.0};
    for (const Vec3& axis : kShownAxes) {
        const PictureDirection d = shown(camera, axis);
        layer.draw_line(
            middle, {middle.x + AxesCross::kLength * d.x, middle.y + AxesCross::kLength * d.y, 0.0},
            kStyle);
    }
}

/// Letters of the shown axes at `distance` pixels from a place.
void draw_axis_letters(Canvas& canvas, double x, double y, double distance, const Camera& camera) {
    for (const Vec3& axis : kShownAxes) {
        const PictureDirection d = shown(camera, axis);
        // Of unit length in the picture: an axis that points at the viewer keeps its letter apart.
        const double length = std::max(std::hypot(d.x, d.y), 0.6);
        canvas.draw_letter(direction_letter(axis),
                           static_cast<int>(std::lround(x + distance * d.x / length)),
                           static_cast<int>(std::lround(y + distance * d.y / length)));
    }
}

} // namespace

std::vector<MeshEdge> bad_edges(const TriangleMesh& mesh) {
    struct Side {
        MeshEdge edge; ///< lower vertex first
        bool forwards; ///< as the triangle runs
        bool operator<(const Side& other) const noexcept { return edge < other.edge; }
    };
    std::vector<Side> sides;
    sides.reserve(3 * mesh.triangles.size());
    for (const auto& t : mesh.triangles) {
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
        for (std::size_t i = 0; i < 3; ++i) {
            const std::uint32_t a = t[i];
            const std::uint32_t b = t[(i + 1) % 3];
            sides.push_back({{std::min(a, b), std::max(a, b)}, a < b});
        }
    }
    std::sort(sides.begin(), sides.end());
    std::vector<MeshEdge> bad;
    for (std::size_t i = 0; i < sides.size();) {
        std::size_t end = i + 1;
        while (end < sides.size() && sides[end].edge == sides[i].edge)
            ++end;
        const bool sound = end == i + 2 && sides[i].forwards != sides[i + 1].forwards;
        if (!sound) bad.push_back(sides[i].edge);
        i = end;
    }
    return bad;
}

void draw_surface(Canvas& canvas, int left, int top, int size, const SurfacePainter& painter,
                  const TriangleMesh& mesh, const SurfaceView& view, const SurfaceLook& look,
                  const std::vector<MeshEdge>& red) {
    constexpr double kMargin = 0.1;              // of the tile: room for the letters
    constexpr double kHiddenBehindShare = 0.005; // of the tile's width in the scene
    constexpr LineStyle kRed{{0.90, 0.05, 0.05}, 2.5, 1.0};
    const Camera camera = fitted_camera(mesh, view.towards, view.up, size, size, kMargin);
    const Shading shading = painter.paint(camera, look);
    PathLayer layer(size, size, shading.depth_m, kHiddenBehindShare * size * camera.pixel_m);
    for (const MeshEdge& edge : red)
        layer.draw_line(camera.project(mesh.vertices[edge[0]]),
                        camera.project(mesh.vertices[edge[1]]), kRed);
    const bool along_an_axis = looks_along_an_axis(camera);
    if (!along_an_axis) draw_axes(layer, camera);
    canvas.put(left, top, size, developed(shading, layer));
    if (along_an_axis)
        draw_edge_letters(canvas, left, top, size, camera.right, -camera.up);
    else
        draw_axis_letters(canvas, left + AxesCross::kFromEdge, top + size - AxesCross::kFromEdge,
                          AxesCross::kLetter, camera);
}

void draw_direction_ball(Canvas& canvas, int left, int top, int size, const SurfaceView& view,
                         const std::function<Rgb(const Vec3&)>& color) {
    constexpr double kRadius = 0.3; // of the tile
    constexpr Rgb kAround{38, 42, 52};
    // Only its directions are of use here: the ball is drawn without rays.
    const Camera camera = fitted_camera({{Vec3(0.0), Vec3(1.0)}, {{0, 0, 1}}}, view.towards,
                                        view.up, size, size, 0.0);
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            const double right = (x + 0.5 - 0.5 * size) / (kRadius * size);
            const double up = (0.5 * size - y - 0.5) / (kRadius * size);
            const double towards_viewer = 1.0 - right * right - up * up;
            const Vec3 n = right * camera.right + up * camera.up -
                           std::sqrt(std::max(0.0, towards_viewer)) * camera.forward;
            canvas.set(left + x, top + y, towards_viewer > 0.0 ? color(n) : kAround);
        }
    for (const Vec3& axis : kShownAxes) {
        const PictureDirection d = shown(camera, axis);
        canvas.draw_letter(direction_letter(axis),
                           static_cast<int>(std::lround(left + size * (0.5 + kRadius * d.x))),
                           static_cast<int>(std::lround(top + size * (0.5 + kRadius * d.y))));
    }
}

} // namespace palpate::internal
