// SPDX-License-Identifier: Apache-2.0
// The refinement that leaves out what a surface does not need, against CGAL's own refine_mesh_3():
// the same facets of the same vertices in the same order.
#ifdef PALPATE_WITH_CGAL

#include <palpate/geometry/internal/surface_refinement.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace palpate::internal {
namespace {

constexpr double kRadius = 20.0; // mm

/// Walls and bridges that are thinner than the facets: they meet at edges and at points.
double material(const Point& p) {
    const double waves = std::sin(0.9 * p.x()) * std::cos(0.8 * p.y()) +
                         std::sin(0.7 * p.y()) * std::cos(0.9 * p.z()) +
                         std::sin(0.8 * p.z()) * std::cos(0.7 * p.x()) - 0.9;
    const double inside = 0.6 * kRadius - std::sqrt(CGAL::squared_distance(p, Point(0, 0, 0)));
    return std::min(waves, inside);
}

Domain domain() {
    return Domain(
        CGAL::parameters::function = [](const Point& p) { return material(p) > 0.0; },
        CGAL::parameters::bounding_object = Kernel::Sphere_3(Point(0, 0, 0), kRadius * kRadius),
        CGAL::parameters::relative_error_bound = 1e-6);
}

/// Points on the surface, where rays from the middle first leave the material or enter it.
std::vector<Point> seeds() {
    std::mt19937 random(20);
    std::normal_distribution<double> normal;
    std::vector<Point> points;
    for (int n = 0; n < 400; ++n) {
        const Kernel::Vector_3 way(normal(random), normal(random), normal(random));
        const Kernel::Vector_3 step = 0.05 / std::sqrt(way.squared_length()) * way;
        Point at(0, 0, 0);
        for (int i = 0; i < 300; ++i, at = at + step)
            if ((material(at) > 0.0) != (material(at + step) > 0.0)) {
                points.push_back(at + 0.5 * step);
                break;
            }
    }
    return points;
}

void insert_seeds(Complex& complex, const Domain& domain) {
    const auto index = domain.index_from_surface_patch_index(Domain::Surface_patch_index(0, 1));
    for (const Point& p : seeds()) {
        const VertexHandle vertex =
            complex.triangulation().insert(Triangulation::Weighted_point(p));
        complex.set_dimension(vertex, 2);
        complex.set_index(vertex, index);
    }
}

using Corners = std::array<Point, 3>;

Corners corners_of(const Complex::Facet& facet) {
    Corners corners;
    for (int k = 0; k < 3; ++k)
        corners[static_cast<std::size_t>(k)] =
            facet.first->vertex((facet.second + k + 1) & 3)->point().point();
    return corners;
}

std::vector<Corners> facets_by_cgal(const Complex& complex) {
    std::vector<Corners> facets;
    for (auto f = complex.facets_in_complex_begin(); f != complex.facets_in_complex_end(); ++f)
        facets.push_back(corners_of(*f));
    return facets;
}

std::vector<Corners> facets_of(const Complex& complex) {
    std::vector<Corners> facets;
    complex.for_each_facet([&](const Complex::Facet& f) { facets.push_back(corners_of(f)); });
    return facets;
}

template <class Manifold>
void refine_by_cgal(Complex& complex, const Domain& domain, const Criteria& criteria,
                    const Manifold& manifold) {
    CGAL::refine_mesh_3(complex, domain, criteria, CGAL::parameters::no_exude(),
                        CGAL::parameters::no_perturb(), CGAL::parameters::no_reset_c3t3(),
                        manifold);
}

TEST(SurfaceRefinement, HasTheFacetsOfCgalsOwnInTheirOrder) {
    const Domain of = domain();
    const Criteria criteria(CGAL::parameters::facet_angle = 30.0,
                            CGAL::parameters::facet_size = 2.0,
                            CGAL::parameters::facet_distance = 0.2);
    Complex ours, cgals, loose;
    for (Complex* complex : {&ours, &cgals, &loose})
        insert_seeds(*complex, of);
    CGAL::Mesh_3::Null_mesher_level below;
    for (int round = 0; round < 2; ++round) { // the second one begins with what the first has made
        SurfaceRefinement(ours, of, criteria, below).run();
        refine_by_cgal(cgals, of, criteria, CGAL::parameters::manifold());
        const std::vector<Corners> facets = facets_of(ours);
        ASSERT_GT(facets.size(), 1000u);
        EXPECT_EQ(facets, facets_by_cgal(ours)) << round;
        EXPECT_EQ(facets, facets_by_cgal(cgals)) << round;
    }
    // There were edges and vertices to mend: without that there are fewer vertices.
    refine_by_cgal(loose, of, criteria, CGAL::parameters::non_manifold());
    EXPECT_GT(ours.triangulation().number_of_vertices(),
              loose.triangulation().number_of_vertices());
}

} // namespace
} // namespace palpate::internal

#endif
