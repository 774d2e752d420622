// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/mesh_report.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <stdexcept>

#include <palpate/geometry/internal/mesh_components.h>
#include <palpate/geometry/internal/mesh_nesting.h>

namespace palpate {
namespace {

constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;

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

/// Two corners in one vertex: such a triangle is a line, and its neighbours are each other's.
bool is_collapsed(const std::array<std::uint32_t, 3>& t) {
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

/// One side of a triangle, keyed by its two vertices in ascending order.
struct HalfEdge {
    std::uint64_t key;
    std::uint32_t triangle;
    bool ascending; // runs from the lower vertex to the higher
};

/// All sides of triangles that are not collapsed, those of one edge side by side.
std::vector<HalfEdge> sorted_half_edges(const TriangleMesh& mesh) {
    std::vector<HalfEdge> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (is_collapsed(mesh.triangles[t])) continue;
        for (int k = 0; k < 3; ++k) {
            const std::uint64_t from = mesh.triangles[t][k], to = mesh.triangles[t][(k + 1) % 3];
            const bool ascending = from < to;
            const std::uint64_t key = ascending ? (from << 32) | to : (to << 32) | from;
            edges.push_back({key, static_cast<std::uint32_t>(t), ascending});
        }
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
    internal::DisjointSets corners_joined(3 * mesh.triangles.size());
    for_each_edge(edges, [&](std::size_t first, std::size_t last) {
        for (const std::uint32_t vertex : {static_cast<std::uint32_t>(edges[first].key >> 32),
                                           static_cast<std::uint32_t>(edges[first].key)})
            for (std::size_t e = first + 1; e < last; ++e)
                corners_joined.join(corner_of(mesh, edges[first].triangle, vertex),
                                    corner_of(mesh, edges[e].triangle, vertex));
    });
    std::vector<std::uint8_t> fans(mesh.vertices.size(), 0);
    for (std::uint32_t corner = 0; corner < 3 * mesh.triangles.size(); ++corner) {
        if (is_collapsed(mesh.triangles[corner / 3])) continue;
        if (corners_joined.root(corner) != corner) continue;
        std::uint8_t& count = fans[mesh.triangles[corner / 3][corner % 3]];
        count = std::min<std::uint8_t>(count + 1, 2);
    }
    return static_cast<std::size_t>(std::count(fans.begin(), fans.end(), 2));
}

/// Triangles whose three vertices an earlier one has.
std::size_t count_duplicates(const TriangleMesh& mesh) {
    std::vector<std::array<std::uint32_t, 3>> sorted = mesh.triangles;
    for (auto& triangle : sorted)
        std::sort(triangle.begin(), triangle.end());
    std::sort(sorted.begin(), sorted.end());
    const auto end = std::unique(sorted.begin(), sorted.end());
    return static_cast<std::size_t>(sorted.end() - end);
}

std::vector<Vec3> used_positions(const TriangleMesh& mesh) {
    std::vector<std::uint8_t> is_used(mesh.vertices.size(), 0);
    for (const auto& triangle : mesh.triangles)
        for (const std::uint32_t vertex : triangle)
            is_used[vertex] = 1;
    std::vector<Vec3> used;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        if (is_used[v]) used.push_back(mesh.vertices[v]);
    return used;
}

std::size_t count_coincident(std::vector<Vec3> positions) {
    std::sort(positions.begin(), positions.end(), [](const Vec3& p, const Vec3& q) {
        return p.x != q.x ? p.x < q.x : p.y != q.y ? p.y < q.y : p.z < q.z;
    });
    std::size_t count = 0;
    for (std::size_t k = 1; k < positions.size(); ++k)
        count += positions[k] == positions[k - 1] ? 1 : 0;
    return count;
}

/// In the order of their labels.
std::vector<MeshComponent> measure_components(const TriangleMesh& mesh,
                                              const internal::ComponentLabels& labels,
                                              const std::vector<HalfEdge>& edges) {
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
        component.closed = component.closed || !is_collapsed(mesh.triangles[t]);
    }
    for_each_edge(edges, [&](std::size_t first, std::size_t last) {
        const auto ascending = std::count_if(edges.begin() + static_cast<std::ptrdiff_t>(first),
                                             edges.begin() + static_cast<std::ptrdiff_t>(last),
                                             [](const HalfEdge& edge) { return edge.ascending; });
        if (2 * ascending != static_cast<std::ptrdiff_t>(last - first))
            components[labels.of_triangle[edges[first].triangle]].closed = false;
    });
    return components;
}

int turn(const MeshComponent& component) { return component.volume_m3 < 0.0 ? -1 : 1; }

/// Closed components with a negative winding number on one of their sides. Beside a component, the
/// winding number is the sum of the turns of those that enclose it; across it, its own turn is
/// added.
std::size_t count_inside_out(const TriangleMesh& mesh, const internal::ComponentLabels& labels,
                             const std::vector<MeshComponent>& components) {
    std::vector<std::uint32_t> closed;
    std::vector<Vec3> samples;
    for (std::uint32_t label = 0; label < components.size(); ++label) {
        if (!components[label].closed) continue;
        closed.push_back(label);
        samples.push_back(components[label].sample);
    }
    const auto enclosing = internal::enclosing_components(mesh, labels, samples);
    std::size_t count = 0;
    for (std::size_t k = 0; k < closed.size(); ++k) {
        int winding = 0;
        for (const std::uint32_t label : enclosing[k])
            if (label != closed[k] && components[label].closed) winding += turn(components[label]);
        if (winding < 0 || winding + turn(components[closed[k]]) < 0) ++count;
    }
    return count;
}

void inspect_triangles(const TriangleMesh& mesh, MeshReport& report) {
    report.smallest_angle_deg = 180.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Corners corner = corners(mesh, t);
        if (is_degenerate(corner.a, corner.b, corner.c)) ++report.degenerate;
        report.collapsed += is_collapsed(mesh.triangles[t]) ? 1 : 0;
        report.smallest_angle_deg = std::min(report.smallest_angle_deg, smallest_angle(corner));
    }
}

} // namespace

