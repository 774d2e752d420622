// SPDX-License-Identifier: Apache-2.0
// Only isosurface.cpp includes this: the CGAL packages it uses are GPL-3.0-or-later, or commercial.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <limits>
#include <map>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Mesher_level_visitors.h>
#include <CGAL/refine_mesh_3.h>

#include <palpate/geometry/internal/extraction_progress.h>
#include <palpate/geometry/internal/mesh_components.h>

namespace palpate::internal {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Domain = CGAL::Labeled_mesh_domain_3<Kernel>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain, CGAL::Default, CGAL::Sequential_tag>::type;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;
using VertexHandle = Triangulation::Vertex_handle;

/// The surface's facets in CGAL's triangulation, which answers what the manifold criteria ask:
/// how facets meet at an edge or a vertex. Counted afresh from the facets around it, every time.
/// CGAL's own answers are the same, but come from a map into which it enters every edge of the
/// triangulation that it asks about: more than half of all time, in which nobody could cancel.
class Complex : public CGAL::Mesh_complex_3_in_triangulation_3<Triangulation> {
public:
    using Base = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation>;

    void count_work_in(ExtractionProgress& progress) { progress_ = &progress; }

    /// From now on the triangulation may have so many vertices; a question that finds more throws
    /// std::runtime_error.
    void allow_vertices(std::size_t count) { most_vertices_ = count; }

    /// Calls use(facet) for each facet of the complex, in the order of CGAL's iterators. Those look
    /// at the cell behind every facet of the triangulation: eight times as long.
    template <class Use>
    void for_each_facet(const Use& use) const {
        for (const Cell_handle cell : triangulation().all_cell_handles())
            for (int i = 0; i < 4; ++i)
                if (cell->is_facet_on_surface(i) && !(cell->neighbor(i) < cell))
                    use(Facet(cell, i));
    }

    Face_status face_status(const Edge& edge) const {
        note_question();
        auto facet = triangulation().incident_facets(edge);
        const auto end = facet;
        int count = 0;
        do
            count += is_in_complex(*facet) ? 1 : 0;
        while (++facet != end);
        return count == 0   ? NOT_IN_COMPLEX
               : count == 1 ? BOUNDARY
               : count == 2 ? REGULAR
                            : SINGULAR;
    }

    Face_status face_status(VertexHandle vertex) const {
        note_question();
        const std::vector<Link> links = links_at(vertex);
        if (links.empty()) return NOT_IN_COMPLEX;
        DisjointSets fans(links.size() / 2); // of facets
        bool is_border = false;
        for (std::size_t first = 0; first < links.size();) {
            std::size_t last = first + 1;
            for (; last < links.size() && links[last].to == links[first].to; ++last)
                fans.join(links[first].facet, links[last].facet);
            if (last - first > 2) return SINGULAR;
            is_border = is_border || last - first == 1;
            first = last;
        }
        for (std::uint32_t facet = 1; facet < links.size() / 2; ++facet)
            if (fans.root(facet) != 0) return SINGULAR;
        return is_border ? BOUNDARY : REGULAR;
    }

    bool has_incident_facets_in_complex(const VertexHandle& vertex) const {
        return face_status(vertex) != NOT_IN_COMPLEX;
    }

private:
    /// A facet's edge from a vertex to another one.
    struct Link {
        VertexHandle to;
        std::uint32_t facet;
    };

    /// Those of the complex, the two of each facet, sorted by the vertex that they lead to.
    std::vector<Link> links_at(VertexHandle vertex) const {
        std::vector<Facet> facets;
        triangulation().incident_facets(vertex, std::back_inserter(facets));
        std::vector<Link> links;
        std::uint32_t count = 0;
        for (const Facet& facet : facets) {
            if (!is_in_complex(facet)) continue;
            for (int k = 1; k < 4; ++k) {
                const VertexHandle to = facet.first->vertex((facet.second + k) & 3);
                if (to != vertex) links.push_back({to, count});
            }
            ++count;
        }
        std::sort(links.begin(), links.end(),
                  [](const Link& x, const Link& y) { return x.to < y.to; });
        return links;
    }

    void note_question() const {
        if (progress_) progress_->work();
        if (triangulation().number_of_vertices() > most_vertices_)
            throw std::runtime_error(
                "the surface crosses or touches itself, so that no closed mesh of it comes to an "
                "end: at a saddle of the field, or at voxels that meet in a corner; choose a "
                "slightly different level, smooth more, or feel the volume alone (contact "
                "\"volume\")");
        // Where CGAL checks itself, it looks at its own counts, which its first answer sets up.
        CGAL_assertion_code(
            Base::has_incident_facets_in_complex(triangulation().finite_vertices_begin()));
    }

