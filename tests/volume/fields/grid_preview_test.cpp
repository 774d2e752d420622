// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/grid_field.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include <gtest/gtest.h>

#include <tests/support/grid_cases.h>

namespace palpate {
namespace {

using test::all_frames;
using test::NamedFrame;

/// Directed edges of a mesh, counted.
std::map<std::pair<std::uint32_t, std::uint32_t>, int> directed_edges(const TriangleMesh& mesh) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const auto& t : mesh.triangles)
        for (std::size_t e = 0; e < 3; ++e)
            ++edges[{t[e], t[(e + 1) % 3]}];
    return edges;
}

double signed_volume(const TriangleMesh& mesh) {
    double six_volumes = 0.0;
    for (const auto& t : mesh.triangles)
        six_volumes +=
            glm::dot(mesh.vertices[t[0]], glm::cross(mesh.vertices[t[1]], mesh.vertices[t[2]]));
    return six_volumes / 6.0;
}

TEST(GridPreview, IsClosedOrientedAndOnTheLevel) {
    for (const NamedFrame& f : all_frames()) {
        SCOPED_TRACE(f.name);
        const std::array<int, 3> size{34, 30, 26};
        const Vec3 middle = test::middle_of(size, f.frame);
        // A ball, and one at the corner of the scan that is cut by three faces.
        const VoxelVolume volume = test::sampled(size, f.frame, [&](const Vec3& p) {
            return 1e3 *
                   std::max(8e-3 - glm::length(p - middle), 4e-3 - glm::length(p - f.frame.offset));
        });
        const GridField field(volume, -20.0F);
        const TriangleMesh mesh = field.preview(0.0);
        ASSERT_GT(mesh.triangles.size(), 500U);

        const auto edges = directed_edges(mesh);
        for (const auto& [edge, count] : edges) {
            ASSERT_EQ(count, 1);
            ASSERT_EQ(edges.count({edge.second, edge.first}), 1U);
        }
        // Outwards: the ball 4/3 pi 8^3 = 2145 mm3 and a part of the other, less what chords cut
        // off
        EXPECT_GT(signed_volume(mesh), 1.9e-6);
        const auto sampler = field.make_sampler();
        std::size_t off_level = 0;
        for (const Vec3& v : mesh.vertices)
            off_level += std::abs(sampler->value(v)) > 1e-6; // U, 1e-9 m on a slope of 1000 U/m
        EXPECT_LT(off_level,
                  mesh.vertices.size() / 50); // at the cut, where slopes jump by a factor of 100
        std::size_t inwards = 0;
        for (const auto& t : mesh.triangles) {
            const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
            const Vec3 normal = glm::cross(b - a, c - a);
            inwards += glm::dot(normal, sampler->sample((a + b + c) / 3.0).gradient) > 0.0;
        }
        EXPECT_LT(inwards, mesh.triangles.size() / 50); // slivers that projection turned over
    }
}

TEST(GridPreview, ClosesAroundBadVoxelsAndTiles) {
    const AffineTransform frame = all_frames()[0].frame;
    VoxelVolume volume = test::sampled({32, 32, 32}, frame, [](const Vec3&) { return 100.0; });
    for (int k = 12; k < 20; ++k)
        for (int j = 12; j < 20; ++j)
            for (int i = 12; i < 20; ++i)
                volume.values[volume.index(i, j, k)] = std::nanf("");
    const TriangleMesh mesh = GridField(volume, -100.0F).preview(0.0);
    const auto edges = directed_edges(mesh);
    for (const auto& [edge, count] : edges) {
        ASSERT_EQ(count, 1);
        ASSERT_EQ(edges.count({edge.second, edge.first}), 1U);
    }
    // A block with a hole: levels half a voxel outside the outermost nodes, rounded at corners and
    // edges
    const double voxel = 0.957e-3 * 0.957e-3 * 1.5e-3;
    EXPECT_NEAR(signed_volume(mesh) / voxel, 32.0 * 32.0 * 32.0 - 8.0 * 8.0 * 8.0, 250.0);
}

} // namespace
} // namespace palpate
