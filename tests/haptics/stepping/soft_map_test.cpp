// SPDX-License-Identifier: Apache-2.0
// One soft surface that is stiffer over what lies beneath: its force is that of an energy
// (docs/palpation.md).
#include <palpate/volume/fields/stiffness_map.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/contact/mesh_contact.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/mesh_fuzz.h"
#include "tests/support/soft_loop.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

using test::ContactLoop;
using test::force;
using test::precise;
using test::soft;

constexpr double kK = ContactLoop::kStiffness;
constexpr double kRadius = 50e-3;    // m
constexpr double kStiffness = 135.0; // N/m, and kStiffer times that on the other side
constexpr double kStiffer = 1.2222;
constexpr double kDeep = 8e-3; // m

/// 1 on the side of negative x, `stiffer` beyond, over 10 mm; the same for all y and z there.
std::shared_ptr<const StiffnessMap> flank(double stiffer) {
    const StiffnessMap::Lattice lattice{{41, 21, 21}, {-40e-3, -20e-3, 30e-3}, 2e-3};
    std::vector<float> gains;
    for (int k = 0; k < lattice.size[2]; ++k)
        for (int j = 0; j < lattice.size[1]; ++j)
            for (int i = 0; i < lattice.size[0]; ++i) {
                const double t = std::clamp(lattice.place(i, j, k).x / 10e-3 + 0.5, 0.0, 1.0);
                gains.push_back(static_cast<float>((stiffer - 1.0) * t * t * (3.0 - 2.0 * t)));
            }
    return std::make_shared<StiffnessMap>(lattice, gains);
}

/// A ball (sign 1) or a cavity (-1), its surface over the flank at x = 0, z = kRadius.
ContactLoop on(double sign, SurfaceFinish finish, std::shared_ptr<const StiffnessMap> map) {
    finish.stiffness = std::move(map);
    return {
        precise(),
        test::one_surface(sign > 0.0 ? make_solid_sphere(kRadius) : make_sphere_cavity(kRadius)),
        {},
        10.0,
        {finish}};
}

/// Behind the surface by `deep`, at an angle from the z axis towards x.
Vec3 place(double sign, double angle, double deep) {
    return (kRadius - sign * deep) * Vec3{std::sin(angle), 0.0, std::cos(angle)};
}

/// Work on the hand, J, over a closed way.
struct Work {
    double felt = 0.0;
    double normal_alone = 0.0;   // without the force along the surface
    double not_carried = 0.0;    // with P grad K alone, without (1 + delta h)^-1
    double greatest_aside = 0.0; // of the force along the surface, N
};

/// Down on the soft side, across, up, and back in front of the surface; or the other way round. A
/// force is held until the next of `frames` frames.
Work around(double sign, bool backwards, int frames, double damping = 0.0) {
    ContactLoop loop = on(sign, soft(kStiffness, damping), flank(kStiffer));
    constexpr double angle = 0.25;  // 12 mm
    const auto at = [&](double t) { // t of [0, 1]
        if (backwards) t = 1.0 - t;
        const double leg = 4.0 * t;
        if (leg < 1.0) return place(sign, -angle, kDeep * leg);
        if (leg < 2.0) return place(sign, angle * (2.0 * (leg - 1.0) - 1.0), kDeep);
        if (leg < 3.0) return place(sign, angle, kDeep * (3.0 - leg));
        return place(sign, angle * (1.0 - 2.0 * (leg - 3.0)), 0.0);
    };
    Work work;
    loop.start(place(sign, -angle, -1e-3));
    loop.move(at(0.0));
    for (int i = 0; i < frames; ++i) {
        const Vec3 probe = at(static_cast<double>(i) / frames);
        const Vec3 way = at((i + 1.0) / frames) - probe;
        loop.move(probe);
        const Vec3 felt = force(loop, probe);
        const Vec3 behind = loop.subdivision().pressed().front - probe;
        const double delta = glm::length(behind);
        if (!(delta > 1e-9)) continue;
        const Vec3 n = behind / delta, normal = glm::dot(felt, n) * n, aside = felt - normal;
        work.felt += glm::dot(felt, way);
        work.normal_alone += glm::dot(normal, way);
        work.not_carried += glm::dot(normal + (1.0 - sign * delta / kRadius) * aside, way);
        work.greatest_aside = std::max(work.greatest_aside, glm::length(aside));
    }
    return work;
}

