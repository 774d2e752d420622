// SPDX-License-Identifier: Apache-2.0
// This source is Apache-2.0; the CGAL packages it uses (Mesh_3, 3D Triangulations) are
// GPL-3.0-or-later, or commercial. It is therefore built into a library of its own,
// palpate::extraction, which as a whole is under CGAL's terms.
#include <palpate/geometry/isosurface.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/refine_mesh_3.h>
#include <CGAL/spatial_sort.h>

#include <palpate/geometry/internal/triangle_grid.h>

namespace palpate {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Domain = CGAL::Labeled_mesh_domain_3<Kernel>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain, CGAL::Default, CGAL::Sequential_tag>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;
using VertexHandle = Triangulation::Vertex_handle;

// CGAL is given millimetres from the centre of the bounds: its numbers are then about 1 to 100,
// where rounding is 1e-14.
constexpr double kMmPerM = 1000.0;
constexpr int kMaterial = 1; // the domain's label where the value is > 0; 0 is free space
// Where CGAL's bisection along a segment ends, mm. Vertices are brought onto the surface
// afterwards, by about as much.
constexpr double kBisectionEnd = 1.0e-5;
constexpr double kRootEnd = 1.0e-7;     // mm, that is 0.1 nm
constexpr double kProgressPeriod = 0.2; // s
constexpr unsigned kClockEvery = 1024;  // evaluations between looks at the clock
// Skull CT took 700 to 1100 evaluations per seed; only the shape of progress rests on it.
constexpr double kEvaluationsPerSeed = 450.0;
// Refinements, each after the first with more seeds where a piece was lost. One sufficed for skull
// CT.
constexpr int kMostRounds = 3;
constexpr double kLeastFacing =
    0.9; // share of the area; at sheets thinner than a facet a few triangles cut through

struct Cancelled {};

Vec3 to_vec(const Point& p) { return {p.x(), p.y(), p.z()}; }
Point to_point(const Vec3& v) { return Point(v.x, v.y, v.z); }

/// The caller's function in millimetres; counts what it costs, tells progress and carries the wish
/// to cancel.
class Material {
public:
    Material(const Isosurface& surface, const Progress& progress)
        : surface_(surface), progress_(progress), center_(surface.bounds.center()),
          expected_(kEvaluationsPerSeed * static_cast<double>(surface.seeds.size())) {}

    /// Own unit of the field; free space beyond the bounds and where the field has no number.
    double value(const Vec3& p_mm) {
        count();
        const Vec3 p = to_scene(p_mm);
        if (glm::any(glm::lessThan(p, surface_.bounds.lower)) ||
            glm::any(glm::greaterThan(p, surface_.bounds.upper)))
            return -1.0;
        const double value = surface_.value(p);
        return std::isnan(value) ? -1.0 : value;
    }
    Vec3 to_scene(const Vec3& p_mm) const { return center_ + p_mm / kMmPerM; }
    Vec3 from_scene(const Vec3& p_m) const { return kMmPerM * (p_m - center_); }
    int label(const Point& p_mm) { return value(to_vec(p_mm)) > 0.0 ? kMaterial : 0; }

    void report(double fraction, std::string_view phase) {
        phase_ = phase;
        last_fraction_ = std::max(last_fraction_, fraction);
        last_report_ = std::chrono::steady_clock::now();
        if (progress_ && !progress_(last_fraction_, phase_)) throw Cancelled{};
    }

private:
    void count() {
        if (++evaluations_ % kClockEvery != 0) return;
        const std::chrono::duration<double> since = std::chrono::steady_clock::now() - last_report_;
        if (since.count() < kProgressPeriod) return;
        // Nobody knows how many triangles there will be: near the end the fraction only creeps.
        report(0.95 * (1.0 - std::exp(-static_cast<double>(evaluations_) / expected_)), phase_);
    }

