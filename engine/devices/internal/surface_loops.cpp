// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/devices/internal/surface_loops.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <queue>
#include <tuple>
#include <utility>

#include <palpate/geometry/mesh_topology.h>

namespace palpate::internal {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

/// Distance of the third corner of a triangle from a source whose distances from the two others
/// are known, m: through the triangle where the straight way leads through it, else along an edge.
double through_triangle(const Vec3& a, double of_a, const Vec3& b, double of_b, const Vec3& c) {
    const double along_edges = std::min(of_a + glm::distance(a, c), of_b + glm::distance(b, c));
    const double length = glm::distance(a, b);
    if (!(length > 0.0)) return along_edges;
    // In the triangle's plane: a in the origin, b on the axis x, c above it, the source below.
    const double x = (of_a * of_a - of_b * of_b + length * length) / (2.0 * length);
    const double y_squared = of_a * of_a - x * x;
    if (!(y_squared > 0.0)) return along_edges;
    const double y = std::sqrt(y_squared);
    const double c_x = glm::dot(c - a, b - a) / length;
    const double c_y = std::sqrt(std::max(0.0, squared_length(c - a) - c_x * c_x));
    const double crosses = x + (c_x - x) * y / (y + c_y);
    if (crosses < 0.0 || crosses > length) return along_edges;
    return std::min(along_edges, std::hypot(c_x - x, c_y + y));
}

/// A mesh whose equal positions are one vertex, with the facets about each of them.
class LoopedMesh {
public:
    explicit LoopedMesh(const TriangleMesh& mesh) : topology_(mesh) {
        std::uint32_t count = 0;
        for (std::uint32_t f = 0; f < topology_.facet_count(); ++f)
            for (const std::uint32_t vertex : topology_.facet(f).vertex)
                count = std::max(count, vertex + 1);
        first_.assign(count + 1, 0);
        for (std::uint32_t f = 0; f < topology_.facet_count(); ++f)
            if (!topology_.facet(f).dropped())
                for (const std::uint32_t vertex : topology_.facet(f).vertex)
                    ++first_[vertex + 1];
        std::partial_sum(first_.begin(), first_.end(), first_.begin());
        about_.resize(first_.back());
        std::vector<std::uint32_t> filled(first_.begin(), first_.end() - 1);
        normals_.assign(count, Vec3{0.0});
        for (std::uint32_t f = 0; f < topology_.facet_count(); ++f) {
            if (topology_.facet(f).dropped()) continue;
            const Vec3 weighted = glm::cross(topology_.corner(f, 1) - topology_.corner(f, 0),
                                             topology_.corner(f, 2) - topology_.corner(f, 0));
            for (const std::uint32_t vertex : topology_.facet(f).vertex) {
                about_[filled[vertex]++] = f;
                normals_[vertex] += weighted;
            }
        }
    }

    const MeshTopology& topology() const { return topology_; }
    std::size_t vertices() const { return normals_.size(); }
    bool is_used(std::size_t vertex) const { return first_[vertex] < first_[vertex + 1]; }
    const Vec3& normal(std::size_t vertex) const { return normals_[vertex]; }
    double area(std::uint32_t f) const {
        return 0.5 * glm::length(glm::cross(topology_.corner(f, 1) - topology_.corner(f, 0),
                                            topology_.corner(f, 2) - topology_.corner(f, 0)));
    }

