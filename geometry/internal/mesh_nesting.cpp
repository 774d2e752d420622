// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/internal/mesh_nesting.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace palpate::internal {
namespace {

/// Points by the squares of a grid over x and y, about as many squares as points.
class PointGrid {
public:
    explicit PointGrid(const std::vector<Vec3>& points) {
        for (const Vec3& p : points)
            bounds_.add(p);
        side_ = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(points.size()))));
        points_in_.resize(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_));
        for (std::uint32_t k = 0; k < points.size(); ++k)
            points_in_[square(column(points[k].x), row(points[k].y))].push_back(k);
    }

    /// Calls visit(index) for every point that may lie within the box, seen along z.
    template <typename Visit>
    void for_each_near(const Box& box, const Visit& visit) const {
        if (box.upper.x < bounds_.lower.x || box.lower.x > bounds_.upper.x ||
            box.upper.y < bounds_.lower.y || box.lower.y > bounds_.upper.y)
            return;
        for (int y = row(box.lower.y); y <= row(box.upper.y); ++y)
            for (int x = column(box.lower.x); x <= column(box.upper.x); ++x)
                for (const std::uint32_t k : points_in_[square(x, y)])
                    visit(k);
    }

private:
    int place(double way, double whole) const { // of a whole that is nothing: the first square
        const double share = whole > 0.0 ? way / whole : 0.0;
        return share > 0.0 ? static_cast<int>(std::min(share * side_, side_ - 1.0)) : 0;
    }
    int column(double x) const {
        return place(x - bounds_.lower.x, bounds_.upper.x - bounds_.lower.x);
    }
    int row(double y) const {
        return place(y - bounds_.lower.y, bounds_.upper.y - bounds_.lower.y);
    }
    std::size_t square(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(side_) +
               static_cast<std::size_t>(x);
    }

    Box bounds_;
    int side_ = 1;
    std::vector<std::vector<std::uint32_t>> points_in_;
};

/// Whether an edge runs across x = p.x and passes p on the side of larger y. Both triangles at an
/// edge are told the same, whatever rounding does: its ends are taken in the order of their
/// indices. So a closed mesh is met an even number of times by every whole line.
bool passes_beyond(const TriangleMesh& mesh, std::uint32_t from, std::uint32_t to, const Vec3& p) {
    const Vec3& a = mesh.vertices[std::min(from, to)];
    const Vec3& b = mesh.vertices[std::max(from, to)];
    if ((a.x <= p.x) == (b.x <= p.x)) return false;
    const double y = a.y + (p.x - a.x) / (b.x - a.x) * (b.y - a.y);
    return y > p.y;
}

/// Whether the line upwards from p meets the triangle.
bool is_above(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& t, const Vec3& p) {
    int beyond = 0;
    for (int k = 0; k < 3; ++k)
        beyond += passes_beyond(mesh, t[k], t[(k + 1) % 3], p) ? 1 : 0;
    if (beyond != 1) return false;
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const Vec3 n = glm::cross(b - a, c - a);
    if (n.z == 0.0) return std::max({a.z, b.z, c.z}) > p.z; // upright: rounding alone made a hit
    return a.z - ((p.x - a.x) * n.x + (p.y - a.y) * n.y) / n.z > p.z;
}

/// Leaves those that occur an odd number of times, once each and ascending.
void keep_odd(std::vector<std::uint32_t>& labels) {
    std::sort(labels.begin(), labels.end());
    std::size_t kept = 0;
    for (std::size_t first = 0; first < labels.size();) {
        std::size_t last = first;
        while (last < labels.size() && labels[last] == labels[first])
            ++last;
        if ((last - first) % 2 == 1) labels[kept++] = labels[first];
        first = last;
    }
    labels.resize(kept);
}

} // namespace

std::vector<std::vector<std::uint32_t>> enclosing_components(const TriangleMesh& mesh,
                                                             const ComponentLabels& labels,
                                                             const std::vector<Vec3>& points) {
    std::vector<std::vector<std::uint32_t>> met(points.size());
    if (points.empty()) return met;
    const PointGrid grid(points);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        Box box;
        for (const std::uint32_t vertex : mesh.triangles[t])
            box.add(mesh.vertices[vertex]);
        grid.for_each_near(box, [&](std::uint32_t k) {
            if (is_above(mesh, mesh.triangles[t], points[k]))
                met[k].push_back(labels.of_triangle[t]);
        });
    }
    for (auto& labels_met : met)
        keep_odd(labels_met);
    return met;
}

} // namespace palpate::internal
