// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/stiffness_map.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

namespace palpate {
namespace {

StiffnessMap random_map() {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> unit(-0.5F, 0.5F);
    const StiffnessMap::Lattice lattice{{7, 6, 9}, {0.01, -0.02, 0.03}, 1e-3};
    std::vector<float> gains(lattice.nodes());
    for (float& gain : gains)
        gain = unit(random);
    return {lattice, gains};
}

Vec3 random_point(std::mt19937& random, const StiffnessMap::Lattice& lattice) {
    std::uniform_real_distribution<double> unit(-0.3, 1.3);
    const double x = unit(random), y = unit(random), z = unit(random);
    return lattice.origin +
           lattice.spacing_m * Vec3{x * lattice.size[0], y * lattice.size[1], z * lattice.size[2]};
}

TEST(StiffnessMap, OfTheSameGainEverywhereIsThatGainInside) {
    const StiffnessMap::Lattice lattice{{5, 5, 5}, Vec3{0.0}, 2e-3};
    const StiffnessMap map(lattice, std::vector<float>(lattice.nodes(), 0.25F));
    const StiffnessMap::Sample inside = map.sample({3.7e-3, 4.1e-3, 5e-3});
    EXPECT_NEAR(inside.ratio, 1.25, 1e-15);
    EXPECT_NEAR(glm::length(inside.gradient), 0.0, 1e-12);
    EXPECT_EQ(map.sample({1.0, 0.0, 0.0}).ratio, 1.0);
}

// Central differences of a spline of degree 2 are exact but for rounding where they do not cross a
// kink of its gradient; there they are off by the step times the jump of the second derivative.
TEST(StiffnessMap, ItsGradientIsTheDerivativeOfItsRatio) {
    const StiffnessMap map = random_map();
    std::mt19937 random(6);
    constexpr double step = 1e-7;
    for (int i = 0; i < 2000; ++i) {
        const Vec3 point = random_point(random, map.lattice());
        const Vec3 gradient = map.sample(point).gradient;
        for (int axis = 0; axis < 3; ++axis) {
            Vec3 way{0.0};
            way[axis] = step;
            const double difference =
                (map.sample(point + way).ratio - map.sample(point - way).ratio) / (2.0 * step);
            EXPECT_NEAR(difference, gradient[axis], step * 4.0 / 1e-6);
        }
    }
}

// Over a way of 1 nm the ratio and its gradient change by no more than their derivatives allow: 1
// per node distance, and 4 per its square.
TEST(StiffnessMap, NeitherItsRatioNorItsGradientJumps) {
    const StiffnessMap map = random_map();
    std::mt19937 random(8);
    std::uniform_int_distribution<int> half(-3, 20);
    constexpr double step = 1e-9;
    for (int i = 0; i < 2000; ++i) {
        Vec3 point = random_point(random, map.lattice());
        // On the border between two cells of the spline.
        point.y = map.lattice().origin.y + 0.5 * half(random) * map.lattice().spacing_m;
        const StiffnessMap::Sample a = map.sample(point - Vec3{0, step, 0});
        const StiffnessMap::Sample b = map.sample(point + Vec3{0, step, 0});
        EXPECT_NEAR(a.ratio, b.ratio, 2.0 * step * 1.0 / 1e-3 + 1e-12);
        EXPECT_LT(glm::length(a.gradient - b.gradient), 2.0 * step * 7.0 / 1e-6 + 1e-9);
    }
}

TEST(StiffnessMap, OfWhatIsNoPlaceIsOne) {
    const StiffnessMap map = random_map();
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::infinity(), -1e300}) {
        EXPECT_EQ(map.sample({bad, 0.0, 0.03}).ratio, 1.0);
        EXPECT_EQ(map.sample({0.01, 0.0, bad}).gradient, Vec3{0.0});
    }
}

TEST(StiffnessMap, RefusesWhatIsNoMap) {
    const StiffnessMap::Lattice lattice{{2, 2, 2}, Vec3{0.0}, 1e-3};
    EXPECT_THROW(StiffnessMap(lattice, std::vector<float>(7)), std::invalid_argument);
    EXPECT_THROW(StiffnessMap(lattice, std::vector<float>(8, -1.0F)), std::invalid_argument);
    EXPECT_THROW(StiffnessMap({{2, 0, 2}, Vec3{0.0}, 1e-3}, {}), std::invalid_argument);
    EXPECT_THROW(StiffnessMap({{2, 2, 2}, Vec3{0.0}, 0.0}, std::vector<float>(8)),
                 std::invalid_argument);
}

} // namespace
} // namespace palpate
