// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/triangle_mesh.h>

#include <algorithm>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <string>

#include <palpate/geometry/internal/mesh_components.h>

namespace palpate {
namespace {

constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;
// |cross| / longest edge squared below which a triangle has no normal worth the name: rounding of
// 1e-16 in the edges turns it by up to 1e-7 there.
constexpr double kDegenerateRatio = 1.0e-9;

struct Corners {
    Vec3 a, b, c;
};

Corners corners(const TriangleMesh& mesh, std::size_t triangle) {
    const auto& t = mesh.triangles[triangle];
    return {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
}

void require_vertices_exist(const TriangleMesh& mesh) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (const std::uint32_t v : mesh.triangles[t])
            if (v >= mesh.vertices.size())
                throw std::invalid_argument("triangle " + std::to_string(t) + " names vertex " +
                                            std::to_string(v) + " of " +
                                            std::to_string(mesh.vertices.size()) +
                                            "; make every index smaller than the vertex count");
}

double smallest_angle(const Corners& t) {
    const auto angle = [](const Vec3& apex, const Vec3& p, const Vec3& q) {
        const Vec3 u = p - apex, v = q - apex;
        return std::atan2(glm::length(glm::cross(u, v)), glm::dot(u, v));
    };
    const double smallest =
        std::min({angle(t.a, t.b, t.c), angle(t.b, t.c, t.a), angle(t.c, t.a, t.b)});
    return kDegreesPerRadian * smallest;
}

/// Six times the signed volume of the tetrahedron (origin, a, b, c): > 0 when abc is
/// counter-clockwise from outside.
double six_volumes(const Corners& t, const Vec3& origin) {
    return glm::dot(t.a - origin, glm::cross(t.b - origin, t.c - origin));
}

/// One side of a triangle, keyed by its two vertices in ascending order.
struct HalfEdge {
    std::uint64_t key;
    std::uint32_t triangle;
    bool ascending; // runs from the lower vertex to the higher
};

/// All sides, those of one edge side by side.
std::vector<HalfEdge> sorted_half_edges(const TriangleMesh& mesh) {
    std::vector<HalfEdge> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (int k = 0; k < 3; ++k) {
            const std::uint64_t from = mesh.triangles[t][k], to = mesh.triangles[t][(k + 1) % 3];
            const bool ascending = from < to;
            const std::uint64_t key = ascending ? (from << 32) | to : (to << 32) | from;
            edges.push_back({key, static_cast<std::uint32_t>(t), ascending});
        }
    std::sort(edges.begin(), edges.end(), [](const HalfEdge& x, const HalfEdge& y) {
        return x.key != y.key ? x.key < y.key : x.triangle < y.triangle;
    });
    return edges;
}

template <typename Visit>
void for_each_edge(const std::vector<HalfEdge>& edges, const Visit& visit) {
    for (std::size_t first = 0; first < edges.size();) {
        std::size_t last = first + 1;
        while (last < edges.size() && edges[last].key == edges[first].key)
            ++last;
        visit(first, last);
        first = last;
    }
}

void count_edges(const std::vector<HalfEdge>& edges, MeshReport& report) {
    for_each_edge(edges, [&](std::size_t first, std::size_t last) {
        const std::size_t count = last - first;
        if (count == 1) ++report.border_edges;
        if (count > 2 || (count == 2 && edges[first].ascending == edges[first + 1].ascending))
            ++report.non_manifold_edges;
    });
}

/// Where the vertex sits among the triangle's three; the triangle has it.
std::uint32_t corner_of(const TriangleMesh& mesh, std::uint32_t triangle, std::uint32_t vertex) {
    const auto& t = mesh.triangles[triangle];
    return 3 * triangle + (t[0] == vertex ? 0u : t[1] == vertex ? 1u : 2u);
}

/// A vertex is manifold when its corners, joined across the edges at it, make one fan.
std::size_t count_split_vertices(const TriangleMesh& mesh, const std::vector<HalfEdge>& edges) {
    DisjointSets corners_joined(3 * mesh.triangles.size());
    for_each_edge(edges, [&](std::size_t first, std::size_t last) {
        for (const std::uint32_t vertex : {static_cast<std::uint32_t>(edges[first].key >> 32),
                                           static_cast<std::uint32_t>(edges[first].key)})
            for (std::size_t e = first + 1; e < last; ++e)
                corners_joined.join(corner_of(mesh, edges[first].triangle, vertex),
                                    corner_of(mesh, edges[e].triangle, vertex));
    });
    std::vector<std::uint8_t> fans(mesh.vertices.size(), 0);
    for (std::uint32_t corner = 0; corner < 3 * mesh.triangles.size(); ++corner) {
        if (corners_joined.root(corner) != corner) continue;
        std::uint8_t& count = fans[mesh.triangles[corner / 3][corner % 3]];
        count = std::min<std::uint8_t>(count + 1, 2);
    }
    return static_cast<std::size_t>(std::count(fans.begin(), fans.end(), 2));
}

Vec3 closest_point_on_segment(const Vec3& p, const Vec3& a, const Vec3& b) noexcept {
    const Vec3 ab = b - a;
    const double length_squared = squared_length(ab);
    if (!(length_squared > 0.0)) return a;
    return a + glm::clamp(glm::dot(p - a, ab) / length_squared, 0.0, 1.0) * ab;
}

/// For a triangle so thin that rounding left no region to its barycentric coordinates.
Vec3 closest_point_on_sides(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) noexcept {
    Vec3 closest = closest_point_on_segment(p, a, b);
    for (const Vec3& q : {closest_point_on_segment(p, b, c), closest_point_on_segment(p, c, a)})
        if (squared_length(q - p) < squared_length(closest - p)) closest = q;
    return closest;
}

std::vector<MeshComponent> measure_components(const TriangleMesh& mesh) {
    const ComponentLabels labels = label_components(mesh);
    std::vector<MeshComponent> components(labels.count);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        MeshComponent& component = components[labels.of_triangle[t]];
        const Corners corner = corners(mesh, t);
        if (component.triangles == 0) component.sample = corner.a;
        ++component.triangles;
        component.area_m2 +=
            0.5 * glm::length(glm::cross(corner.b - corner.a, corner.c - corner.a));
        // About a vertex of its own, so that a small part far out keeps its digits.
        component.volume_m3 += six_volumes(corner, component.sample) / 6.0;
        for (const Vec3& p : {corner.a, corner.b, corner.c})
            component.bounds.add(p);
    }
    std::stable_sort(
        components.begin(), components.end(),
        [](const MeshComponent& x, const MeshComponent& y) { return x.area_m2 > y.area_m2; });
    return components;
}

} // namespace