    const Isosurface& surface_;
    const Progress& progress_;
    Vec3 center_; // m, scene frame: the origin in millimetres
    double expected_;
    double last_fraction_ = 0.0;
    std::string_view phase_; // of string literals only
    std::uint64_t evaluations_ = 0;
    std::chrono::steady_clock::time_point last_report_ = std::chrono::steady_clock::now();
};

/// Gradient direction by central differences over 2 um: short against any facet, long against
/// rounding. Own unit per mm.
Vec3 gradient(Material& material, const Vec3& p) {
    constexpr double kHalf = 1.0e-3; // mm
    Vec3 g{0.0};
    for (int axis = 0; axis < 3; ++axis) {
        Vec3 step{0.0};
        step[axis] = kHalf;
        g[axis] = (material.value(p + step) - material.value(p - step)) / (2.0 * kHalf);
    }
    return g;
}

/// Root between a point where the value is > 0 and one where it is not: regula falsi, every third
/// step a bisection.
Vec3 root_between(Material& material, Vec3 inside, double value_inside, Vec3 outside,
                  double value_outside) {
    constexpr int kMostSteps = 120; // every third halves: 2^-40 of the first bracket at the worst
    for (int step = 0; step < kMostSteps && glm::distance(inside, outside) > kRootEnd; ++step) {
        double share = 0.5; // of the way from inside to outside
        if (step % 3 != 2 && std::isfinite(value_inside - value_outside))
            share = std::clamp(value_inside / (value_inside - value_outside), 0.01, 0.99);
        const Vec3 p = inside + share * (outside - inside);
        const double value = material.value(p);
        if (value > 0.0) {
            inside = p;
            value_inside = value;
        } else {
            outside = p;
            value_outside = value;
        }
    }
    return 0.5 * (inside + outside);
}

/// The surface on the gradient's line through p, no farther than `reach` mm.
std::optional<Vec3> onto_surface(Material& material, const Vec3& p, double reach) {
    const double value = material.value(p);
    if (value == 0.0) return p;
    const Vec3 g = gradient(material, p);
    const double slope = glm::length(g);
    if (!(slope > 0.0) || !std::isfinite(slope)) return std::nullopt;
    const Vec3 direction = (value > 0.0 ? -1.0 : 1.0) / slope * g;

    // The linear step, a little more, then twice as far each time.
    double step = std::clamp(1.5 * std::abs(value) / slope, 1.0e-3 * reach, reach);
    while (true) {
        const Vec3 q = p + step * direction;
        const double there = material.value(q);
        if ((there > 0.0) != (value > 0.0))
            return value > 0.0 ? root_between(material, p, value, q, there)
                               : root_between(material, q, there, p, value);
        if (step >= reach) return std::nullopt;
        step = std::min(2.0 * step, reach);
    }
}

/// Points on the surface at about `spacing` mm around p, in its tangent plane's six main
/// directions.
std::vector<Vec3> ring(Material& material, const Vec3& p, double spacing) {
    const Vec3 g = gradient(material, p);
    const double slope = glm::length(g);
    if (!(slope > 0.0) || !std::isfinite(slope)) return {};
    const Vec3 n = g / slope;
    const Vec3 across = std::abs(n.x) < 0.6 ? Vec3{1.0, 0.0, 0.0} : Vec3{0.0, 1.0, 0.0};
    const Vec3 u = glm::normalize(glm::cross(n, across)), v = glm::cross(n, u);
    std::vector<Vec3> points;
    for (int k = 0; k < 6; ++k) {
        const double angle = k * CGAL_PI / 3.0;
        const auto q = onto_surface(
            material, p + spacing * (std::cos(angle) * u + std::sin(angle) * v), spacing);
        if (q) points.push_back(*q);
    }
    return points;
}

/// Delaunay refinement of one isosurface, in millimetres.
class Mesher {
public:
    Mesher(const Isosurface& surface, const IsosurfaceSettings& settings, const Progress& progress)
        : material_(surface, progress), facet_size_(kMmPerM * settings.facet_size_m),
          domain_(make_domain(surface.bounds)),
          criteria_(CGAL::parameters::facet_angle = settings.facet_angle_deg,
                    CGAL::parameters::facet_size = facet_size_,
                    CGAL::parameters::facet_distance = kMmPerM * settings.facet_distance_m) {}

    TriangleMesh run(const std::vector<Vec3>& seeds_m) {
        material_.report(0.0, "placing seeds");
        insert(on_surface(seeds_m));
        if (complex_.triangulation().dimension() < 3) densify(seeds_, 0.5 * facet_size_);
        if (complex_.triangulation().dimension() < 3)
            throw std::runtime_error("no surface found at the seeds; give seeds within a facet "
                                     "size of where the value changes sign");
        for (int round = 1;; ++round) {
            material_.report(0.0, "refining the surface");
            CGAL::refine_mesh_3(complex_, domain_, criteria_, CGAL::parameters::no_exude(),
                                CGAL::parameters::no_perturb(), CGAL::parameters::no_reset_c3t3(),
                                CGAL::parameters::manifold());
            TriangleMesh mesh = collect();
            const std::vector<VertexHandle> lost = lost_seeds(mesh);
            if (lost.empty() || round == kMostRounds) return finished(std::move(mesh));
            densify(lost, facet_size_ * std::pow(0.5, round));
        }
    }

