// SPDX-License-Identifier: Apache-2.0
// A contact of a body that moves: the same contact, seen from elsewhere.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/contact/direct_contact.h>
#include <palpate/haptics/contact/latest.h>
#include <palpate/haptics/contact/moving_contact.h>
#include <palpate/haptics/stepping/frame_flags.h>

#include "tests/support/contact_kinds.h"
#include "tests/support/contact_loop.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

using test::ContactLoop;
using test::Kind;

constexpr double kRadius = 0.02; // m
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::array kKinds{Kind::formula, Kind::volume, Kind::mesh, Kind::guarded};

std::vector<std::unique_ptr<SurfaceContact>> moving_ball(Kind kind) {
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(
        std::make_unique<MovingContact>(test::ball(kind, kRadius, kInfinity, Yielding::holds, 4)));
    return surfaces;
}
std::vector<std::unique_ptr<SurfaceContact>> still_ball(Kind kind) {
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(test::ball(kind, kRadius, kInfinity, Yielding::holds, 4));
    return surfaces;
}

MovingSurface& body(ContactLoop& loop, std::size_t i = 0) {
    return *loop.subdivision().surface(i).moving();
}

Vec3 random_vector(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    const double x = normal(random), y = normal(random), z = normal(random);
    return {x, y, z};
}

RigidPose random_pose(std::mt19937_64& random, double within_m) {
    const Vec3 at = within_m * random_vector(random);
    const Vec3 axis = glm::normalize(random_vector(random));
    const double angle = std::uniform_real_distribution<double>(-3.0, 3.0)(random);
    return {at, glm::angleAxis(angle, axis)};
}

/// A hand that goes round the ball, now in front of it and now up to 4 mm behind its surface.
Vec3 next_probe(std::mt19937_64& random, const Vec3& before) {
    const Vec3 probe = before + 1e-3 * random_vector(random);
    const double height = glm::length(probe);
    if (height < kRadius - 4e-3) return probe * ((kRadius - 4e-3) / height);
    return height > kRadius + 3e-3 ? probe * ((kRadius + 3e-3) / height) : probe;
}

// Beyond a million metres nobody can say what is on the way.
TEST(MovingContact, DoesNotPassTheProxyOnAWayThatNobodyCanSee) {
    for (const bool direct : {false, true}) {
        SCOPED_TRACE(direct);
        std::vector<std::unique_ptr<SurfaceContact>> surfaces = moving_ball(Kind::mesh);
        if (direct)
            surfaces.front() = std::make_unique<MovingContact>(std::make_unique<DirectContact>(
                std::make_shared<const SurfaceScene>(
                    std::make_shared<const TriangleMesh>(test::icosphere(kRadius, 4))),
                make_solid_sphere(kRadius), LevelSettings{}));
        ContactLoop loop({}, std::move(surfaces));
        body(loop).set_pose({{0.3, 0.0, 0.0}, {1, 0, 0, 0}});
        const Vec3 probe(0.1, 0.0, 0.0);
        loop.start(probe);
        body(loop).set_pose({{-999999.95, 0.0, 0.0}, {1, 0, 0, 0}});
        std::uint32_t flags = 0;
        for (int i = 0; i < 3; ++i) {
            flags |= loop.move(probe).flags;
            EXPECT_LT(std::abs(loop.proxy().x), 1e6) << "it is carried no farther";
            // It may slide round the ball, which the probe pulls at from very far.
            const auto path = loop.subdivision().path();
            for (std::size_t c = 1; c < path.size(); ++c) {
                const Vec3 a = body(loop).to_body(path[c - 1]), b = body(loop).to_body(path[c]);
                const double length2 = squared_length(b - a);
                const double share =
                    length2 > 0.0 ? std::clamp(-glm::dot(a, b - a) / length2, 0.0, 1.0) : 0.0;
                EXPECT_GT(glm::length(a + share * (b - a)), 0.99 * kRadius) << i << ' ' << c;
            }
        }
        EXPECT_TRUE(flags & kBodyHeldBack);
    }
    // Where nothing can be on the way, both go on.
    ContactLoop loop({}, moving_ball(Kind::mesh));
    body(loop).set_pose({{-999999.95, 0.0, 0.0}, {1, 0, 0, 0}});
    loop.start({0.1, 0.0, 0.0});
    loop.move({0.101, 0.0, 0.0});
    EXPECT_EQ(loop.proxy(), Vec3(0.101, 0.0, 0.0));
    body(loop).set_pose({});
    loop.move({0.101, 0.0, 0.0});
    EXPECT_EQ(body(loop).pose().position, Vec3(0.0));
}

