// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/vector_field.h>

#include <array>
#include <cfenv>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include <palpate/volume/fields/grid_vector_field.h>

namespace palpate {
namespace {

constexpr double kRadius = 0.02;                          // m
constexpr double kPitch = 2.0 * std::numbers::pi * 0.005; // m per turn
constexpr double kFloat = std::numeric_limits<float>::epsilon();

class Points {
public:
    Vec3 next(double half) {
        std::uniform_real_distribution<double> one(-half, half);
        return {one(random_), one(random_), one(random_)};
    }
    double sign() { return std::bernoulli_distribution(0.5)(random_) ? 1.0 : -1.0; }

private:
    std::mt19937 random_{7};
};

/// An oblique grid of 5 x 4 x 6 voxels filled by a function of the scene point.
template <typename Function>
VectorVolume filled(const Function& at) {
    VectorVolume volume;
    volume.size = {5, 4, 6};
    volume.index_to_scene = {Mat3{{8e-4, 6e-4, 0}, {-9e-4, 12e-4, 0}, {0, 1e-4, 1e-3}},
                             {0.01, 0.002, -0.001}};
    for (int k = 0; k < volume.size[2]; ++k)
        for (int j = 0; j < volume.size[1]; ++j)
            for (int i = 0; i < volume.size[0]; ++i)
                for (const double number : at(volume.index_to_scene.point(Vec3(i, j, k))))
                    volume.values.push_back(static_cast<float>(number));
    volume.components = static_cast<int>(volume.values.size() / volume.voxels());
    if (volume.components == 6) volume.kind = VectorVolume::Kind::symmetric_tensor;
    return volume;
}

std::array<double, 3> numbers(const Vec3& v) { return {v.x, v.y, v.z}; }

Vec3 somewhere_in(const VectorVolume& volume, Points& points) {
    const Vec3 share = points.next(0.499) + Vec3(0.5);
    return volume.index_to_scene.point(
        share * Vec3(volume.size[0] - 1, volume.size[1] - 1, volume.size[2] - 1));
}

TEST(Helix, IsTheUnitTangentOfTheCurveThroughThePoint) {
    const auto field = make_helix(kRadius, kPitch);
    const auto sampler = field->make_sampler();
    const double rise = kPitch / (2.0 * std::numbers::pi);
    for (double angle = 0.0; angle < 7.0; angle += 0.3) {
        // The derivative of (r cos, r sin, rise angle) by the angle.
        const Vec3 along{-kRadius * std::sin(angle), kRadius * std::cos(angle), rise};
        const VectorSample s =
            sampler->sample({kRadius * std::cos(angle), kRadius * std::sin(angle), rise * angle});
        ASSERT_TRUE(s.valid);
        EXPECT_LE(glm::length(s.value - glm::normalize(along)), 1e-15);
    }
    EXPECT_EQ(sampler->sample({0, 0, 0.3}).value, Vec3(0, 0, 1));
    EXPECT_FALSE(sampler->sample(Vec3(std::nan(""))).valid);
}

TEST(Helix, DerivativeIsTheLimitOfDifferences) {
    const auto field = make_helix(kRadius, kPitch);
    const auto sampler = field->make_sampler();
    Points points;
    for (int n = 0; n < 200; ++n) {
        const Vec3 at = points.next(kRadius);
        const Mat3 derivative = sampler->sample(at).derivative;
        constexpr double kStep =
            1e-6; // m: a relative error of (step / 5 mm)^2 = 4e-8, rounding 1e-10
        for (int axis = 0; axis < 3; ++axis) {
            Vec3 step(0.0);
            step[axis] = kStep;
            const Vec3 difference =
                (sampler->sample(at + step).value - sampler->sample(at - step).value) /
                (2.0 * kStep);
            EXPECT_LE(glm::length(difference - derivative[axis]), 1e-7 / 0.005) << n;
        }
    }
}

TEST(Helix, RotatesAboutItsAxisInTheMiddle) {
    const auto field = make_helix(kRadius, kPitch);
    const double rise = kPitch / (2.0 * std::numbers::pi);
    const Vec3 rotation = curl(field->make_sampler()->sample(Vec3(0.0)).derivative);
    EXPECT_LE(glm::length(rotation - Vec3(0, 0, 2.0 / rise)), 1e-12 / rise);
}

TEST(Helix, FeatureIsTheSmallestRadiusOfCurvature) {
    const double rise = kPitch / (2.0 * std::numbers::pi);
    EXPECT_NEAR(make_helix(kRadius, kPitch)->feature_size_m(), 2.0 * rise, 1e-15);
    const double inner = 0.5 * rise; // all of it turns less than at r = rise
    EXPECT_NEAR(make_helix(inner, kPitch)->feature_size_m(), 2.5 * rise, 1e-15);
    EXPECT_THROW(make_helix(0.0, kPitch), std::invalid_argument);
    EXPECT_THROW(make_helix(kRadius, std::nan("")), std::invalid_argument);
}

TEST(GridVectorField, AnAffineFieldIsExactWithItsDerivative) {
    const Mat3 slope{{3, -2, 40}, {5, 70, -1}, {11, 13, -17}};
    const auto at = [&](const Vec3& p) { return numbers(slope * p + Vec3{1, -2, 0.5}); };
    const VectorVolume volume = filled(at);
    const GridVectorField field(volume, VectorSense::directed);
    const auto sampler = field.make_sampler();
    Points points;
    for (int n = 0; n < 300; ++n) {
        const Vec3 p = somewhere_in(volume, points);
        const VectorSample s = sampler->sample(p);
        ASSERT_TRUE(s.valid);
        // Nodes below 4 are rounded to float: 1 ulp of 2 to 4 is 2 eps; differences of two over a
        // spacing of 1 mm, of which oblique axes make at most twice as much.
        EXPECT_LE(glm::length(s.value - (slope * p + Vec3{1, -2, 0.5})), 4.0 * kFloat);
        for (int axis = 0; axis < 3; ++axis)
            EXPECT_LE(glm::length(s.derivative[axis] - slope[axis]), 16.0 * kFloat / 1e-3);
    }
    EXPECT_EQ(sampler->samples(), 300u);
    EXPECT_NEAR(field.feature_size_m(), 1e-3, 1e-15);
}

TEST(GridVectorField, HasNoDataOutsideAndBesideHoles) {
    VectorVolume volume = filled([](const Vec3&) { return numbers({0, 0, 1}); });
    const AffineTransform place = volume.index_to_scene;
    // Component y of voxel 0, 0, 0.
    volume.values[1] = std::numeric_limits<float>::quiet_NaN();
    const GridVectorField field(volume, VectorSense::directed);
    const auto sampler = field.make_sampler();
    EXPECT_FALSE(sampler->sample(place.point({0.5, 0.5, 0.5})).valid);
    EXPECT_TRUE(sampler->sample(place.point({1.5, 0.5, 0.5})).valid);
    EXPECT_TRUE(sampler->sample(place.point({3.999999, 2.999999, 4.999999})).valid);
    EXPECT_FALSE(sampler->sample(place.point({4.01, 1, 1})).valid);
    EXPECT_FALSE(sampler->sample(place.point({1, -0.01, 1})).valid);
    EXPECT_FALSE(sampler->sample(Vec3(std::numeric_limits<double>::infinity())).valid);
    EXPECT_FALSE(sampler->sample(Vec3(std::nan(""))).valid);
}

TEST(GridVectorField, SignsOfAxialVectorsDoNotMatter) {
    const auto helix = make_helix(kRadius, kPitch);
    const auto exact = helix->make_sampler();
    const auto value = [&](const Vec3& p) { return exact->sample(p).value; };
    Points points;
    const VectorVolume volume = filled([&](const Vec3& p) { return numbers(2.0 * value(p)); });
    const VectorVolume flipped =
        filled([&](const Vec3& p) { return numbers(2.0 * points.sign() * value(p)); });
    const GridVectorField field(volume, VectorSense::axial);
    const GridVectorField other(flipped, VectorSense::axial);
    const auto sampler = field.make_sampler();
    const auto other_sampler = other.make_sampler();
    for (int n = 0; n < 300; ++n) {
        const Vec3 p = somewhere_in(volume, points);
        const VectorSample s = sampler->sample(p);
        ASSERT_TRUE(s.valid);
        EXPECT_EQ(s.value, other_sampler->sample(p).value) << "v v^T has no sign: the same bits";
        EXPECT_NEAR(glm::length(s.value), 2.0, 1e-6) << "floats, squared";
        // Interpolation between nodes 1.5 mm apart of a field that turns within 10 mm: (1.5/10)^2/8
        // along each of three axes.
        EXPECT_GE(std::abs(glm::dot(s.value, value(p))), 2.0 * std::cos(3.0 * 0.0225 / 8.0));
    }
}

TEST(GridVectorField, TensorsGiveTheirPrincipalDirectionAndAnisotropy) {
    // Eigenvalues 3, 1, 1 along an axis: fractional anisotropy 2 / sqrt(11).
    const Vec3 axis = glm::normalize(Vec3{1, 2, -2});
    const auto tensor = [&](const Vec3&) {
        const Mat3 t = Mat3(1.0) + 2.0 * glm::outerProduct(axis, axis);
        return std::array<double, 6>{t[0][0], t[1][0], t[2][0], t[1][1], t[2][1], t[2][2]};
    };
    const VectorVolume volume = filled(tensor);
    const GridVectorField field(volume, VectorSense::axial);
    const VectorSample s =
        field.make_sampler()->sample(volume.index_to_scene.point({1.3, 1.7, 2.2}));
    ASSERT_TRUE(s.valid);
    EXPECT_NEAR(std::abs(glm::dot(s.value, axis)), 2.0 / std::sqrt(11.0), 4.0 * kFloat);
    EXPECT_NEAR(glm::length(s.value), 2.0 / std::sqrt(11.0), 4.0 * kFloat);

    // Fibres along an axis but for 1e-30 of it: nothing to turn.
    const auto almost = [](const Vec3&) { return std::array<double, 6>{3, 1e-30, 1e-30, 1, 0, 1}; };
    const GridVectorField straight(filled(almost), VectorSense::axial);
    std::feclearexcept(FE_ALL_EXCEPT);
    EXPECT_TRUE(straight.make_sampler()->sample(volume.index_to_scene.point({1, 1, 1})).valid);
    EXPECT_FALSE(std::fetestexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW)); // loops trap them

