// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/mesh_sharpness.h>

#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

TEST(SharpEdges, ABoxHasTwelveOfEighteen) {
    const TriangleMesh box = test::box_mesh({0.0, 0.0, 0.0}, {0.01, 0.02, 0.03});
    ASSERT_EQ(box.triangles.size(), 12u) << "two a side, so 18 edges of which 6 are diagonals";
    EXPECT_DOUBLE_EQ(share_of_sharp_edges(box, 40.0), 12.0 / 18.0);
    EXPECT_DOUBLE_EQ(share_of_sharp_edges(box, 91.0), 0.0) << "they turn by 90 degrees";
}

TEST(SharpEdges, AFineSphereHasNone) {
    // 1280 triangles: neighbours turn by about 2 / sqrt(1280 / 4) rad = 6 degrees, at most twice
    // that.
    const TriangleMesh sphere = test::icosphere(0.05, 3);
    EXPECT_DOUBLE_EQ(share_of_sharp_edges(sphere, 13.0), 0.0);
    EXPECT_GT(share_of_sharp_edges(sphere, 3.0), 0.5);
}

TEST(SharpEdges, BordersAndDegenerateTrianglesAreNotCounted) {
    TriangleMesh sheet = test::sheet(0.1, 1); // two triangles, one inner edge, flat
    EXPECT_DOUBLE_EQ(share_of_sharp_edges(sheet, 1.0), 0.0);
    sheet.triangles.push_back({0, 1, 1});
    EXPECT_DOUBLE_EQ(share_of_sharp_edges(sheet, 1.0), 0.0);
    EXPECT_DOUBLE_EQ(share_of_sharp_edges(TriangleMesh{}, 1.0), 0.0);
    sheet.triangles.push_back({0, 1, 99});
    EXPECT_THROW(share_of_sharp_edges(sheet, 1.0), std::invalid_argument);
}

} // namespace
} // namespace palpate
