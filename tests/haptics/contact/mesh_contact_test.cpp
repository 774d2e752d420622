// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/contact/mesh_contact.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include <palpate/haptics/effects/constant_force.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/brute_force_queries.h"
#include "tests/support/effect_lists.h"
#include "tests/support/mesh_fuzz.h"
#include "tests/support/odd_meshes.h"

namespace palpate {
namespace {

using test::certified;
using test::ContactLoop;
using test::one_mesh;
using test::stepping;

constexpr double kRadius = 0.05; // m
// Sliding ends where less than this is left of the way, m (CertifiedMesh::tolerance_m at 50 mm),
// and edges are snapped to within a quarter of it.
constexpr double kExact = 1.5e-12;

Vec3 random_direction(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    const double x = normal(random), y = normal(random), z = normal(random);
    return glm::normalize(Vec3{x, y, z});
}

// The inside of a convex body is convex: the constrained position is the closest point, whatever
// the way there.
TEST(MeshContact, InAConvexCavityTheProxyIsTheClosestPoint) {
    const TriangleMesh mesh = test::icosphere(kRadius, 4);
    ContactLoop loop({}, one_mesh(certified(mesh)));
    loop.start(Vec3{0.0});
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> depth(-0.002, 0.01);
    for (int i = 0; i < 500; ++i) {
        const Vec3 probe = (kRadius + depth(random)) * random_direction(random);
        const SubdivisionResult frame = loop.move(probe);
        ASSERT_EQ(frame.flags, 0u);
        if (frame.contacts == 0) {
            ASSERT_EQ(loop.proxy(), probe);
            continue;
        }
        const Vec3 expected = test::brute_closest_point(mesh, probe)->position;
        ASSERT_LE(glm::length(loop.proxy() - expected), kExact);
    }
}

// Shares of the way (eq. 9) end in the same place: the last one is the whole rest.
TEST(MeshContact, EveryMethodEndsThere) {
    const TriangleMesh mesh = test::icosphere(kRadius, 4);
    const auto shared = certified(mesh);
    for (const SteppingSettings& settings :
         {stepping(SteppingMethod::single), stepping(SteppingMethod::fixed, 1),
          stepping(SteppingMethod::fixed, 7), stepping(SteppingMethod::paper),
          stepping(SteppingMethod::adaptive)}) {
        ContactLoop loop(settings, one_mesh(shared), {}, 5.0);
        loop.start(Vec3{0.0});
        for (int i = 0; i < 300; ++i) {
            const double angle = 0.004 * i;
            const Vec3 probe = (0.0545 + 0.002 * std::sin(0.05 * i)) *
                               Vec3{std::cos(angle), std::sin(angle), 0.3 * std::sin(2.0 * angle)};
            loop.move(probe);
            if (i == 0) continue; // one evaluation flies to the wall, and no farther
            const Vec3 expected = test::brute_closest_point(mesh, probe)->position;
            ASSERT_LE(glm::length(loop.proxy() - expected), kExact) << i;
        }
    }
}

TEST(MeshContact, AHeldProbeMeansAHeldProxy) {
    for (const TriangleMesh& mesh :
         {test::spiky_ball(0.04, 3, 0.3, 4), test::soup(test::icosphere(0.04, 3), 5e-9)}) {
        ContactLoop loop({}, one_mesh(certified(mesh)));
        std::mt19937_64 random(8);
        for (int trial = 0; trial < 20; ++trial) {
            loop.start(0.08 * random_direction(random));
            const Vec3 probe = 0.02 * random_direction(random);
            for (int i = 0; i < 5; ++i)
                loop.move(probe);
            ASSERT_EQ(loop.move(probe).flags, 0u) << "still under way";
            const Vec3 held = loop.proxy();
            for (int i = 0; i < 250; ++i) {
                loop.move(probe);
                ASSERT_EQ(loop.proxy(), held);
            }
        }
    }
}

// The cap beside the way is as high as the way, to the last bit: it is not in it, and nothing leads
// round the wall. Both are turned about the height, so that the way goes through the cap's box.
TEST(MeshContact, AWallBesideAFlatFacetInThePlaneOfTheWayIsNotPassed) {
    constexpr double kHeight = 0.01, kWall = 0.02, kHalf = 0.004;
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> size(0.002, 0.02), way(-0.03, 0.06), turn(0.3, 1.2);
    for (int trial = 0; trial < 200; ++trial) {
        TriangleMesh mesh = test::box_mesh({kWall, -kHalf, -0.02}, {kWall + 0.001, kHalf, 0.03});
        const double x = way(random), y = kHalf + 0.1 * size(random);
        test::append(mesh,
                     test::box_mesh({x, y, -0.01}, {x + size(random), y + size(random), kHeight}));
        const double angle = turn(random), c = std::cos(angle), s = std::sin(angle);
        const auto turned = [&](const Vec3& p) {
            return Vec3(c * p.x - s * p.y, s * p.x + c * p.y, p.z);
        };
        for (Vec3& vertex : mesh.vertices)
            vertex = turned(vertex);
        ContactLoop loop({}, one_mesh(certified(mesh)));
        loop.start(turned({-0.035, 0.0, kHeight}));
        double furthest = -0.035;
        for (int i = 0; i < 40; ++i) {
            const double probe = way(random);
            loop.move(turned({probe, 0.0, kHeight}));
            const double proxy = c * loop.proxy().x + s * loop.proxy().y;
            ASSERT_LE(proxy, kWall + kExact) << trial << ", " << i;
            // Nothing else holds it.
            ASSERT_NEAR(proxy, std::min(probe, kWall), 1e-7) << trial << ", " << i;
            furthest = std::max(furthest, probe);
        }
        ASSERT_GT(furthest, kWall + 0.001);
    }
}

TEST(MeshContact, JumpsEndOnTheWallInTheSameFrame) {
    const TriangleMesh mesh = test::icosphere(kRadius, 6);
    ContactLoop loop({}, one_mesh(certified(mesh)));
    loop.start(Vec3{0.0});
    for (const Vec3& probe : {Vec3{0.1, 0, 0}, Vec3{-0.06, 0.001, 0}, Vec3{0, 0.3, 0.4},
                              Vec3{1e5, -1e5, 2e5}, Vec3{0.0, 0.0, -0.051}}) {
        EXPECT_EQ(loop.move(probe).flags, 0u);
        const Vec3 expected = test::brute_closest_point(mesh, probe)->position;
        // Far out the closest point itself is worth no more than the rounding of the probe.
        EXPECT_LE(glm::length(loop.proxy() - expected), kExact + 1e-15 * glm::length(probe));
    }
    EXPECT_EQ(loop.move({0.01, 0, 0}).contacts, 0u);
    EXPECT_EQ(loop.proxy(), Vec3(0.01, 0, 0));
}

TEST(MeshContact, FreeMotionFarFromTheMeshAsksNothing) {
    ContactLoop loop({}, one_mesh(certified(test::icosphere(kRadius, 4))));
    loop.start(Vec3{0.0});
    loop.move({0.0001, 0, 0});
    const auto before = loop.surface(0).queries().surface_queries;
    for (int i = 0; i < 100; ++i)
        loop.move({1e-6 * i, 1e-4, 0});
    EXPECT_EQ(loop.surface(0).queries().surface_queries, before);
}

TEST(MeshContact, SlidingAsksNothing) {
    ContactLoop loop({}, one_mesh(certified(test::icosphere(kRadius, 5))));
    loop.start(Vec3{0.0});
    loop.move({0.055, 0, 0});
    const auto before = loop.surface(0).queries().surface_queries;
    for (int i = 0; i < 1000; ++i)
        loop.move(0.055 * Vec3{std::cos(0.003 * i), std::sin(0.003 * i), 0});
    EXPECT_EQ(loop.surface(0).queries().surface_queries, before);
}

// A constant force d shifts the probe by d / k, exactly.
TEST(MeshContact, ForcesShiftTheProbe) {
    const TriangleMesh mesh = test::icosphere(kRadius, 4);
    const Vec3 force{0.4, -1.2, 0.7}; // N
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(std::make_unique<ConstantForce>(force));
    ContactLoop loop({}, one_mesh(certified(mesh)), std::move(effects));
    loop.start(Vec3{0.0});
    for (int i = 0; i < 100; ++i) {
        const Vec3 probe = 0.055 * Vec3{std::cos(0.02 * i), 0.1, std::sin(0.02 * i)};
        loop.move(probe);
        const Vec3 expected =
            test::brute_closest_point(mesh, probe + force / ContactLoop::kStiffness)->position;
        ASSERT_LE(glm::length(loop.proxy() - expected), kExact);
    }
}

// In a corner the facets that held the proxy against one pull are not those that hold it against
// the next: what stands off the probe is held by something, and the frame says so.
TEST(MeshContact, InACornerWhatHoldsAgainstTheNextPullIsReported) {
    TriangleMesh corner; // six facets, as valleys and ridges
    for (const Vec3& mm : {Vec3{1.6, 6.9, 7.0},
                           {0.0, 12.1, 19.6},
                           {-3.4, 14.8, 15.0},
                           {0.0, 10.7, 6.6},
                           {6.3, 16.4, 10.2},
                           {9.1, 12.6, 14.7},
                           {4.6, 7.6, 15.1}})
        corner.vertices.push_back(1e-3 * mm);
    const std::array<std::uint32_t, 6> round{1, 2, 3, 4, 5, 6};
    for (std::size_t i = 0; i < round.size(); ++i)
        corner.triangles.push_back({0, round[i], round[(i + 1) % round.size()]});
    std::mt19937_64 random(1);
    int held = 0;
    for (const bool reversed : {false, true}) {
        ContactLoop loop({}, one_mesh(certified(reversed ? test::reversed(corner) : corner)));
        loop.start({0.0046, 0.011, 0.0096});
        for (int i = 0; i < 20000; ++i) {
            const Vec3 probe = corner.vertices[0] + 0.02 * random_direction(random);
            const SubdivisionResult frame = loop.move(probe);
            if (frame.flags != 0 || glm::length(loop.proxy() - probe) < 1e-6) continue;
            ++held;
            ASSERT_GT(frame.contacts, 0u) << "in frame " << i;
        }
    }
    EXPECT_GT(held, 500);
}

// On the plate's top, off its edge, down its side, under it: the closest point of where the probe
// can be reached from, with the force always away from the plate.
TEST(MeshContact, OverTheEdgeOfAPlateTheProxyComesOff) {
    ContactLoop loop({}, one_mesh(certified(test::plate())));
    loop.start({0, 0, 0.01});
    loop.move({0.0, 0.0, -0.002});
    EXPECT_LE(glm::length(loop.proxy() - Vec3(0, 0, 0.0005)), kExact);
    for (int i = 0; i <= 300; ++i)
        loop.move({1e-4 * i, 0.003, -0.002});
    // At the edge the side face is nearer than the top: the proxy is on it, then beyond it.
    loop.move({0.0299, 0.003, -0.0002});
    EXPECT_EQ(loop.move({0.031, 0.003, -0.002}).contacts, 0u);
    EXPECT_EQ(loop.proxy(), Vec3(0.031, 0.003, -0.002));
    loop.move({0.02, 0.003, -0.002});
    EXPECT_EQ(loop.proxy(), Vec3(0.02, 0.003, -0.002)) << "below the plate is free, too";
    loop.move({0.02, 0.003, 0.0});
    EXPECT_LE(glm::length(loop.proxy() - Vec3(0.02, 0.003, -0.0005)), kExact);
}

TEST(MeshContact, ASheetIsFeltFromBothSidesAndReleasedOverItsBorder) {
    for (const bool reversed : {false, true}) {
        TriangleMesh sheet = test::turned(test::sheet(0.06, 8));
        if (reversed) sheet = test::partly_reversed(sheet);
        const auto mesh = certified(sheet);
        const auto place = [](const Vec3& p) { return test::turned({{p}, {}}).vertices[0]; };
        ContactLoop loop({}, one_mesh(mesh));
        std::mt19937_64 random(11);
        std::uniform_real_distribution<double> in(-0.028, 0.028);
        for (int trial = 0; trial < 200; ++trial) {
            const double side = trial % 2 ? 1.0 : -1.0;
            const double x = in(random), y = in(random);
            loop.start(place({x, y, 0.004 * side}));
            loop.move(place({x, y, -0.003 * side}));
            ASSERT_LE(glm::length(loop.proxy() - place({x, y, 0})), kExact);
            loop.move(place({y, x, -0.002 * side}));
            ASSERT_LE(glm::length(loop.proxy() - place({y, x, 0})), kExact);
            const Vec3 beyond = place({0.032 * side, y, -0.001 * side});
            loop.move(beyond);
            ASSERT_EQ(loop.proxy(), beyond);
        }
    }
}

// The play operator: level := max(level, depth - s / k) while pushed, back with the probe
// (composition.md 2.3).
TEST(MeshContact, AYieldingMeshIsThePlayOperator) {
    const double strength = 1.0, lag = strength / ContactLoop::kStiffness; // 2 mm
    ContactLoop loop({}, one_mesh(certified(test::sheet(0.06, 8)), {strength}));
    loop.start({0.0013, 0.0021, 0.004});
    double level = 0.0; // m, > 0: behind the sheet
    double depth = -0.004;
    const auto go_to = [&](double target) {
        const double step = target > depth ? 1e-4 : -1e-4;
        while (std::abs(target - depth) > 1e-9) {
            depth += step;
            loop.move({0.0013, 0.0021, -depth});
            // Pushed in it gives way; pulled back it follows, no farther out than the sheet.
            level = std::max({level, depth - lag, 0.0});
            if (depth < level) level = std::max(0.0, depth);
            const double proxy = depth < level ? depth : std::max(level, depth - lag);
            const double expected = depth < 0.0 ? depth : proxy;
            ASSERT_NEAR(-loop.proxy().z, expected, 1e-9) << depth;
            ASSERT_LE(ContactLoop::kStiffness * (depth + loop.proxy().z), strength + 1e-9);
        }
    };
    go_to(0.0015); // holds
    go_to(0.006);  // yields
    go_to(0.0045); // holds where it was pushed to
    go_to(0.007);
    go_to(-0.003); // out again: forgotten
    go_to(0.0018); // holds at the sheet
}

TEST(MeshContact, SkinYieldsAndBoneHolds) {
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    MeshContactSettings skin;
    skin.strength_n = 0.5;
    surfaces.push_back(std::make_unique<MeshContact>(certified(test::icosphere(0.06, 5)), skin));
    const TriangleMesh bone = test::icosphere(0.05, 5);
    surfaces.push_back(std::make_unique<MeshContact>(certified(bone), MeshContactSettings{}));
    ContactLoop loop({}, std::move(surfaces));
    const Vec3 direction = glm::normalize(Vec3{0.3, 0.5, 0.8});
    loop.start(0.07 * direction);
    for (int i = 0; i <= 250; ++i)
        loop.move((0.07 - 1e-4 * i) * direction);
    // The bone's facets are flat where its sphere is not.
    EXPECT_NEAR(glm::length(loop.proxy()), 0.05, 5e-5);
    const auto inside = [&](const Vec3& p) { return test::winding_number(bone, p) > 0.5; };
    EXPECT_FALSE(inside(loop.proxy() + 1e-9 * direction));
    for (int i = 0; i <= 250; ++i)
        loop.move((0.045 + 1e-4 * i) * direction);
    EXPECT_LE(glm::length(loop.proxy() - 0.07 * direction), 1e-12);
}

/// A sheet through the origin with the given normal, as a thick box below it.
TriangleMesh slab_below(const Vec3& normal) {
    const Vec3 n = glm::normalize(normal);
    const Vec3 u = glm::normalize(glm::cross(n, Vec3{0.1, 0.9, 0.2})), v = glm::cross(n, u);
    TriangleMesh box = test::box_mesh({-0.04, -0.04, -0.01}, {0.04, 0.04, 0.0});
    for (Vec3& p : box.vertices)
        p = p.x * u + p.y * v + p.z * n;
    return box;
}

// Two bodies make a groove: the solver sees both, and the proxy is where both planes hold it.
TEST(MeshContact, TwoMeshesMakeAGroove) {
    const Vec3 n1 = glm::normalize(Vec3{0.6, 0.1, 0.8}), n2 = glm::normalize(Vec3{-0.7, 0.2, 0.9});
    for (const SteppingMethod method : {SteppingMethod::adaptive, SteppingMethod::fixed}) {
        std::vector<std::unique_ptr<SurfaceContact>> surfaces;
        for (const Vec3& n : {n1, n2})
            surfaces.push_back(
                std::make_unique<MeshContact>(certified(slab_below(n)), MeshContactSettings{}));
        ContactLoop loop(stepping(method, 16), std::move(surfaces));
        loop.start({0, 0, 0.02});
        PrimitiveSet planes;
        planes.add({Vec3{0.0}, n1, std::numeric_limits<double>::infinity()});
        planes.add({Vec3{0.0}, n2, std::numeric_limits<double>::infinity()});
        std::mt19937_64 random(17);
        std::uniform_real_distribution<double> in(-0.004, 0.004);
        for (int i = 0; i < 300; ++i) {
            const double x = in(random), y = in(random), z = in(random);
            const Vec3 probe{x, y, z};
            // Sixteen-fold frames: one is a step of each plane, their edges and back.
            for (int again = 0; again < 4; ++again)
                loop.move(probe);
            const Vec3 expected = solve_proxy(planes, probe, ContactLoop::kStiffness).proxy;
            ASSERT_LE(glm::length(loop.proxy() - expected), 1e-9) << i;
        }
    }
}

TEST(MeshContact, MeshAndVolumeTogether) {
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::make_unique<MeshContact>(certified(slab_below({0.8, 0.1, 0.9})),
                                                     MeshContactSettings{}));
    surfaces.push_back(std::make_unique<VolumeContact>(make_sphere_cavity(0.02), LevelSettings{}));
    ContactLoop loop({}, std::move(surfaces));
    loop.start({0, 0, 0.015});
    const Vec3 n = glm::normalize(Vec3{0.8, 0.1, 0.9});
    std::mt19937_64 random(23);
    for (int i = 0; i < 2000; ++i) {
        loop.move(0.03 * random_direction(random));
        // 25 um: what the volume's certificate lets a chord be too deep.
        ASSERT_LE(glm::length(loop.proxy()), 0.02 + 25e-6);
        ASSERT_GE(glm::dot(n, loop.proxy()), -1e-12);
    }
}

/// In one of two boxes side by side, less than 1 nm apart: a proxy on its end, which is certified,
/// beside a face that is not.
class OnAnEndOfTwoBoxes {
public:
    static constexpr double kHalf = 0.01; // m