TEST(StiffnessOverLumps, TheForceIntoTheSurfaceIsTheLawsTimesTheRatio) {
    for (const double sign : {1.0, -1.0}) {
        ContactLoop loop = on(sign, soft(kStiffness), flank(kStiffer));
        loop.start(place(sign, -0.3, -1e-3));
        for (int i = 0; i <= 300; ++i) {
            const double angle = -0.3 + 2e-3 * i, deep = 2e-5 * (i + 1);
            const Vec3 probe = place(sign, angle, deep);
            loop.move(probe);
            const double ratio = flank(kStiffer)->sample(place(sign, angle, 0.0)).ratio;
            const Vec3 n = sign * glm::normalize(probe);
            EXPECT_NEAR(glm::dot(force(loop, probe), n), ratio * kStiffness * deep, 1e-8);
        }
    }
}

/// Of an energy in J, at a place in m: N, by central differences.
template <class Energy>
Vec3 slope_of(const Energy& energy, const Vec3& probe) {
    Vec3 slope{0.0};
    constexpr double step = 1e-8; // m
    for (int axis = 0; axis < 3; ++axis) {
        Vec3 way{0.0};
        way[axis] = step;
        slope[axis] = (energy(probe + way) - energy(probe - way)) / (2.0 * step);
    }
    return slope;
}

// U = rho(y) K delta^2 / 2. Central differences are off by the step times how the slope of rho
// jumps between cells of its spline: 4 mJ times 1e4 / m^2 times the step, 4e-7 N.
TEST(StiffnessOverLumps, TheForceIsTheSlopeOfAnEnergy) {
    const auto map = flank(kStiffer);
    for (const double sign : {1.0, -1.0}) {
        const auto energy = [&](const Vec3& probe) {
            const double delta = sign * (kRadius - glm::length(probe));
            return 0.5 * kStiffness * map->sample(kRadius * glm::normalize(probe)).ratio * delta *
                   delta;
        };
        for (const double angle : {-0.07, -0.02, 0.013, 0.09}) {
            const Vec3 probe = place(sign, angle, kDeep);
            ContactLoop loop = on(sign, soft(kStiffness), map);
            loop.start(place(sign, angle, -1e-3));
            loop.move(probe);
            EXPECT_LT(glm::length(force(loop, probe) + slope_of(energy, probe)), 1e-6);
        }
    }
}

// ---- how far a front goes along with the probe --------------------------------------------------

/// It changes along all three axes, within 60 mm of the origin.
std::shared_ptr<const StiffnessMap> hills() {
    const StiffnessMap::Lattice lattice{{41, 41, 41}, Vec3(-60e-3), 3e-3};
    std::vector<float> gains;
    for (int k = 0; k < lattice.size[2]; ++k)
        for (int j = 0; j < lattice.size[1]; ++j)
            for (int i = 0; i < lattice.size[0]; ++i) {
                const Vec3 p = lattice.place(i, j, k);
                gains.push_back(static_cast<float>(
                    0.2 * (1.0 + std::sin(40.0 * p.x + 0.3) * std::sin(35.0 * p.y + 1.1) *
                                     std::sin(45.0 * p.z + 2.3))));
            }
    return std::make_shared<StiffnessMap>(lattice, gains);
}

/// The force on a hand that presses so, from in front of the surface.
Vec3 pressed(std::unique_ptr<SurfaceContact> surface, std::shared_ptr<const StiffnessMap> map,
             const Vec3& from, const Vec3& probe) {
    SurfaceFinish finish = soft(kStiffness);
    finish.stiffness = std::move(map);
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(std::move(surface));
    ContactLoop loop(precise(), std::move(surfaces), {}, 10.0, {finish});
    loop.start(from);
    for (int i = 0; i < 4; ++i)
        loop.move(probe);
    return force(loop, probe);
}