TEST(MovingContact, FeelsTheSameBitsWhereTheSceneHasIt) {
    for (const Kind kind : kKinds) {
        ContactLoop moving({}, moving_ball(kind)), still({}, still_ball(kind));
        std::mt19937_64 random(5);
        Vec3 probe{0, 0, kRadius + 2e-3};
        moving.start(probe);
        still.start(probe);
        for (int frame = 0; frame < 500; ++frame) {
            probe = next_probe(random, probe);
            const SubdivisionResult a = moving.move(probe), b = still.move(probe);
            ASSERT_EQ(a.proxy, b.proxy) << test::name_of(kind) << ", frame " << frame;
            ASSERT_EQ(a.flags, b.flags);
            ASSERT_EQ(a.felt, b.felt);
        }
    }
}

TEST(MovingContact, ElsewhereItIsTheSameWithinRounding) {
    for (const Kind kind : kKinds) {
        std::mt19937_64 random(6);
        for (int pose_number = 0; pose_number < 10; ++pose_number) {
            const RigidPose pose = random_pose(random, 0.1);
            const RigidMap map(pose);
            ContactLoop moving({}, moving_ball(kind)), still({}, still_ball(kind));
            Vec3 probe{0, 0, kRadius + 2e-3};
            body(moving).set_pose(pose);
            moving.start(map.point(probe));
            still.start(probe);
            double worst = 0.0;
            int finished = 0;
            for (int frame = 0; frame < 100; ++frame) {
                probe = next_probe(random, probe);
                const SubdivisionResult a = moving.move(map.point(probe));
                const SubdivisionResult b = still.move(probe);
                EXPECT_TRUE(a.flags & kBodyMoved);
                if (((a.flags | b.flags) & ~kBodyMoved) != 0) continue; // unfinished
                ++finished;
                worst = std::max(worst, glm::length(map.point_back(a.proxy) - b.proxy));
            }
            // A frame ends within some of its tolerances of 0.1 um (docs/files.md), and rounding
            // may decide for another one of them.
            EXPECT_LT(worst, 1e-6) << test::name_of(kind);
            EXPECT_GE(finished, 50); // the hand jumps by millimetres
        }
    }
}

TEST(MovingContact, TellsItsLeashInTheScenesFrame) {
    std::mt19937_64 random(8);
    for (int i = 0; i < 10; ++i) {
        const RigidPose pose = random_pose(random, 0.1);
        const RigidMap map(pose);
        ContactLoop moving({}, moving_ball(Kind::guarded)), still({}, still_ball(Kind::guarded));
        body(moving).set_pose(pose);
        const Vec3 above{0, 0, kRadius + 2e-3}, within{1e-3, 0, kRadius - 1e-3};
        moving.start(map.point(above));
        still.start(above);
        for (const Vec3& probe : {above, within}) {
            moving.move(map.point(probe));
            still.move(probe);
        }
        const std::optional<Leash> found = moving.surface(0).leash(),
                                   wanted = still.surface(0).leash();
        ASSERT_TRUE(found && wanted);
        EXPECT_EQ(found->length_m, wanted->length_m);
        EXPECT_NEAR(glm::length(found->guard - map.point(wanted->guard)), 0.0, 1e-6); // as above
    }
    ContactLoop mesh({}, moving_ball(Kind::mesh));
    mesh.start({0, 0, 2 * kRadius});
    EXPECT_FALSE(mesh.surface(0).leash()) << "a mesh alone has none";
}

