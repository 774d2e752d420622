// SPDX-License-Identifier: Apache-2.0
// Wedges and grooves of every angle, felt in every way: the bounds of the table in
// docs/stability.md, which `palpate_stability --wedges` prints. And what random scenes found there.
#include <cmath>
#include <span>

#include <gtest/gtest.h>

#include <palpate/haptics/contact/mesh_contact.h>

#include "tests/stability/random/random_meshes.h"
#include "tests/stability/random/wedge_table.h"
#include "tests/support/contact_loop.h"
#include "tests/support/odd_meshes.h"
#include "tests/support/stepping_methods.h"

namespace palpate {
namespace {

using stability::WedgeResult;
using stability::WedgeShape;
using test::Kind;

constexpr double kRounding_m = 1e-12;
constexpr double kCertificate_m = 25e-6; // LevelSettings::certificate_m

class Wedges : public testing::TestWithParam<SteppingMethod> {};
INSTANTIATE_TEST_SUITE_P(Every, Wedges, testing::ValuesIn(test::kEveryMethod),
                         [](const testing::TestParamInfo<SteppingMethod>& of) {
                             return test::name_of(of.param);
                         });

TEST_P(Wedges, OfFormulasAndMeshesAreNotEntered) {
    for (const WedgeShape shape : {WedgeShape::wedge, WedgeShape::groove}) {
        const WedgeResult formula = stability::worst_wedge(shape, Kind::formula, GetParam());
        EXPECT_LE(formula.penetration_m, kCertificate_m + kRounding_m);
        EXPECT_EQ(formula.rest_m, 0.0);
        const WedgeResult mesh = stability::worst_wedge(shape, Kind::mesh, GetParam());
        EXPECT_LE(mesh.penetration_m, kRounding_m);
        EXPECT_EQ(mesh.rest_m, 0.0);
    }
}

TEST_P(Wedges, LeaveNoForceInFreeSpaceInAGroove) {
    for (const Kind kind : {Kind::formula, Kind::volume, Kind::mesh, Kind::guarded})
        EXPECT_LE(stability::worst_wedge(WedgeShape::groove, kind, GetParam()).ghost_n, 1e-9)
            << test::name_of(kind);
}

// Over an edge the force is gone once nothing is in the way. By a formula an edge that is sharper
// than the reach of its certificate is felt a frame longer, with what it was pressed with. A guard
// is not in it: where voxels and mesh are farther apart than its leash, the proxy comes over the
// edge late.
TEST_P(Wedges, LeaveNoForceInFreeSpaceOverAnEdge) {
    constexpr double kPressed_n = test::ContactLoop::kStiffness * stability::kWedgePressed_m;
    EXPECT_LE(stability::worst_wedge(WedgeShape::wedge, Kind::formula, GetParam()).ghost_n,
              kPressed_n + 1e-9);
    for (const Kind kind : {Kind::volume, Kind::mesh})
        EXPECT_LE(stability::worst_wedge(WedgeShape::wedge, kind, GetParam()).ghost_n, 1e-9)
            << test::name_of(kind);
}

// Where voxels have lost an edge, the mesh is what holds the proxy, no farther than the leash.
TEST_P(Wedges, AGuardHoldsAnEdgeThatVoxelsHaveLost) {
    for (const WedgeShape shape : {WedgeShape::wedge, WedgeShape::groove})
        EXPECT_LE(stability::worst_wedge(shape, Kind::guarded, GetParam()).penetration_m,
                  stability::kWedgeLeash_m + kRounding_m);
}

// Voxels cut edges off and fill corners: by less than half of one.
TEST_P(Wedges, OfVoxelsAreEnteredByLessThanHalfAVoxel) {
    for (const Kind kind : {Kind::volume, Kind::guarded})
        for (const WedgeShape shape : {WedgeShape::wedge, WedgeShape::groove}) {
            const WedgeResult worst = stability::worst_wedge(shape, kind, GetParam());
            EXPECT_LE(worst.penetration_m, 0.5 * stability::kWedgeVoxel_m) << test::name_of(kind);
            EXPECT_EQ(worst.rest_m, 0.0) << test::name_of(kind);
        }
}

// Seen: on its way over the very edge of a sharp wedge the proxy met the facet behind, took it for
// the one in front, and was inside from then on.
TEST(SharpWedge, MetExactlyOnItsEdgeIsNotEntered) {
    for (const double angle_deg : {5.0, 20.0, 45.0, 80.0})
        for (const double sign : {-1.0, 1.0}) {
            const TriangleMesh mesh = stability::prism(angle_deg, 0.02);
            test::ContactLoop loop({}, test::one_mesh(test::certified(mesh)));
            const Vec3 start{sign * 1e-3, 0.3e-3, 0.5e-3};
            loop.start(start);
            for (int i = 1; i <= 20; ++i) {
                loop.move(-0.5 * i * start); // through the edge, which is the y axis
                const Vec3 x = loop.proxy(), back = x - (-0.5 * i * start);
                const double length = glm::length(back);
                const Vec3 off = length > 1e-8 ? x + 1e-8 / length * back : x;
                ASSERT_LT(test::winding_number(mesh, off), 0.5)
                    << angle_deg << " degrees, frame " << i;
            }
        }
}

// Seen: a facet of 1.9 m by 0.2 mm. The point of it that a ray had met was wrong by 0.3 nm along
// it, 24 tolerances; the proxy was taken to be elsewhere than on it, and went on through it.
TEST(Sliver, IsNotPassed) {
    TriangleMesh mesh;
    mesh.vertices = {{0.82169511061305589, -0.34541382861509068, 0.77990925545879497},
                     {-0.21249530178663317, 0.96588577669857167, 0.65166128291025072},
                     {-0.21264376398960377, 0.9657793742866202, 0.65177054581586258}};
    mesh.triangles = {{0, 1, 2}};
    test::ContactLoop loop({}, test::one_mesh(test::certified(mesh)));
    loop.start({0.18871, 0.08455, 1.12151});
    loop.move({0.72238, 0.50166, -0.04552});
    const std::span<const Vec3> path = loop.subdivision().path();
    ASSERT_GE(path.size(), 3U);
    // It goes over an edge of it, if anywhere: not from where it has met it.
    const Vec3 corner = mesh.vertices[0];
    const Vec3 normal =
        glm::normalize(glm::cross(mesh.vertices[1] - corner, mesh.vertices[2] - corner));
    const double height_m = glm::dot(normal, path[2] - corner);
    EXPECT_LT(std::abs(height_m), 1e-9) << "it left the facet's plane";
}

// Seen: of two surfaces the other one stopped the proxy where it had just left this one, by a
// picometre. Rounding then said on which side of the facet it was.
TEST(CutOffFlight, LeavesTheProxyOnItsSide) {
    const TriangleMesh mesh = test::turned(test::plate());
    MeshContact contact(test::certified(mesh), {});
    ContactSet contacts;
    int places = 0;
    for (const auto& t : mesh.triangles)
        for (int place = 0; place < 20; ++place) {
            const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
            const Vec3 n = glm::normalize(glm::cross(b - a, c - a));
            const Vec3 q = a + (0.2 + 0.02 * place) * (b - a) + (0.3 - 0.01 * place) * (c - a);
            const Vec3 start = q + 1e-3 * n;
            contact.restart(start);
            const Chord down = contact.carry(start, q - 1e-3 * n);
            const Vec3 on = start - down.fraction * 2e-3 * n;
            contacts.clear();
            contact.offer(on, contacts);
            contact.commit(on, false, true);
            const Vec3 away = 1e-3 * glm::normalize(b - a) + 5e-5 * n;
            ASSERT_EQ(contact.carry(on, on + away).fraction, 1.0);
            const Vec3 cut = on + 5e-9 * away; // 5 pm, and 0.25 pm high: within the tolerance
            contacts.clear();
            contact.offer(cut, contacts);
            EXPECT_LE(contact.carry(cut, cut - 2e-3 * n).fraction, 1e-6) << "place " << place;
            ++places;
        }
    EXPECT_EQ(places, 240);
}

} // namespace
} // namespace palpate