/// Less the slope of U = rho(y) K |a - y|^2 / 2, with y the front of the probe a. By central
/// differences; see TheForceIsTheSlopeOfAnEnergy.
template <class Front>
Vec3 downhill(const StiffnessMap& map, const Front& front_of, const Vec3& probe) {
    const auto energy = [&](const Vec3& a) {
        const Vec3 y = front_of(a);
        return 0.5 * kStiffness * map.sample(y).ratio * glm::dot(a - y, a - y);
    };
    return -slope_of(energy, probe);
}

// Inside a box of facets the front is the probe without what is beyond the walls: on a wall it goes
// along both ways, on its diagonal, where two facets of one plane hold it, too; along an edge one
// way; and in a corner it stays.
TEST(StiffnessOverLumps, OnWallsEdgesAndCornersOfAMeshTheForceIsTheSlopeOfAnEnergy) {
    constexpr double kHalf = 30e-3;
    const auto map = hills();
    const auto front_of = [](const Vec3& a) { return glm::clamp(a, Vec3(-kHalf), Vec3(kHalf)); };
    for (const Vec3& probe :
         {Vec3{7e-3, 11e-3, 38e-3}, Vec3{12e-3, 12e-3, 38e-3}, Vec3{12e-3, -12e-3, 38e-3},
          Vec3{9e-3, 36e-3, 35e-3}, Vec3{-36e-3, 11e-3, -35e-3}, Vec3{35e-3, 37e-3, 34e-3},
          Vec3{-35e-3, 37e-3, 34e-3}}) {
        const Vec3 felt =
            pressed(std::make_unique<MeshContact>(
                        test::certified(test::reversed(test::box_mesh(Vec3(-kHalf), Vec3(kHalf)))),
                        MeshContactSettings{}),
                    map, 0.9 * front_of(probe), probe);
        EXPECT_LE(glm::length(felt - downhill(*map, front_of, probe)), 1e-6)
            << probe.x << ' ' << probe.y << ' ' << probe.z;
        // What the force would be with a front that goes along as on a wall, or not at all.
        const Vec3 y = front_of(probe), n = glm::normalize(y - probe);
        const double u = 0.5 * kStiffness * glm::dot(y - probe, y - probe);
        const StiffnessMap::Sample at = map->sample(y);
        const Vec3 into = at.ratio * kStiffness * (y - probe);
        const Vec3 along = at.gradient - glm::dot(at.gradient, n) * n;
        const int walls = static_cast<int>(std::abs(probe.x) > kHalf) +
                          static_cast<int>(std::abs(probe.y) > kHalf) +
                          static_cast<int>(std::abs(probe.z) > kHalf);
        if (walls > 1) {
            EXPECT_GT(glm::length(felt - (into - u * along)), 1e-3);
        }
        if (walls < 3) {
            EXPECT_GT(glm::length(felt - into), 1e-3);
        }
    }
}

// Where two facets are one plane but for half a milliradian, as of a smooth surface, the front goes
// along as on one: as an edge it would stop in each such valley.
TEST(StiffnessOverLumps, AValleyOfHalfAMilliradianIsNoEdge) {
    constexpr double kHalf = 30e-3, kSlope = 2.5e-4, kRise = kSlope * kHalf;
    TriangleMesh valley;
    valley.vertices = {{-kHalf, -kHalf, kRise}, {0.0, -kHalf, 0.0}, {kHalf, -kHalf, kRise},
                       {-kHalf, kHalf, kRise},  {0.0, kHalf, 0.0},  {kHalf, kHalf, kRise}};
    valley.triangles = {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}};
    const auto map = hills();
    const Vec3 y{0.0, 7e-3, 0.0}, probe = y - Vec3{0, 0, kDeep};
    const Vec3 felt =
        pressed(std::make_unique<MeshContact>(test::certified(valley), MeshContactSettings{}), map,
                y + Vec3{0, 0, 1e-3}, probe);
    const StiffnessMap::Sample at = map->sample(y);
    const Vec3 along{at.gradient.x, at.gradient.y, 0.0};
    const Vec3 expected =
        at.ratio * kStiffness * (y - probe) - 0.5 * kStiffness * kDeep * kDeep * along;
    EXPECT_LE(glm::length(felt - expected), 1e-8);
    EXPECT_GT(std::abs(felt.x), 1e-3) << "across the valley";
}

/// A ring: a tube of 20 mm around a circle of 30 mm about z. `around` the axis, `about` the tube
/// from the outside.
struct RingPlace {
    static constexpr double kCircle = 30e-3, kTube = 20e-3;
    double around, about, deep;

