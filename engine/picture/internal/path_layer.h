// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <palpate/engine/picture/internal/force_colors.h>

namespace palpate::internal {

/// A point of a picture: pixels from its upper left corner, and how far it is from the viewer.
struct PicturePoint {
    double x = 0.0;       ///< pixels, to the right
    double y = 0.0;       ///< pixels, down
    double depth_m = 0.0; ///< m
};

/// How a line looks.
struct LineStyle {
    Color color{};
    double width = 1.0;   ///< pixels
    double opacity = 1.0; ///< [0, 1]
};

/// Lines over a picture, hidden where the picture is nearer to the viewer. A pixel takes the colour
/// of the line that covers it most, the later one of two: lines of many short pieces then show no
/// joints.
class PathLayer {
public:
    /// `depth_m` of each pixel, row by row; infinity where nothing is. It must outlive the layer.
    PathLayer(int width, int height, const std::vector<float>& depth_m, double tolerance_m);

    void draw_line(const PicturePoint& from, const PicturePoint& to, const LineStyle& style);

    /// Opacity of a pixel, [0, 1], and its colour.
    double opacity(std::size_t pixel) const noexcept { return opacities_[pixel]; }
    Color color(std::size_t pixel) const noexcept;

private:
    int width_;
    int height_;
    const std::vector<float>& depth_m_;
    double tolerance_m_;
    std::vector<float> opacities_;
    std::vector<std::array<float, 3>> colors_;
};

} // namespace palpate::internal
