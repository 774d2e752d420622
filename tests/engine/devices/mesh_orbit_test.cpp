// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/engine/run/mesh_scene_fixture.h"

namespace palpate {
namespace {

using test::ball;
using test::inner_radius;
using test::kCenter;
using test::kRadius;
using test::MeshScene;

TEST_F(MeshScene, AnOrbitGoesAroundAMeshAndPressesIntoIt) {
    const auto one = scene(mesh_);
    DeviceDescription orbit;
    orbit.duration_s = 5.0;
    const auto states = make_orbit(orbit_target(one->surfaces().front()), orbit, 1000.0);
    ASSERT_GT(states.size(), 1000u);
    EXPECT_GT(glm::length(states.front().position - kCenter), kRadius) << "begins in free space";
    std::size_t deep = 0;
    for (const DeviceState& state : states) {
        const double radius = glm::length(state.position - kCenter);
        // Chords between rays 0.25 mm apart cut off less than a micrometre.
        ASSERT_GE(radius, inner_radius() - 5e-3 - 1e-6);
        if (radius < kRadius - 1e-3) ++deep;
    }
    EXPECT_GT(deep, states.size() / 2);
    EXPECT_GT(run_trace(one, states, clock_).audits.front().mesh_distance_m().size(), deep);
}

TEST_F(MeshScene, AnOrbitFeelsAMeshThatIsACavityFromInside) {
    const SurfaceScene cavity(std::make_shared<TriangleMesh>(test::reversed(ball())));
    DeviceDescription orbit;
    const auto states = make_orbit(orbit_target(cavity), orbit, 1000.0);
    double farthest = 0.0;
    for (const DeviceState& state : states)
        farthest = std::max(farthest, glm::length(state.position - kCenter));
    EXPECT_LT(glm::length(states.front().position - kCenter), inner_radius());
    EXPECT_LE(farthest, kRadius + 5e-3 + 1e-9);
    EXPECT_GE(farthest, kRadius + 4e-3);
}

/// Twelve spikes: beside them the closest point is on an edge or a tip, whose facets face
/// elsewhere.
TriangleMesh spiky_ball() {
    TriangleMesh mesh = test::icosphere(kRadius, 1, kCenter);
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
        mesh.vertices[i] = kCenter + (i < 12 ? 1.4 : 0.5) * (mesh.vertices[i] - kCenter);
    return mesh;
}

/// Distance from the centre to the surface along a direction, for a body that has one facet there.
double radius_along(const TriangleMesh& mesh, const Vec3& direction) {
    for (const auto& t : mesh.triangles) {
        const Vec3 a = mesh.vertices[t[0]] - kCenter, b = mesh.vertices[t[1]] - kCenter,
                   c = mesh.vertices[t[2]] - kCenter;
        if (glm::dot(direction, glm::cross(a, b)) < 0.0 ||
            glm::dot(direction, glm::cross(b, c)) < 0.0 ||
            glm::dot(direction, glm::cross(c, a)) < 0.0)
            continue;
        const Vec3 normal = glm::cross(b - a, c - a);
        return glm::dot(normal, a) / glm::dot(normal, direction);
    }
    return std::numeric_limits<double>::quiet_NaN();
}

TEST_F(MeshScene, InsideIsWhatLiesBehindTheFacetThatIsSeen) {
    for (const TriangleMesh& body :
         {test::bumpy_sphere(kRadius, 4, 0.3, 5.0, kCenter), spiky_ball()}) {
        const SurfaceScene mesh(std::make_shared<TriangleMesh>(body));
        const OrbitTarget target = orbit_target(mesh);
        std::mt19937 random(7);
        std::uniform_real_distribution<double> uniform(-1.4 * kRadius, 1.4 * kRadius);
        std::size_t inside = 0;
        for (int i = 0; i < 2000; ++i) {
            const Vec3 q{uniform(random), uniform(random), uniform(random)};
            const bool expected = glm::length(q) < radius_along(body, glm::normalize(q));
            ASSERT_EQ(target.inside(kCenter + q), expected) << i;
            inside += expected;
        }
        EXPECT_GT(inside, 50u);
        EXPECT_LT(inside, 1700u);
    }
}

} // namespace
} // namespace palpate