TEST(MovingContact, ABodyPushesAHeldProbe) {
    for (const Kind kind : kKinds) {
        ContactLoop loop({}, moving_ball(kind));
        const Vec3 probe{0.0, 0.0, kRadius + 5e-3};
        loop.start(probe);
        loop.move(probe);
        for (int frame = 1; frame <= 100; ++frame) {
            const double height_m = 1e-4 * frame; // 0.1 m/s, up to 10 mm: 5 of them past the probe
            body(loop).set_pose({{0.0, 0.0, height_m}, {1, 0, 0, 0}});
            const SubdivisionResult result = loop.move(probe);
            const double expected = std::max(probe.z, height_m + kRadius);
            // The facets of level 4 lie up to 0.06 mm inside the ball, voxels err by 1.3 um.
            ASSERT_NEAR(result.proxy.z, expected, 7e-5) << test::name_of(kind) << frame;
            ASSERT_FALSE(result.flags & (kBodyHeldBack | kStalled)) << test::name_of(kind);
        }
        EXPECT_TRUE(loop.move(probe).felt & 1);
    }
}

TEST(MovingContact, FrictionTakesTheProxyAlong) {
    for (const Kind kind : {Kind::formula, Kind::mesh}) {
        SurfaceFinish rough;
        rough.friction = {0.8, 0.8};
        ContactLoop loop({}, moving_ball(kind), {}, 0.0, {rough});
        loop.start({0.0, 0.0, kRadius + 1e-3});
        const Vec3 probe{0.0, 0.0, kRadius - 2e-3};
        for (int frame = 0; frame < 20; ++frame)
            loop.move(probe);
        const Vec3 before = loop.proxy();
        // Turned by 0.5 mm of the surface: tan of the pull is 0.5 / 2, less than the 0.8 that hold.
        for (int frame = 1; frame <= 50; ++frame) {
            const double angle = frame * 1e-5 / kRadius;
            body(loop).set_pose({Vec3{0.0}, glm::angleAxis(angle, Vec3{0, 1, 0})});
            ASSERT_FALSE(loop.move(probe).flags & kBodyHeldBack);
        }
        EXPECT_NEAR(loop.proxy().x - before.x, 5e-4, 1e-6) << test::name_of(kind);
    }
}

TEST(MovingContact, WithoutFrictionItTurnsBeneathTheProxy) {
    for (const Kind kind : kKinds) {
        ContactLoop loop({}, moving_ball(kind));
        loop.start({0.0, 0.0, kRadius + 1e-3});
        const Vec3 probe{0.0, 0.0, kRadius - 2e-3};
        for (int frame = 0; frame < 200; ++frame) {
            body(loop).set_pose({Vec3{0.0}, glm::angleAxis(frame * 0.01, Vec3{0, 1, 0})});
            const Vec3 proxy = loop.move(probe).proxy;
            // On facets of up to 1.5 mm a slope of 0.04 rad takes it 0.04 x 2 mm to a side.
            ASSERT_LT(glm::length(proxy - Vec3{0.0, 0.0, kRadius}), 1.5e-4) << test::name_of(kind);
        }
    }
}

TEST(MovingContact, StatesAreRestoredToTheBit) {
    for (const Kind kind : kKinds) {
        ContactLoop loop({}, moving_ball(kind));
        std::mt19937_64 random(8);
        Vec3 probe{0, 0, kRadius + 2e-3};
        loop.start(probe);
        std::vector<RigidPose> poses;
        std::vector<Vec3> probes;
        Vec3 at{0.0};
        Quaternion turned{1, 0, 0, 0};
        for (int frame = 0; frame < 200; ++frame) {
            at += 1e-4 * random_vector(random);
            turned = glm::normalize(turned *
                                    glm::angleAxis(0.01, glm::normalize(random_vector(random))));
            poses.push_back({at, turned});
            probe = next_probe(random, probe - at) + at;
            probes.push_back(probe);
        }
        const auto run = [&](std::size_t from, std::size_t to) {
            std::vector<Vec3> proxies;
            for (std::size_t frame = from; frame < to; ++frame) {
                body(loop).set_pose(poses[frame]);
                proxies.push_back(loop.move(probes[frame]).proxy);
            }
            return proxies;
        };
        run(0, 100);
        const Subdivision::State state = loop.subdivision().save_state();
        const Vec3 proxy = loop.proxy();
        const std::vector<Vec3> first = run(100, 200);
        loop.subdivision().restore_state(state);
        // The proxy is the caller's: it is moved there by a frame's start.
        Vec3 again = proxy;
        for (std::size_t frame = 100; frame < 200; ++frame) {
            body(loop).set_pose(poses[frame]);
            again = loop.subdivision()
                        .advance({probes[frame], again, ContactLoop::kStiffness, 1e-3})
                        .proxy;
            ASSERT_EQ(again, first[frame - 100]) << test::name_of(kind) << ", frame " << frame;
        }
    }
}

