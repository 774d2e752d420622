// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/mesh_sharpness.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <tuple>

namespace palpate {
namespace {

struct HalfEdge {
    std::uint32_t low, high;
    std::size_t triangle;
};

std::vector<HalfEdge> half_edges(const TriangleMesh& mesh) {
    std::vector<HalfEdge> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const std::uint32_t a = mesh.triangles[t][corner];
            const std::uint32_t b = mesh.triangles[t][(corner + 1) % 3];
            if (a >= mesh.vertices.size())
                throw std::invalid_argument(
                    "share_of_sharp_edges: a triangle names a vertex that does not exist");
            edges.push_back({std::min(a, b), std::max(a, b), t});
        }
    std::sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
        return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
    });
    return edges;
}

Vec3 normal_of(const TriangleMesh& mesh, std::size_t triangle) {
    const auto& t = mesh.triangles[triangle];
    return triangle_normal(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
}

} // namespace

double share_of_sharp_edges(const TriangleMesh& mesh, double angle_deg) {
    const double cosine = std::cos(angle_deg * std::numbers::pi / 180.0);
    const std::vector<HalfEdge> edges = half_edges(mesh);
    std::size_t counted = 0, sharp = 0;
    for (std::size_t e = 0; e + 1 < edges.size(); ++e) {
        const HalfEdge &one = edges[e], &other = edges[e + 1];
        if (one.low != other.low || one.high != other.high) continue;
        const Vec3 a = normal_of(mesh, one.triangle), b = normal_of(mesh, other.triangle);
        if (a == Vec3(0.0) || b == Vec3(0.0)) continue;
        ++counted;
        sharp += glm::dot(a, b) < cosine ? 1 : 0;
    }
    return counted == 0 ? 0.0 : static_cast<double>(sharp) / static_cast<double>(counted);
}

} // namespace palpate
