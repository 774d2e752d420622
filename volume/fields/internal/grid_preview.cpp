// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/internal/grid_preview.h>

#include <algorithm>
#include <cmath>

#include <palpate/volume/fields/internal/grid_sampler.h>

namespace palpate::internal {
namespace {

double smallest_spacing(const GridNodes& nodes) {
    const Mat3& steps = nodes.index_to_scene.linear;
    return std::min({glm::length(steps[0]), glm::length(steps[1]), glm::length(steps[2])});
}

Vec3 projected(const Vec3& vertex, GridSampler& sampler, double level, double longest_way) {
    constexpr int kMaxSteps =
        20; // quadratic convergence needs 3 to 5; the rest is for kinks at cell faces
    constexpr double kClose = 1e-9; // m: far below what a mesh can show
    Vec3 p = vertex;
    for (int n = 0; n < kMaxSteps; ++n) {
        const FieldSample s = sampler.sample(p);
        const double slope = glm::length(s.slope);
        const double missing = level - s.value;
        if (!(slope > 0.0) || std::abs(missing) > slope * longest_way) return vertex;
        const Vec3 step = (missing / slope) * (s.slope / slope);
        p += step;
        if (glm::length(p - vertex) > longest_way) return vertex;
        if (glm::length(step) < kClose) return p;
    }
    return vertex;
}

/// Every second one, in place.
void thin_out(std::vector<double>& slopes) {
    for (std::size_t n = 0; 2 * n < slopes.size(); ++n)
        slopes[n] = slopes[2 * n];
    slopes.resize((slopes.size() + 1) / 2);
}

/// Slopes of every n-th cell between the given nodes that the level passes, n a power of two that
/// leaves at most 100,000.
std::vector<double> slopes_at_level(const GridNodes& nodes, double level, int margin) {
    constexpr std::size_t kMost = 100'000; // the median of these is within 0.5 % of ranks
    std::vector<double> slopes;
    std::size_t passed = 0, every = 1;
    const std::array<int, 3>& size = nodes.size;
    for (int k = -margin; k < size[2] - 1 + margin; ++k)
        for (int j = -margin; j < size[1] - 1 + margin; ++j)
            for (int i = -margin; i < size[0] - 1 + margin; ++i) {
                constexpr int o = GridNodes::kOrigin;
                const Corners v = nodes.corners({i + o, j + o, k + o});
                const auto [low, high] = std::minmax_element(v.begin(), v.end());
                if (!(*low < level && *high >= level) || passed++ % every != 0) continue;
                const Polynomial<3> by_i = on_line(v, Vec3(0.5), Vec3(1.0, 0.0, 0.0));
                const Polynomial<3> by_j = on_line(v, Vec3(0.5), Vec3(0.0, 1.0, 0.0));
                const Polynomial<3> by_k = on_line(v, Vec3(0.5), Vec3(0.0, 0.0, 1.0));
                slopes.push_back(
                    glm::length(nodes.gradient_to_scene * Vec3(by_i[1], by_j[1], by_k[1])));
                if (slopes.size() > kMost) {
                    thin_out(slopes);
                    every *= 2;
                }
            }
    return slopes;
}

} // namespace

void project_onto_level(TriangleMesh& mesh, const GridNodes& nodes, double level) {
    GridSampler sampler(nodes);
    const double longest_way = smallest_spacing(nodes);
    for (Vec3& vertex : mesh.vertices)
        vertex = projected(vertex, sampler, level, longest_way);
}

double median_slope(const GridNodes& nodes, double level) {
    std::vector<double> slopes = slopes_at_level(nodes, level, 0);
    if (slopes.empty()) // the step down to the background is no property of the data: only for want
                        // of others
        slopes = slopes_at_level(nodes, level, 1);
    if (slopes.empty()) return 0.0;
    const auto middle = slopes.begin() + static_cast<std::ptrdiff_t>(slopes.size() / 2);
    std::nth_element(slopes.begin(), middle, slopes.end());
    return *middle;
}

} // namespace palpate::internal