MeshReport inspect(const TriangleMesh& mesh) {
    require_vertices_exist(mesh);
    MeshReport report;
    report.vertices = mesh.vertices.size();
    report.triangles = mesh.triangles.size();
    report.unused_vertices = mesh.vertices.size();
    if (mesh.triangles.empty()) return report;

    inspect_triangles(mesh, report);
    report.duplicates = count_duplicates(mesh);
    const std::vector<Vec3> used = used_positions(mesh);
    report.unused_vertices = mesh.vertices.size() - used.size();
    report.coincident_vertices = count_coincident(used);

    const std::vector<HalfEdge> edges = sorted_half_edges(mesh);
    count_edges(edges, report);
    report.non_manifold_vertices = count_split_vertices(mesh, edges);

    const internal::ComponentLabels labels = internal::label_components(mesh);
    report.components = measure_components(mesh, labels, edges);
    report.inside_out = count_inside_out(mesh, labels, report.components);
    std::stable_sort(
        report.components.begin(), report.components.end(),
        [](const MeshComponent& x, const MeshComponent& y) { return x.area_m2 > y.area_m2; });
    for (const MeshComponent& component : report.components) {
        report.area_m2 += component.area_m2;
        report.volume_m3 += component.volume_m3;
        report.bounds.add(component.bounds.lower);
        report.bounds.add(component.bounds.upper);
    }
    return report;
}

namespace {

/// "1 edge", "3 edges".
std::string counted(std::size_t count, const std::string& one, const std::string& many) {
    return std::to_string(count) + " " + (count == 1 ? one : many);
}

} // namespace

std::vector<std::string> meaning_for_contact(const MeshReport& report,
                                             std::optional<std::size_t> self_intersections) {
    if (report.triangles == 0) return {"There is no triangle: nothing can be felt."};
    std::vector<std::string> meaning;
    const auto say = [&](std::size_t count, const std::string& one, const std::string& many,
                         const std::string& what) {
        if (count > 0) meaning.push_back(counted(count, one, many) + what);
    };
    say(report.border_edges, "border edge", "border edges",
        ": the surface is open there; the hand can go around the edge and comes to the back, which "
        "is felt as well.");
    say(report.non_manifold_edges, "non-manifold edge", "non-manifold edges",
        ": more than two triangles meet there, or two that face opposite ways; where there are "
        "more than two the contact is guarded instead of certified: nothing passes, but a frame "
        "may stop short.");
    say(report.non_manifold_vertices, "non-manifold vertex", "non-manifold vertices",
        ": surfaces touch there in a point; the contact around it is guarded instead of "
        "certified.");
    say(report.inside_out, "closed component is inside out", "closed components are inside out",
        ": the normals point into the body. The hand feels either side of a triangle, so contact "
        "is the same.");
    if (self_intersections)
        say(*self_intersections, "pair of triangles intersects", "pairs of triangles intersect",
            ": there the contact is guarded instead of certified: nothing passes, but a frame may "
            "stop short.");
    say(report.degenerate, "triangle without an area", "triangles without an area",
        ": ignored; the contact on the triangles beside is guarded where that leaves a gap.");
    say(report.duplicates, "triangle repeats another", "triangles repeat others",
        ": felt once, but the contact is guarded there; remove them.");
    say(report.coincident_vertices, "vertex lies exactly on another",
        "vertices lie exactly on others",
        ": contact joins them; edges between them count as borders here.");
    say(report.unused_vertices, "vertex of no triangle", "vertices of no triangle", ": ignored.");
    if (meaning.empty())
        meaning.push_back("Closed and 2-manifold, every normal outwards: felt everywhere from "
                          "outside and inside, and nothing passes through.");
    if (!self_intersections) meaning.push_back("Self-intersections were not looked for.");
    return meaning;
}

} // namespace palpate
