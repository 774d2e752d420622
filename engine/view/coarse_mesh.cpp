// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/coarse_mesh.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <unordered_map>

namespace palpate {
namespace {

double area_m2(const TriangleMesh& mesh) {
    double twice = 0.0;
    for (const auto& [a, b, c] : mesh.triangles)
        twice += glm::length(
            glm::cross(mesh.vertices[b] - mesh.vertices[a], mesh.vertices[c] - mesh.vertices[a]));
    return 0.5 * twice;
}

/// Vertices of one cell of edge `cell_m` made one.
TriangleMesh clustered(const TriangleMesh& mesh, const Vec3& origin, double cell_m) {
    constexpr double kMostCells = 1 << 21; // along an axis: three fit into 64 bits
    TriangleMesh coarse;
    std::vector<std::uint32_t> counts;
    std::vector<std::uint32_t> cluster_of(mesh.vertices.size());
    std::unordered_map<std::uint64_t, std::uint32_t> clusters;
    clusters.reserve(mesh.vertices.size() / 4);
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const Vec3 at = glm::min((mesh.vertices[i] - origin) / cell_m, Vec3(kMostCells - 1.0));
        const std::uint64_t key = (static_cast<std::uint64_t>(at.x) << 42) |
                                  (static_cast<std::uint64_t>(at.y) << 21) |
                                  static_cast<std::uint64_t>(at.z);
        const auto [cluster, is_new] =
            clusters.try_emplace(key, static_cast<std::uint32_t>(coarse.vertices.size()));
        if (is_new) {
            coarse.vertices.emplace_back(0.0);
            counts.push_back(0);
        }
        cluster_of[i] = cluster->second;
        coarse.vertices[cluster->second] += mesh.vertices[i];
        ++counts[cluster->second];
    }
    for (std::size_t i = 0; i < coarse.vertices.size(); ++i)
        coarse.vertices[i] /= static_cast<double>(counts[i]);

    for (const auto& triangle : mesh.triangles) {
        std::array<std::uint32_t, 3> now{cluster_of[triangle[0]], cluster_of[triangle[1]],
                                         cluster_of[triangle[2]]};
        if (now[0] == now[1] || now[1] == now[2] || now[2] == now[0]) continue;
        // The smallest index first: the same triangle is then the same numbers.
        std::rotate(now.begin(), std::min_element(now.begin(), now.end()), now.end());
        coarse.triangles.push_back(now);
    }
    std::sort(coarse.triangles.begin(), coarse.triangles.end());
    coarse.triangles.erase(std::unique(coarse.triangles.begin(), coarse.triangles.end()),
                           coarse.triangles.end());
    return coarse;
}

} // namespace

Box box_of(const TriangleMesh& mesh) {
    Box box;
    for (const Vec3& vertex : mesh.vertices)
        box.add(vertex);
    return box;
}

TriangleMesh coarse_mesh(const TriangleMesh& mesh, std::size_t most_triangles) {
    if (most_triangles == 0)
        throw std::invalid_argument("most_triangles = 0 leaves nothing to see; give 1 or more");
    if (mesh.triangles.size() <= most_triangles) return mesh;
    constexpr int kMostTries = 16;
    constexpr double kEnough = 0.9; // of what is allowed
    const Vec3 origin = box_of(mesh).lower;
    const auto most = static_cast<double>(most_triangles);
    // A cell of a smooth sheet leaves about two triangles, and their number goes by its area.
    double cell_m = std::sqrt(2.0 * area_m2(mesh) / most);
    double too_small_m = 0.0;
    std::optional<TriangleMesh> best;
    for (int i = 0; i < kMostTries; ++i) {
        TriangleMesh tried = clustered(mesh, origin, cell_m);
        const auto count = static_cast<double>(tried.triangles.size());
        if (count > most) {
            too_small_m = std::max(too_small_m, cell_m);
        } else if (!best || tried.triangles.size() > best->triangles.size()) {
            best = std::move(tried);
        }
        if (best && static_cast<double>(best->triangles.size()) >= kEnough * most) break;
        constexpr double kAim = 0.95; // between enough and too many
        const double next_m = cell_m * std::sqrt(std::max(count, 1.0) / (kAim * most));
        cell_m = count > most ? std::max(next_m, 1.02 * cell_m)
                              : std::max(next_m, 0.5 * (too_small_m + cell_m));
    }
    return best ? *std::move(best) : TriangleMesh{};
}

QuantisedMesh quantised(const TriangleMesh& mesh, const Box& box) {
    constexpr double kSteps = 65535.0;
    QuantisedMesh result;
    result.positions.reserve(3 * mesh.vertices.size());
    result.indices.reserve(3 * mesh.triangles.size());
    for (const Vec3& vertex : mesh.vertices)
        for (int axis = 0; axis < 3; ++axis) {
            const double edge = box.upper[axis] - box.lower[axis];
            const double share = edge > 0.0 ? (vertex[axis] - box.lower[axis]) / edge : 0.0;
            result.positions.push_back(
                static_cast<std::uint16_t>(std::lround(kSteps * std::clamp(share, 0.0, 1.0))));
        }
    for (const auto& triangle : mesh.triangles)
        result.indices.insert(result.indices.end(), triangle.begin(), triangle.end());
    return result;
}

} // namespace palpate
