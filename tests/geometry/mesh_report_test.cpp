// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/mesh_report.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <palpate/geometry/internal/mesh_nesting.h>

#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

TEST(Inspect, EmptyMeshHasNothingAndIsNotClosed) {
    const MeshReport report = inspect({});
    EXPECT_EQ(report.triangles, 0u);
    EXPECT_EQ(report.smallest_angle_deg, 0.0);
    EXPECT_FALSE(report.closed());
    EXPECT_TRUE(report.components.empty());
}

// It has no edge, and thus no border.
TEST(Inspect, AFaceThatIsALineIsNotClosed) {
    TriangleMesh mesh;
    mesh.vertices = {Vec3(0.0), Vec3(0.1)};
    mesh.triangles = {{0, 0, 1}};
    const MeshReport report = inspect(mesh);
    EXPECT_EQ(report.collapsed, 1u);
    EXPECT_EQ(report.border_edges, 0u);
    EXPECT_FALSE(report.closed());
}

TEST(Inspect, BoxHasItsAreaVolumeAndAngle) {
    const MeshReport report = inspect(test::box_mesh({0.0, 0.0, 0.0}, {0.1, 0.1, 0.1}));
    EXPECT_TRUE(report.closed());
    EXPECT_TRUE(report.manifold());
    // A handful of products of numbers of size 0.1: relative rounding of a few 1e-16.
    EXPECT_NEAR(report.area_m2, 0.06, 1e-16);
    EXPECT_NEAR(report.volume_m3, 1e-3, 1e-17);
    EXPECT_NEAR(report.smallest_angle_deg, 45.0, 1e-12);
    EXPECT_EQ(report.components.size(), 1u);
    EXPECT_EQ(report.bounds.upper, Vec3(0.1));
}

TEST(Inspect, SphereFarAwayKeepsItsVolume) {
    const MeshReport near = inspect(test::icosphere(0.05, 4));
    const MeshReport far = inspect(test::moved(test::icosphere(0.05, 4), Vec3(10.0, -20.0, 30.0)));
    EXPECT_TRUE(far.closed() && far.manifold());
    // Vertices are rounded to ulp(30 m) = 3.6e-15 m: volume changes by at most that times the
    // area, 1.1e-16 m^3.
    EXPECT_NEAR(far.volume_m3, near.volume_m3, 1.2e-16);
    const double ball = 4.0 / 3.0 * std::numbers::pi * std::pow(0.05, 3);
    EXPECT_GT(near.volume_m3, 0.99 * ball);
    EXPECT_LT(near.volume_m3, ball);
}

TEST(Inspect, ReversedMeshHasNegativeVolume) {
    const TriangleMesh mesh = test::icosphere(0.05, 2);
    EXPECT_EQ(inspect(test::reversed(mesh)).volume_m3, -inspect(mesh).volume_m3);
}

TEST(Inspect, SheetHasItsBorder) {
    const MeshReport report = inspect(test::sheet(0.06, 5));
    EXPECT_EQ(report.border_edges, 20u);
    EXPECT_FALSE(report.closed());
    EXPECT_TRUE(report.manifold());
}

TEST(Inspect, OneTriangleTurnedRoundIsNotManifold) {
    TriangleMesh mesh = test::icosphere(0.05, 1);
    std::swap(mesh.triangles[7][0], mesh.triangles[7][1]);
    const MeshReport report = inspect(mesh);
    EXPECT_EQ(report.non_manifold_edges, 3u);
    EXPECT_EQ(report.border_edges, 0u);
}

TEST(Inspect, ThirdTriangleAtAnEdgeIsNotManifold) {
    TriangleMesh mesh = test::sheet(0.06, 1);
    mesh.vertices.push_back({0.0, 0.0, 0.01});
    mesh.triangles.push_back({0, 3, 4}); // 0-3 is the diagonal
    EXPECT_EQ(inspect(mesh).non_manifold_edges, 1u);
}

