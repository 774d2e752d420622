// SPDX-License-Identifier: Apache-2.0
// This source is Apache-2.0; the CGAL packages it uses (Mesh_3, 3D Triangulations) are
// GPL-3.0-or-later, or commercial. It is therefore built into a library of its own,
// palpate::extraction, which as a whole is under CGAL's terms.
#include <palpate/geometry/isosurface.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <stdexcept>
#include <string>

#include <CGAL/spatial_sort.h>

#include <palpate/geometry/internal/extraction_progress.h>
#include <palpate/geometry/internal/isosurface_material.h>
#include <palpate/geometry/internal/surface_refinement.h>
#include <palpate/geometry/mesh_report.h>
#include <palpate/geometry/triangle_grid.h>

namespace palpate {
namespace {

using internal::Complex;
using internal::Criteria;
using internal::Domain;
using internal::Kernel;
using internal::Point;
using internal::Triangulation;
using internal::VertexHandle;

constexpr int kMaterial = 1; // the domain's label where the value is > 0; 0 is free space
// Where CGAL's bisection along a segment ends, mm. Vertices are brought onto the surface
// afterwards, by about as much.
constexpr double kBisectionEnd = 1.0e-5;
// Refinements, each after the first with more seeds where a piece was lost, and the fraction that
// progress has at their ends: the first took 0.92, 0.6 or 0.45 of all time when it was the only
// one, one of two or of three.
constexpr std::array<double, 3> kEndOfRound{0.6, 0.8, 0.95};
// Values of the field and questions about the complex, each about 0.2 us. Skull CT took 700 and
// 1450 a seed, the generated CT 550 and 700; only the shape of progress rests on it.
constexpr double kWorkPerSeed = 1200.0;
constexpr double kWorkOfLaterRounds = 0.5; // of the first: mostly looking at what is there already
constexpr double kLeastFacing =
    0.9; // share of the area; at sheets thinner than a facet a few triangles cut through

Vec3 to_vec(const Point& p) { return {p.x(), p.y(), p.z()}; }
Point to_point(const Vec3& v) { return Point(v.x, v.y, v.z); }

/// Delaunay refinement of one isosurface, in millimetres.
class Mesher {
public:
    Mesher(const Isosurface& surface, const IsosurfaceSettings& settings, const Progress& progress)
        : progress_(progress), material_(surface, progress_),
          facet_size_(internal::kMmPerM * settings.facet_size_m),
          domain_(make_domain(surface.bounds)),
          criteria_(CGAL::parameters::facet_angle = settings.facet_angle_deg,
                    CGAL::parameters::facet_size = facet_size_,
                    CGAL::parameters::facet_distance =
                        internal::kMmPerM * settings.facet_distance_m) {
        complex_.count_work_in(progress_);
    }

    TriangleMesh run(const std::vector<Vec3>& seeds_m) {
        const double seeds = static_cast<double>(seeds_m.size());
        progress_.begin("placing seeds", 0.01, 10.0 * seeds);
        insert(on_surface(seeds_m));
        if (complex_.triangulation().dimension() < 3) densify(seeds_, 0.5 * facet_size_);
        if (complex_.triangulation().dimension() < 3)
            throw std::runtime_error("no surface found at the seeds; give seeds within a facet "
                                     "size of where the value changes sign");
        double expected_work = kWorkPerSeed * seeds;
        for (std::size_t round = 0;; ++round) {
            progress_.begin("refining the surface", kEndOfRound[round], expected_work);
            internal::SurfaceRefinement(complex_, domain_, criteria_, no_level_).run();
            if (round == 0) expected_work = kWorkOfLaterRounds * progress_.done();
            progress_.begin("collecting vertices", kEndOfRound[round], 1.0);
            TriangleMesh mesh = collect();
            progress_.begin("looking for lost pieces", kEndOfRound[round], 1.0);
            const std::vector<VertexHandle> lost = lost_seeds(mesh);
            if (lost.empty() || round + 1 == kEndOfRound.size()) return finished(std::move(mesh));
            densify(lost, facet_size_ * std::pow(0.5, round + 1));
        }
    }