    Vec3 outwards() const { return {std::cos(around), std::sin(around), 0.0}; }
    Vec3 normal() const { return std::cos(about) * outwards() + Vec3{0, 0, std::sin(about)}; }
    Vec3 at(double height) const { return kCircle * outwards() + (kTube + height) * normal(); }
    static Vec3 front_of(const Vec3& a) {
        const Vec3 circle = kCircle * glm::normalize(Vec3{a.x, a.y, 0.0});
        return circle + kTube * glm::normalize(a - circle);
    }
};

// A front goes (1 + delta h)^-1 of the probe's way along each principal direction, of curvature h,
// and is taken to go twice as far at most.
TEST(StiffnessOverLumps, OnARingTheFrontGoesByBothCurvatures) {
    const auto map = hills();
    for (const double deep : {4e-3, 9e-3, 13e-3, 17e-3})
        for (const double about : {0.2, 1.3, 2.5, 3.6, 5.5})
            for (const double around : {0.4, 2.9, 4.5}) {
                const RingPlace ring{around, about, deep};
                const Vec3 probe = ring.at(-deep), y = ring.at(0.0);
                const Vec3 felt = pressed(
                    std::make_unique<VolumeContact>(std::shared_ptr<const ScalarField>(make_torus(
                                                        RingPlace::kCircle, RingPlace::kTube)),
                                                    LevelSettings{}),
                    map, ring.at(1e-3), probe);
                const StiffnessMap::Sample at = map->sample(y);
                const Vec3 across = glm::normalize(glm::cross(Vec3{0, 0, 1}, ring.outwards()));
                const Vec3 along = glm::cross(ring.normal(), across);
                const double follows_along = 1.0 / (1.0 - deep / RingPlace::kTube);
                const double follows_across =
                    1.0 / (1.0 - deep * std::cos(about) / glm::length(Vec3{y.x, y.y, 0.0}));
                const double u = 0.5 * kStiffness * deep * deep;
                const Vec3 expected =
                    at.ratio * kStiffness * deep * ring.normal() -
                    u * (std::min(2.0, follows_along) * glm::dot(at.gradient, along) * along +
                         std::min(2.0, follows_across) * glm::dot(at.gradient, across) * across);
                EXPECT_LE(glm::length(felt - expected), 1e-8)
                    << deep << ' ' << about << ' ' << around;
                if (follows_along < 2.0) {
                    EXPECT_LE(glm::length(felt - downhill(*map, RingPlace::front_of, probe)), 1e-6);
                }
            }
}

// On a ball both curvatures are alike: 9 mm deep in one of 12 the front would go four times as far.
TEST(StiffnessOverLumps, InTheMiddleOfABallTheFrontIsTakenToGoTwiceAsFar) {
    constexpr double kSmall = 12e-3, kPressed = 9e-3;
    const auto map = hills();
    const Vec3 up = glm::normalize(Vec3{1.0, -2.0, 1.5});
    const Vec3 felt =
        pressed(std::make_unique<VolumeContact>(
                    std::shared_ptr<const ScalarField>(make_solid_sphere(kSmall)), LevelSettings{}),
                map, (kSmall + 1e-3) * up, (kSmall - kPressed) * up);
    const StiffnessMap::Sample at = map->sample(kSmall * up);
    const Vec3 along = at.gradient - glm::dot(at.gradient, up) * up;
    const Vec3 expected = at.ratio * kStiffness * kPressed * up -
                          2.0 * 0.5 * kStiffness * kPressed * kPressed * along;
    EXPECT_LE(glm::length(felt - expected), 1e-8);
}

// ---- work, and what is refused
// -------------------------------------------------------------------