    /// Distances from a vertex into those of its component, which must be kFar; returns these
    /// vertices, the nearest first.
    std::vector<std::uint32_t> march(std::uint32_t from, std::vector<double>& distance) {
        std::vector<std::uint32_t> reached;
        final_.resize(vertices(), false);
        using Entry = std::pair<double, std::uint32_t>;
        std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front;
        distance[from] = 0.0;
        front.push({0.0, from});
        const auto offer = [&](std::uint32_t vertex, double value) {
            if (final_[vertex] || !(value < distance[vertex])) return;
            distance[vertex] = value;
            front.push({value, vertex});
        };
        while (!front.empty()) {
            const auto [value, vertex] = front.top();
            front.pop();
            if (final_[vertex]) continue;
            final_[vertex] = true;
            reached.push_back(vertex);
            for (std::uint32_t at = first_[vertex]; at < first_[vertex + 1]; ++at)
                offer_over(about_[at], vertex, distance, offer);
        }
        for (const std::uint32_t vertex : reached)
            final_[vertex] = false;
        return reached;
    }

private:
    template <class Offer>
    void offer_over(std::uint32_t f, std::uint32_t vertex, const std::vector<double>& distance,
                    const Offer& offer) const {
        const auto& corners = topology_.facet(f).vertex;
        const auto k = static_cast<std::size_t>(std::find(corners.begin(), corners.end(), vertex) -
                                                corners.begin());
        const std::uint32_t b = corners[(k + 1) % 3], c = corners[(k + 2) % 3];
        const Vec3 &at = topology_.position(vertex), &at_b = topology_.position(b),
                   &at_c = topology_.position(c);
        for (const auto& [to, other, at_to, at_other] :
             {std::tuple{b, c, at_b, at_c}, std::tuple{c, b, at_c, at_b}})
            offer(to, final_[other]
                          ? through_triangle(at, distance[vertex], at_other, distance[other], at_to)
                          : distance[vertex] + glm::distance(at, at_to));
    }

    MeshTopology topology_;
    std::vector<std::uint32_t> first_, about_; // facets about vertex i: about_[first_[i]] and on
    std::vector<Vec3> normals_;                // of vertices, as long as twice the area about them
    std::vector<bool> final_;                  // while it marches
};

/// The loops of one component at one distance.
class LoopTracer {
public:
    LoopTracer(const LoopedMesh& surface, const std::vector<double>& distance)
        : surface_(surface), distance_(distance), visited_(surface.topology().facet_count(), -1) {}

    void trace(const std::vector<std::uint32_t>& facets, double at_m, std::size_t component,
               int level, std::vector<SurfaceLoop>& loops) {
        at_m_ = at_m;
        level_ = level;
        for (const std::uint32_t f : facets) {
            if (visited_[f] == level || !is_crossed(f)) continue;
            SurfaceLoop loop;
            loop.component = component;
            loop.level = level;
            loop.is_closed = follow(f, crossed_edges(f)[1], loop.points);
            if (!loop.is_closed) {
                // From where the walk began, the other way.
                std::vector<LoopPoint> before;
                follow(f, crossed_edges(f)[0], before);
                std::reverse(before.begin(), before.end());
                loop.points.insert(loop.points.begin(), before.begin(), before.end());
            }
            loops.push_back(std::move(loop));
        }
    }

private:
    double at(std::uint32_t f, std::size_t corner) const {
        return distance_[surface_.topology().facet(f).vertex[corner % 3]];
    }
    bool is_beyond(std::uint32_t f, std::size_t corner) const { return at(f, corner) >= at_m_; }
    bool is_crossed(std::uint32_t f) const {
        if (surface_.topology().facet(f).dropped()) return false;
        return is_beyond(f, 0) != is_beyond(f, 1) || is_beyond(f, 1) != is_beyond(f, 2);
    }
    /// The two edges of a crossed facet with an end on either side.
    std::array<std::size_t, 2> crossed_edges(std::uint32_t f) const {
        std::array<std::size_t, 2> edges{};
        std::size_t found = 0;
        for (std::size_t k = 0; k < 3 && found < 2; ++k)
            if (is_beyond(f, k) != is_beyond(f, k + 1)) edges[found++] = k;
        return edges;
    }
    LoopPoint crossing(std::uint32_t f, std::size_t edge) const {
        const auto& vertex = surface_.topology().facet(f).vertex;
        const std::uint32_t a = vertex[edge], b = vertex[(edge + 1) % 3];
        const double share = (at_m_ - distance_[a]) / (distance_[b] - distance_[a]);
        const Vec3 &p = surface_.topology().position(a), &q = surface_.topology().position(b);
        const Vec3 normal = glm::normalize((1.0 - share) * glm::normalize(surface_.normal(a)) +
                                           share * glm::normalize(surface_.normal(b)));
        return {p + share * (q - p),
                is_finite(normal) ? normal : surface_.topology().facet(f).normal};
    }
    /// Goes out of a facet over an edge and on until it is back (true) or at a border.
    bool follow(std::uint32_t f, std::size_t edge, std::vector<LoopPoint>& points) {
        const std::uint32_t begin = f;
        for (;;) {
            visited_[f] = level_;
            points.push_back(crossing(f, edge));
            const Facet& facet = surface_.topology().facet(f);
            const std::uint32_t next = facet.neighbour[edge];
            if (next == f) return false;
            const std::size_t entered = facet.shared_edge[edge];
            f = next;
            if (f == begin) return true;
            if (visited_[f] == level_ || !is_crossed(f)) return false;
            const auto edges = crossed_edges(f);
            edge = edges[0] == entered ? edges[1] : edges[0];
        }
    }