    Mesher(const Mesher&) = delete; // the domain's function refers to this object
    Mesher& operator=(const Mesher&) = delete;

private:
    Domain make_domain(const Box& bounds) {
        const double radius = 0.5 * kMmPerM * glm::length(bounds.extent()) + 2.0 * facet_size_;
        const double diagonal = 2.0 * std::sqrt(3.0) * radius; // of the sphere's box: CGAL's unit
        return Domain(
            CGAL::parameters::function = [this](const Point& p) { return material_.label(p); },
            CGAL::parameters::bounding_object =
                Kernel::Sphere_3(Point(0.0, 0.0, 0.0), radius * radius),
            CGAL::parameters::relative_error_bound = 2.0 * kBisectionEnd / diagonal);
    }

    std::vector<Point> on_surface(const std::vector<Vec3>& seeds_m) {
        std::vector<Point> points;
        for (const Vec3& seed : seeds_m)
            if (const auto p = onto_surface(material_, material_.from_scene(seed), facet_size_))
                points.push_back(to_point(*p));
        return points;
    }

    void insert(std::vector<Point> points) {
        CGAL::spatial_sort(points.begin(), points.end(), Kernel());
        Triangulation& triangulation = complex_.triangulation();
        const auto index =
            domain_.index_from_surface_patch_index(Domain::Surface_patch_index(0, kMaterial));
        Triangulation::Cell_handle near;
        for (const Point& p : points) {
            const VertexHandle vertex =
                triangulation.insert(Triangulation::Weighted_point(p), near);
            if (vertex == VertexHandle()) continue;
            near = vertex->cell();
            complex_.set_dimension(vertex, 2);
            complex_.set_index(vertex, index);
            seeds_.push_back(vertex);
        }
    }

    /// Seeds that no facet uses and no triangle that faces their way is near: of a piece that the
    /// mesh has not. (A seed at a thin bridge may be unused although the surface around it is
    /// there.)
    std::vector<VertexHandle> lost_seeds(const TriangleMesh& mesh) {
        CGAL::Unique_hash_map<VertexHandle, bool> used(false);
        for (auto f = complex_.facets_in_complex_begin(); f != complex_.facets_in_complex_end();
             ++f)
            for (int k = 1; k < 4; ++k)
                used[f->first->vertex((f->second + k) & 3)] = true;
        const double near = facet_size_ / kMmPerM;
        const TriangleGrid grid(mesh, near);
        std::vector<VertexHandle> lost;
        for (const VertexHandle vertex : seeds_) {
            if (used[vertex]) continue;
            const Vec3 p = to_vec(vertex->point().point());
            if (!grid.has_facing(material_.to_scene(p), -gradient(material_, p), near))
                lost.push_back(vertex);
        }
        return lost;
    }

    void densify(const std::vector<VertexHandle>& around, double spacing) {
        std::vector<Point> points;
        for (const VertexHandle vertex : around)
            for (const Vec3& p : ring(material_, to_vec(vertex->point().point()), spacing))
                points.push_back(to_point(p));
        insert(std::move(points));
    }

    TriangleMesh collect() {
        material_.report(0.96, "collecting vertices");
        TriangleMesh mesh;
        CGAL::Unique_hash_map<VertexHandle, std::uint32_t> index_of(kNoIndex);
        for (auto f = complex_.facets_in_complex_begin(); f != complex_.facets_in_complex_end();
             ++f) {
            // CGAL's triple is counter-clockwise seen from within the cell; ours shall be from
            // outside the material.
            Complex::Facet facet = *f;
            if (!complex_.is_in_complex(facet.first))
                facet = complex_.triangulation().mirror_facet(facet);
            std::array<std::uint32_t, 3> triangle{};
            for (int k = 0; k < 3; ++k) {
                const VertexHandle vertex =
                    facet.first->vertex(Triangulation::vertex_triple_index(facet.second, 2 - k));
                std::uint32_t& index = index_of[vertex];
                if (index == kNoIndex) {
                    index = static_cast<std::uint32_t>(mesh.vertices.size());
                    mesh.vertices.push_back(scene_position(vertex));
                }
                triangle[k] = index;
            }
            mesh.triangles.push_back(triangle);
        }
        return mesh;
    }