MeshReport inspect(const TriangleMesh& mesh) {
    require_vertices_exist(mesh);
    MeshReport report;
    report.vertices = mesh.vertices.size();
    report.triangles = mesh.triangles.size();
    if (mesh.triangles.empty()) return report;

    report.smallest_angle_deg = 180.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Corners corner = corners(mesh, t);
        if (is_degenerate(corner.a, corner.b, corner.c)) ++report.degenerate;
        report.smallest_angle_deg = std::min(report.smallest_angle_deg, smallest_angle(corner));
    }

    const std::vector<HalfEdge> edges = sorted_half_edges(mesh);
    count_edges(edges, report);
    report.non_manifold_vertices = count_split_vertices(mesh, edges);

    report.components = measure_components(mesh);
    for (const MeshComponent& component : report.components) {
        report.area_m2 += component.area_m2;
        report.volume_m3 += component.volume_m3;
        report.bounds.add(component.bounds.lower);
        report.bounds.add(component.bounds.upper);
    }
    return report;
}

bool is_degenerate(const Vec3& a, const Vec3& b, const Vec3& c) noexcept {
    const Vec3 ab = b - a, ac = c - a, bc = c - b;
    const double longest = std::max({squared_length(ab), squared_length(ac), squared_length(bc)});
    return !(glm::length(glm::cross(ab, ac)) > kDegenerateRatio * longest);
}

Vec3 triangle_normal(const Vec3& a, const Vec3& b, const Vec3& c) noexcept {
    if (is_degenerate(a, b, c)) return Vec3{0.0};
    return glm::normalize(glm::cross(b - a, c - a));
}

Vec3 closest_point_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b,
                               const Vec3& c) noexcept {
    const Vec3 ab = b - a, ac = c - a, ap = p - a;

    // Vertex regions, and with their products the edge regions beside them.
    const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
    if (d1 <= 0.0 && d2 <= 0.0) return a;
    const Vec3 bp = p - b;
    const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
    if (d3 >= 0.0 && d4 <= d3) return b;
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return d1 > d3 ? a + d1 / (d1 - d3) * ab : a;
    const Vec3 cp = p - c;
    const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
    if (d6 >= 0.0 && d5 <= d6) return c;
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return d2 > d6 ? a + d2 / (d2 - d6) * ac : a;
    const double va = d3 * d6 - d5 * d4;
    const double along = d4 - d3, back = d5 - d6;
    if (va <= 0.0 && along >= 0.0 && back >= 0.0)
        return along + back > 0.0 ? b + along / (along + back) * (c - b) : b;

    const double sum = va + vb + vc;
    if (va >= 0.0 && vb >= 0.0 && vc >= 0.0 && sum > 0.0) return a + vb / sum * ab + vc / sum * ac;
    return closest_point_on_sides(p, a, b, c);
}

} // namespace palpate