    ExtractionProgress* progress_ = nullptr;
    std::size_t most_vertices_ = std::numeric_limits<std::size_t>::max();
};

/// All edges and vertices of the complex at once: how many facets meet at each edge, and which
/// facets hang together around a vertex.
class SurfaceLinks {
public:
    explicit SurfaceLinks(const Complex& complex) : index_of_(kNone) {
        complex.for_each_facet([&](const Complex::Facet& facet) {
            std::array<std::uint32_t, 3> corner{};
            for (int k = 0; k < 3; ++k)
                corner[static_cast<std::size_t>(k)] =
                    index_of(facet.first->vertex((facet.second + k + 1) & 3));
            for (std::uint32_t a = 0; a < 3; ++a) {
                const std::uint32_t b = (a + 1) % 3;
                const bool up = corner[a] < corner[b];
                sides_.push_back({corner[up ? a : b], corner[up ? b : a],
                                  corner_count_ + (up ? a : b), corner_count_ + (up ? b : a)});
            }
            corner_count_ += 3;
        });
        std::sort(sides_.begin(), sides_.end(), [](const Side& x, const Side& y) {
            return std::tie(x.low, x.high, x.corner_low) < std::tie(y.low, y.high, y.corner_low);
        });
    }

    /// Calls use(one end, the other, how many facets meet there) for each edge.
    template <class Use>
    void for_each_edge(const Use& use) const {
        for_each_run([&](std::size_t first, std::size_t last) {
            use(vertices_[sides_[first].low], vertices_[sides_[first].high], last - first);
        });
    }

    /// Where more than two facets share an edge, or facets do not hang together; in the order of
    /// the triangulation's vertices.
    std::vector<VertexHandle> singular_vertices(const Triangulation& triangulation) const {
        std::vector<std::uint8_t> is_singular(vertices_.size(), 0);
        DisjointSets fans(corner_count_); // of corners: around a vertex, across its edges
        for_each_run([&](std::size_t first, std::size_t last) {
            for (std::size_t n = first + 1; n < last; ++n) {
                fans.join(sides_[first].corner_low, sides_[n].corner_low);
                fans.join(sides_[first].corner_high, sides_[n].corner_high);
            }
            if (last - first > 2)
                is_singular[sides_[first].low] = is_singular[sides_[first].high] = 1;
        });
        std::vector<std::uint32_t> fan_at(vertices_.size(), kNone);
        const auto see = [&](std::uint32_t vertex, std::uint32_t corner) {
            const std::uint32_t fan = fans.root(corner);
            if (fan_at[vertex] == kNone) fan_at[vertex] = fan;
            if (fan_at[vertex] != fan) is_singular[vertex] = 1;
        };
        for (const Side& side : sides_) {
            see(side.low, side.corner_low);
            see(side.high, side.corner_high);
        }
        std::vector<VertexHandle> singular;
        for (const VertexHandle vertex : triangulation.finite_vertex_handles())
            if (const std::uint32_t index = index_of_[vertex];
                index != kNone && is_singular[index] != 0)
                singular.push_back(vertex);
        return singular;
    }

private:
    static constexpr std::uint32_t kNone = 0xffffffffu;

    /// An edge as one facet has it: its ends, and the facet's corners there.
    struct Side {
        std::uint32_t low, high;
        std::uint32_t corner_low, corner_high;
    };

    std::uint32_t index_of(VertexHandle vertex) {
        std::uint32_t& index = index_of_[vertex];
        if (index == kNone) {
            index = static_cast<std::uint32_t>(vertices_.size());
            vertices_.push_back(vertex);
        }
        return index;
    }

    /// Calls use(first, last) for the sides of each edge.
    template <class Use>
    void for_each_run(const Use& use) const {
        for (std::size_t first = 0, last = 0; first < sides_.size(); first = last) {
            while (last < sides_.size() && sides_[last].low == sides_[first].low &&
                   sides_[last].high == sides_[first].high)
                ++last;
            use(first, last);
        }
    }

