// SPDX-License-Identifier: Apache-2.0
#include "bench/internal/extraction_methods.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>

#include <CGAL/Complex_2_in_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Implicit_surface_3.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Random.h>
#include <CGAL/Surface_mesh_default_criteria_3.h>
#include <CGAL/Surface_mesh_default_triangulation_3.h>
#include <CGAL/make_surface_mesh.h>
#include <CGAL/refine_mesh_3.h>
#include <CGAL/spatial_sort.h>
#include <tbb/enumerable_thread_specific.h>

#include <palpate/geometry/internal/mesh_components.h>

namespace palpate::bench {
namespace {

constexpr double kMmPerM = 1000.0;
constexpr double kRootEnd = 1.0e-5; // mm, as the library asks of CGAL's bisections

/// The task in millimetres from the centre of the field's bounds, as the library gives it to CGAL;
/// a sampler for each thread.
class Field {
public:
    explicit Field(const ExtractionTask& task)
        : task_(task), center_(task.field.bounds().center()),
          samplers_([&task] { return task.field.make_sampler(); }) {}

    double operator()(const Vec3& p_mm) const {
        return samplers_.local()->value(to_scene(p_mm)) - task_.level;
    }
    Vec3 to_scene(const Vec3& p_mm) const { return center_ + p_mm / kMmPerM; }
    Vec3 from_scene(const Vec3& p_m) const { return kMmPerM * (p_m - center_); }
    double radius() const { // mm, of a sphere around the bounds
        return 0.5 * kMmPerM * glm::length(task_.field.bounds().extent()) +
               2.0 * kMmPerM * task_.settings.facet_size_m;
    }

private:
    const ExtractionTask& task_;
    Vec3 center_; // m
    mutable tbb::enumerable_thread_specific<std::unique_ptr<FieldSampler>> samplers_;
};

template <class Point>
std::vector<Point> seeds_of(const ExtractionTask& task, const Field& field) {
    std::vector<Point> points;
    for (const Vec3& seed : task.seeds) {
        const Vec3 p = field.from_scene(seed);
        points.emplace_back(p.x, p.y, p.z);
    }
    CGAL::spatial_sort(points.begin(), points.end());
    return points;
}

/// Turns every component so that most of its area faces lower values.
void face_lower_values(TriangleMesh& mesh, const ExtractionTask& task) {
    const internal::ComponentLabels labels = internal::label_components(mesh);
    const auto sampler = task.field.make_sampler();
    std::vector<double> facing(labels.count, 0.0); // m^2
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto& [i, j, k] = mesh.triangles[t];
        const Vec3 &a = mesh.vertices[i], &b = mesh.vertices[j], &c = mesh.vertices[k];
        const Vec3 area = 0.5 * glm::cross(b - a, c - a);
        const Vec3 slope = sampler->sample((a + b + c) / 3.0).slope;
        facing[labels.of_triangle[t]] -= std::copysign(glm::length(area), glm::dot(area, slope));
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        if (facing[labels.of_triangle[t]] < 0.0)
            std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
}

} // namespace

TriangleMesh by_surface_mesher(const ExtractionTask& task) {
    using Triangulation = CGAL::Surface_mesh_default_triangulation_3;
    using Complex = CGAL::Complex_2_in_triangulation_3<Triangulation>;
    using Traits = Triangulation::Geom_traits;
    using Point = Traits::Point_3;
    using Function = std::function<double(Point)>;

    CGAL::get_default_random() = CGAL::Random(0); // its first points are random
    const Field field(task);
    const Function value = [&field](const Point& p) { return field({p.x(), p.y(), p.z()}); };
    const double radius = field.radius();
    const CGAL::Implicit_surface_3<Traits, Function> surface(
        value, Traits::Sphere_3(CGAL::ORIGIN, radius * radius), kRootEnd / radius);
    const CGAL::Surface_mesh_default_criteria_3<Triangulation> criteria(
        task.settings.facet_angle_deg, kMmPerM * task.settings.facet_size_m,
        kMmPerM * task.settings.facet_distance_m);
    Triangulation triangulation;
    const auto seeds = seeds_of<Point>(task, field);
    triangulation.insert(seeds.begin(), seeds.end());
    Complex complex(triangulation);
    CGAL::make_surface_mesh(complex, surface, criteria, CGAL::Manifold_tag());

    std::vector<Point> points;
    std::vector<std::vector<std::size_t>> facets;
    CGAL::Unique_hash_map<Triangulation::Vertex_handle, std::size_t> index_of(points.max_size());
    for (auto facet = complex.facets_begin(); facet != complex.facets_end(); ++facet) {
        std::vector<std::size_t> corners;
        for (int k = 1; k < 4; ++k) {
            const auto vertex = facet->first->vertex((facet->second + k) & 3);
            std::size_t& index = index_of[vertex];
            if (index == points.max_size()) {
                index = points.size();
                points.push_back(vertex->point());
            }
            corners.push_back(index);
        }
        facets.push_back(std::move(corners));
    }
    CGAL::Polygon_mesh_processing::orient_polygon_soup(points, facets);
    TriangleMesh mesh;
    for (const Point& p : points)
        mesh.vertices.push_back(field.to_scene({p.x(), p.y(), p.z()}));
    for (const auto& corners : facets)
        mesh.triangles.push_back({static_cast<std::uint32_t>(corners[0]),
                                  static_cast<std::uint32_t>(corners[1]),
                                  static_cast<std::uint32_t>(corners[2])});
    face_lower_values(mesh, task);
    return mesh;
}

TriangleMesh by_parallel_mesh_3(const ExtractionTask& task) {
    using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
    using Domain = CGAL::Labeled_mesh_domain_3<Kernel>;
    using Triangulation =
        CGAL::Mesh_triangulation_3<Domain, CGAL::Default, CGAL::Parallel_tag>::type;
    using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation>;
    using Criteria = CGAL::Mesh_criteria_3<Triangulation>;
    using Point = Kernel::Point_3;

    const Field field(task);
    const double radius = field.radius();
    Domain domain(
        CGAL::parameters::function =
            [&field](const Point& p) {
                return field({p.x(), p.y(), p.z()}) > 0.0 ? 1 : 0;
            },
        CGAL::parameters::bounding_object = Kernel::Sphere_3(CGAL::ORIGIN, radius * radius),
        CGAL::parameters::relative_error_bound = 2.0 * kRootEnd / (2.0 * std::sqrt(3.0) * radius));
    const Criteria criteria(CGAL::parameters::facet_angle = task.settings.facet_angle_deg,
                            CGAL::parameters::facet_size = kMmPerM * task.settings.facet_size_m,
                            CGAL::parameters::facet_distance =
                                kMmPerM * task.settings.facet_distance_m);
    Complex complex;
    const auto surface = domain.index_from_surface_patch_index({0, 1});
    for (const Point& p : seeds_of<Point>(task, field)) {
        const auto vertex = complex.triangulation().insert(Triangulation::Weighted_point(p));
        if (vertex == Triangulation::Vertex_handle()) continue;
        complex.set_dimension(vertex, 2);
        complex.set_index(vertex, surface);
    }
    CGAL::refine_mesh_3(complex, domain, criteria, CGAL::parameters::no_exude(),
                        CGAL::parameters::no_perturb(), CGAL::parameters::no_reset_c3t3(),
                        CGAL::parameters::manifold());

    TriangleMesh mesh;
    constexpr std::uint32_t kNone = 0xffffffffu;
    CGAL::Unique_hash_map<Triangulation::Vertex_handle, std::uint32_t> index_of(kNone);
    for (auto f = complex.facets_in_complex_begin(); f != complex.facets_in_complex_end(); ++f) {
        Complex::Facet facet = *f;
        if (!complex.is_in_complex(facet.first))
            facet = complex.triangulation().mirror_facet(facet);
        std::array<std::uint32_t, 3> triangle{};
        for (int k = 0; k < 3; ++k) {
            const auto vertex =
                facet.first->vertex(Triangulation::vertex_triple_index(facet.second, 2 - k));
            std::uint32_t& index = index_of[vertex];
            if (index == kNone) {
                index = static_cast<std::uint32_t>(mesh.vertices.size());
                const auto& p = vertex->point();
                mesh.vertices.push_back(field.to_scene(
                    {CGAL::to_double(p.x()), CGAL::to_double(p.y()), CGAL::to_double(p.z())}));
            }
            triangle[k] = index;
        }
        mesh.triangles.push_back(triangle);
    }
    return mesh;
}

} // namespace palpate::bench
