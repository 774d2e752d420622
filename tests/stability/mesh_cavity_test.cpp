// SPDX-License-Identifier: Apache-2.0
// The paper's path on meshes of its cavity, up to 25 times as fast: contact `mesh` is exact
// whatever the speed.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/mesh_fuzz.h"
#include "tests/support/mesh_references.h"
#include "tests/support/odd_meshes.h"

namespace palpate {
namespace {

constexpr double kRadius = 0.05;

struct Case {
    int levels; // 6: 80 k triangles, 7: 330 k
    bool turned;
};

class MeshCavity : public testing::TestWithParam<Case> {};

TEST_P(MeshCavity, TheProxyIsTheClosestPointOfTheMeshAtEverySpeed) {
    const Case param = GetParam();
    const TriangleMesh plain = test::icosphere(kRadius, param.levels);
    const TriangleMesh mesh = param.turned ? test::turned(plain) : plain;
    const auto certified = test::certified(mesh);
    EXPECT_EQ(certified->uncertain_count(), 0u);
    // The probe is 5 mm outside: the closest point is within an edge's length of its projection.
    const test::ConeSearch reference(mesh, 0.05);

    test::ContactLoop loop({}, test::one_mesh(certified));
    for (const double step : {0.2e-3, 1e-3, 2e-3, 5e-3}) {
        const std::vector<Vec3> path = test::out_and_round(step);
        loop.start(path.front());
        double lag = 0.0, reference_lag = 0.0;
        long compared = 0;
        for (std::size_t i = 0; i < path.size(); ++i) {
            const SubdivisionResult frame = loop.move(path[i]);
            ASSERT_EQ(frame.flags, 0u) << i;                                    // none capped
            ASSERT_LE(glm::length(loop.proxy()), kRadius * (1.0 + 1e-15)) << i; // none lost
            if (frame.contacts == 0 || i % 4) continue;
            const Vec3 expected = reference.closest(path[i]);
            ASSERT_LE(glm::length(loop.proxy() - expected), 1e-9) << i;
            const Vec3 radial = kRadius * glm::normalize(path[i]);
            lag = std::max(lag, glm::length(loop.proxy() - radial));
            reference_lag = std::max(reference_lag, glm::length(expected - radial));
            ++compared;
        }
        EXPECT_LE(lag, reference_lag + 1e-9);
        EXPECT_GE(compared, static_cast<long>(path.size() / 5));
    }
}

INSTANTIATE_TEST_SUITE_P(Icospheres, MeshCavity,
                         testing::Values(Case{6, false}, Case{6, true}, Case{7, false},
                                         Case{7, true}));

// Over and back again: nothing is remembered of the way.
TEST(MeshCavityPath, ThereAndBackIsTheSame) {
    test::ContactLoop loop({}, test::one_mesh(test::certified(test::icosphere(kRadius, 6))));
    const std::vector<Vec3> path = test::out_and_round(1e-3);
    loop.start(path.front());
    std::vector<Vec3> there;
    for (const Vec3& probe : path) {
        loop.move(probe);
        there.push_back(loop.proxy());
    }
    for (std::size_t i = path.size(); i-- > 0;) {
        loop.move(path[i]);
        ASSERT_LE(glm::length(loop.proxy() - there[i]), 1.5e-12) << i;
    }
}

} // namespace
} // namespace palpate
