// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/picture.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <png.h>

#include <palpate/engine/internal/force_colors.h>
#include <palpate/engine/internal/path_layer.h>

namespace palpate {
namespace {

using internal::Color;
using internal::PathLayer;
using internal::PicturePoint;

constexpr int kSmallest = 16;    // pixels
constexpr int kLargest = 8192;   // pixels
constexpr double kMargin = 0.05; // of the picture's size, around the surface

/// The proxy lies on the volume's level, the picture shows its mesh: what is deeper than this is
/// behind the surface.
constexpr double kHiddenBehind_m = 1.5e-3;

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

void check(const PictureView& view) {
    const auto fits = [](int size) { return size >= kSmallest && size <= kLargest; };
    if (!fits(view.width) || !fits(view.height))
        throw std::invalid_argument(fmt::format("picture size is {} x {} pixels; choose {} to {}",
                                                view.width, view.height, kSmallest, kLargest));
    const Vec3 side = glm::cross(view.towards, view.up);
    constexpr double kParallel = 1e-6; // sine of the angle between the two
    const double lengths = glm::length(view.towards) * glm::length(view.up);
    if (!is_finite(side) || !(glm::length(side) > kParallel * lengths))
        throw std::invalid_argument(
            "viewing direction and up must be finite, not zero and not parallel; choose others");
}

Camera camera_for(const TriangleMesh& mesh, const PictureView& view) {
    Camera camera;
    camera.forward = glm::normalize(view.towards);
    camera.right = glm::normalize(glm::cross(view.towards, view.up));
    camera.up = glm::cross(camera.right, camera.forward);
    camera.width = view.width;
    camera.height = view.height;

    Box bounds; // along right, up, forward
    for (const Vec3& p : mesh.vertices)
        bounds.add(
            {glm::dot(p, camera.right), glm::dot(p, camera.up), glm::dot(p, camera.forward)});
    const Vec3 middle = bounds.center();
    camera.center = middle.x * camera.right + middle.y * camera.up + middle.z * camera.forward;

    const Vec3 extent = bounds.extent();
    const double room = 1.0 - 2.0 * kMargin;
    constexpr double kSmallestPixel_m = 1e-12; // a surface without extent still gets a picture
    camera.pixel_m = std::max(
        {extent.x / (room * view.width), extent.y / (room * view.height), kSmallestPixel_m});
    camera.half_depth_m = 0.6 * glm::length(extent) + kSmallestPixel_m; // 0.5 would graze
    return camera;
}

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

/// The first surface that is seen from free space; one seen from within the material is looked
/// through, so that a cavity shows its inside.
std::optional<SurfaceHit> first_seen(const SurfaceScene& surface, const Camera& camera, double x,
                                     double y) noexcept {
    constexpr int kLookedThrough = 32; // surfaces; more is a fractal, not a body
    const double step = std::max(1e-6 * camera.half_depth_m, 4.0 * surface.query_error_m());
    Vec3 from = camera.ray_start(x, y);
    const Vec3 to = from + camera.forward * (2.0 * camera.half_depth_m);
    for (int i = 0; i < kLookedThrough; ++i) {
        const std::optional<SurfaceHit> hit = surface.first_hit(from, to);
        if (!hit || glm::dot(hit->normal, camera.forward) < 0.0) return hit;
        from = hit->position + camera.forward * step;
        if (glm::dot(to - from, camera.forward) <= 0.0) break;
    }
    return std::nullopt;
}

/// Light of a bone-coloured surface towards the viewer, linear: a key light from above left, a weak
/// one from the right, and the sky.
Color shade(const Vec3& n, const Camera& camera) noexcept {
    const Vec3 local(glm::dot(n, camera.right), glm::dot(n, camera.up),
                     -glm::dot(n, camera.forward));
    const Vec3 key = glm::normalize(Vec3(-0.45, 0.65, 0.75));
    const Vec3 fill = glm::normalize(Vec3(0.85, -0.05, 0.45));
    const double lit = std::max(0.0, glm::dot(local, key));
    const double filled = std::max(0.0, glm::dot(local, fill));
    const double sky = 0.5 + 0.5 * local.y;
    const Vec3 half = glm::normalize(key + Vec3(0.0, 0.0, 1.0));
    const double gloss = 0.10 * std::pow(std::max(0.0, glm::dot(local, half)), 40.0);

    constexpr Color kBone{0.86, 0.73, 0.53}; // linear
    constexpr Color kKey{1.00, 0.96, 0.90};  // warm
    constexpr Color kFill{0.55, 0.68, 0.90}; // cool
    constexpr Color kSky{0.90, 0.95, 1.00};
    Color color{};
    for (std::size_t i = 0; i < 3; ++i)
        color[i] = kBone[i] * (0.72 * lit * kKey[i] + 0.20 * filled * kFill[i] +
                               (0.07 + 0.13 * sky) * kSky[i]) +
                   gloss;
    return color;
}

/// Light grey, a little darker below; linear.
Color background(double share_down) noexcept {
    const double light = 0.93 - 0.16 * share_down;
    return {0.97 * light, 0.985 * light, light};
}

/// What is seen of the surface: colours (linear) and depths, row by row.
struct Shading {
    std::vector<std::array<float, 3>> colors;
    std::vector<float>
        depth_m; ///< of the farthest of a pixel's samples; infinity where one sees nothing
};

class SurfacePainter {
public:
    SurfacePainter(const SurfaceScene& surface, const Camera& camera)
        : surface_(surface), camera_(camera), normals_(vertex_normals(surface.mesh())) {}