    Mesher(const Mesher&) = delete; // the domain's function refers to this object
    Mesher& operator=(const Mesher&) = delete;

private:
    Domain make_domain(const Box& bounds) {
        const double radius =
            0.5 * internal::kMmPerM * glm::length(bounds.extent()) + 2.0 * facet_size_;
        const double diagonal = 2.0 * std::sqrt(3.0) * radius; // of the sphere's box: CGAL's unit
        return Domain(
            CGAL::parameters::function =
                [this](const Point& p) { return material_.value(to_vec(p)) > 0.0 ? kMaterial : 0; },
            CGAL::parameters::bounding_object =
                Kernel::Sphere_3(Point(0.0, 0.0, 0.0), radius * radius),
            CGAL::parameters::relative_error_bound = 2.0 * kBisectionEnd / diagonal);
    }

    std::vector<Point> on_surface(const std::vector<Vec3>& seeds_m) {
        std::vector<Point> points;
        for (const Vec3& seed : seeds_m)
            if (const auto p =
                    internal::onto_surface(material_, material_.from_scene(seed), facet_size_))
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
        complex_.for_each_facet([&](const Complex::Facet& f) {
            for (int k = 1; k < 4; ++k)
                used[f.first->vertex((f.second + k) & 3)] = true;
        });
        const double near = facet_size_ / internal::kMmPerM;
        const TriangleGrid grid(mesh, near);
        std::vector<VertexHandle> lost;
        for (const VertexHandle vertex : seeds_) {
            if (used[vertex]) continue;
            const Vec3 p = to_vec(vertex->point().point());
            if (!grid.has_facing(material_.to_scene(p), -internal::gradient(material_, p), near))
                lost.push_back(vertex);
        }
        return lost;
    }

    void densify(const std::vector<VertexHandle>& around, double spacing) {
        std::vector<Point> points;
        for (const VertexHandle vertex : around)
            for (const Vec3& p :
                 internal::ring(material_, to_vec(vertex->point().point()), spacing))
                points.push_back(to_point(p));
        insert(std::move(points));
    }

    TriangleMesh collect() {
        TriangleMesh mesh;
        CGAL::Unique_hash_map<VertexHandle, std::uint32_t> index_of(kNoIndex);
        complex_.for_each_facet([&](Complex::Facet facet) {
            // CGAL's triple is counter-clockwise seen from within the cell; ours shall be from
            // outside the material.
            if (!is_material(facet.first)) facet = complex_.triangulation().mirror_facet(facet);
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
        });
        return mesh;
    }

    /// What CGAL calls a cell of the complex: its dual point is in the material.
    bool is_material(Complex::Cell_handle cell) const {
        const Triangulation& triangulation = complex_.triangulation();
        return !triangulation.is_infinite(cell) &&
               domain_.is_in_domain_object()(triangulation.dual(cell)).has_value();
    }

    Vec3 scene_position(VertexHandle vertex) {
        const Vec3 p = to_vec(vertex->point().point());
        return material_.to_scene(
            internal::onto_surface(material_, p, 4.0 * kBisectionEnd).value_or(p));
    }

    /// The mesh, when it keeps what was promised.
    TriangleMesh finished(TriangleMesh mesh) {
        progress_.begin("checking", 0.98, 1.0);
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

    internal::ExtractionProgress progress_;
    internal::Material material_;
    double facet_size_; // mm
    Domain domain_;
    Criteria criteria_;
    Complex complex_;
    CGAL::Mesh_3::Null_mesher_level no_level_;
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
        if (progress && !progress(1.0, "done")) throw internal::Cancelled{};
        return mesh;
    } catch (const internal::Cancelled&) {
        throw std::runtime_error("extraction of the isosurface cancelled");
    }
}

} // namespace palpate
