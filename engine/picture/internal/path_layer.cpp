// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/picture/internal/path_layer.h>

#include <algorithm>
#include <cmath>

namespace palpate::internal {

PathLayer::PathLayer(int width, int height, const std::vector<float>& depth_m, double tolerance_m)
    : width_(width), height_(height), depth_m_(depth_m), tolerance_m_(tolerance_m),
      opacities_(depth_m.size(), 0.0F), colors_(depth_m.size()) {}

Color PathLayer::color(std::size_t pixel) const noexcept {
    return {colors_[pixel][0], colors_[pixel][1], colors_[pixel][2]};
}

void PathLayer::draw_line(const PicturePoint& from, const PicturePoint& to,
                          const LineStyle& style) {
    constexpr double kBlur = 0.5; // pixels: the edge goes from full to none over a pixel
    const double reach = 0.5 * style.width + kBlur;
    // Clamped before it becomes an integer: a path may lead far out of the picture.
    const auto limit = [](double value, int size) {
        return static_cast<int>(std::clamp(value, -1.0, static_cast<double>(size)));
    };
    const int x_first = std::max(0, limit(std::floor(std::min(from.x, to.x) - reach), width_));
    const int x_last =
        std::min(width_ - 1, limit(std::ceil(std::max(from.x, to.x) + reach), width_));
    const int y_first = std::max(0, limit(std::floor(std::min(from.y, to.y) - reach), height_));
    const int y_last =
        std::min(height_ - 1, limit(std::ceil(std::max(from.y, to.y) + reach), height_));

    const double dx = to.x - from.x;
    const double dy = to.y - from.y;
    const double squared = dx * dx + dy * dy;
    constexpr double kPointSquared = 1e-12; // pixels squared, a line shorter than that is a point
    for (int y = y_first; y <= y_last; ++y) {
        for (int x = x_first; x <= x_last; ++x) {
            const double px = x + 0.5 - from.x;
            const double py = y + 0.5 - from.y;
            const double along =
                squared < kPointSquared ? 0.0 : std::clamp((px * dx + py * dy) / squared, 0.0, 1.0);
            const double distance = std::hypot(px - along * dx, py - along * dy);
            const double cover = std::clamp(reach - distance, 0.0, 1.0);
            const auto pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                               static_cast<std::size_t>(x);
            const double depth = from.depth_m + along * (to.depth_m - from.depth_m);
            if (!(depth <= static_cast<double>(depth_m_[pixel]) + tolerance_m_)) continue;
            const auto opacity = static_cast<float>(cover * style.opacity);
            if (opacity == 0.0F || opacity < opacities_[pixel]) continue;
            opacities_[pixel] = opacity;
            for (std::size_t i = 0; i < 3; ++i)
                colors_[pixel][i] = static_cast<float>(style.color[i]);
        }
    }
}

} // namespace palpate::internal
