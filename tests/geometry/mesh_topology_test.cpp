// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/mesh_topology.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/support/odd_meshes.h"

namespace palpate {
namespace {

/// Triangles other than `facet` with both ends of its edge, by looking at all of them.
std::vector<std::uint32_t> brute_neighbours(const TriangleMesh& mesh, std::uint32_t facet, int k) {
    const Vec3 a = mesh.vertices[mesh.triangles[facet][k]];
    const Vec3 b = mesh.vertices[mesh.triangles[facet][(k + 1) % 3]];
    std::vector<std::uint32_t> found;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        int shared = 0;
        for (const std::uint32_t v : mesh.triangles[t])
            if (mesh.vertices[v] == a || mesh.vertices[v] == b) ++shared;
        if (t != facet && shared == 2) found.push_back(t);
    }
    return found;
}

void expect_brute_neighbours(const TriangleMesh& mesh) {
    const MeshTopology topology(mesh);
    for (std::uint32_t f = 0; f < topology.facet_count(); ++f)
        for (int k = 0; k < 3; ++k) {
            const auto expected = brute_neighbours(mesh, f, k);
            const Facet& facet = topology.facet(f);
            if (expected.size() != 1) {
                ASSERT_TRUE(topology.is_border(f, k));
                ASSERT_EQ(facet.singular || expected.empty(), true);
                continue;
            }
            ASSERT_EQ(facet.neighbour[k], expected[0]);
            const Facet& there = topology.facet(expected[0]);
            const std::uint8_t back = facet.shared_edge[k];
            ASSERT_EQ(there.neighbour[back], f);
            ASSERT_EQ(there.turn[back], facet.turn[k]);
        }
}

/// Each triangle with vertices of its own, as STL files have them.
TriangleMesh unshared(const TriangleMesh& mesh) {
    TriangleMesh result;
    for (const auto& t : mesh.triangles) {
        const auto first = static_cast<std::uint32_t>(result.vertices.size());
        for (const std::uint32_t v : t)
            result.vertices.push_back(mesh.vertices[v]);
        result.triangles.push_back({first, first + 1, first + 2});
    }
    return result;
}

TEST(MeshTopology, NeighboursAreThoseThatShareAnEdge) {
    expect_brute_neighbours(test::icosphere(0.05, 2));
    expect_brute_neighbours(test::sheet(0.05, 7));
    expect_brute_neighbours(test::partly_reversed(test::icosphere(0.05, 2)));
}

TEST(MeshTopology, VerticesAtOnePlaceAreOne) {
    expect_brute_neighbours(unshared(test::icosphere(0.05, 2)));
}

TEST(MeshTopology, AFanHasTheFacetsOfItsVertexOnceAndFromOneSide) {
    const TriangleMesh mesh = test::icosphere(0.05, 2);
    const MeshTopology topology(mesh);
    for (std::uint32_t f = 0; f < topology.facet_count(); ++f)
        for (std::uint8_t k = 0; k < 3; ++k) {
            Fan fan;
            ASSERT_TRUE(topology.fan(f, -1, k, fan));
            std::set<std::uint32_t> found, expected;
            const std::uint32_t vertex = mesh.triangles[f][k];
            for (std::size_t i = 0; i < fan.size(); ++i) {
                found.insert(fan[i].facet);
                ASSERT_EQ(fan[i].side, -1);
                ASSERT_EQ(mesh.triangles[fan[i].facet][fan[i].corner], vertex);
            }
            for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
                if (std::count(mesh.triangles[t].begin(), mesh.triangles[t].end(), vertex))
                    expected.insert(t);
            ASSERT_EQ(found, expected);
            ASSERT_EQ(fan.size(), expected.size());
        }
}

// Whichever way round facets are stored: all that a walk reaches without passing through are seen
// from outside.
TEST(MeshTopology, WalkingOverReversedFacetsStaysOutside) {
    const TriangleMesh mesh = test::partly_reversed(test::icosphere(0.05, 2));
    const MeshTopology topology(mesh);
    const auto outwards = [&](std::uint32_t f) {
        return glm::dot(topology.facet(f).normal, topology.corner(f, 0)) > 0.0 ? 1 : -1;
    };
    for (std::uint32_t f = 0; f < topology.facet_count(); ++f)
        for (int k = 0; k < 3; ++k)
            ASSERT_EQ(outwards(f) * topology.facet(f).turn[k],
                      outwards(topology.facet(f).neighbour[k]));
}

TEST(MeshTopology, OverABorderLiesTheOtherSide) {
    const MeshTopology topology(test::sheet(0.05, 4));
    std::size_t borders = 0;
    for (std::uint32_t f = 0; f < topology.facet_count(); ++f)
        for (int k = 0; k < 3; ++k)
            if (topology.is_border(f, k)) {
                ++borders;
                EXPECT_EQ(topology.facet(f).turn[k], -1);
            }
    EXPECT_EQ(borders, 16u);
    Fan fan; // of a corner of the sheet: one facet or two, from both sides
    ASSERT_TRUE(topology.fan(0, 1, 0, fan));
    int sides = 0;
    for (std::size_t i = 0; i < fan.size(); ++i)
        sides += fan[i].side;
    EXPECT_EQ(sides, 0);
    EXPECT_FALSE(topology.facet(0).singular);
}

TEST(MeshTopology, EdgesOfFourFacetsAreNoSurface) {
    const MeshTopology topology(test::wedges_on_one_edge(0.03));
    for (std::uint32_t f = 0; f < topology.facet_count(); ++f)
        EXPECT_TRUE(topology.facet(f).singular) << f; // each has the edge, or one of its ends
}

TEST(MeshTopology, TwoFansAtAVertexAreNoSurface) {
    TriangleMesh mesh = test::icosphere(0.05, 1);
    test::append(mesh, test::moved(test::icosphere(0.05, 1),
                                   mesh.vertices[0] - test::icosphere(0.05, 1).vertices[3]));
    const MeshTopology topology(mesh);
    std::size_t singular = 0;
    for (std::uint32_t f = 0; f < topology.facet_count(); ++f)
        if (topology.facet(f).singular) ++singular;
    EXPECT_EQ(singular, 10u); // five facets of either sphere at the vertex where they touch
}

TEST(MeshTopology, TrianglesWithoutAreaAreDroppedAndNoBorder) {
    TriangleMesh mesh = test::icosphere(0.05, 1);
    // Between two facets: a vertex on their edge, and the flat triangle that closes the joint.
    const auto t = mesh.triangles[0];
    const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.push_back(0.5 * (mesh.vertices[t[0]] + mesh.vertices[t[1]]));
    mesh.triangles[0] = {t[0], middle, t[2]};
    mesh.triangles.push_back({middle, t[1], t[2]});
    mesh.triangles.push_back({t[0], t[1], middle});
    const MeshTopology topology(mesh);
    EXPECT_TRUE(topology.facet(static_cast<std::uint32_t>(mesh.triangles.size()) - 1).dropped());
    EXPECT_TRUE(topology.facet(0).singular);

    // Such as name a corner twice take nobody's neighbour away.
    TriangleMesh littered = test::icosphere(0.05, 1);
    const std::size_t whole = littered.triangles.size();
    for (std::size_t i = 0; i < whole; ++i)
        littered.triangles.push_back(
            {littered.triangles[i][0], littered.triangles[i][1], littered.triangles[i][1]});
    const MeshTopology clean(littered);
    for (std::uint32_t f = 0; f < whole; ++f) {
        EXPECT_FALSE(clean.facet(f).singular);
        for (int k = 0; k < 3; ++k)
            EXPECT_FALSE(clean.is_border(f, k));
    }
}

TEST(MeshTopology, UnknownVerticesAreRefused) {
    TriangleMesh mesh = test::plate();
    mesh.triangles[3][2] = 99;
    EXPECT_THROW(MeshTopology{mesh}, std::invalid_argument);
}

} // namespace
} // namespace palpate