    const LoopedMesh& surface_;
    const std::vector<double>& distance_;
    std::vector<int> visited_; // facet -> level of the loop through it that was last found
    double at_m_ = 0.0;
    int level_ = 0;
};

/// A component: where it is begun, and its facets.
struct Component {
    std::uint32_t tip = 0;
    double longest_m = 0.0; // from there over the surface
    double area = 0.0;
    std::vector<std::uint32_t> facets;
};

/// The components, the largest first, with the distances from their tips.
std::vector<Component> components_of(LoopedMesh& surface, std::vector<double>& distance) {
    std::vector<Component> components;
    std::vector<std::size_t> component_of(surface.vertices(), 0);
    distance.assign(surface.vertices(), kFar);
    for (std::uint32_t v = 0; v < surface.vertices(); ++v) {
        if (!surface.is_used(v) || distance[v] < kFar) continue;
        // The vertex that is farthest from any one is a tip.
        const std::vector<std::uint32_t> reached = surface.march(v, distance);
        Component component;
        component.tip = reached.back();
        for (const std::uint32_t vertex : reached) {
            distance[vertex] = kFar;
            component_of[vertex] = components.size();
        }
        component.longest_m = distance[surface.march(component.tip, distance).back()];
        components.push_back(std::move(component));
    }
    for (std::uint32_t f = 0; f < surface.topology().facet_count(); ++f) {
        const Facet& facet = surface.topology().facet(f);
        if (facet.dropped()) continue;
        Component& component = components[component_of[facet.vertex[0]]];
        component.facets.push_back(f);
        component.area += surface.area(f);
    }
    std::stable_sort(components.begin(), components.end(),
                     [](const Component& a, const Component& b) { return a.area > b.area; });
    return components;
}

} // namespace

std::vector<SurfaceLoop> surface_loops(const TriangleMesh& mesh, double spacing_m) {
    LoopedMesh surface(mesh);
    std::vector<double> distance;
    const std::vector<Component> components = components_of(surface, distance);
    LoopTracer tracer(surface, distance);
    std::vector<SurfaceLoop> loops;
    int level = 0; // counted on over the components: each has its own
    for (std::size_t c = 0; c < components.size(); ++c) {
        const int levels =
            std::max(1, static_cast<int>(std::ceil(components[c].longest_m / spacing_m)));
        for (int k = 0; k < levels; ++k)
            tracer.trace(components[c].facets, (k + 0.5) * components[c].longest_m / levels, c,
                         level++, loops);
        ++level; // so that loops of two components are not neighbours
    }
    return loops;
}

std::vector<double> surface_distances(const TriangleMesh& mesh, std::size_t from) {
    LoopedMesh surface(mesh);
    std::vector<double> distance(surface.vertices(), kFar);
    // Vertices may have other names where equal positions are one.
    const Vec3& begin = mesh.vertices[from];
    for (std::uint32_t v = 0; v < surface.vertices(); ++v)
        if (surface.topology().position(v) == begin) {
            surface.march(v, distance);
            break;
        }
    std::vector<double> result(mesh.vertices.size(), kFar);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k)
            result[mesh.triangles[t][k]] =
                distance[surface.topology().facet(static_cast<std::uint32_t>(t)).vertex[k]];
    return result;
}

} // namespace palpate::internal