TEST(Inspect, TwoConesThatShareTheirTipAreOneComponentWithASplitVertex) {
    TriangleMesh mesh = test::box_mesh({0.0, 0.0, 0.0}, {0.1, 0.1, 0.1});
    TriangleMesh other = test::box_mesh({0.1, 0.1, 0.1}, {0.2, 0.2, 0.2});
    test::append(mesh, other);
    for (auto& triangle : mesh.triangles)
        for (auto& vertex : triangle)
            if (vertex == 8) vertex = 7; // the corner where they meet
    const MeshReport report = inspect(mesh);
    EXPECT_EQ(report.non_manifold_vertices, 1u);
    EXPECT_EQ(report.non_manifold_edges, 0u);
    EXPECT_TRUE(report.closed());
    EXPECT_EQ(report.components.size(), 1u);
}

TEST(Inspect, ComponentsComeLargestFirst) {
    TriangleMesh mesh = test::icosphere(0.01, 2);
    test::append(mesh, test::icosphere(0.03, 2, Vec3(0.1, 0.0, 0.0)));
    test::append(mesh, test::reversed(test::icosphere(0.02, 2, Vec3(0.1, 0.0, 0.0))));
    const MeshReport report = inspect(mesh);
    ASSERT_EQ(report.components.size(), 3u);
    EXPECT_NEAR(report.components[0].bounds.extent().z, 0.06, 1e-4 * 0.06 + 0.003);
    EXPECT_GT(report.components[0].volume_m3, 0.0);
    EXPECT_LT(report.components[1].volume_m3, 0.0);
    EXPECT_GT(report.components[1].area_m2, report.components[2].area_m2);
    EXPECT_EQ(report.components[2].triangles, 320u);
    EXPECT_EQ(report.components[2].sample, mesh.vertices[mesh.triangles[0][0]]);
}

TEST(Inspect, CountsDegenerateTriangles) {
    TriangleMesh mesh = test::sheet(0.06, 1);
    mesh.triangles.push_back({0, 1, 1});
    mesh.vertices.push_back(
        {0.0, -0.03, 1e-12}); // almost on the side 0-1: |cross| / side^2 = 2e-11
    mesh.triangles.push_back({0, 1, 4});
    EXPECT_EQ(inspect(mesh).degenerate, 2u);
}

TEST(Inspect, TriangleOfAnUnknownVertexIsRefused) {
    TriangleMesh mesh = test::sheet(0.06, 1);
    mesh.triangles.push_back({0, 1, 4});
    EXPECT_THROW(inspect(mesh), std::invalid_argument);
}

TEST(Inspect, LargeMeshIsQuick) {
    TriangleMesh mesh = test::icosphere(0.1, 7);
    test::append(mesh, test::icosphere(0.1, 7, Vec3(1.0, 0.0, 0.0)));
    const auto start = std::chrono::steady_clock::now();
    const MeshReport report = inspect(mesh);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    EXPECT_EQ(report.components.size(), 2u);
    RecordProperty("seconds_for_655360_triangles", std::to_string(taken.count()));
    EXPECT_LT(taken.count(), 60.0); // no timing test: a quadratic method takes hours
}

TEST(Inspect, CollapsedTriangleLeavesItsNeighboursJoined) {
    TriangleMesh mesh = test::icosphere(0.05, 1);
    mesh.triangles.push_back({0, 12, 12}); // an edge of the mesh and back
    const MeshReport report = inspect(mesh);
    EXPECT_EQ(report.degenerate, 1u);
    EXPECT_TRUE(report.closed() && report.manifold());
    EXPECT_TRUE(report.components.at(0).closed);
}

TEST(Inspect, CountsRepeatedTrianglesWhicheverWayTheyFace) {
    TriangleMesh mesh = test::sheet(0.06, 2);
    EXPECT_EQ(inspect(mesh).duplicates, 0u);
    const auto t = mesh.triangles[3];
    mesh.triangles.push_back({t[1], t[2], t[0]});
    mesh.triangles.push_back({t[1], t[0], t[2]});
    EXPECT_EQ(inspect(mesh).duplicates, 2u);
}

TEST(Inspect, CountsVerticesThatAreUnusedOrOnTopOfOthers) {
    TriangleMesh mesh = test::sheet(0.06, 1);
    mesh.vertices.push_back(mesh.vertices[0]); // unused, and therefore no matter where
    EXPECT_EQ(inspect(mesh).unused_vertices, 1u);
    EXPECT_EQ(inspect(mesh).coincident_vertices, 0u);
    mesh.triangles[1][0] = 4; // the sheet is cut along its diagonal at one end
    const MeshReport report = inspect(mesh);
    EXPECT_EQ(report.unused_vertices, 0u);
    EXPECT_EQ(report.coincident_vertices, 1u);
    EXPECT_EQ(report.border_edges, 6u);
}