TEST(Latest, GivesTheNewestValueOnce) {
    Latest<int> latest;
    int value = -1;
    EXPECT_FALSE(latest.take(value));
    EXPECT_EQ(value, -1);
    latest.set(1);
    latest.set(2);
    EXPECT_TRUE(latest.take(value));
    EXPECT_EQ(value, 2);
    EXPECT_FALSE(latest.take(value));
    for (int i = 3; i < 10; ++i) {
        latest.set(i);
        if (i % 3 != 0) continue;
        EXPECT_TRUE(latest.take(value));
        EXPECT_EQ(value, i);
    }
}

TEST(Latest, IsNeverSeenHalfWritten) {
    struct Pair {
        long a = 0, b = 0;
    };
    Latest<Pair> latest;
    constexpr long kLast = 200000;
    std::thread writer([&] {
        for (long i = 1; i <= kLast; ++i)
            latest.set({i, -i});
    });
    Pair seen;
    long before = 0;
    while (seen.a < kLast) {
        if (!latest.take(seen)) continue;
        ASSERT_EQ(seen.a, -seen.b);
        ASSERT_GT(seen.a, before);
        before = seen.a;
    }
    writer.join();
}

TEST(RigidPose, GoesTheShorterWay) {
    const RigidPose from{{0, 0, 0}, glm::angleAxis(0.3, Vec3{0, 0, 1})};
    const RigidPose to{{2, 0, 0}, -glm::angleAxis(0.9, Vec3{0, 0, 1})}; // the same rotation
    EXPECT_NEAR(angle_between(from.orientation, to.orientation), 0.6, 1e-15);
    const RigidPose middle = pose_between(from, to, 0.5);
    EXPECT_EQ(middle.position, Vec3(1, 0, 0));
    EXPECT_NEAR(angle_between(from.orientation, middle.orientation), 0.3, 1e-15);
    EXPECT_EQ(pose_between(from, to, 1.0), to);
    const Vec3 point{0.1, -0.2, 0.3};
    const RigidMap map(middle);
    EXPECT_LT(glm::length(map.point_back(map.point(point)) - point), 1e-15);
}

TEST(MovingContact, WithOneEvaluationAHandThatLeavesWhatYieldedIsNotHeld) {
    LevelSettings weak;
    weak.strength_n = 1.0;
    auto contact = std::make_unique<MovingContact>(std::make_unique<VolumeContact>(
        std::shared_ptr<const ScalarField>(make_solid_sphere(50e-3)), weak));
    MovingContact& body = *contact;
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::move(contact));
    SteppingSettings settings;
    settings.method = SteppingMethod::single;
    test::ContactLoop loop(settings, std::move(surfaces));
    const auto at = [](double depth_m) { return Vec3{50e-3 - depth_m, 0, 0}; };
    loop.start(at(-1e-3));
    for (int i = -20; i <= 100; ++i)
        loop.move(at(5e-5 * i));
    for (int i = 100; i >= 58; --i)
        loop.move(at(5e-5 * i));
    for (int i = 1; i <= 100; ++i) {
        body.set_pose({Vec3{2e-5 * i, 0, 0}});
        const Vec3 probe = at(2.9e-3) + Vec3{4e-5 * i, 0, 0};
        loop.move(probe);
        EXPECT_LE(500.0 * glm::length(loop.proxy() - probe), 1e-6) << i;
    }
}

} // namespace
} // namespace palpate
