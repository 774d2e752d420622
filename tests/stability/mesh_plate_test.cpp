// SPDX-License-Identifier: Apache-2.0
// A plate of 60 x 60 x 1 mm, pressed through at speed: at random places, near its edges, and slid
// off.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "tests/support/mesh_fuzz.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

constexpr double kTop = 0.0005; // m
// Sliding ends where less than this is left, m.
constexpr double kExact = 1e-12;

class MeshPlate : public testing::TestWithParam<double> {};

TEST_P(MeshPlate, NothingGetsThroughAtRandomPlaces) {
    const double step = GetParam();
    test::ContactLoop loop({}, test::one_mesh(test::certified(test::plate())));
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> in(-0.025, 0.025), extra(0.0, 1e-3);
    for (int trial = 0; trial < 200; ++trial) {
        const Vec3 place = trial % 10 == 1 ? Vec3{0.0} : Vec3{in(random), in(random), 0.0};
        const double from = 0.01 + extra(random);
        loop.start(place + Vec3{0, 0, from});
        for (double z = from; z > -0.011; z -= step) {
            const Vec3 before = loop.proxy();
            loop.move(place + Vec3{0, 0, z});
            ASSERT_NEAR(loop.proxy().z, std::max(z, kTop), kExact);
            ASSERT_LE(glm::length(loop.proxy() - before), step + kExact) << "no kick";
        }
        for (int held = 0; held < 50; ++held)
            loop.move(place + Vec3{0, 0, -0.011});
        ASSERT_NEAR(loop.proxy().z, kTop, kExact);
    }
}

TEST_P(MeshPlate, NothingGetsThroughBesideAnEdge) {
    const double step = GetParam();
    test::ContactLoop loop({}, test::one_mesh(test::certified(test::plate())));
    std::mt19937_64 random(2);
    std::uniform_real_distribution<double> in(-0.025, 0.025);
    for (int trial = 0; trial < 100; ++trial) {
        const double inset[] = {1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 4e-3};
        const Vec3 place{0.03 - inset[trial % 6], in(random), 0.0};
        loop.start(place + Vec3{0, 0, 0.0107});
        for (double z = 0.0107; z > -0.011; z -= step) {
            loop.move(place + Vec3{0, 0, z});
            ASSERT_NEAR(loop.proxy().z, std::max(z, kTop), kExact);
        }
    }
}

TEST_P(MeshPlate, SlidOffItIsReleasedAndNotBefore) {
    const double step = GetParam();
    test::ContactLoop loop({}, test::one_mesh(test::certified(test::plate())));
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> in(-0.02, 0.02), turn(-0.5, 0.5);
    for (int trial = 0; trial < 50; ++trial) {
        Vec3 probe{0.0, in(random), 0.005};
        const double angle = turn(random);
        const Vec3 along{std::cos(angle), std::sin(angle), 0.0};
        loop.start(probe);
        for (; probe.z > -0.0025; probe.z -= step)
            loop.move(probe);
        probe.z = -0.0025;
        while (std::abs(probe.x) < 0.045 && std::abs(probe.y) < 0.045) {
            probe += step * along;
            loop.move(probe);
            const bool over = std::abs(probe.x) <= 0.03 && std::abs(probe.y) <= 0.03;
            if (over)
                ASSERT_NEAR(loop.proxy().z, kTop, kExact);
            else
                ASSERT_EQ(loop.proxy(), probe);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Speeds, MeshPlate, testing::Values(0.2e-3, 1e-3, 5e-3));

} // namespace
} // namespace palpate
