// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/picture/picture.h>

#include <algorithm>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/picture/internal/canvas.h>
#include <palpate/engine/picture/internal/force_colors.h>
#include <palpate/engine/picture/internal/path_layer.h>
#include <palpate/engine/picture/internal/surface_shading.h>

namespace palpate {
namespace {

using internal::Camera;
using internal::PathLayer;
using internal::Shading;

constexpr int kSmallest = 16;    // pixels
constexpr int kLargest = 8192;   // pixels
constexpr double kMargin = 0.05; // of the picture's size, around the surface

/// The proxy lies on the volume's level, the picture shows its mesh: what is deeper than this is
/// behind the surface.
constexpr double kHiddenBehind_m = 1.5e-3;

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

} // namespace

std::string render_png(const SurfaceScene& surface, std::span<const FrameReport> frames,
                       const PictureView& view) {
    check(view);
    const Camera camera = internal::fitted_camera(surface.mesh(), view.towards, view.up, view.width,
                                                  view.height, kMargin);
    const Shading shading = internal::SurfacePainter(surface).paint(camera);

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
    return internal::png_bytes(view.width, view.height, internal::developed(shading, layer));
}

} // namespace palpate