    explicit OnAnEndOfTwoBoxes(double beside_m, const MeshContactSettings& settings = {})
        : contact_(boxes(), settings) {
        contact_.restart(proxy_);
        go({3 * kHalf, 0, 2e-3});
        on_ = {2 * kHalf, kHalf - beside_m, 2e-3};
        for (int leg = 0; leg < 3; ++leg) // one ends on the edge between both facets of the end
            go(on_);
        EXPECT_LE(glm::length(proxy_ - on_), kExact);
    }
    /// A chord from where the proxy is, and how far it went, m. By a vector from the place at
    /// first.
    double along(const Vec3& way) { return go(on_ + way); }
    /// Planes that it is offered after that.
    const ContactSet& planes() const { return contacts_; }

private:
    static std::shared_ptr<const CertifiedMesh> boxes() {
        constexpr double kGap = 0.7e-9; // m
        TriangleMesh mesh = test::box_mesh({-2 * kHalf, -kHalf, -kHalf}, {-kGap, kHalf, kHalf});
        test::append(mesh, test::box_mesh({0, -kHalf, -kHalf}, {2 * kHalf, kHalf, kHalf}));
        auto made = certified(mesh);
        EXPECT_EQ(made->uncertain_count(), 20u) << "all but the ends";
        return made;
    }
    double go(const Vec3& to) {
        const Vec3 from = proxy_;
        proxy_ += contact_.carry(from, to).fraction * (to - from);
        contacts_.clear();
        contact_.offer(proxy_, contacts_);
        contact_.commit(proxy_, false, true);
        return glm::length(proxy_ - from);
    }