    const auto alike = [](const Vec3&) { return std::array<double, 6>{1, 0, 0, 1, 0, 1}; };
    const GridVectorField none(filled(alike), VectorSense::axial);
    EXPECT_FALSE(none.make_sampler()->sample(volume.index_to_scene.point({1, 1, 1})).valid)
        << "no direction stands out";
}

TEST(GridVectorField, RefusesVolumesItCannotInterpolate) {
    const VectorVolume good = filled([](const Vec3&) { return numbers({0, 0, 1}); });
    VectorVolume bad = good;
    bad.size = {1, 20, 6};
    EXPECT_THROW(GridVectorField(bad, VectorSense::directed), std::invalid_argument);
    bad = good;
    bad.values.pop_back();
    EXPECT_THROW(GridVectorField(bad, VectorSense::directed), std::invalid_argument);
    bad = good;
    bad.index_to_scene.linear[1] = bad.index_to_scene.linear[0];
    EXPECT_THROW(GridVectorField(bad, VectorSense::directed), std::invalid_argument);
    bad = filled([](const Vec3&) { return std::array<double, 6>{1, 0, 0, 1, 0, 1}; });
    EXPECT_THROW(GridVectorField(bad, VectorSense::directed), std::invalid_argument);
}

} // namespace
} // namespace palpate