TEST(Inspect, LoneShellThatFacesInwardsIsInsideOut) {
    EXPECT_EQ(inspect(test::icosphere(0.05, 2)).inside_out, 0u);
    EXPECT_EQ(inspect(test::reversed(test::icosphere(0.05, 2))).inside_out, 1u);
}

TEST(Inspect, VoidInABodyFacesInwardsRightly) {
    TriangleMesh mesh = test::icosphere(0.05, 2);
    test::append(mesh, test::reversed(test::icosphere(0.03, 2)));
    test::append(mesh, test::icosphere(0.01, 1)); // a stone in the void
    EXPECT_EQ(inspect(mesh).inside_out, 0u);
    EXPECT_EQ(inspect(test::reversed(mesh)).inside_out, 3u);
}

TEST(Inspect, BodyWithinABodyIsNotInsideOut) {
    TriangleMesh mesh = test::icosphere(0.05, 2);
    test::append(mesh, test::icosphere(0.03, 2));
    EXPECT_EQ(inspect(mesh).inside_out, 0u);
}

TEST(Inspect, ShellBesideOrAboveABodyIsNotWithinIt) {
    // In the body's bounds, but outside: a corner of the box around a ball; and right above it.
    for (const Vec3& place : {Vec3(0.045, 0.045, 0.045), Vec3(0.0, 0.0, 0.08),
                              Vec3(0.0, 0.0, -0.08), Vec3(0.08, 0.0, 0.0)}) {
        TriangleMesh mesh = test::icosphere(0.05, 3);
        test::append(mesh, test::reversed(test::icosphere(0.005, 1, place)));
        EXPECT_EQ(inspect(mesh).inside_out, 1u) << place.x << " " << place.z;
    }
}

TEST(Inspect, OpenOrMixedComponentsAreNeitherClosedNorInsideOut) {
    const TriangleMesh open = test::reversed(test::sheet(0.06, 3));
    EXPECT_FALSE(inspect(open).components.at(0).closed);
    EXPECT_EQ(inspect(open).inside_out, 0u);
    TriangleMesh mixed = test::reversed(test::icosphere(0.05, 1));
    std::swap(mixed.triangles[7][0], mixed.triangles[7][1]);
    EXPECT_FALSE(inspect(mixed).components.at(0).closed);
    EXPECT_EQ(inspect(mixed).inside_out, 0u);
}

// Axis-parallel boxes with the points right above and below their edges and vertices: every line
// meets some exactly, where rounding could count a triangle twice or not at all.
TEST(EnclosingComponents, LinesThroughEdgesAndVerticesCountOnce) {
    TriangleMesh mesh = test::box_mesh(Vec3(-2.0), Vec3(2.0));
    test::append(mesh, test::box_mesh(Vec3(-4.0), Vec3(4.0)));
    test::append(mesh, test::icosphere(3.0, 3, Vec3(20.0, 0.0, 0.0)));
    std::vector<Vec3> points;
    for (int x = -5; x <= 5; ++x)
        for (int y = -5; y <= 5; ++y)
            for (int z = -5; z <= 5; ++z)
                points.push_back(Vec3(x, y, z + 0.5)); // never on a face, often under an edge
    const auto enclosing =
        internal::enclosing_components(mesh, internal::label_components(mesh), points);
    for (std::size_t k = 0; k < points.size(); ++k) {
        const Vec3 size = glm::abs(points[k]);
        const double most = std::max({size.x, size.y, size.z});
        const double flat = std::max(size.x, size.y);
        const bool on_side = (flat == 2.0 && size.z < 2.0) || (flat == 4.0 && size.z < 4.0);
        if (on_side) continue; // on a surface both are right
        std::vector<std::uint32_t> expected;
        if (most < 2.0) expected.push_back(0);
        if (most < 4.0) expected.push_back(1);
        ASSERT_EQ(enclosing[k], expected)
            << points[k].x << " " << points[k].y << " " << points[k].z;
    }
}

