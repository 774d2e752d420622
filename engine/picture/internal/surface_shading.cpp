// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/picture/internal/surface_shading.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <thread>

namespace palpate::internal {
namespace {

/// Normals of the vertices: sums of the triangles' normals by area, unit length; zero where there
/// is none.
std::vector<Vec3> vertex_normals(const TriangleMesh& mesh) {
    std::vector<Vec3> normals(mesh.vertices.size(), Vec3(0.0));
    for (const auto& t : mesh.triangles) {
        const Vec3& a = mesh.vertices[t[0]];
        const Vec3 twice_area = glm::cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a);
        for (const std::uint32_t vertex : t)
            normals[vertex] += twice_area;
    }
    for (Vec3& n : normals) {
        const double length = glm::length(n);
        n = length > 0.0 ? n / length : Vec3(0.0);
    }
    return normals;
}

/// The triangle's vertex normals at a point of it, by barycentric coordinates; unit.
Vec3 smooth_normal(const TriangleMesh& mesh, const std::vector<Vec3>& normals,
                   const SurfaceHit& hit) {
    const auto& t = mesh.triangles[hit.triangle];
    const Vec3& a = mesh.vertices[t[0]];
    const Vec3& b = mesh.vertices[t[1]];
    const Vec3& c = mesh.vertices[t[2]];
    const Vec3 twice_area = glm::cross(b - a, c - a);
    const double squared = squared_length(twice_area);
    if (!(squared > 0.0)) return hit.normal;
    const double of_b = glm::dot(glm::cross(hit.position - a, c - a), twice_area) / squared;
    const double of_c = glm::dot(glm::cross(b - a, hit.position - a), twice_area) / squared;
    const Vec3 n =
        (1.0 - of_b - of_c) * normals[t[0]] + of_b * normals[t[1]] + of_c * normals[t[2]];
    constexpr double kOpposed =
        0.1; // normals that cancel each other out: a crease, take the facet's
    const double length = glm::length(n);
    return length > kOpposed ? n / length : hit.normal;
}

/// The first surface that is seen; where only sides of free space count, one seen from within the
/// material is looked through, so that a cavity shows its inside.
std::optional<SurfaceHit> first_seen(const SurfaceScene& surface, const Camera& camera, double x,
                                     double y, SurfaceLook::Sides sides) noexcept {
    constexpr int kLookedThrough = 32; // surfaces; more is a fractal, not a body
    const double step = std::max(1e-6 * camera.half_depth_m, 4.0 * surface.query_error_m());
    Vec3 from = camera.ray_start(x, y);
    const Vec3 to = from + camera.forward * (2.0 * camera.half_depth_m);
    for (int i = 0; i < kLookedThrough; ++i) {
        const std::optional<SurfaceHit> hit = surface.first_hit(from, to);
        if (!hit || sides == SurfaceLook::Sides::both ||
            glm::dot(hit->normal, camera.forward) < 0.0)
            return hit;
        from = hit->position + camera.forward * step;
        if (glm::dot(to - from, camera.forward) <= 0.0) break;
    }
    return std::nullopt;
}

/// Light of a surface of a colour towards the viewer, linear: a key light from above left, a weak
/// one from the right, and the sky.
Color shade(const Vec3& n, const Color& base, const Camera& camera) noexcept {
    const Vec3 local(glm::dot(n, camera.right), glm::dot(n, camera.up),
                     -glm::dot(n, camera.forward));
    const Vec3 key = glm::normalize(Vec3(-0.45, 0.65, 0.75));
    const Vec3 fill = glm::normalize(Vec3(0.85, -0.05, 0.45));
    const double lit = std::max(0.0, glm::dot(local, key));
    const double filled = std::max(0.0, glm::dot(local, fill));
    const double sky = 0.5 + 0.5 * local.y;
    const Vec3 half = glm::normalize(key + Vec3(0.0, 0.0, 1.0));
    const double gloss = 0.10 * std::pow(std::max(0.0, glm::dot(local, half)), 40.0);

    constexpr Color kKey{1.00, 0.96, 0.90};  // warm
    constexpr Color kFill{0.55, 0.68, 0.90}; // cool
    constexpr Color kSky{0.90, 0.95, 1.00};
    Color color{};
    for (std::size_t i = 0; i < 3; ++i)
        color[i] = base[i] * (0.72 * lit * kKey[i] + 0.20 * filled * kFill[i] +
                              (0.07 + 0.13 * sky) * kSky[i]) +
                   gloss;
    return color;
}

/// Light grey, a little darker below; linear.
Color background(double share_down) noexcept {
    const double light = 0.93 - 0.16 * share_down;
    return {0.97 * light, 0.985 * light, light};
}

/// Paints rows of one picture.
class RowPainter {
public:
    RowPainter(const SurfaceScene& surface, const std::vector<Vec3>& normals, const Camera& camera,
               const SurfaceLook& look)
        : surface_(surface), normals_(normals), camera_(camera), look_(look) {}

