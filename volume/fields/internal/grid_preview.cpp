// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/internal/grid_preview.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

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

/// Which blocks of eight cells along each axis, one per leaf, have nodes on both sides of a level:
/// in no other one does it pass a cell.
class PassedBlocks {
public:
    PassedBlocks(const GridNodes& nodes, double level) : nodes_(nodes) {
        constexpr std::size_t kLeafNodes = 512;
        const auto count = static_cast<std::ptrdiff_t>(nodes.leaves.size());
        const std::array<std::ptrdiff_t, 3> counts{
            count / nodes.stride[0], nodes.stride[0] / nodes.stride[1], nodes.stride[1]};
        std::vector<std::uint8_t> sides; // of each leaf's nodes: 1 below the level, 2 from it on
        sides.reserve(nodes.leaves.size());
        for (const float* leaf : nodes.leaves) {
            std::uint8_t of_leaf = 0;
            for (std::size_t n = 0; n < kLeafNodes; ++n)
                of_leaf |= leaf[n] < level ? 1 : 2;
            sides.push_back(of_leaf);
        }
        passed_.reserve(sides.size());
        for (std::ptrdiff_t i = 0; i < counts[0]; ++i)
            for (std::ptrdiff_t j = 0; j < counts[1]; ++j)
                for (std::ptrdiff_t k = 0; k < counts[2]; ++k) {
                    int both = 0; // a block's cells reach into the leaves beyond it
                    for (int corner = 0; corner < 8; ++corner)
                        both |= sides[static_cast<std::size_t>(
                            std::min(i + (corner & 1), counts[0] - 1) * nodes.stride[0] +
                            std::min(j + (corner >> 1 & 1), counts[1] - 1) * nodes.stride[1] +
                            std::min(k + (corner >> 2), counts[2] - 1))];
                    passed_.push_back(both == 3);
                }
    }

    /// Whether the level may pass a cell, given in local coordinates.
    bool have(const CellIndex& cell) const {
        return passed_[static_cast<std::size_t>((cell.i >> 3) * nodes_.stride[0] +
                                                (cell.j >> 3) * nodes_.stride[1] +
                                                (cell.k >> 3) * nodes_.stride[2])];
    }

private:
    const GridNodes& nodes_;
    std::vector<bool> passed_;
};

/// Slopes of every n-th cell between the given nodes that the level passes, n a power of two that
/// leaves at most 100,000.
std::vector<double> slopes_at_level(const GridNodes& nodes, const PassedBlocks& blocks,
                                    double level, int margin) {
    constexpr std::size_t kMost = 100'000; // the median of these is within 0.5 % of ranks
    std::vector<double> slopes;
    std::size_t passed = 0, every = 1;
    const std::array<int, 3>& size = nodes.size;
    for (int k = -margin; k < size[2] - 1 + margin; ++k)
        for (int j = -margin; j < size[1] - 1 + margin; ++j)
            for (int i = -margin; i < size[0] - 1 + margin; ++i) {
                constexpr int o = GridNodes::kOrigin;
                const CellIndex cell{i + o, j + o, k + o};
                if (!blocks.have(cell)) {
                    i |= GridNodes::kLeafEdge - 1; // to the block's last cell: kOrigin is a leaf
                    continue;
                }
                const Corners v = nodes.corners(cell);
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
    const PassedBlocks blocks(nodes, level);
    std::vector<double> slopes = slopes_at_level(nodes, blocks, level, 0);
    if (slopes.empty()) // the step down to the background is no property of the data: only for want
                        // of others
        slopes = slopes_at_level(nodes, blocks, level, 1);
    if (slopes.empty()) return 0.0;
    const auto middle = slopes.begin() + static_cast<std::ptrdiff_t>(slopes.size() / 2);
    std::nth_element(slopes.begin(), middle, slopes.end());
    return *middle;
}

} // namespace palpate::internal