// A force that is held for a frame errs by half of how it changes within it, so the work over a
// closed way falls with the step: it comes of the zero-order hold, and of nothing else.
TEST(StiffnessOverLumps, WorkOverClosedWaysIsThatOfTheZeroOrderHold) {
    for (const double sign : {1.0, -1.0})
        for (const bool backwards : {false, true}) {
            const Work coarse = around(sign, backwards, 3000),
                       fine = around(sign, backwards, 12000);
            EXPECT_NEAR(coarse.felt / fine.felt, 4.0, 0.08) << sign << backwards;
            EXPECT_LT(std::abs(fine.felt), 0.02e-3);
            // The controls: without the force along the surface, and without how the front follows.
            EXPECT_NEAR(std::abs(fine.normal_alone), 0.96e-3, 0.01e-3);
            EXPECT_NEAR(std::abs(fine.not_carried), 0.15e-3, 0.01e-3);
            EXPECT_NEAR(fine.greatest_aside, sign > 0.0 ? 0.16 : 0.12, 5e-3); // of 1.2 N
        }
}

TEST(StiffnessOverLumps, WithADamperAClosedWayTakesWork) {
    for (const bool backwards : {false, true})
        EXPECT_LT(around(1.0, backwards, 3000, 5.0).felt, 0.0);
}

// A ratio that would make it stiffer than the coupling makes it as stiff as that.
TEST(StiffnessOverLumps, NothingIsStifferThanTheCoupling) {
    ContactLoop loop = on(1.0, soft(450.0), flank(1.5));
    loop.start(place(1.0, 0.2, -1e-3));
    const Vec3 probe = place(1.0, 0.2, 5e-3);
    loop.move(probe);
    EXPECT_NEAR(glm::length(force(loop, probe)), kK * 5e-3, 1e-9);
    EXPECT_NEAR(loop.subdivision().pressed().slope_n_per_m, kK, 1e-9);
    EXPECT_NEAR(loop.subdivision().pressed().indentation_m, 0.0, 1e-15);
}

TEST(StiffnessOverLumps, AHeldProbeKeepsTheBitsOfTheTip) {
    ContactLoop loop = on(-1.0, soft(kStiffness), flank(kStiffer));
    loop.start(place(-1.0, 0.0, -1e-3));
    const Vec3 probe = place(-1.0, 0.01, kDeep);
    loop.move(probe);
    loop.move(probe);
    const Vec3 tip = loop.proxy();
    for (int i = 0; i < 200; ++i) {
        loop.move(probe);
        ASSERT_EQ(loop.proxy(), tip);
    }
}

TEST(StiffnessOverLumps, AMapOfOneIsNoneToTheBit) {
    ContactLoop with = on(1.0, soft(kStiffness), flank(1.0));
    ContactLoop without = on(1.0, soft(kStiffness), nullptr);
    SCOPED_TRACE("seed 4");
    std::mt19937 random(4);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    with.start({0, 0, kRadius + 1e-3});
    without.start({0, 0, kRadius + 1e-3});
    Vec3 probe{0, 0, kRadius};
    for (int i = 0; i < 1000; ++i) {
        const double x = unit(random), y = unit(random), z = unit(random);
        probe = place(1.0, 0.2 * x, 5e-3 * (1.0 + z)) + Vec3{0, 5e-3 * y, 0};
        with.move(probe);
        without.move(probe);
        ASSERT_EQ(with.proxy(), without.proxy());
    }
}

TEST(StiffnessOverLumps, IsRefusedWhereItsForceWouldBeThatOfNoEnergy) {
    SurfaceFinish rubs = soft(kStiffness);
    rubs.friction = {0.3, 0.3};
    EXPECT_THROW(on(1.0, rubs, flank(1.2)), std::invalid_argument);
    SurfaceFinish yields = soft(kStiffness);
    yields.strength_n = 2.0;
    EXPECT_THROW(on(1.0, yields, flank(1.2)), std::invalid_argument);
    EXPECT_THROW(on(1.0, SurfaceFinish{}, flank(1.2)), std::invalid_argument);
    // Not alone.
    SurfaceFinish plain = soft(kStiffness);
    plain.stiffness = flank(1.2);
    std::vector<std::unique_ptr<SurfaceContact>> two;
    two.push_back(std::make_unique<VolumeContact>(make_solid_sphere(kRadius), LevelSettings{}));
    two.push_back(
        std::make_unique<VolumeContact>(make_solid_sphere(0.5 * kRadius), LevelSettings{}));
    EXPECT_THROW(ContactLoop(precise(), std::move(two), {}, 10.0, {plain, SurfaceFinish{}}),
                 std::invalid_argument);
}

} // namespace
} // namespace palpate