    MeshContact contact_;
    ContactSet contacts_;
    Vec3 proxy_{kHalf, 0, 2e-3}, on_{0.0};
};

// Seen: the proxy was drawn off the end and could not go, as the face was nearer than a skin. It
// was then taken to be in free space, without the label of its side, and the next chord went out
// through the end.
TEST(MeshContact, WhereAFlightEndsAtOnceTheProxyKeepsItsSide) {
    for (const double beside_m : {0.0, 1e-9, 2e-9, 1e-8}) {
        SCOPED_TRACE(beside_m);
        OnAnEndOfTwoBoxes proxy(beside_m);
        EXPECT_LE(proxy.along({-1e-3, 3e-3, 0}), kExact) << "off the end, through the face";
        EXPECT_LE(proxy.along({1e-3, 0, 0}), kExact) << "through the end";
        EXPECT_LE(proxy.along({1e-3, 1e-4, 0}), kExact) << "through the edge";
        EXPECT_GE(proxy.along({-1e-3, -3e-3, 0}), 3e-3) << "back into the box";
    }
}

TEST(MeshContact, WhereAFlightEndsAtOnceBothFacetsHold) {
    OnAnEndOfTwoBoxes hard(2e-9);
    hard.along({-1e-3, 3e-3, 0});
    ASSERT_EQ(hard.planes().size(), 2u);
    EXPECT_EQ(hard.planes()[0].plane.normal, Vec3(0, -1, 0));
    EXPECT_EQ(hard.planes()[1].plane.normal, Vec3(-1, 0, 0));

    // Of one that yields, the one that is pressed: two would resist with twice its strength.
    MeshContactSettings settings;
    settings.strength_n = 1.0;
    OnAnEndOfTwoBoxes weak(2e-9, settings);
    weak.along({-1e-3, 3e-3, 0});
    ASSERT_EQ(weak.planes().size(), 1u);
    EXPECT_EQ(weak.planes()[0].plane.normal, Vec3(0, -1, 0));
    weak.along({1e-3, 0, 0});
    ASSERT_EQ(weak.planes().size(), 1u);
    EXPECT_EQ(weak.planes()[0].plane.normal, Vec3(-1, 0, 0));
}

TEST(MeshContact, SettingsOutOfRangeAreRefused) {
    const auto mesh = certified(test::plate());
    EXPECT_THROW(MeshContact(nullptr, {}), std::invalid_argument);
    EXPECT_THROW(MeshContact(mesh, {0.0}), std::invalid_argument);
    EXPECT_THROW(MeshContact(mesh, {1.0, -1.0}), std::invalid_argument);
}

} // namespace
} // namespace palpate
