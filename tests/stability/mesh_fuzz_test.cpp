// SPDX-License-Identifier: Apache-2.0
// Random probes, jumps of 100 mm among them, round meshes that are hard to touch. PALPATE_FUZZ=50
// makes it a million frames.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/mesh_fuzz.h"
#include "tests/support/odd_meshes.h"

namespace palpate {
namespace {

using test::FuzzPlan;
using test::FuzzResult;

struct Work {
    const char* name;
    TriangleMesh mesh;
    Vec3 start;
    TriangleMesh oriented; ///< for the winding number where the mesh itself is not; else empty
};

std::ostream& operator<<(std::ostream& out, const Work& work) { return out << work.name; }

TriangleMesh two_spheres() {
    TriangleMesh two = test::icosphere(0.03, 3, {-0.015, 0, 0});
    test::append(two, test::icosphere(0.03, 3, {0.015, 0.001, 0.002}));
    return two;
}

/// With so much room between them, m; they overlap where it is less than nothing.
TriangleMesh two_boxes(double room_m) {
    TriangleMesh two = test::box_mesh({-0.03, -0.02, -0.015}, {-0.5 * room_m, 0.02, 0.015});
    test::append(two, test::box_mesh({0.5 * room_m, -0.02, -0.015}, {0.03, 0.02, 0.015}));
    return two;
}

std::vector<Work> clean_works() {
    const TriangleMesh ball = test::icosphere(0.04, 3);
    return {{"SpikesOutside", test::spiky_ball(0.04, 2, 0.5, 1), {0, 0, 0.079}, {}},
            {"SpikesInside", test::spiky_ball(0.04, 2, 0.5, 1), {0, 0, 0}, {}},
            {"FineSpikesOutside", test::spiky_ball(0.04, 3, 0.3, 2), {0, 0, 0.079}, {}},
            {"FineSpikesInside", test::spiky_ball(0.04, 3, 0.3, 2), {0, 0, 0}, {}},
            {"Plate", test::plate(), {0, 0, 0.02}, {}},
            {"PlateInside", test::plate(), {0, 0, 0}, {}},
            {"PlateTurned", test::turned(test::plate()), {0, 0, 0.06}, {}},
            {"Knife", test::knife(0.03, 0.001, 7), {0, 0, 0.02}, {}},
            {"KnifeTurned", test::turned(test::knife(0.03, 0.001, 7)), {0, 0, 0.02}, {}},
            {"PartlyReversed", test::partly_reversed(ball), {0, 0, 0.06}, ball}};
}

std::vector<Work> uncertain_works() {
    const TriangleMesh ball = test::icosphere(0.04, 3);
    return {{"TwoSpheres", two_spheres(), {0, 0, 0.06}, {}},
            {"TwoSpheresInside", two_spheres(), {-0.03, 0, 0}, {}},
            {"Soup", test::soup(ball, 5e-9), {0, 0, 0.06}, {}},
            {"SoupInside", test::soup(ball, 5e-9), {0, 0, 0}, {}},
            {"TJunctions", test::with_t_junctions(ball, 200), {0, 0, 0.06}, {}},
            {"TJunctionsInside", test::with_t_junctions(ball, 200), {0, 0, 0}, {}},
            {"WedgesOnOneEdge", test::wedges_on_one_edge(0.03), {0, 0.05, 0}, {}},
            {"CrackInside", two_boxes(0.7e-9), {-0.015, 0, 0}, {}},
            {"CrackInsideTurned", test::turned(two_boxes(5e-11)), {0, 0, 0.001}, {}},
            {"OverlapInside", two_boxes(-5e-10), {-0.015, 0, 0}, {}}};
}

FuzzResult fuzz(const Work& work, long frames, test::ContactLoop& loop) {
    const TriangleMesh& oriented = work.oriented.triangles.empty() ? work.mesh : work.oriented;
    const double winds = test::winding_number(oriented, work.start);
    FuzzPlan plan;
    plan.frames = frames;
    plan.start = work.start;
    plan.seed = 7;
    plan.check_every = 3;
    return test::fuzz(loop, work.mesh, plan, [&](const Vec3& p) {
        return std::abs(test::winding_number(oriented, p) - winds) > 0.5;
    });
}

FuzzResult run(const Work& work, long frames,
               CertifiedMesh::Certificates certificates = CertifiedMesh::Certificates::computed) {
    test::ContactLoop loop({}, test::one_mesh(test::certified(work.mesh, certificates)));
    return fuzz(work, frames, loop);
}

std::string name_of(const testing::TestParamInfo<Work>& info) { return info.param.name; }

class MeshFuzzClean : public testing::TestWithParam<Work> {};

TEST_P(MeshFuzzClean, NothingGetsThroughAndEveryFrameEnds) {
    const FuzzResult result = run(GetParam(), test::fuzz_frames(20000));
    EXPECT_EQ(result.through, 0);
    EXPECT_GE(result.checks, result.frames / 20);
    EXPECT_GE(result.in_contact, result.frames / 20);
    EXPECT_EQ(result.capped, 0);
    EXPECT_EQ(result.stalled, 0);
    EXPECT_EQ(result.held_moves, 0);
    EXPECT_LE(result.worst_rise, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Works, MeshFuzzClean, testing::ValuesIn(clean_works()), name_of);

class MeshFuzzUncertain : public testing::TestWithParam<Work> {};

TEST_P(MeshFuzzUncertain, NothingGetsThrough) {
    const FuzzResult result = run(GetParam(), test::fuzz_frames(20000));
    EXPECT_EQ(result.through, 0);
    EXPECT_GE(result.checks, result.frames / 20);
    EXPECT_EQ(result.held_moves, 0);
    EXPECT_LE(result.worst_rise, 1e-12);
    // Where facets intersect, a frame in a hundred may end before its time.
    EXPECT_LE(result.capped + result.stalled, result.frames / 100);
}

// With friction the mesh does not lead: the solver proposes, and the mesh carries facet by facet.
// Seen, with the many sub-steps of `paper`: a flight from a certified facet ended at once above
// another, the label of the side was forgotten, and the proxy went out of a box.
TEST_P(MeshFuzzUncertain, NothingGetsThroughWithFriction) {
    SteppingSettings stepping;
    stepping.method = SteppingMethod::paper;
    std::vector<SurfaceFinish> rough(1);
    rough.front().friction = {0.4, 0.3};
    test::ContactLoop loop(stepping, test::one_mesh(test::certified(GetParam().mesh)), {}, 0.0,
                           std::move(rough));
    const FuzzResult result = fuzz(GetParam(), test::fuzz_frames(2000), loop);
    EXPECT_EQ(result.through, 0);
    EXPECT_GE(result.checks, result.frames / 40);
    EXPECT_GE(result.in_contact, result.frames / 20);
    RecordProperty("stalled", std::to_string(result.stalled));
}

INSTANTIATE_TEST_SUITE_P(Works, MeshFuzzUncertain, testing::ValuesIn(uncertain_works()), name_of);

/// Bodies that are surfaces of their own: the solver sees them together, each keeps its
/// certificate.
FuzzResult run_apart(const std::vector<TriangleMesh>& bodies, const Vec3& start, long frames) {
    TriangleMesh all;
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    for (const TriangleMesh& body : bodies) {
        test::append(all, body);
        surfaces.push_back(
            std::make_unique<MeshContact>(test::certified(body), MeshContactSettings{}));
    }
    const auto inside = [&](const Vec3& p) {
        int count = 0;
        for (const TriangleMesh& body : bodies)
            count += test::winding_number(body, p) > 0.5;
        return count;
    };
    const int at_start = inside(start);
    test::ContactLoop loop({}, std::move(surfaces));
    FuzzPlan plan;
    plan.frames = frames;
    plan.start = start;
    plan.seed = 11;
    plan.check_every = 3;
    return test::fuzz(loop, all, plan, [&](const Vec3& p) { return inside(p) != at_start; });
}

TEST(MeshFuzzSeveral, OverlappingBodiesAreHeldTogether) {
    const std::vector<TriangleMesh> balls{test::icosphere(0.03, 3, {-0.015, 0, 0}),
                                          test::icosphere(0.03, 3, {0.015, 0.001, 0.002}),
                                          test::icosphere(0.02, 3, {0.002, 0.025, 0.003})};
    const FuzzResult result = run_apart(balls, {0, 0, 0.06}, test::fuzz_frames(20000));
    EXPECT_EQ(result.through, 0);
    EXPECT_GE(result.checks, result.frames / 20);
    EXPECT_GE(result.in_contact, result.frames / 20);
    EXPECT_EQ(result.held_moves, 0);
    RecordProperty("capped", std::to_string(result.capped));
    RecordProperty("stalled", std::to_string(result.stalled));
    RecordProperty("worst_rise", std::to_string(1e12 * result.worst_rise));
    EXPECT_LE(result.capped + result.stalled, result.frames / 100);
}

// What the certificates are for: walking on facets that have none goes through what is in the way.
TEST(MeshFuzzControl, WithoutCertificatesOverlappingSpheresLeak) {
    const Work work{"", two_spheres(), {-0.03, 0, 0}, {}};
    EXPECT_GT(run(work, 20000, CertifiedMesh::Certificates::assumed).through, 100);
}

} // namespace
} // namespace palpate
