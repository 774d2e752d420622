// SPDX-License-Identifier: Apache-2.0
// Bodies that move and turn at random, among them and against each other, with a hand that jumps:
// none of them passes the proxy. PALPATE_FUZZ=50 makes it a million frames.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/contact/moving_contact.h>
#include <palpate/haptics/contact/volume_contact.h>
#include <palpate/haptics/stepping/frame_flags.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/contact_kinds.h"
#include "tests/support/contact_loop.h"
#include "tests/support/mesh_fuzz.h"
#include "tests/support/odd_meshes.h"

namespace palpate {
namespace {

using test::ContactLoop;

enum class Side { inside, on, outside };

/// A body, and on which side of it a point of its own frame is, by means that no contact has.
struct Body {
    std::string name;
    std::function<std::unique_ptr<SurfaceContact>()> contact;
    std::function<Side(const Vec3&)> side;
    bool moves = true;
};

/// A closed mesh: inside is where it winds round the point. On it is within a hair.
Body mesh_body(std::string name, const TriangleMesh& mesh, bool moves = true) {
    const auto certified = test::certified(mesh);
    return {std::move(name),
            [certified] {
                return std::make_unique<MeshContact>(certified, MeshContactSettings{});
            },
            [certified](const Vec3& p) {
                if (certified->scene().closest_point(p, 1e-7)) return Side::on;
                return test::winding_number(certified->scene().mesh(), p) > 0.5 ? Side::inside
                                                                                : Side::outside;
            },
            moves};
}

/// By the radius, of a certificate that ends `behind_m` behind the level.
std::function<Side(const Vec3&)> side_of_ball(double radius_m, double behind_m) {
    return [=](const Vec3& p) {
        if (glm::length(p) < radius_m - behind_m) return Side::inside;
        return glm::length(p) > radius_m + behind_m ? Side::outside : Side::on;
    };
}

/// A ball by a formula.
Body ball_body(double radius_m) {
    return {"ball",
            [=] {
                return std::make_unique<VolumeContact>(make_solid_sphere(radius_m),
                                                       LevelSettings{});
            },
            side_of_ball(radius_m, 1.001 * LevelSettings{}.certificate_m)};
}

Body guarded_ball(double radius_m) {
    constexpr double kVoxel_m = 0.5e-3;
    const auto grid = test::voxels_of([=](const Vec3& p) { return radius_m - glm::length(p); },
                                      radius_m + 4e-3, kVoxel_m);
    const auto mesh = test::certified(test::icosphere(radius_m, 5));
    return {"guarded",
            [=] {
                return std::make_unique<GuardedContact>(grid, LevelSettings{}, mesh, 1e-3);
            },
            // Between voxels the distance errs by h^2 / (4 R), and its slope by sqrt(3) h / R.
            side_of_ball(radius_m, LevelSettings{}.certificate_m *
                                           (1.0 + std::sqrt(3.0) * kVoxel_m / radius_m) +
                                       0.25 * kVoxel_m * kVoxel_m / radius_m)};
}

struct Case {
    std::string name;
    std::vector<Body> bodies;
    Vec3 start{0.0};
    double apart_m = 0.0; ///< bodies' places are about so far from each other
};

std::ostream& operator<<(std::ostream& out, const Case& of) { return out << of.name; }

std::vector<Case> cases() {
    const TriangleMesh spikes = test::spiky_ball(0.02, 2, 0.4, 3);
    const TriangleMesh table = test::box_mesh({-0.2, -0.2, -0.02}, {0.2, 0.2, 0.0});
    return {
        {"Plate", {mesh_body("plate", test::plate())}, {0, 0, 0.03}, 0.0},
        {"Knife", {mesh_body("knife", test::knife(0.03, 0.001, 7))}, {0, 0, 0.03}, 0.0},
        {"SpikesOutside", {mesh_body("spikes", spikes)}, {0, 0, 0.05}, 0.0},
        {"SpikesInside", {mesh_body("spikes", spikes)}, {0, 0, 0}, 0.0},
        {"Ball", {ball_body(0.02)}, {0, 0, 0.05}, 0.0},
        {"Guarded", {guarded_ball(0.02)}, {0, 0, 0.05}, 0.0},
        {"TwoPlates",
         {mesh_body("plate", test::plate()), mesh_body("plate", test::plate())},
         {0, 0, 0.05},
         0.08},
        {"OnATable",
         {mesh_body("spikes", spikes), ball_body(0.015), mesh_body("table", table, false)},
         {0, 0, 0.05},
         0.06},
        {"ThreeThatMeet",
         {mesh_body("spikes", spikes), ball_body(0.02), guarded_ball(0.015)},
         {0, 0, 0.07},
         0.03},
    };
}

struct Counts {
    long frames = 0, in_contact = 0, moved = 0, held_back = 0, passed = 0, not_finite = 0,
         stalled = 0;
};

Counts run(const Case& of, long frames, unsigned seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    const auto vector = [&](double size) {
        const double x = normal(random), y = normal(random), z = normal(random);
        return size * Vec3{x, y, z};
    };

    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    for (const Body& body : of.bodies) {
        std::unique_ptr<SurfaceContact> contact = body.contact();
        if (body.moves) contact = std::make_unique<MovingContact>(std::move(contact));
        surfaces.push_back(std::move(contact));
    }
    ContactLoop loop({}, std::move(surfaces));
    const auto felt_pose = [&](std::size_t i) {
        const MovingSurface* body = loop.subdivision().surface(i).moving();
        return body ? body->pose() : RigidPose{};
    };
    // Side by side, so that the start is in none of them.
    std::vector<RigidPose> poses(of.bodies.size());
    std::vector<Vec3> homes(of.bodies.size(), Vec3{0.0});
    for (std::size_t i = 0; i < of.bodies.size(); ++i) {
        homes[i] = of.apart_m * Vec3{static_cast<double>(i), 0.0, 0.0};
        if (!of.bodies[i].moves) homes[i] = Vec3{0.0};
        poses[i].position = homes[i];
        if (of.bodies[i].moves) loop.subdivision().surface(i).moving()->set_pose(poses[i]);
    }
    std::vector<Side> began; // on which side of each
    loop.start(of.start);
    for (std::size_t i = 0; i < of.bodies.size(); ++i)
        began.push_back(of.bodies[i].side(RigidMap(felt_pose(i)).point_back(of.start)));

    Counts counts;
    Vec3 probe = of.start;
    for (long frame = 0; frame < frames; ++frame) {
        const double kind = uniform(random);
        if (kind < 0.03) // somewhere about one of them
            probe = felt_pose(random() % of.bodies.size()).position + vector(0.012);
        else if (kind < 0.8)
            probe += vector(std::pow(10.0, -5.0 + 2.5 * uniform(random)));
        if (glm::length(probe) > 0.15) probe *= 0.15 / glm::length(probe);
        for (std::size_t i = 0; i < of.bodies.size(); ++i) {
            if (!of.bodies[i].moves || uniform(random) < 0.3) continue;
            RigidPose& pose = poses[i];
            if (uniform(random) < 0.01) { // to another place at once
                pose = {homes[i] + vector(0.03),
                        glm::angleAxis(6.0 * uniform(random), glm::normalize(vector(1.0)))};
            } else { // up to 10 m/s, and 100 rad/s
                pose.position += vector(std::pow(10.0, -6.0 + 4.0 * uniform(random)));
                pose.position += 0.02 * (homes[i] - pose.position);
                pose.orientation = glm::normalize(
                    pose.orientation * glm::angleAxis(std::pow(10.0, -5.0 + 4.0 * uniform(random)),
                                                      glm::normalize(vector(1.0))));
            }
            loop.subdivision().surface(i).moving()->set_pose(pose);
        }
        const SubdivisionResult result = loop.move(probe);
        ++counts.frames;
        counts.in_contact += result.felt != 0;
        counts.moved += (result.flags & kBodyMoved) != 0;
        counts.held_back += (result.flags & kBodyHeldBack) != 0;
        counts.stalled += (result.flags & kStalled) != 0;
        counts.not_finite += !is_finite(result.proxy) || (result.flags & kForceNotFinite) != 0;
        for (std::size_t i = 0; i < of.bodies.size(); ++i) {
            const Side side =
                of.bodies[i].side(RigidMap(felt_pose(i)).point_back(result.proxy));
            counts.passed += side != Side::on && side != began[i];
        }
    }
    return counts;
}

class MovingBodies : public testing::TestWithParam<Case> {};

TEST_P(MovingBodies, NonePassesTheProxy) {
    const long frames = test::fuzz_frames(4000);
    const Counts counts = run(GetParam(), frames, 11);
    RecordProperty("frames", std::to_string(counts.frames));
    RecordProperty("held_back", std::to_string(counts.held_back));
    EXPECT_EQ(counts.passed, 0);
    EXPECT_EQ(counts.not_finite, 0);
    EXPECT_GT(counts.in_contact, frames / 50);
    EXPECT_GT(counts.moved, frames / 2);
    // A body alone has nothing to press the proxy against.
    if (GetParam().bodies.size() == 1) {
        EXPECT_EQ(counts.held_back, 0);
    }
}

INSTANTIATE_TEST_SUITE_P(Cases, MovingBodies, testing::ValuesIn(cases()),
                         [](const auto& of) { return of.param.name; });

/// A hand that holds still between a wall and a box that comes, step by step.
TEST(MovingBodies, ABoxThatPressesTheProxyAgainstAWallWaits) {
    const auto wall = test::certified(test::box_mesh({-0.1, -0.1, -0.02}, {0.1, 0.1, 0.0}));
    const auto box = test::certified(test::box_mesh({-0.01, -0.01, 0.02}, {0.01, 0.01, 0.04}));
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::make_unique<MovingContact>(
        std::make_unique<MeshContact>(box, MeshContactSettings{})));
    surfaces.push_back(std::make_unique<MeshContact>(wall, MeshContactSettings{}));
    ContactLoop loop({}, std::move(surfaces));
    const Vec3 probe{0.001, 0.002, 0.01};
    loop.start(probe);
    MovingSurface& body = *loop.subdivision().surface(0).moving();
    for (int frame = 1; frame <= 300; ++frame) { // its underside from 20 mm to -10 mm
        body.set_pose({{0.0, 0.0, -1e-4 * frame}, {1, 0, 0, 0}});
        const SubdivisionResult result = loop.move(probe);
        const double underside = 0.02 - 1e-4 * frame;
        EXPECT_NEAR(result.proxy.z, std::clamp(underside, 0.0, probe.z), 1e-7) << frame;
        EXPECT_EQ((result.flags & kBodyHeldBack) != 0, underside < -1e-9) << frame;
        // What is felt never reaches into the wall.
        EXPECT_GE(0.02 + body.pose().position.z, -1e-7);
    }
    // The hand goes aside: the proxy slides out along the wall, and the box goes on.
    for (int frame = 0; frame < 40; ++frame)
        loop.move({0.001 + 5e-4 * frame, 0.002, 0.001});
    EXPECT_EQ(body.pose().position.z, -1e-4 * 300);
    EXPECT_GT(loop.proxy().x, 0.01);
}

/// A jaw that comes down pushes the proxy, which it presses onto a table, out of the wedge between.
TEST(MovingBodies, AWedgeThatClosesPushesTheProxyOut) {
    const auto table = test::certified(test::box_mesh({-0.1, -0.1, -0.02}, {0.2, 0.1, 0.0}));
    const auto upper = test::certified(test::box_mesh({0.0, -0.1, 0.0}, {0.2, 0.1, 0.02}));
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::make_unique<MeshContact>(table, MeshContactSettings{}));
    surfaces.push_back(std::make_unique<MovingContact>(
        std::make_unique<MeshContact>(upper, MeshContactSettings{})));
    ContactLoop loop({}, std::move(surfaces));
    MovingSurface& jaw = *loop.subdivision().surface(1).moving();
    constexpr double kAngle = 0.3; // about the y axis: the jaw opens towards +x
    const auto lowered = [](double by_m) {
        return RigidPose{{0.0, 0.0, -by_m}, glm::angleAxis(-kAngle, Vec3{0, 1, 0})};
    };
    jaw.set_pose(lowered(0.0));
    const Vec3 probe{0.02, 0.0, 0.004};
    loop.start(probe);
    for (int frame = 0; frame <= 100; ++frame) {
        const double by_m = 1e-4 * frame;
        jaw.set_pose(lowered(by_m));
        const SubdivisionResult result = loop.move(probe);
        const double edge_m = by_m / std::tan(kAngle); // of the wedge: it runs along +x
        EXPECT_GE(result.proxy.x, edge_m - 1e-6) << frame;
        EXPECT_GE(result.proxy.z, -1e-7) << frame;
        EXPECT_FALSE(result.flags & kBodyHeldBack) << frame;
    }
    EXPECT_GT(loop.proxy().x, 0.032); // from 20 mm
}

} // namespace
} // namespace palpate