    CGAL::Unique_hash_map<VertexHandle, std::uint32_t> index_of_;
    std::vector<VertexHandle> vertices_; // of the complex
    std::vector<Side> sides_;
    std::uint32_t corner_count_ = 0;
};

/// CGAL's refinement of a surface to a closed manifold: what refine_mesh_3() does with
/// parameters::manifold(), facet by facet in the same order, and so the same mesh. It leaves out
/// that call's scan of the cells, which are not refined, and asks for the complex's edges and
/// vertices at once instead of all of the triangulation's one by one: a third of all time.
class SurfaceRefinement
    : public CGAL::Mesh_3::Refine_facets_3<Triangulation, Criteria::Facet_criteria, Domain, Complex,
                                           CGAL::Mesh_3::Null_mesher_level, CGAL::Sequential_tag,
                                           CGAL::Mesh_3::Refine_facets_manifold_base> {
public:
    using Base =
        CGAL::Mesh_3::Refine_facets_3<Triangulation, Criteria::Facet_criteria, Domain, Complex,
                                      CGAL::Mesh_3::Null_mesher_level, CGAL::Sequential_tag,
                                      CGAL::Mesh_3::Refine_facets_manifold_base>;

    /// All must outlive it; `below` is the level of refinement below, which is none.
    SurfaceRefinement(Complex& complex, const Domain& domain, const Criteria& criteria,
                      CGAL::Mesh_3::Null_mesher_level& below)
        : Base(complex.triangulation(), criteria.facet_criteria_object(), domain, below, complex,
               CGAL::parameters::internal::Manifold_options::MANIFOLD, 0, nullptr),
          complex_(complex) {}

    /// From the vertices that the triangulation has, which must span a volume.
    void run() {
        const CGAL::Null_mesh_visitor nobody;
        complex_.clear_cells_and_facets_from_c3t3();
        complex_.allow_vertices(std::numeric_limits<std::size_t>::max());
        this->scan_triangulation();
        this->refine(nobody);
        complex_.allow_vertices(kMostGrowth * complex_.triangulation().number_of_vertices() +
                                kMostNewVertices);
        note_bad_edges();
        this->refine(nobody);
        for (const VertexHandle vertex :
             SurfaceLinks(complex_).singular_vertices(complex_.triangulation()))
            this->m_bad_vertices.insert(vertex);
        this->m_bad_vertices_initialized = true;
        this->refine(nobody);
        complex_.clear_manifold_info();
    }

private:
    /// What making it a manifold may add to the vertices that size and distance ask for. It parts
    /// narrow necks, some vertices each. Where two sheets cross there is no end to it.
    static constexpr std::size_t kMostGrowth = 8;
    static constexpr std::size_t kMostNewVertices = 20000;

    using Ends = std::pair<VertexHandle, VertexHandle>;

    struct BadEdge {
        Ends ends;
        int turn;       // when it is refined: first those of more than two facets
        int one, other; // the ends in the edge's first cell
    };

    /// Edges at which not two facets meet, in the order in which CGAL would find them: by the
    /// oldest cell at each.
    void note_bad_edges() {
        std::map<Complex::Cell_handle, std::vector<BadEdge>> bad;
        SurfaceLinks(complex_).for_each_edge(
            [&](VertexHandle a, VertexHandle b, std::size_t count) {
                if (count == 2) return;
                const Complex::Cell_handle cell = oldest_cell(a, b);
                const int i = cell->index(a), j = cell->index(b);
                bad[cell].push_back({b < a ? Ends(b, a) : Ends(a, b), count > 2 ? 0 : 1,
                                     std::min(i, j), std::max(i, j)});
            });
        for (const Complex::Cell_handle cell : complex_.triangulation().all_cell_handles()) {
            if (bad.empty()) break;
            const auto found = bad.find(cell);
            if (found == bad.end()) continue;
            std::vector<BadEdge>& edges = found->second;
            std::sort(edges.begin(), edges.end(), [](const BadEdge& x, const BadEdge& y) {
                return std::tie(x.one, x.other) < std::tie(y.one, y.other);
            });
            for (const BadEdge& edge : edges)
                this->m_bad_edges.insert(typename Base::Bad_edge(edge.ends, edge.turn));
            bad.erase(found);
        }
        this->m_manifold_info_initialized = true;
    }

    Complex::Cell_handle oldest_cell(VertexHandle a, VertexHandle b) const {
        Complex::Cell_handle start;
        int i = 0, j = 0;
        complex_.triangulation().is_edge(a, b, start, i, j);
        Complex::Cell_handle oldest = start;
        auto cell = complex_.triangulation().incident_cells(start, i, j);
        do
            if (const Complex::Cell_handle here = cell; here < oldest) oldest = here;
        while (++cell != start);
        return oldest;
    }

    Complex& complex_;
};

} // namespace palpate::internal