    Shading paint() const {
        const auto pixels =
            static_cast<std::size_t>(camera_.width) * static_cast<std::size_t>(camera_.height);
        Shading shading{std::vector<std::array<float, 3>>(pixels), std::vector<float>(pixels)};
        // Rows are handed out one by one: those in the middle take longest.
        std::atomic<int> next_row{0};
        const auto work = [&] {
            for (int y = next_row++; y < camera_.height; y = next_row++)
                paint_row(y, shading);
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

private:
    void paint_row(int y, Shading& shading) const noexcept {
        for (int x = 0; x < camera_.width; ++x) {
            const auto pixel =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_.width) +
                static_cast<std::size_t>(x);
            paint_pixel(x, y, shading.colors[pixel], shading.depth_m[pixel]);
        }
    }

    /// Two by two samples, a little turned so that edges along the axes are smooth as well.
    void paint_pixel(int x, int y, std::array<float, 3>& color, float& depth_m) const noexcept {
        constexpr std::array<std::array<double, 2>, 4> kSamples{
            {{0.375, 0.125}, {0.875, 0.375}, {0.625, 0.875}, {0.125, 0.625}}};
        Color sum{};
        depth_m = 0.0F;
        for (const auto& at : kSamples) {
            const auto hit = first_seen(surface_, camera_, x + at[0], y + at[1]);
            Color sample = background((y + at[1]) / camera_.height);
            if (hit) sample = shade(smooth_normal(surface_.mesh(), normals_, *hit), camera_);
            const float depth = hit ? static_cast<float>(camera_.project(hit->position).depth_m)
                                    : std::numeric_limits<float>::infinity();
            depth_m = std::max(depth_m, depth);
            for (std::size_t i = 0; i < 3; ++i)
                sum[i] += sample[i];
        }
        for (std::size_t i = 0; i < 3; ++i)
            color[i] = static_cast<float>(sum[i] / static_cast<double>(kSamples.size()));
    }

    const SurfaceScene& surface_;
    const Camera& camera_;
    std::vector<Vec3> normals_;
};

/// Draws one kind of frames: free ones or those in contact.
template <typename Style>
void draw_path(PathLayer& layer, const Camera& camera, std::span<const FrameReport> frames,
               const Style& style_of) {
    for (std::size_t i = 1; i < frames.size(); ++i) {
        const FrameReport& before = frames[i - 1];
        const FrameReport& after = frames[i];
        if (before.trial != after.trial || !is_finite(before.proxy) || !is_finite(after.proxy))
            continue;
        const std::optional<internal::LineStyle> style = style_of(before, after);
        if (style)
            layer.draw_line(camera.project(before.proxy), camera.project(after.proxy), *style);
    }
}

std::vector<std::uint8_t> to_rgb(const Shading& shading, const PathLayer& layer) {
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

std::string to_png(const std::vector<std::uint8_t>& rgb, const Camera& camera) {
    png_image image;
    std::memset(&image, 0, sizeof image);
    image.version = PNG_IMAGE_VERSION;
    image.format = PNG_FORMAT_RGB;
    image.width = static_cast<png_uint_32>(camera.width);
    image.height = static_cast<png_uint_32>(camera.height);
    // The bound is above what any picture takes: no second compression just to learn the size.
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
    std::string bytes(size, '\0');
    if (png_image_write_to_memory(&image, bytes.data(), &size, 0, rgb.data(), 0, nullptr) == 0)
        throw std::runtime_error(fmt::format("libpng cannot make a picture ({})", image.message));
    bytes.resize(size);
    return bytes;
}

} // namespace

std::string render_png(const SurfaceScene& surface, std::span<const FrameReport> frames,
                       const PictureView& view) {
    check(view);
    const Camera camera = camera_for(surface.mesh(), view);
    const Shading shading = SurfacePainter(surface, camera).paint();

    // Widths for a picture of 900 pixels; others in proportion.
    const double unit = std::max(1.0, std::min(view.width, view.height) / 900.0);
    PathLayer layer(view.width, view.height, shading.depth_m, kHiddenBehind_m);
    using Style = std::optional<internal::LineStyle>;
    const auto touches = [](const FrameReport& a, const FrameReport& b) {
        return a.contacts > 0 && b.contacts > 0;
    };
    draw_path(layer, camera, frames, [&](const FrameReport& a, const FrameReport& b) -> Style {
        if (touches(a, b)) return std::nullopt;
        return internal::LineStyle{{0.42, 0.44, 0.48}, unit, 0.6};
    });
    const double scale_n = internal::force_scale_n(frames);
    draw_path(layer, camera, frames, [&](const FrameReport& a, const FrameReport& b) -> Style {
        if (!touches(a, b)) return std::nullopt;
        return internal::LineStyle{internal::force_color(glm::length(b.force) / scale_n),
                                   2.8 * unit, 1.0};
    });
    return to_png(to_rgb(shading, layer), camera);
}

} // namespace palpate