TEST(EnclosingComponents, AgreeWithTheWindingNumber) {
    std::mt19937_64 random(5);
    TriangleMesh mesh;
    std::vector<TriangleMesh> parts;
    for (int k = 0; k < 4; ++k) {
        const Vec3 center(0.02 * k, 0.01 * (k % 2), 0.0);
        parts.push_back(test::bumpy_sphere(0.02 + 0.01 * k, 3, 0.3, 5.0, center));
        test::append(mesh, parts.back());
    }
    std::uniform_real_distribution<double> in(-0.03, 0.07);
    std::vector<Vec3> points(300);
    for (Vec3& p : points)
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = in(random);
    const auto enclosing =
        internal::enclosing_components(mesh, internal::label_components(mesh), points);
    std::size_t found = 0;
    for (std::size_t k = 0; k < points.size(); ++k) {
        std::vector<std::uint32_t> expected;
        for (std::uint32_t part = 0; part < parts.size(); ++part) {
            double winding = 0.0; // van Oosterom and Strackee 1983
            for (const auto& t : parts[part].triangles) {
                const Vec3 a = parts[part].vertices[t[0]] - points[k];
                const Vec3 b = parts[part].vertices[t[1]] - points[k];
                const Vec3 c = parts[part].vertices[t[2]] - points[k];
                const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
                winding += std::atan2(glm::dot(a, glm::cross(b, c)),
                                      la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la +
                                          glm::dot(c, a) * lb) /
                           (2.0 * std::numbers::pi);
            }
            if (winding > 0.5) expected.push_back(part);
        }
        found += expected.size();
        ASSERT_EQ(enclosing[k], expected) << "point " << k;
    }
    EXPECT_GT(found, 100u); // enough of them inside to mean something
}

bool says(const std::vector<std::string>& sentences, const std::string& what) {
    for (const std::string& sentence : sentences)
        if (sentence.find(what) != std::string::npos) return true;
    return false;
}

TEST(MeaningForContact, SoundMeshHasOneSentence) {
    const MeshReport report = inspect(test::icosphere(0.05, 2));
    const auto meaning = meaning_for_contact(report, 0);
    ASSERT_EQ(meaning.size(), 1u);
    EXPECT_TRUE(says(meaning, "nothing passes through"));
    const auto unknown = meaning_for_contact(report, std::nullopt);
    ASSERT_EQ(unknown.size(), 2u);
    EXPECT_TRUE(says(unknown, "not looked for"));
}

TEST(MeaningForContact, EveryDefectHasItsSentence) {
    EXPECT_TRUE(says(meaning_for_contact(inspect({}), 0), "nothing can be felt"));
    MeshReport report = inspect(test::icosphere(0.05, 2));
    const auto expect_sentence = [&](std::size_t& defect, const std::string& one,
                                     const std::string& many) {
        for (const std::size_t count : {1u, 3u}) {
            defect = count;
            const auto meaning = meaning_for_contact(report, 0);
            ASSERT_EQ(meaning.size(), 1u) << one;
            EXPECT_TRUE(meaning[0].starts_with(count == 1 ? one : many)) << meaning[0];
            EXPECT_TRUE(meaning[0].ends_with('.'));
        }
        defect = 0;
    };
    expect_sentence(report.border_edges, "1 border edge:", "3 border edges:");
    expect_sentence(report.non_manifold_edges, "1 non-manifold edge:", "3 non-manifold edges:");
    expect_sentence(report.non_manifold_vertices,
                    "1 non-manifold vertex:", "3 non-manifold vertices:");
    expect_sentence(report.inside_out, "1 closed component is", "3 closed components are");
    expect_sentence(report.degenerate, "1 triangle without", "3 triangles without");
    expect_sentence(report.duplicates, "1 triangle repeats", "3 triangles repeat");
    expect_sentence(report.coincident_vertices, "1 vertex lies", "3 vertices lie");
    expect_sentence(report.unused_vertices, "1 vertex of no", "3 vertices of no");
    EXPECT_TRUE(meaning_for_contact(report, 1).at(0).starts_with("1 pair of triangles intersects"));
    EXPECT_TRUE(meaning_for_contact(report, 2).at(0).starts_with("2 pairs of triangles intersect"));
}

} // namespace
} // namespace palpate
