// SPDX-License-Identifier: Apache-2.0
// Contact with bumpy meshes of 500 000 triangles, where the constrained position depends on the way
// there.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/mesh_fuzz.h"
#include "tests/support/mesh_references.h"
#include "tests/support/odd_meshes.h"

namespace palpate {
namespace {

struct Case {
    unsigned seed;
    bool turned;
    double step; // m per frame
};

class MeshStar : public testing::TestWithParam<Case> {};

TEST_P(MeshStar, EveryEndIsALocalMinimumAndWhereASmallStepFlowEnds) {
    const Case param = GetParam();
    TriangleMesh mesh = test::random_star(test::cube_sphere(204), 0.05, 0.06, param.seed);
    if (param.turned) mesh = test::turned(mesh);
    ASSERT_EQ(mesh.triangles.size(), 499392u);
    const auto certified = test::certified(mesh);
    EXPECT_EQ(certified->uncertain_count(), 0u);

    test::ContactLoop loop({}, test::one_mesh(certified));
    const std::vector<Vec3> path = test::out_and_round(param.step, 0.06);
    loop.start(path.front());
    // A step of 0.1 um along the surface that is left leads nearer by reach / |g| of it: 1e-12 m of
    // way left at depths from 1 mm are 1e-16 m, and twice the rounding of a position.
    constexpr double kStep = 1e-7;
    long compared = 0, different = 0, contacts = 0;
    const std::size_t every = path.size() / 1500 + 1;
    for (std::size_t i = 0; i < path.size(); ++i) {
        const Vec3 before = loop.proxy();
        const SubdivisionResult frame = loop.move(path[i]);
        ASSERT_EQ(frame.flags, 0u) << i;
        if (frame.contacts == 0) continue;
        ++contacts;
        const double depth = glm::length(loop.proxy() - path[i]);
        ASSERT_LE(test::descent_left(certified->scene(), loop.proxy(), path[i], kStep),
                  1.5e-12 * kStep / depth + 2e-17)
            << i;
        if (i % every) continue;
        ++compared;
        // Steps round the corners of the way by about their length, and hop over barriers lower
        // than that: where a micrometre ends elsewhere, a tenth decides.
        bool same = false;
        for (const double flow_step : {1e-6, 1e-7}) {
            const Vec3 flow = test::small_step_flow(certified->scene(), before, path[i], flow_step);
            same = glm::length(flow - loop.proxy()) <= 1e-6;
            if (same) break;
        }
        if (!same) ++different;
    }
    EXPECT_GE(contacts, 500);
    EXPECT_GE(compared, 100);
    RecordProperty("different", static_cast<int>(different));
    RecordProperty("compared", static_cast<int>(compared));
    EXPECT_LE(different, compared / 100);
}

INSTANTIATE_TEST_SUITE_P(Stars, MeshStar,
                         testing::Values(Case{1, false, 0.2e-3}, Case{2, true, 0.2e-3},
                                         Case{3, false, 1e-3}));

} // namespace
} // namespace palpate