    void paint_row(int y, Shading& shading) const {
        for (int x = 0; x < camera_.width; ++x) {
            const auto pixel =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_.width) +
                static_cast<std::size_t>(x);
            paint_pixel(x, y, shading.colors[pixel], shading.depth_m[pixel]);
        }
    }

private:
    /// Two by two samples, a little turned so that edges along the axes are smooth as well.
    void paint_pixel(int x, int y, std::array<float, 3>& color, float& depth_m) const {
        constexpr std::array<std::array<double, 2>, 4> kSamples{
            {{0.375, 0.125}, {0.875, 0.375}, {0.625, 0.875}, {0.125, 0.625}}};
        Color sum{};
        depth_m = 0.0F;
        for (const auto& at : kSamples) {
            const auto hit = first_seen(surface_, camera_, x + at[0], y + at[1], look_.sides);
            const Color sample = hit ? seen(*hit) : background((y + at[1]) / camera_.height);
            const float depth = hit ? static_cast<float>(camera_.project(hit->position).depth_m)
                                    : std::numeric_limits<float>::infinity();
            depth_m = std::max(depth_m, depth);
            for (std::size_t i = 0; i < 3; ++i)
                sum[i] += sample[i];
        }
        for (std::size_t i = 0; i < 3; ++i)
            color[i] = static_cast<float>(sum[i] / static_cast<double>(kSamples.size()));
    }

    Color seen(const SurfaceHit& hit) const {
        constexpr Color kInner{0.16, 0.24, 0.75}; // linear; blue is no colour of anatomy
        const Vec3 normal = smooth_normal(surface_.mesh(), normals_, hit);
        if (glm::dot(hit.normal, camera_.forward) > 0.0) return shade(-normal, kInner, camera_);
        return shade(normal, look_.color ? look_.color(hit) : kBone, camera_);
    }

    const SurfaceScene& surface_;
    const std::vector<Vec3>& normals_;
    const Camera& camera_;
    const SurfaceLook& look_;
};

} // namespace

Camera fitted_camera(const TriangleMesh& mesh, const Vec3& towards, const Vec3& up, int width,
                     int height, double margin) {
    Camera camera;
    camera.forward = glm::normalize(towards);
    camera.right = glm::normalize(glm::cross(towards, up));
    camera.up = glm::cross(camera.right, camera.forward);
    camera.width = width;
    camera.height = height;

    Box bounds; // along right, up, forward; a vertex of no triangle may be anywhere
    for (const auto& triangle : mesh.triangles)
        for (const std::uint32_t vertex : triangle) {
            const Vec3& p = mesh.vertices[vertex];
            bounds.add(
                {glm::dot(p, camera.right), glm::dot(p, camera.up), glm::dot(p, camera.forward)});
        }
    const Vec3 middle = bounds.center();
    camera.center = middle.x * camera.right + middle.y * camera.up + middle.z * camera.forward;

    const Vec3 extent = bounds.extent();
    const double room = 1.0 - 2.0 * margin;
    constexpr double kSmallestPixel_m = 1e-12; // a surface without extent still gets a picture
    camera.pixel_m =
        std::max({extent.x / (room * width), extent.y / (room * height), kSmallestPixel_m});
    camera.half_depth_m = 0.6 * glm::length(extent) + kSmallestPixel_m; // 0.5 would graze
    return camera;
}

SurfacePainter::SurfacePainter(const SurfaceScene& surface)
    : surface_(surface), normals_(vertex_normals(surface.mesh())) {}

Shading SurfacePainter::paint(const Camera& camera, const SurfaceLook& look) const {
    const auto pixels =
        static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
    Shading shading{std::vector<std::array<float, 3>>(pixels), std::vector<float>(pixels)};
    const RowPainter painter(surface_, normals_, camera, look);
    // Rows are handed out one by one: those in the middle take longest.
    std::atomic<int> next_row{0};
    const auto work = [&] {
        for (int y = next_row++; y < camera.height; y = next_row++)
            painter.paint_row(y, shading);
    };
    constexpr unsigned kMostThreads = 16;
    const unsigned threads = std::clamp(std::thread::hardware_concurrency(), 1u, kMostThreads);
    std::vector<std::jthread> others;
    for (unsigned i = 1; i < threads; ++i)
        others.emplace_back(work);
    work();
    others.clear(); // waits for them
    return shading;
}

std::vector<std::uint8_t> developed(const Shading& shading, const PathLayer& layer) {
    std::vector<std::uint8_t> rgb;
    rgb.reserve(3 * shading.colors.size());
    for (std::size_t pixel = 0; pixel < shading.colors.size(); ++pixel) {
        const double opacity = layer.opacity(pixel);
        const Color line = layer.color(pixel);
        for (std::size_t i = 0; i < 3; ++i) {
            constexpr double kGamma = 2.2; // of sRGB, nearly
            const double below =
                std::pow(std::clamp<double>(shading.colors[pixel][i], 0.0, 1.0), 1.0 / kGamma);
            const double value = below + opacity * (line[i] - below);
            rgb.push_back(
                static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(value, 0.0, 1.0))));
        }
    }
    return rgb;
}

} // namespace palpate::internal