    Vec3 scene_position(VertexHandle vertex) {
        const Vec3 p = to_vec(vertex->point().point());
        return material_.to_scene(onto_surface(material_, p, 4.0 * kBisectionEnd).value_or(p));
    }

    /// The mesh, when it keeps what was promised.
    TriangleMesh finished(TriangleMesh mesh) {
        material_.report(0.98, "checking");
        const MeshReport report = inspect(mesh);
        if (!report.closed() || !report.manifold())
            throw std::runtime_error(
                "the mesh is not a closed manifold: " + std::to_string(report.border_edges) +
                " border edges, " + std::to_string(report.non_manifold_edges) + " edges and " +
                std::to_string(report.non_manifold_vertices) +
                " vertices not manifold; enlarge the bounds or choose a smaller facet_size_m");
        if (facing_share(mesh) < kLeastFacing)
            throw std::runtime_error("the mesh does not face free space; see that the value is "
                                     "> 0 in the material and choose a smaller facet_size_m");
        return mesh;
    }

    /// Share of the area whose value falls along the normal, a tenth of a facet size across.
    double facing_share(const TriangleMesh& mesh) {
        double facing = 0.0, all = 0.0;
        for (const auto& triangle : mesh.triangles) {
            const Vec3 a = material_.from_scene(mesh.vertices[triangle[0]]);
            const Vec3 b = material_.from_scene(mesh.vertices[triangle[1]]);
            const Vec3 c = material_.from_scene(mesh.vertices[triangle[2]]);
            const Vec3 center = (a + b + c) / 3.0;
            const Vec3 across = 0.05 * facet_size_ * triangle_normal(a, b, c);
            const double area = 0.5 * glm::length(glm::cross(b - a, c - a));
            all += area;
            if (material_.value(center - across) > material_.value(center + across)) facing += area;
        }
        return all > 0.0 ? facing / all : 0.0;
    }

    static constexpr std::uint32_t kNoIndex = 0xffffffffu;

    Material material_;
    double facet_size_; // mm
    Domain domain_;
    Criteria criteria_;
    Complex complex_;
    std::vector<VertexHandle> seeds_;
};

void require_settings(const Isosurface& surface, const IsosurfaceSettings& settings) {
    const auto require = [](bool good, const std::string& what) {
        if (!good) throw std::invalid_argument(what);
    };
    const auto length = [](double v) { return v > 0.0 && std::isfinite(v); };
    require(static_cast<bool>(surface.value), "isosurface has no function; set Isosurface::value");
    require(is_finite(surface.bounds.lower) && is_finite(surface.bounds.upper) &&
                !surface.bounds.empty(),
            "isosurface has no finite bounds; set Isosurface::bounds");
    require(!surface.seeds.empty(),
            "isosurface has no seeds; give points on it, see choose_seeds()");
    require(std::all_of(surface.seeds.begin(), surface.seeds.end(), is_finite),
            "a seed of the isosurface is not finite; give points on the surface");
    require(settings.facet_angle_deg > 0.0 && settings.facet_angle_deg <= 30.0,
            "facet_angle_deg is " + std::to_string(settings.facet_angle_deg) +
                "; choose it in (0, 30]");
    require(length(settings.facet_size_m), "facet_size_m is " +
                                               std::to_string(settings.facet_size_m) +
                                               "; choose a length > 0 in metres");
    require(length(settings.facet_distance_m), "facet_distance_m is " +
                                                   std::to_string(settings.facet_distance_m) +
                                                   "; choose a length > 0 in metres");
}

} // namespace

TriangleMesh extract_isosurface(const Isosurface& surface, const IsosurfaceSettings& settings,
                                const Progress& progress) {
    require_settings(surface, settings);
    try {
        TriangleMesh mesh = Mesher(surface, settings, progress).run(surface.seeds);
        if (progress && !progress(1.0, "done")) throw Cancelled{};
        return mesh;
    } catch (const Cancelled&) {
        throw std::runtime_error("extraction of the isosurface cancelled");
    }
}

} // namespace palpate
